//! Statistics of a run: errors against the truth, outcomes of the measurement cycles, verdicts, and the state at the end.

use serde::Serialize;
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;
use sonarfix_hal::robot::Report;
use sonarfix_replay::{Score, Verdicts};
use sonarfix_sim::statistics::FixCounts;
use sonarfix_sim::trace::{
    AbsoluteRecord, Calibration, FixRecord, Outcome, Recorder, SearchRecord, Tick,
};

/// The statistics of a run, while its records arrive.
#[derive(Debug, Default)]
pub struct RunStatistics {
    score: Score,
    health: Verdicts,
    verdict: Verdict,
    fixes: FixCounts,
    /// Driven by the encoders, metres.
    distance: f64,
    first: Option<f64>,
    last: Option<Tick>,
}

/// The figures of a run, as `--json` prints them: metres, radians, seconds.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Figures {
    /// From the first encoder tick to the last.
    pub duration: f64,
    /// Driven by the encoders.
    pub distance: f64,
    /// Errors of the localizer; `None` without a true pose. Medians are within half a per cent.
    pub position_rms: Option<f64>,
    pub position_median: Option<f64>,
    pub position_max: Option<f64>,
    pub heading_rms: Option<f64>,
    pub heading_max: Option<f64>,
    /// Error of dead reckoning.
    pub odometry_position_rms: Option<f64>,
    /// Outcomes of the measurement cycles.
    pub fixes: FixCounts,
    /// The verdicts.
    pub health: Verdicts,
    /// The calibration at the end.
    #[serde(rename = "final")]
    pub calibration: Calibration,
    /// Deviations of x, y and heading at the end.
    pub final_pose_deviation: [f64; 3],
}

impl RunStatistics {
    /// A recorder that passes the records on and counts them here.
    pub fn of<'a, R: Recorder>(&'a mut self, recorder: &'a mut R) -> Measured<'a, R> {
        Measured { statistics: self, recorder }
    }

    fn tick(&mut self, tick: &Tick) {
        let first = *self.first.get_or_insert(tick.time);
        if let Some(last) = &self.last {
            let (from, to) = (last.odometry, tick.odometry);
            self.distance += (to.x - from.x).hypot(to.y - from.y);
        }
        let estimate = &tick.estimate;
        self.health.note(tick.time - first, self.verdict, estimate.verdict);
        self.health.note_mismatch(estimate.mismatch);
        self.verdict = estimate.verdict;
        if let Some(truth) = &tick.truth {
            let at = (tick.time - first, self.distance);
            self.score.add(at, estimate, &tick.odometry, &truth.pose);
        }
        self.last = Some(*tick);
    }

    fn fix(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Accepted | Outcome::Downweighted => self.fixes.accepted += 1,
            Outcome::Gated => self.fixes.gated += 1,
            Outcome::Refused => self.fixes.refused += 1,
        }
    }

    /// The figures so far.
    pub fn figures(&self) -> Figures {
        let errors = self.score.localizer();
        let last = self.last.map(|tick| (tick.time, tick.estimate));
        let [x, y, heading, ..] = last.map_or([f64::NAN; 7], |(_, estimate)| estimate.deviation);
        Figures {
            duration: last.zip(self.first).map_or(0.0, |((end, _), start)| end - start),
            distance: self.distance,
            position_rms: errors.map(|errors| errors.position_rms),
            position_median: errors.map(|errors| errors.position_median),
            position_max: errors.map(|errors| errors.position_max),
            heading_rms: errors.map(|errors| errors.heading_rms),
            heading_max: errors.map(|errors| errors.heading_max),
            odometry_position_rms: self.score.odometry().map(|errors| errors.position_rms),
            fixes: self.fixes,
            health: self.health,
            calibration: last.map(|(_, estimate)| estimate.calibration).unwrap_or_default(),
            final_pose_deviation: [x, y, heading],
        }
    }
}

/// Passes the records of a run on, and counts them.
#[derive(Debug)]
pub struct Measured<'a, R> {
    statistics: &'a mut RunStatistics,
    recorder: &'a mut R,
}

impl<R: Recorder> Recorder for Measured<'_, R> {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        self.recorder.started(make);
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        self.statistics.tick(&tick);
        self.recorder.tick(|| tick);
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        let fix = make();
        self.statistics.fix(fix.outcome);
        self.recorder.fix(|| fix);
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        self.recorder.absolute(make);
    }

    fn search(&mut self, make: impl FnOnce() -> SearchRecord) {
        self.recorder.search(make);
    }

    fn began(&mut self, localizer: &Localizer) {
        self.recorder.began(localizer);
    }

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        self.recorder.polled(report, localizer);
    }
}
