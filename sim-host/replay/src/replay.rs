//! A replay and its summary.

use std::collections::BTreeMap;
use std::io::BufRead;

use serde::Serialize;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_sim::observe;
use sonarfix_sim::statistics::FixCounts;
use sonarfix_sim::trace::{Calibration, Recorder};

use crate::estimators::Searches;
use crate::fault::{Complaint, ReplayError, Source};
use crate::lines::Lines;
use crate::reference::Reference;
use crate::score::{Consistency, Verdicts};
use crate::session::{End, Session, Trouble};
use crate::{log, reference};

/// A replay without its recording.
#[derive(Debug, Clone, Copy)]
pub struct Replay<'a> {
    /// The nominal robot.
    pub robot: &'a RobotConfig,
    /// The map.
    pub walls: &'a [Wall],
    /// Whether a malformed line ends the replay.
    pub strict: bool,
    /// The most ranges that are taken of one scan while the pose is known, each at another wall: 1 to
    /// [`MOST_PINGS_PER_SCAN`](crate::scan::MOST_PINGS_PER_SCAN).
    pub pings_per_scan: u32,
}

/// The result of a replay. Lengths in metres, angles in radians, times in seconds since the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// RMS position error of the localizer; `None` without a reference.
    pub position_rms: Option<f64>,
    /// Median, within half a per cent.
    pub position_median: Option<f64>,
    /// Maximum.
    pub position_max: Option<f64>,
    /// RMS heading error of the localizer.
    pub heading_rms: Option<f64>,
    /// Median, within half a per cent.
    pub heading_median: Option<f64>,
    /// Maximum.
    pub heading_max: Option<f64>,
    /// RMS position error of dead reckoning with the nominal robot.
    pub odometry_position_rms: Option<f64>,
    /// Median, within half a per cent.
    pub odometry_position_median: Option<f64>,
    /// Maximum.
    pub odometry_position_max: Option<f64>,
    /// RMS heading error of dead reckoning.
    pub odometry_heading_rms: Option<f64>,
    /// Median, within half a per cent.
    pub odometry_heading_median: Option<f64>,
    /// Maximum.
    pub odometry_heading_max: Option<f64>,
    /// Outcomes of the measurement cycles.
    pub fixes: FixCounts,
    /// Outcomes of headings, positions and poses from outside.
    pub absolute: FixCounts,
    /// How many measurement cycles were refused, by reason.
    pub refusals: BTreeMap<String, u64>,
    /// The calibration at the end.
    #[serde(rename = "final")]
    pub calibration: Calibration,
    /// Its standard deviations.
    pub final_deviation: Calibration,
    /// The health verdicts.
    pub health: Verdicts,
    /// What the search did; `None` if the robot does not search.
    pub search: Option<Searches>,
    /// Consistency of errors and covariance.
    pub consistency: Consistency,
    /// The start, on the log's clock.
    pub started_at: f64,
    /// From the start to the last encoder record.
    pub duration: f64,
    /// Distance travelled according to the encoders.
    pub distance: f64,
    /// Lines of the log.
    pub lines: u64,
    /// Malformed lines of the log.
    pub lines_skipped: u64,
    /// Encoder records used.
    pub encoder_records: u64,
    /// Number of jumps of the encoder counts.
    pub encoder_jumps: u64,
    /// Ranges and scans from before the start or after the last encoder record.
    pub ranges_unused: u64,
    /// Rows of the reference that were compared.
    pub reference_rows: u64,
    /// Malformed lines of the reference.
    pub reference_lines_skipped: u64,
}

/// Counts malformed lines and reports them, or ends the replay at the first.
struct Complaints<'a> {
    strict: bool,
    in_log: u64,
    in_reference: u64,
    report: &'a mut dyn FnMut(&Complaint),
}

