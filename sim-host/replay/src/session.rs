//! One replay in progress: records in, fixes and scores out.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::iter::Peekable;
use std::vec::IntoIter;

use sonarfix::aim::{Aim, NoAim, Reason};
use sonarfix::config::{PingSchedule, RangerId, RangerParameters};
use sonarfix::filter::ekf::{STATES, StandardDeviations, StateEstimate};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians, SquareMetres};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::TurnReading;
use sonarfix_hal::config::RobotConfig;
use sonarfix_search::navigator::{Mode, Navigator, UNKNOWN_HEADING, UNKNOWN_POSITION};
use sonarfix_search::search::Search;
use sonarfix_sim::observe::{self, Measurement};
use sonarfix_sim::odometry::DeadReckoning;
use sonarfix_sim::statistics::FixCounts;
use sonarfix_sim::trace::{FixRecord, Pose, Recorder};

use crate::estimators::{Estimators, Searches};
use crate::fault::{Fault, ReplayError};
use crate::gap::Gap;
use crate::log::Record;
use crate::measured::Measured;
use crate::reference::{Reference, micros, seconds};
use crate::scan::{Cone, Scan, Sweep};
use crate::score::{Score, Verdicts};
use crate::wheels::{self, Reading};

/// Ranges that may wait for the next encoder record: a sonar that pings for a minute.
const MOST_HELD: usize = 1024;
/// Largest total number of their beams: 4 MiB.
const MOST_BEAMS: usize = 1 << 20;

/// The prediction behind an aim, which a log does not have.
const UNKNOWN: Reason =
    Reason { gain: SquareMetres(0.0), success: 0.0, time: Duration::from_ticks(0), candidates: 0 };

/// What went wrong with a record.
pub enum Trouble {
    /// The record is skipped.
    Skip(Fault),
    /// The replay ends.
    End(ReplayError),
}

impl<F: Into<Fault>> From<F> for Trouble {
    fn from(fault: F) -> Self {
        Self::Skip(fault.into())
    }
}

impl From<ReplayError> for Trouble {
    fn from(error: ReplayError) -> Self {
        Self::End(error)
    }
}

/// A range or a scan that waits for the encoder record after it.
struct Pending {
    time: i64,
    echo: Echo,
}

enum Echo {
    At {
        bearing: f64,
        range: Option<f64>,
        wall: Option<u32>,
        ranger: RangerId,
    },
    /// Of a scan ranges are used if one is due, and during a search.
    Scan {
        scan: Scan,
        is_due: bool,
        /// For how many the sonar has had time.
        pings: u32,
    },
    /// There was no measurable wall.
    Skip,
    /// A heading, position or pose from outside, measured so many microseconds before.
    Absolute {
        age: i64,
        measurement: AbsoluteMeasurement,
    },
    /// The pose was replaced.
    Pose(Start),
    /// The mode has changed.
    Mode {
        mode: Mode,
        state: StateEstimate,
        deviation: StandardDeviations,
    },
}

/// The start record, of either kind.
#[derive(Clone, Copy)]
struct Begin {
    time: i64,
    pose: Pose,
    state: StateEstimate,
    deviation: StandardDeviations,
    /// Whether the log has no start, and the robot searches for its pose.
    is_unknown: bool,
    /// Whether the robot recorded the log itself, with every encoder sample that it took.
    is_own: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Encoder {
    Ticks,
    Wheels,
}

/// Counts of a replay.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub fixes: FixCounts,
    /// Headings, positions and poses from outside.
    pub absolute: FixCounts,
    /// Refused measurement cycles, by reason.
    pub refusals: BTreeMap<String, u64>,
    pub encoder_records: u64,
    /// Ranges and scans from before the start or after the last encoder record.
    pub unused: u64,
    /// Number of detected jumps of the encoder counts.
    pub encoder_jumps: u64,
    /// Distance travelled by the axle's centre according to the encoders, metres.
    pub distance: f64,
    pub verdicts: Verdicts,
}

