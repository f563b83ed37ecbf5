//! One replay under way: records in, fixes and scores out.

use std::io::BufRead;
use std::iter::Peekable;
use std::vec::IntoIter;

use sonarfix::aim::{Aim, NoAim, Reason};
use sonarfix::config::Rhythm;
use sonarfix::ekf::State;
use sonarfix::localizer::{Fix, Localizer, OdometryError};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Duration, Instant, Metres, Radians, SquareMetres};
use sonarfix_map::Robot;

use crate::observe::{self, Look};
use crate::odometry::DeadReckoning;
use crate::replay::fault::{Fault, ReplayError};
use crate::replay::log::Record;
use crate::replay::reference::{Reference, micros, seconds};
use crate::replay::scan::{Listening, Scan};
use crate::replay::score::{Score, Verdicts};
use crate::replay::wheels::Reading;
use crate::statistics::FixCounts;
use crate::trace::{FixRecord, Pose, Recorder, Tick, Truth};

/// Ranges that may wait for the next encoder record: a sonar that pings for a minute.
const MOST_HELD: usize = 1024;
/// And their beams, all together: 4 MiB.
const MOST_BEAMS: usize = 1 << 20;

/// Why the robot looked where it did, which a log does not say.
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
struct Held {
    time: i64,
    echo: Echo,
}

enum Echo {
    At {
        bearing: f64,
        range: Option<f64>,
        wall: Option<u32>,
    },
    Scan(Scan),
    /// The robot found nothing to look at.
    Skip,
}

/// The start record, whichever it was.
#[derive(Clone, Copy)]
struct Begin {
    time: i64,
    pose: Pose,
    state: State,
    deviation: State,
}

#[derive(Clone, Copy, PartialEq)]
enum Encoder {
    Ticks,
    Wheels,
}

/// What a replay counts.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub fixes: FixCounts,
    pub encoder_records: u64,
    /// Ranges and scans from before the start or after the last encoder record.
    pub unused: u64,
    /// How often the encoders were taken to have jumped.
    pub encoder_jumps: u64,
    /// Way of the robot's middle by its encoders, metres.
    pub distance: f64,
    pub verdicts: Verdicts,
}

/// The localizer, and the encoders alone beside it.
struct Pilot<'a> {
    localizer: Localizer<'a>,
    odometry: DeadReckoning,
    /// When the localizer began.
    epoch: i64,
    /// What the localizer has been told of the encoders.
    told: Reading,
}

impl Pilot<'_> {
    /// Seconds since the start.
    fn since_start(&self, time: i64) -> f64 {
        seconds(time - self.epoch)
    }

    /// Moves on to a reading; returns the way that was rolled.
    fn drive_to(&mut self, reading: Reading) -> Result<f64, OdometryError> {
        if reading.time <= self.told.time {
            return Ok(0.0);
        }
        let ([right, left], told) = self.told.advanced_to(reading);
        let now = Instant::from_ticks((reading.time - self.epoch).unsigned_abs());
        self.localizer.odometry(now, WheelTravel::new(right, left))?;
        self.odometry.moved([right.into(), left.into()]);
        self.told = told;
        Ok(f64::midpoint(right.into(), left.into()).abs())
    }
}

/// A replay under way.
pub struct Session<'a, R, V> {
    robot: &'a Robot,
    walls: &'a [Wall],
    recorder: &'a mut V,
    reference: Option<Reference<R>>,
    begin: Option<Begin>,
    encoder: Option<Encoder>,
    pilot: Option<Pilot<'a>>,
    /// The last encoder record.
    last: Option<Reading>,
    /// An encoder record that was too far from the last one to be believed.
    suspect: Option<Reading>,
    held: Vec<Held>,
    beams: usize,
    /// From when on a scan is used for a fix.
    next_fix: i64,
    score: Score,
    tally: Tally,
}

/// What is said of a row of the reference that is skipped.
pub type Complain<'c> = dyn FnMut(u64, Fault) -> Result<(), ReplayError> + 'c;

