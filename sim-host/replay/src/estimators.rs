//! The estimators of a replay: the navigator with its search, and dead reckoning beside it.

use serde::Serialize;
use sonarfix::filter::ekf::{EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal, Localizer, OdometryError};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::robot::EVALUATIONS_PER_MILLISECOND;
use sonarfix_search::navigator::{Mode, Navigator};
use sonarfix_search::search::Search;
use sonarfix_sim::observe;
use sonarfix_sim::odometry::DeadReckoning;
use sonarfix_sim::trace::{Pose, Tick, Truth};

use crate::gap::Gap;
use crate::reference::seconds;
use crate::turns::Turns;
use crate::wheels::Reading;

/// What the search did during a replay. Times in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Searches {
    /// How often it began.
    pub begun: u64,
    /// How often its unique answer became the pose.
    pub handed_over: u64,
    /// How many of these poses were confirmed.
    pub confirmed: u64,
    /// Time with an unknown pose.
    pub searching_seconds: f64,
    /// Time with a pose that was not confirmed.
    pub provisional_seconds: f64,
}

/// The computing time that a recorded robot grants the search.
#[derive(Debug, Clone, Copy, Default)]
pub struct ComputingTime {
    /// Thousandths of an evaluation.
    spare: i64,
}

impl ComputingTime {
    /// The evaluations of an interval, microseconds.
    pub fn evaluations(&mut self, elapsed: i64) -> u16 {
        let thousandths = self.spare + elapsed * i64::from(EVALUATIONS_PER_MILLISECOND);
        self.spare = thousandths % 1_000;
        // More than a whole search in a gap of the log would do nothing new.
        u16::try_from(thousandths / 1_000).unwrap_or(u16::MAX)
    }
}

/// The navigator, with dead reckoning beside it.
pub struct Estimators<'a> {
    pub navigator: Navigator<'a>,
    pub search: Option<Box<Search<'a>>>,
    pub odometry: DeadReckoning,
    /// Start time of the localizer.
    pub epoch: i64,
    /// The encoder reading that the localizer has received.
    pub received: Reading,
    /// The time of the last encoder sample that failed.
    missed: i64,
    pub searches: Searches,
    /// The recorded turns of a gyro.
    pub turns: Turns,
    computing: ComputingTime,
}

impl<'a> Estimators<'a> {
    /// Estimators that start with a reading of the encoders.
    pub fn new(
        navigator: Navigator<'a>,
        search: Option<Box<Search<'a>>>,
        odometry: DeadReckoning,
        reading: Reading,
    ) -> Self {
        Self {
            navigator,
            search,
            odometry,
            epoch: reading.time,
            received: reading,
            missed: reading.time,
            searches: Searches::default(),
            turns: Turns::default(),
            computing: ComputingTime::default(),
        }
    }

    /// The localizer.
    pub fn localizer(&self) -> &Localizer<'a> {
        self.navigator.localizer()
    }

    /// Whether the pose is unknown.
    pub fn is_searching(&self) -> bool {
        self.navigator.mode() == Mode::Searching
    }

    /// The state at a time since the start.
    pub fn tick(&self, time: f64, truth: Option<Pose>) -> Tick {
        Tick {
            time,
            truth: truth.map(|pose| Truth { pose, calibration: None, gyro_bias: None }),
            estimate: observe::estimate(self.localizer()),
            bound: None,
            odometry: self.odometry.pose(),
        }
    }

    /// Seconds since the start.
    pub fn since_start(&self, time: i64) -> f64 {
        seconds(time - self.epoch)
    }

    /// Advances to a reading; returns the distance travelled. The search works during that time.
    pub fn drive_to(&mut self, reading: Reading) -> Result<f64, OdometryError> {
        if reading.time <= self.received.time {
            return Ok(0.0);
        }
        let elapsed = reading.time - self.received.time;
        let ([right, left], received) = self.received.advanced_to(reading);
        let now = Instant::from_ticks((reading.time - self.epoch).unsigned_abs());
        let travel = WheelTravel::new(right, left);
        let reading = self.turns.at(received.time);
        let turn = self.turns.since_taken(reading);
        self.navigator.odometry_with_turn(now, travel, turn, self.search.as_deref_mut())?;
        self.turns.take(reading);
        self.odometry.moved([right.into(), left.into()]);
        self.received = received;
        self.work(elapsed);
        Ok(f64::midpoint(right.into(), left.into()).abs())
    }

    /// Passes a heading, position or pose that was measured at a time.
    pub fn absolute(&mut self, time: i64, measurement: &AbsoluteMeasurement) -> AbsoluteFix {
        // Before the epoch there is no step.
        let since = u64::try_from(time - self.epoch);
        let refused = AbsoluteFix::Refused(AbsoluteRefusal::BeforeLastStep);
        since.map_or(refused, |since| {
            self.navigator.absolute(Instant::from_ticks(since), measurement)
        })
    }

    /// Passes the next encoder sample that failed, in a gap of the log up to a time; returns its time.
    pub fn miss(&mut self, gap: &Gap, until: i64) -> Option<i64> {
        let time = gap.next_failed(self.missed, until)?;
        let now = Instant::from_ticks((time - self.epoch).unsigned_abs());
        self.navigator.localizer_mut().odometry_missing(now);
        self.missed = time;
        Some(time)
    }

    /// Makes the evaluations of a time, microseconds, and changes the mode when it is due.
    fn work(&mut self, elapsed: i64) {
        let before = self.navigator.mode();
        match before {
            Mode::Tracking => {}
            Mode::Searching => self.searches.searching_seconds += seconds(elapsed),
            Mode::Provisional => self.searches.provisional_seconds += seconds(elapsed),
        }
        let Some(search) = &mut self.search else { return };
        let evaluations = self.computing.evaluations(elapsed);
        let changed = self.navigator.work(evaluations, search);
        self.count(before, changed);
    }

    /// Takes a recorded change of the mode. From then on the log decides about the mode, and the replay searches no more.
    pub fn adopt(
        &mut self,
        mode: Mode,
        state: StateEstimate,
        deviation: StandardDeviations,
    ) -> Result<(), EkfError> {
        let before = self.navigator.mode();
        self.navigator.adopt(mode, state, deviation)?;
        self.search = None;
        self.count(before, Some(mode).filter(|mode| *mode != before));
        Ok(())
    }

    /// Changes the mode if a fix requires it.
    pub fn update(&mut self) {
        let Some(search) = &mut self.search else { return };
        let before = self.navigator.mode();
        let changed = self.navigator.update(search);
        self.count(before, changed);
    }

    fn count(&mut self, before: Mode, changed: Option<Mode>) {
        match changed {
            Some(Mode::Searching) => self.searches.begun += 1,
            Some(Mode::Provisional) => self.searches.handed_over += 1,
            Some(Mode::Tracking) if before == Mode::Provisional => self.searches.confirmed += 1,
            _ => {}
        }
    }

    /// The bearing in which the search wants the next ping.
    pub fn sweep(&self) -> Option<Radians> {
        self.search.as_ref().map(|search| search.aim())
    }

    /// Passes the range of a ping in any direction to the search.
    pub fn swept(&mut self, bearing: Radians, range: Option<Metres>) {
        if let Some(search) = &mut self.search {
            // The parser refuses what is not finite.
            _ = self.navigator.ping(bearing, range, search);
        }
    }
}