/// A replay in progress.
pub struct Session<'a, R, V> {
    robot: &'a RobotConfig,
    walls: &'a [Wall],
    recorder: &'a mut V,
    reference: Option<Reference<R>>,
    begin: Option<Begin>,
    encoder: Option<Encoder>,
    estimators: Option<Estimators<'a>>,
    /// The last encoder record.
    last: Option<Reading>,
    /// An encoder record that is implausibly far from the last one.
    suspect: Option<Reading>,
    pending: Vec<Pending>,
    beams: usize,
    /// Time from which the next scan is used.
    next_fix: i64,
    /// The most ranges that are taken of a scan while the pose is known.
    pings_per_scan: u32,
    /// The pings of a robot that takes several of a scan.
    sweep: Sweep,
    score: Score,
    tally: Tally,
}

/// Reports a row of the reference that is skipped.
pub type Complain<'c> = dyn FnMut(u64, Fault) -> Result<(), ReplayError> + 'c;

impl<'a, R: BufRead, V: Recorder> Session<'a, R, V> {
    pub fn new(
        robot: &'a RobotConfig,
        walls: &'a [Wall],
        reference: Option<Reference<R>>,
        recorder: &'a mut V,
    ) -> Self {
        Self {
            robot,
            walls,
            recorder,
            reference,
            begin: None,
            encoder: None,
            estimators: None,
            last: None,
            suspect: None,
            pending: Vec::new(),
            beams: 0,
            next_fix: 0,
            pings_per_scan: 1,
            sweep: Sweep::default(),
            score: Score::default(),
            tally: Tally::default(),
        }
    }

    /// With the most ranges that are taken of a scan while the pose is known.
    pub fn with_pings_per_scan(self, pings_per_scan: u32) -> Self {
        Self { pings_per_scan, ..self }
    }

    /// Processes the next record of the log.
    pub fn take(&mut self, record: Record, complain: &mut Complain) -> Result<(), Trouble> {
        match record {
            Record::Start { time, pose, position_deviation, heading_deviation } => {
                let (sigma, heading) = (position_deviation, heading_deviation);
                let deviation = self.with_prior([sigma, sigma, heading]);
                let state = estimate([pose.x, pose.y, pose.heading, 0.0, 0.0, 0.0, 0.0]);
                let time = micros(time);
                let (is_unknown, is_own) = (false, false);
                let begin = Begin { time, pose, state, deviation, is_unknown, is_own };
                self.take_start(begin, complain)
            }
            Record::Mode { time, mode, state, deviation } => {
                let (state, deviation) = (estimate(state), deviations(deviation));
                self.hold(micros(time), Echo::Mode { mode, state, deviation })
            }
            Record::Resume { time, state: received, deviation } => {
                let [x, y, heading, ..] = received;
                let pose = Pose { x, y, heading };
                let (state, deviation) = (estimate(received), deviations(deviation));
                let time = micros(time);
                let (is_unknown, is_own) = (false, true);
                let begin = Begin { time, pose, state, deviation, is_unknown, is_own };
                self.take_start(begin, complain)
            }
            #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
            Record::Ticks { time, right, left } => {
                let wheels = wheels::of_counts(self.robot, [right as f64, left as f64]);
                self.take_wheels(micros(time), wheels, Encoder::Ticks, complain)
            }
            Record::Turn { time, angle, breaks } => {
                let time = micros(time);
                let at = Instant::from_ticks(time.unsigned_abs());
                if let Some(estimators) = &mut self.estimators {
                    estimators.turns.add(time, TurnReading::new(at, angle, breaks));
                }
                Ok(())
            }
            Record::Wheels { time, right, left } => {
                self.take_wheels(micros(time), [right, left], Encoder::Wheels, complain)
            }
            Record::Range { time, bearing, range, wall, ranger } => {
                self.hold(micros(time), Echo::At { bearing, range, wall, ranger })
            }
            Record::Absolute { time, age, measurement } => {
                self.hold(micros(time), Echo::Absolute { age: micros(age), measurement })
            }
            Record::Skip { time } => self.hold(micros(time), Echo::Skip),
            Record::Scan { time, scan } => {
                self.hold(micros(time), Echo::Scan { scan, is_due: true, pings: 0 })
            }
            Record::Pose { time, pose, position_deviation, heading_deviation } => {
                let [x, y, heading, position, deviation] =
                    single([pose.x, pose.y, pose.heading, position_deviation, heading_deviation]);
                let pose = sonarfix::geometry::pose::Pose::new(x, y, Radians(heading));
                let position_deviation = Metres(position);
                let heading_deviation = Radians(deviation);
                let start = Start { pose, position_deviation, heading_deviation };
                self.hold(micros(time), Echo::Pose(start))
            }
        }
    }