impl<'a, R: BufRead, V: Recorder> Session<'a, R, V> {
    pub fn new(
        robot: &'a Robot,
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
            pilot: None,
            last: None,
            suspect: None,
            held: Vec::new(),
            beams: 0,
            next_fix: 0,
            score: Score::default(),
            tally: Tally::default(),
        }
    }

    /// Takes the next record of the log.
    pub fn take(&mut self, record: Record, complain: &mut Complain) -> Result<(), Trouble> {
        match record {
            Record::Start { time, pose, position_deviation, heading_deviation } => {
                let (sigma, heading) = (position_deviation, heading_deviation);
                let state = state_of_pose([pose.x, pose.y, pose.heading]);
                let prior = self.robot.config.prior;
                let deviation = State {
                    scale_right: prior.scale_right,
                    scale_left: prior.scale_left,
                    track_width_error: prior.track_width.0,
                    range_scale: prior.range_scale,
                    ..state_of_pose([sigma, sigma, heading])
                };
                self.take_start(Begin { time: micros(time), pose, state, deviation }, complain)
            }
            Record::Resume { time, state: told, deviation } => {
                let [x, y, heading, ..] = told;
                let pose = Pose { x, y, heading };
                let (state, deviation) = (state(told), state(deviation));
                self.take_start(Begin { time: micros(time), pose, state, deviation }, complain)
            }
            Record::Ticks { time, right, left } => {
                let wheels = self.rolled([right, left])?;
                self.take_wheels(micros(time), wheels, Encoder::Ticks, complain)
            }
            Record::Wheels { time, right, left } => {
                self.take_wheels(micros(time), [right, left], Encoder::Wheels, complain)
            }
            Record::Range { time, bearing, range, wall } => {
                self.hold(micros(time), Echo::At { bearing, range, wall })
            }
            Record::Skip { time } => self.hold(micros(time), Echo::Skip),
            Record::Scan { time, scan } => self.hold(micros(time), Echo::Scan(scan)),
        }
    }

    fn rolled(&self, ticks: [i64; 2]) -> Result<[f64; 2], ReplayError> {
        let per_tick = self.robot.travel_per_tick;
        let per_tick = per_tick.ok_or(ReplayError::NoTravelPerTick)?;
        #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
        let [right, left] = ticks.map(|count| count as f64);
        Ok([right * f64::from(per_tick.right.0), left * f64::from(per_tick.left.0)])
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
        let timing = &self.robot.config.sonar.timing;
        let period = match timing.rhythm {
            Rhythm::Every(period) => period,
            // A recording has no servo to wait for.
            Rhythm::AsFastAsPossible => timing.cycle,
        };
        i64::try_from(period.to_micros()).unwrap_or(i64::MAX).max(1)
    }

    /// The localizer starts where it is told, when both start and encoders are known.
    fn begin_at(
        &mut self,
        begin: Begin,
        reading: Reading,
        complain: &mut Complain,
    ) -> Result<(), ReplayError> {
        let config = self.robot.config;
        let track_width = config.drive.track_width.0.into();
        let map = Map::new(self.walls);
        let Begin { state, deviation, .. } = begin;
        let localizer = Localizer::resume(config, map, state, deviation, Instant::from_ticks(0))?;
        self.pilot = Some(Pilot {
            localizer,
            odometry: DeadReckoning::new(begin.pose, track_width),
            epoch: reading.time,
            told: reading,
        });
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
                // Two records agree with each other and not with those before: the counters have
                // jumped. Meanwhile the wheels rolled as they did after, as far as anyone knows.
                self.tally.encoder_jumps += 1;
                let jumped = last.rolling_on(suspect, reading);
                self.advance(last, jumped, complain)?;
                if let Some(pilot) = &mut self.pilot {
                    pilot.told = suspect;
                }
                self.last = Some(suspect);
            }
        }
        self.suspect = None;
        self.tally.encoder_records += 1;
        let last = self.last.replace(reading);
        if self.pilot.is_none()
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

    /// Whether a wheel can have rolled so.
    fn is_plausible(&self, from: Reading, to: Reading) -> bool {
        // A little less than the localizer allows: the parts of a travel are rounded.
        let fastest = 0.999 * f64::from(self.robot.config.max_wheel_speed.0);
        from.speed_to(to) <= fastest
    }

    fn hold(&mut self, time: i64, echo: Echo) -> Result<(), Trouble> {
        let Some(begin) = self.begin.filter(|begin| time >= begin.time) else {
            self.tally.unused += 1;
            return Ok(());
        };
        let earliest = self.last.map_or(begin.time, |last| last.time);
        if time < earliest {
            return Err(Fault::TimeWentBack.into());
        }
        let beams = match &echo {
            Echo::At { .. } | Echo::Skip => 0,
            Echo::Scan(scan) => {
                if time < self.next_fix {
                    return Ok(());
                }
                scan.ranges.len()
            }
        };
        if self.held.len() >= MOST_HELD || self.beams + beams > MOST_BEAMS {
            return Err(Fault::TooManyRanges.into());
        }
        if matches!(echo, Echo::Scan(_)) {
            let period = self.fix_period();
            self.next_fix += ((time - self.next_fix) / period + 1) * period;
        }
        self.beams += beams;
        self.held.push(Held { time, echo });
        Ok(())
    }

    /// Lives through the time between two encoder records.
    fn advance(
        &mut self,
        from: Reading,
        to: Reading,
        complain: &mut Complain,
    ) -> Result<(), Trouble> {
        let Some(mut pilot) = self.pilot.take() else {
            return Ok(());
        };
        let mut held = std::mem::take(&mut self.held);
        held.sort_by_key(|held| held.time);
        let mut held = held.into_iter().peekable();
        let lived = self.live(&mut pilot, from, to, &mut held, complain);
        // What is later than the record, or came after something that went wrong.
        self.held = held.filter(|held| held.time > to.time).collect();
        self.beams = self.held.iter().map(Held::beams).sum();
        if lived.is_err() {
            pilot.told.wheels = to.wheels;
        }
        self.pilot = Some(pilot);
        lived
    }

    fn live(
        &mut self,
        pilot: &mut Pilot,
        from: Reading,
        to: Reading,
        held: &mut Peekable<IntoIter<Held>>,
        complain: &mut Complain,
    ) -> Result<(), Trouble> {
        loop {
            let row = self.reference.as_ref().and_then(Reference::next);
            let row = row.filter(|row| row.time <= to.time);
            let look_by = row.map_or(to.time, |row| row.time);
            if let Some(look) = held.next_if(|held| held.time <= look_by) {
                if look.time < pilot.epoch {
                    self.tally.unused += 1;
                    continue;
                }
                self.tally.distance += pilot.drive_to(from.between(to, look.time))?;
                self.look(pilot, &look);
            } else if let (Some(row), Some(reference)) = (row, &mut self.reference) {
                self.tally.distance += pilot.drive_to(from.between(to, row.time))?;
                let estimate = observe::estimate(&pilot.localizer);
                let time = pilot.since_start(row.time);
                self.score.add(time, &estimate, &pilot.odometry.pose(), &row.pose);
                reference.read(&mut *complain)?;
            } else {
                break;
            }
        }
        self.tally.distance += pilot.drive_to(to)?;
        let truth = self.reference.as_ref().and_then(|r| r.pose_at(to.time));
        self.recorder.tick(|| Tick {
            time: pilot.since_start(to.time),
            truth: truth.map(|pose| Truth { pose, calibration: None }),
            estimate: observe::estimate(&pilot.localizer),
            bound: None,
            odometry: pilot.odometry.pose(),
        });
        Ok(())
    }

    /// Takes a range as the robot would have, or as it was taken.
    fn look(&mut self, pilot: &mut Pilot, held: &Held) {
        let localizer = &mut pilot.localizer;
        let pose = localizer.pose();
        let sonar = &self.robot.config.sonar;
        let mount = pose.to_map(sonar.mount);
        let mut look = Look {
            time: seconds(held.time - pilot.epoch),
            sonar: [mount.x.0.into(), mount.y.0.into()],
            heading: pose.heading.radians().0.into(),
            range: None,
            met: None,
        };
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let aim = match &held.echo {
            Echo::At { bearing, wall: None, .. } => localizer.aim_at(Radians(*bearing as f32)),
            // The robot chose the wall as it pinged, and not as it heard. What range it expected
            // then and why it looked there, a fix does not ask.
            Echo::At { bearing, wall: Some(wall), .. } => Ok(Aim {
                wall: WallId(*wall),
                bearing: Radians(*bearing as f32),
                range: Metres(0.0),
                why: UNKNOWN,
            }),
            Echo::Scan(_) => localizer.aim(),
            Echo::Skip => Err(localizer.aim().err().unwrap_or(NoAim::NoWall)),
        };
        let before = localizer.health().verdict;
        let aim = match aim {
            Ok(aim) => aim,
            Err(no_aim) => {
                localizer.skip();
                self.tally.verdicts.note(look.time, before, localizer.health().verdict);
                self.tally.fixes.refused += 1;
                self.recorder.fix(|| observe::no_aim_record(look, no_aim));
                return;
            }
        };
        look.range = match &held.echo {
            Echo::At { range, .. } => *range,
            Echo::Skip => None,
            Echo::Scan(scan) => scan.earliest(&Listening {
                bearing: aim.bearing.0.into(),
                cone: sonar.cone.0.into(),
                reach: (sonar.min_range.0.into(), sonar.max_range.0.into()),
            }),
        };
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let range = look.range.map(|range| Metres(range as f32));
        let fix = localizer.fix(&aim, range);
        let now = localizer.health().verdict;
        self.tally.verdicts.note(look.time, before, now);
        let fixes = &mut self.tally.fixes;
        match fix {
            Fix::Accepted(_) | Fix::Weakened(_) => fixes.accepted += 1,
            Fix::Gated(_) => fixes.gated += 1,
            Fix::Refused(_) => fixes.refused += 1,
        }
        self.recorder.fix(|| {
            let record = observe::fix_record(look, &aim, &fix);
            FixRecord { why: record.why.filter(|_| aim.why != UNKNOWN), ..record }
        });
    }

    /// Ends the replay.
    pub fn end(mut self) -> Result<End<'a>, ReplayError> {
        let pilot = self.pilot.ok_or(ReplayError::NoStart)?;
        let last = self.last.unwrap_or(pilot.told);
        let duration = pilot.since_start(last.time);
        let verdict = pilot.localizer.health().verdict;
        self.tally.verdicts.note(duration, verdict, verdict);
        self.tally.unused += self.held.len() as u64;
        Ok(End {
            started_at: seconds(pilot.epoch),
            duration,
            localizer: pilot.localizer,
            score: self.score,
            tally: self.tally,
        })
    }
}

impl Held {
    fn beams(&self) -> usize {
        match &self.echo {
            Echo::At { .. } | Echo::Skip => 0,
            Echo::Scan(scan) => scan.ranges.len(),
        }
    }
}

/// A number for each state, as the robot computes.
fn state(values: [f64; 7]) -> State {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let [x, y, heading, scale_right, scale_left, track_width_error, range_scale] =
        values.map(|value| value as f32);
    State { x, y, heading, scale_right, scale_left, track_width_error, range_scale }
}

fn state_of_pose([x, y, heading]: [f64; 3]) -> State {
    state([x, y, heading, 0.0, 0.0, 0.0, 0.0])
}

/// What is left when a replay has ended.
pub struct End<'a> {
    /// On the log's clock, seconds.
    pub started_at: f64,
    /// From the start to the last encoder record, seconds.
    pub duration: f64,
    pub localizer: Localizer<'a>,
    pub score: Score,
    pub tally: Tally,
}
