//! A robot that is picked up and put down elsewhere: how long until it says that it is lost, and
//! whether it ever believes in a wrong place again.

use indicatif::ProgressBar;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::config::Config;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, OdometryError, Start, StartError};
use sonarfix::map::Map;
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Pose;
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_map::{FileError, Floor, Scenario};

use crate::world::sensor::SensorModel;
use crate::world::{Ping, World};

/// A room of 6 m × 8 m with a partition.
const ROOM: &str = r#"
format = 1
[map]
unit = "m"
wall = [
    { name = "south", from = [0, 0], to = [6, 0] },
    { name = "east", from = [6, 0], to = [6, 8] },
    { name = "north", from = [6, 8], to = [0, 8] },
    { name = "west", from = [0, 8], to = [0, 0] },
    { name = "partition", from = [0, 5], to = [3.5, 5] },
]
"#;

/// How far away it is put down, metres; and turned by a quarter.
const AWAY: f64 = 1.0;
/// Fixes before it is picked up.
const BEFORE: usize = 20;
/// Fixes for which it is watched afterwards.
pub const WATCHED: usize = 100;
/// Seconds from one fix to the next.
const PERIOD: f64 = 0.5;
/// A position within this, and a heading within [`NEAR_HEADING`], is where the robot is: metres.
const NEAR: f64 = 0.1;
const NEAR_HEADING: f64 = 0.1;

/// What can keep a trial from being made.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The room or the sonar.
    #[error(transparent)]
    File(#[from] FileError),
    /// The localizer.
    #[error("the localizer refuses to start: {0}")]
    Start(#[from] StartError),
    /// The wheels.
    #[error("the localizer refuses its wheels' travel: {0}")]
    Odometry(#[from] OdometryError),
}

/// What one robot did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Whether it was still tracking when it was picked up.
    pub tracked_before: bool,
    /// After how many fixes it first said `Lost`; `None` if not within [`WATCHED`].
    pub called_after: Option<usize>,
    /// Whether its pose was right again when the watch ended.
    pub found_back: bool,
    /// Whether it said `Tracking` then, of a pose that was not.
    pub falsely_sure: bool,
}

/// The seeds 0 to `trials` − 1.
///
/// # Errors
/// [`TrialError`], of the first trial that could not go on.
pub fn trials(trials: u64) -> Result<Vec<Outcome>, TrialError> {
    let floor = Floor::parse(ROOM, "room.toml")?;
    // An ideal sonar with a noise of 5 mm, that hears up to 4 m.
    let mut scenario = Scenario::paper()?;
    scenario.truth.range_noise = 0.005;
    scenario.robot.config.sonar.max_range = Metres(4.0);
    let (walls, world) = (floor.walls(), World::new(&floor));
    let sensor = SensorModel::ideal(&scenario);
    let bar = ProgressBar::new(trials);
    let outcomes = (0..trials)
        .into_par_iter()
        .map(|seed| {
            let outcome = Trial::new(seed, Map::new(&walls), &world, &sensor)?.watch();
            bar.inc(1);
            outcome
        })
        .collect();
    bar.finish_and_clear();
    outcomes
}

/// A robot on a slow curve; it knows its wheels exactly, for ease of the truth.
struct Trial<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    localizer: Localizer<'a>,
    /// x, y, heading.
    truth: [f64; 3],
    /// The direction in which it will be carried off, radians.
    away: f64,
    now: u64,
    noise: ChaCha8Rng,
    luck: ChaCha8Rng,
}

impl<'a> Trial<'a> {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    fn new(
        seed: u64,
        map: Map<'a>,
        world: &'a World,
        sensor: &'a SensorModel,
    ) -> Result<Self, TrialError> {
        let mut noise = ChaCha8Rng::seed_from_u64(seed);
        // Anywhere in the southern part, so that a metre off still is inside the room.
        let truth = [
            noise.random_range(1.7..4.3),
            noise.random_range(1.7..3.3),
            noise.random_range(-3.0..3.0),
        ];
        let [x, y, heading] = truth.map(|v| v as f32);
        let start = Start {
            pose: Pose::new(x, y, Radians(heading)),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.02),
        };
        let config = Config::for_track_width(Metres(0.2));
        let localizer = Localizer::new(config, map, start, Instant::from_ticks(0))?;
        let away = noise.random_range(-3.0..3.0);
        let luck = noise.clone();
        Ok(Self { world, sensor, localizer, truth, away, now: 0, noise, luck })
    }

    fn watch(mut self) -> Result<Outcome, TrialError> {
        let mut tracked_before = true;
        for _ in 0..BEFORE {
            tracked_before &= self.go_on()? == Verdict::Tracking;
        }
        let [x, y, heading] = &mut self.truth;
        *x += AWAY * self.away.cos();
        *y += AWAY * self.away.sin();
        *heading += std::f64::consts::FRAC_PI_2;
        let mut called_after = None;
        for fix in 1..=WATCHED {
            if self.go_on()? == Verdict::Lost {
                called_after = called_after.or(Some(fix));
            }
        }
        let found_back = self.is_right();
        let is_sure = self.localizer.health().verdict == Verdict::Tracking;
        Ok(Outcome {
            tracked_before,
            called_after,
            found_back,
            falsely_sure: is_sure && !found_back,
        })
    }

    fn is_right(&self) -> bool {
        let pose = self.localizer.pose();
        let [x, y, heading] = self.truth;
        let off = (f64::from(pose.x.0) - x).hypot(f64::from(pose.y.0) - y);
        let turned = crate::angle::wrap(f64::from(pose.heading.radians().0) - heading);
        off < NEAR && turned.abs() < NEAR_HEADING
    }

    /// Rolls on a curve for half a second and takes a fix.
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    fn go_on(&mut self) -> Result<Verdict, TrialError> {
        const STEPS: u64 = 5;
        for _ in 0..STEPS {
            self.now += crate::simulate::micros(PERIOD) / STEPS;
            let (advance, turn) = (0.02, 0.02);
            let half = 0.5 * 0.2 * turn;
            let travel = WheelTravel::new((advance + half) as f32, (advance - half) as f32);
            self.localizer.odometry(Instant::from_ticks(self.now), travel)?;
            let [x, y, heading] = &mut self.truth;
            let middle = *heading + turn / 2.0;
            *x += advance * middle.cos();
            *y += advance * middle.sin();
            *heading += turn;
        }
        let Ok(aim) = self.localizer.aim() else {
            self.localizer.skip();
            return Ok(self.localizer.health().verdict);
        };
        let [x, y, heading] = self.truth;
        let direction = heading + f64::from(aim.bearing.0);
        let ping = Ping { time: 0.0, sonar_after: &|_| [x, y], direction };
        let echo = self.world.echo(&ping, self.sensor, &mut self.noise, &mut self.luck);
        let range = echo.map(|echo| Metres(echo.range as f32));
        let _ = self.localizer.fix(&aim, range);
        Ok(self.localizer.health().verdict)
    }
}