    /// Deviations of a pose, with those of the robot file for the calibration.
    fn with_prior(&self, [x, y, heading]: [f64; 3]) -> StandardDeviations {
        let prior = self.robot.localizer.prior;
        StandardDeviations {
            scale_right: prior.scale_right,
            scale_left: prior.scale_left,
            track_width_error: prior.track_width,
            range_scale: prior.range_scale,
            ..deviations([x, y, heading, 0.0, 0.0, 0.0, 0.0])
        }
    }

    /// The start of a robot whose log has none: it searches for its pose.
    fn without_start(&self, time: i64) -> Option<Begin> {
        if !self.robot.start.is_unknown() {
            return None;
        }
        let position = f64::from(UNKNOWN_POSITION.0);
        let deviation = self.with_prior([position, position, UNKNOWN_HEADING.0.into()]);
        let (pose, state) = (Pose::default(), estimate([0.0; STATES]));
        Some(Begin { time, pose, state, deviation, is_unknown: true, is_own: false })
    }

    fn take_start(&mut self, begin: Begin, complain: &mut Complain) -> Result<(), Trouble> {
        if self.begin.is_some() {
            return Err(Fault::SecondStart.into());
        }
        self.begin = Some(begin);
        self.next_fix = begin.time + self.fix_period();
        match self.last {
            Some(last) if last.time >= begin.time => Ok(self.begin_at(begin, last, complain)?),
            _ => Ok(()),
        }
    }

    fn fix_period(&self) -> i64 {
        let timing = &self.robot.localizer.rangers.first.timing;
        let period = match timing.schedule {
            PingSchedule::Every(period) => period,
            // A recording has no servo to wait for.
            PingSchedule::AsFastAsPossible => timing.cycle,
        };
        i64::try_from(period.to_micros()).unwrap_or(i64::MAX).max(1)
    }

    /// Starts the localizer when both the start and the encoders are known.
    fn begin_at(
        &mut self,
        begin: Begin,
        reading: Reading,
        complain: &mut Complain,
    ) -> Result<(), ReplayError> {
        let config = self.robot.localizer;
        let track_width = config.drive.track_width.0.into();
        let map = Map::new(self.walls);
        let Begin { state, deviation, .. } = begin;
        let localizer = Localizer::resume(config, map, state, deviation, Instant::from_ticks(0))?;
        let mut navigator = Navigator::new(localizer);
        let mut search = self.robot.start.is_unknown().then(Box::<Search>::default);
        if let (true, Some(search)) = (begin.is_unknown, &mut search) {
            navigator.search_in(self.robot.start.region(), search);
        }
        let odometry = DeadReckoning::new(begin.pose, track_width);
        let estimators = Estimators::new(navigator, search, odometry, reading);
        let estimators = self.estimators.insert(estimators);
        self.recorder.started(|| estimators.tick(0.0, None));
        let epoch = reading.time;
        if let Some(reference) = &mut self.reference {
            reference.read(&mut *complain)?;
            while reference.next().is_some_and(|row| row.time < epoch) {
                reference.read(&mut *complain)?;
            }
        }
        Ok(())
    }