impl Complaints<'_> {
    fn add(&mut self, complaint: Complaint) -> Result<(), ReplayError> {
        if self.strict {
            return Err(complaint.into());
        }
        match complaint.source_file {
            Source::Log => self.in_log += 1,
            Source::Reference => self.in_reference += 1,
        }
        (self.report)(&complaint);
        Ok(())
    }
}

impl Replay<'_> {
    /// Replays a log, with a reference if there is one. Malformed lines are passed to `report`.
    ///
    /// # Errors
    /// [`ReplayError`], if the replay ends early.
    pub fn run(
        &self,
        log: impl BufRead,
        reference: Option<impl BufRead>,
        recorder: &mut impl Recorder,
        report: &mut dyn FnMut(&Complaint),
    ) -> Result<Summary, ReplayError> {
        let mut complaints = Complaints { strict: self.strict, in_log: 0, in_reference: 0, report };
        let reference = reference.map(Reference::open).transpose()?;
        let mut session = Session::new(self.robot, self.walls, reference, recorder)
            .with_pings_per_scan(self.pings_per_scan);
        let mut lines = Lines::of(log);
        reference::expect_header(&mut lines, Source::Log, log::HEADER)?;
        loop {
            let line = lines.next().map_err(|error| ReplayError::Read(Source::Log, error))?;
            let Some(line) = line else { break };
            let fault = match line.and_then(log::parse) {
                Ok(None) => continue,
                Err(malformed) => malformed.into(),
                Ok(Some(record)) => {
                    let mut complain = |line, fault| {
                        complaints.add(Complaint { source_file: Source::Reference, line, fault })
                    };
                    match session.take(record, &mut complain) {
                        Ok(()) => continue,
                        Err(Trouble::End(error)) => return Err(error),
                        Err(Trouble::Skip(fault)) => fault,
                    }
                }
            };
            complaints.add(Complaint { source_file: Source::Log, line: lines.number(), fault })?;
        }
        let (in_log, in_reference) = (complaints.in_log, complaints.in_reference);
        Ok(Summary {
            lines: lines.number(),
            lines_skipped: in_log,
            reference_lines_skipped: in_reference,
            ..Summary::of(&session.end()?)
        })
    }
}

impl Summary {
    fn of(end: &End) -> Self {
        let estimate = observe::estimate(&end.localizer);
        let [.., scale_right, scale_left, track_width, range_scale] = estimate.deviation;
        let (localizer, odometry) = (end.score.localizer(), end.score.odometry());
        Self {
            position_rms: localizer.map(|f| f.position_rms),
            position_median: localizer.map(|f| f.position_median),
            position_max: localizer.map(|f| f.position_max),
            heading_rms: localizer.map(|f| f.heading_rms),
            heading_median: localizer.map(|f| f.heading_median),
            heading_max: localizer.map(|f| f.heading_max),
            odometry_position_rms: odometry.map(|f| f.position_rms),
            odometry_position_max: odometry.map(|f| f.position_max),
            odometry_position_median: odometry.map(|f| f.position_median),
            odometry_heading_rms: odometry.map(|f| f.heading_rms),
            odometry_heading_median: odometry.map(|f| f.heading_median),
            odometry_heading_max: odometry.map(|f| f.heading_max),
            fixes: end.tally.fixes,
            absolute: end.tally.absolute,
            refusals: end.tally.refusals.clone(),
            calibration: estimate.calibration,
            final_deviation: Calibration { scale_right, scale_left, track_width, range_scale },
            health: end.tally.verdicts,
            search: end.searches,
            consistency: end.score.consistency(),
            started_at: end.started_at,
            duration: end.duration,
            distance: end.tally.distance,
            lines: 0,
            lines_skipped: 0,
            encoder_records: end.tally.encoder_records,
            encoder_jumps: end.tally.encoder_jumps,
            ranges_unused: end.tally.unused,
            reference_rows: end.score.rows(),
            reference_lines_skipped: 0,
        }
    }
}