    fn take_wheels(
        &mut self,
        time: i64,
        wheels: [f64; 2],
        encoder: Encoder,
        complain: &mut Complain,
    ) -> Result<(), Trouble> {
        if *self.encoder.get_or_insert(encoder) != encoder {
            return Err(Fault::BothEncoders.into());
        }
        let reading = Reading { time, wheels };
        if let Some(last) = self.last {
            if time == last.time {
                return Err(Fault::Stale.into());
            }
            if time < last.time {
                return Err(Fault::TimeWentBack.into());
            }
            if !self.is_plausible(last, reading) {
                let suspect = self.suspect.replace(reading);
                let suspect = suspect.filter(|s| s.time < time && self.is_plausible(*s, reading));
                let suspect = suspect.ok_or(Fault::TooFast)?;
                // Two records agree with each other, but not with those before: the counters have
                // jumped. The speeds during the gap are assumed to be those after it.
                self.tally.encoder_jumps += 1;
                let jumped = last.rolling_on(suspect, reading);
                self.advance(last, jumped, complain)?;
                if let Some(estimators) = &mut self.estimators {
                    estimators.received = suspect;
                }
                self.last = Some(suspect);
            }
        }
        self.suspect = None;
        self.tally.encoder_records += 1;
        let last = self.last.replace(reading);
        if self.estimators.is_none()
            && let Some(begin) = self.begin
            && time >= begin.time
        {
            let at = last.map_or(reading, |last| last.between(reading, begin.time));
            self.begin_at(begin, at, complain)?;
        }
        match last {
            Some(last) => self.advance(last, reading, complain),
            None => Ok(()),
        }
    }

    /// Whether a wheel speed is plausible.
    fn is_plausible(&self, from: Reading, to: Reading) -> bool {
        // Slightly below the limit of the localizer: the parts of a travel are rounded.
        let fastest = 0.999 * f64::from(self.robot.localizer.max_wheel_speed.0);
        from.speed_to(to) <= fastest
    }

    fn hold(&mut self, time: i64, mut echo: Echo) -> Result<(), Trouble> {
        if self.begin.is_none()
            && let Some(last) = self.last
        {
            // A measurement before any start.
            self.begin = self.without_start(last.time);
            self.next_fix = last.time + self.fix_period();
        }
        let Some(begin) = self.begin.filter(|begin| time >= begin.time) else {
            self.tally.unused += 1;
            return Ok(());
        };
        let earliest = self.last.map_or(begin.time, |last| last.time);
        if time < earliest {
            return Err(Fault::TimeWentBack.into());
        }
        let beams = echo.beams();
        let is_searching = self.estimators.as_ref().is_some_and(Estimators::is_searching);
        if let Echo::Scan { is_due, pings, .. } = &mut echo {
            *is_due = time >= self.next_fix;
            // A single range at the `fix_period` takes no time of the sweep.
            let takes_several = is_searching || *is_due && self.pings_per_scan > 1;
            *pings = if takes_several { self.sweep.pings_until(time) } else { 0 };
            if !*is_due && *pings == 0 {
                return Ok(());
            }
        }
        if self.pending.len() >= MOST_HELD || self.beams + beams > MOST_BEAMS {
            return Err(Fault::TooManyRanges.into());
        }
        if let Echo::Scan { is_due: true, .. } = echo {
            let period = self.fix_period();
            self.next_fix += ((time - self.next_fix) / period + 1) * period;
        }
        self.beams += beams;
        self.pending.push(Pending { time, echo });
        Ok(())
    }

    /// Processes the interval between two encoder records.
    fn advance(
        &mut self,
        from: Reading,
        to: Reading,
        complain: &mut Complain,
    ) -> Result<(), Trouble> {
        let Some(mut estimators) = self.estimators.take() else {
            return Ok(());
        };
        let mut pending = std::mem::take(&mut self.pending);
        pending.sort_by_key(|pending| pending.time);
        let gap = self.gap(&estimators, from, to, &pending);
        let mut pending = pending.into_iter().peekable();
        let lived = self.live(&mut estimators, from, to, gap, &mut pending, complain);
        // Ranges later than the record, or after an error.
        self.pending = pending.filter(|pending| pending.time > to.time).collect();
        self.beams = self.pending.iter().map(|pending| pending.echo.beams()).sum();
        if lived.is_err() {
            estimators.received.wheels = to.wheels;
        }
        self.estimators = Some(estimators);
        lived
    }

    fn live(
        &mut self,
        estimators: &mut Estimators,
        from: Reading,
        to: Reading,
        gap: Option<Gap>,
        pending: &mut Peekable<IntoIter<Pending>>,
        complain: &mut Complain,
    ) -> Result<(), Trouble> {
        loop {
            let row = self.reference.as_ref().and_then(Reference::next);
            let row = row.filter(|row| row.time <= to.time);
            let measure_until = row.map_or(to.time, |row| row.time);
            if let Some(measurement) = pending.next_if(|pending| pending.time <= measure_until) {
                if measurement.time < estimators.epoch {
                    self.tally.unused += 1;
                    continue;
                }
                self.tally.distance += estimators.drive_to(from.between(to, measurement.time))?;
                match &measurement.echo {
                    Echo::Absolute { age, measurement: absolute } => {
                        let measured_at = measurement.time - age;
                        let fix = estimators.absolute(measured_at, absolute);
                        self.tally.absolute.count(&fix);
                        let since = u64::try_from(measured_at - estimators.epoch).unwrap_or(0);
                        let measured_at = Instant::from_ticks(since);
                        self.recorder
                            .absolute(|| observe::absolute_record(measured_at, absolute, &fix));
                    }
                    Echo::Pose(start) => estimators.navigator.set_pose(start)?,
                    Echo::Mode { mode, state, deviation } => {
                        estimators.adopt(*mode, *state, *deviation)?;
                    }
                    echo if estimators.is_searching() => {
                        sweep(estimators, echo, &self.robot.localizer.rangers.first);
                    }
                    Echo::Scan { is_due: false, .. } => {}
                    Echo::Scan { scan, pings, .. } => {
                        let pings = (*pings).min(self.pings_per_scan);
                        self.measure_scan(estimators, &measurement, scan, pings);
                    }
                    _ => _ = self.measure(estimators, &measurement),
                }
                self.update(estimators, measurement.time);
            } else if let Some(row) = row {
                match &gap {
                    Some(gap) if row.time < to.time => self.miss(estimators, gap, row.time),
                    _ => {
                        let reading = from.between(to, row.time);
                        self.tally.distance += estimators.drive_to(reading)?;
                    }
                }
                let estimate = observe::estimate(estimators.localizer());
                let at = (estimators.since_start(row.time), self.tally.distance);
                let odometry = estimators.odometry.pose();
                self.score.add(at, &estimate, &odometry, &row.pose);
                self.reference.as_mut().map_or(Ok(()), |it| it.read(&mut *complain))?;
            } else {
                break;
            }
        }
        if let Some(gap) = &gap {
            self.miss(estimators, gap, to.time);
        }
        self.tally.distance += estimators.drive_to(to)?;
        let truth = self.reference.as_ref().and_then(|r| r.pose_at(to.time));
        self.recorder.tick(|| estimators.tick(estimators.since_start(to.time), truth));
        Ok(())
    }

    /// The gap between two encoder records in which the robot could not read its encoders. After lost frames there may be
    /// a measurement between the records, for which it has read them.
    fn gap(
        &self,
        estimators: &Estimators,
        from: Reading,
        to: Reading,
        pending: &[Pending],
    ) -> Option<Gap> {
        let is_between = |held: &Pending| from.time < held.time && held.time < to.time;
        if !self.begin.is_some_and(|begin| begin.is_own) || pending.iter().any(is_between) {
            return None;
        }
        let period = i64::try_from(self.robot.encoder_period.to_micros()).unwrap_or(i64::MAX);
        Gap::between(from, to, estimators.epoch, period)
    }

    /// Passes the encoder samples that failed up to a time.
    fn miss(&mut self, estimators: &mut Estimators, gap: &Gap, until: i64) {
        let mut before = estimators.localizer().health().verdict;
        while let Some(time) = estimators.miss(gap, until) {
            let now = estimators.localizer().health().verdict;
            let since_start = estimators.since_start(time);
            self.tally.verdicts.note(since_start, before, now);
            self.score.note_verdict((since_start, self.tally.distance), now);
            before = now;
            let truth = self.reference.as_ref().and_then(|r| r.pose_at(time));
            self.recorder.tick(|| estimators.tick(estimators.since_start(time), truth));
        }
    }

    /// Changes the mode if a measurement requires it.
    fn update(&mut self, estimators: &mut Estimators, time: i64) {
        let before = estimators.localizer().health().verdict;
        estimators.update();
        let now = estimators.localizer().health().verdict;
        let since_start = estimators.since_start(time);
        self.tally.verdicts.note(since_start, before, now);
        self.tally.verdicts.note_mismatch(estimators.localizer().mismatch());
        self.score.note_verdict((since_start, self.tally.distance), now);
    }

    /// Measures walls in a scan, at least one and at most `pings`, as long as the pose is known. Each ping is chosen with what
    /// the ones before have told, and at another wall. Where no wall can be measured, each counts as a cycle without one, as it
    /// would on the robot.
    fn measure_scan(
        &mut self,
        estimators: &mut Estimators,
        pending: &Pending,
        scan: &Scan,
        pings: u32,
    ) {
        let sonar = self.robot.localizer.rangers.first;
        let mut measured: Option<Measured> = None;
        for ping in 0..pings.max(1) {
            if ping > 0 {
                self.update(estimators, pending.time);
                if estimators.is_searching() {
                    return;
                }
            }
            if let Some(measured) = &mut measured {
                let Some(aim) = measured.next_aim(estimators.localizer()) else { return };
                let measurement = measurement(estimators, pending.time, &sonar);
                let range = scan.earliest(&Cone::of(&sonar, aim.bearing));
                self.fix(estimators, Measurement { range, ..measurement }, &aim);
            } else {
                let first = self.measure(estimators, pending);
                measured = first.map(|first| Measured::new(first, sonar.cone));
            }
        }
    }

    /// Measures as the robot would have, or with the recorded bearing; returns the aim, if there was a wall.
    fn measure(&mut self, estimators: &mut Estimators, pending: &Pending) -> Option<Aim> {
        let sonar = match pending.echo {
            Echo::At { ranger, .. } => self.robot.localizer.rangers.get(ranger),
            _ => None,
        };
        let sonar = sonar.unwrap_or(&self.robot.localizer.rangers.first);
        let mut measurement = measurement(estimators, pending.time, sonar);
        let navigator = &mut estimators.navigator;
        let localizer = navigator.localizer();
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let aim = match &pending.echo {
            Echo::At { bearing, wall: None, ranger, .. } => {
                localizer.aim_along(*ranger, Radians(*bearing as f32))
            }
            // The robot chose the wall at the time of the ping, not of the echo. A fix does not
            // depend on the predicted range and gain of that choice.
            Echo::At { bearing, wall: Some(wall), ranger, .. } => Ok(Aim {
                ranger: *ranger,
                wall: WallId(*wall),
                bearing: Radians(*bearing as f32),
                range: Metres(0.0),
                why: UNKNOWN,
            }),
            Echo::Scan { .. } => localizer.aim(),
            Echo::Skip | Echo::Absolute { .. } | Echo::Pose(_) | Echo::Mode { .. } => {
                Err(localizer.aim().err().unwrap_or(NoAim::NoWall))
            }
        };
        let before = localizer.health().verdict;
        let aim = match aim {
            Ok(aim) => aim,
            Err(no_aim) => {
                let localizer = navigator.localizer_mut();
                if let Echo::At { range, .. } = pending.echo {
                    measurement.range = range;
                    localizer.skip_unplanned();
                } else {
                    localizer.skip();
                }
                let now = navigator.localizer().health().verdict;
                self.tally.verdicts.note(measurement.time, before, now);
                self.tally.fixes.refused += 1;
                *self.tally.refusals.entry(no_aim.to_string()).or_default() += 1;
                self.recorder.fix(|| observe::no_aim_record(measurement, no_aim));
                return None;
            }
        };
        measurement.range = match &pending.echo {
            Echo::At { range, .. } => *range,
            Echo::Skip | Echo::Absolute { .. } | Echo::Pose(_) | Echo::Mode { .. } => None,
            Echo::Scan { scan, .. } => scan.earliest(&Cone::of(sonar, aim.bearing)),
        };
        self.fix(estimators, measurement, &aim);
        Some(aim)
    }

    /// Passes the range of a ping to the localizer.
    fn fix(&mut self, estimators: &mut Estimators, measurement: Measurement, aim: &Aim) {
        let navigator = &mut estimators.navigator;
        let before = navigator.localizer().health().verdict;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let range = measurement.range.map(|range| Metres(range as f32));
        let fix = navigator.fix(aim, range, estimators.search.as_deref_mut());
        let localizer = navigator.localizer();
        let now = localizer.health().verdict;
        self.tally.verdicts.note(measurement.time, before, now);
        let fixes = &mut self.tally.fixes;
        match fix {
            Fix::Accepted(_) | Fix::Downweighted(_) => fixes.accepted += 1,
            Fix::Gated(_) => fixes.gated += 1,
            Fix::Refused(refusal) => {
                fixes.refused += 1;
                *self.tally.refusals.entry(refusal.to_string()).or_default() += 1;
            }
            _ => fixes.refused += 1,
        }
        self.recorder.fix(|| {
            let record = observe::fix_record(measurement, aim, &fix, localizer);
            FixRecord { why: record.why.filter(|_| aim.why != UNKNOWN), ..record }
        });
    }

    /// Ends the replay.
    pub fn end(mut self) -> Result<End<'a>, ReplayError> {
        let estimators = self.estimators.ok_or(ReplayError::NoStart)?;
        let last = self.last.unwrap_or(estimators.received);
        let duration = estimators.since_start(last.time);
        let verdict = estimators.localizer().health().verdict;
        self.tally.verdicts.note(duration, verdict, verdict);
        self.tally.unused += self.pending.len() as u64;
        Ok(End {
            started_at: seconds(estimators.epoch),
            duration,
            localizer: estimators.localizer().clone(),
            searches: self.robot.start.is_unknown().then_some(estimators.searches),
            score: self.score,
            tally: self.tally,
        })
    }
}

impl Echo {
    fn beams(&self) -> usize {
        match self {
            Echo::At { .. }
            | Echo::Skip
            | Echo::Absolute { .. }
            | Echo::Pose(_)
            | Echo::Mode { .. } => 0,
            Echo::Scan { scan, .. } => scan.ranges.len(),
        }
    }
}

/// A ping of a sonar at the estimated pose, without its range.
fn measurement(estimators: &Estimators, time: i64, sonar: &RangerParameters) -> Measurement {
    let pose = estimators.localizer().pose();
    let mount = pose.to_map(sonar.mount);
    Measurement {
        time: seconds(time - estimators.epoch),
        sonar: [mount.x.0.into(), mount.y.0.into()],
        heading: pose.heading.radians().0.into(),
        range: None,
        source: None,
    }
}

/// The pings of a robot that searches.
fn sweep(estimators: &mut Estimators, echo: &Echo, sonar: &RangerParameters) {
    match echo {
        Echo::At { bearing, range, .. } => {
            let [bearing] = single([*bearing]);
            let range = range.map(|range| single([range])).map(|[range]| Metres(range));
            estimators.swept(Radians(bearing), range);
        }
        Echo::Scan { scan, pings, .. } => {
            for _ in 0..*pings {
                let Some(bearing) = estimators.sweep() else { return };
                let range = scan.specular(&Cone::of(sonar, bearing)).map(|range| single([range]));
                estimators.swept(bearing, range.map(|[range]| Metres(range)));
            }
        }
        Echo::Skip | Echo::Absolute { .. } | Echo::Pose(_) | Echo::Mode { .. } => {}
    }
}

fn estimate(values: [f64; STATES]) -> StateEstimate {
    StateEstimate::from_array(single(values))
}

fn deviations(values: [f64; STATES]) -> StandardDeviations {
    StandardDeviations::from_array(single(values))
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn single<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|value| value as f32)
}

/// The result of a replay.
pub struct End<'a> {
    /// Start time on the log's clock, seconds.
    pub started_at: f64,
    /// From the start to the last encoder record, seconds.
    pub duration: f64,
    pub localizer: Localizer<'a>,
    /// `None` if the robot does not search.
    pub searches: Option<Searches>,
    pub score: Score,
    pub tally: Tally,
}
