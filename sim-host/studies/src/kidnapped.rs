//! Kidnapped robots: the time until the verdict is `Lost`, and whether a robot relocalizes or tracks a
//! wrong pose.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, OdometryError, Start, StartError};
use sonarfix::map::Map;
use sonarfix_map::{FileError, Floor, Scenario};

use sonarfix_sim::progress::Progress;
use sonarfix_sim::world::sensor::SensorModel;
use sonarfix_sim::world::{Ping, World};

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

/// Distance of the kidnapping, metres; the heading changes by 90°.
const AWAY: f64 = 1.0;
/// Measurement cycles before the kidnapping.
const BEFORE: usize = 20;
/// Measurement cycles after the kidnapping.
pub const WATCHED: usize = 100;
/// Period of the measurement cycles, seconds.
const PERIOD: f64 = 0.5;
/// Position error of a correct pose, metres; its heading error is below [`NEAR_HEADING`].
const NEAR: f64 = 0.1;
const NEAR_HEADING: f64 = 0.1;

/// Why a trial failed.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The room or the scenario is invalid.
    #[error(transparent)]
    File(#[from] FileError),
    /// The localizer rejects its start.
    #[error("the localizer rejects its start: {0}")]
    Start(#[from] StartError),
    /// The localizer rejects the travel.
    #[error("the localizer rejects the travel of the wheels: {0}")]
    Odometry(#[from] OdometryError),
}

/// The outcome of one trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Whether the verdict was `Tracking` up to the kidnapping.
    pub tracked_before: bool,
    /// The cycle of the first verdict `Lost`; `None` if not within [`WATCHED`].
    pub called_after: Option<usize>,
    /// Whether the pose was correct at the end.
    pub relocalized: bool,
    /// Whether the verdict was `Tracking` at the end, with a wrong pose.
    pub tracks_wrong_pose: bool,
}

/// Runs `trials` seeds from `first` on, unless it is interrupted.
///
/// # Errors
/// The [`TrialError`] of the first trial that fails.
pub fn trials(
    first: u64,
    trials: u64,
    progress: &impl Progress,
) -> Result<Vec<Outcome>, TrialError> {
    let floor = Floor::parse(ROOM, "room.toml")?;
    // An ideal sonar with a noise of 5 mm and a maximum range of 4 m.
    let mut scenario = Scenario::paper()?;
    scenario.truth.range_noise = 0.005;
    scenario.robot.localizer.rangers.first.max_range = Metres(4.0);
    let (walls, world) = (floor.walls(), World::new(&floor));
    let sensor = SensorModel::ideal(&scenario);
    (0..trials)
        .into_par_iter()
        .filter(|_| !progress.is_interrupted())
        .map(|trial| {
            let seed = first.wrapping_add(trial);
            let outcome = Trial::new(seed, Map::new(&walls), &world, &sensor)?.watch();
            progress.finished();
            outcome
        })
        .collect()
}

/// A robot on a slow curve, without wheel errors.
struct Trial<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    localizer: Localizer<'a>,
    /// x, y, heading.
    truth: [f64; 3],
    /// The direction of the kidnapping, radians.
    away: f64,
    now: u64,
    noise: ChaCha8Rng,
    echo_rng: ChaCha8Rng,
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
        // In the southern part, so that a displacement by a metre stays inside the room.
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
        let echo_rng = noise.clone();
        Ok(Self { world, sensor, localizer, truth, away, now: 0, noise, echo_rng })
    }

    fn watch(mut self) -> Result<Outcome, TrialError> {
        let mut tracked_before = true;
        for _ in 0..BEFORE {
            tracked_before &= self.cycle()? == Verdict::Tracking;
        }
        let [x, y, heading] = &mut self.truth;
        *x += AWAY * self.away.cos();
        *y += AWAY * self.away.sin();
        *heading += std::f64::consts::FRAC_PI_2;
        let mut called_after = None;
        for fix in 1..=WATCHED {
            if self.cycle()? == Verdict::Lost {
                called_after = called_after.or(Some(fix));
            }
        }
        let relocalized = self.is_right();
        let is_tracking = self.localizer.health().verdict == Verdict::Tracking;
        Ok(Outcome {
            tracked_before,
            called_after,
            relocalized,
            tracks_wrong_pose: is_tracking && !relocalized,
        })
    }

    fn is_right(&self) -> bool {
        let pose = self.localizer.pose();
        let [x, y, heading] = self.truth;
        let off = (f64::from(pose.x.0) - x).hypot(f64::from(pose.y.0) - y);
        let turned = sonarfix_sim::angle::wrap(f64::from(pose.heading.radians().0) - heading);
        off < NEAR && turned.abs() < NEAR_HEADING
    }

    /// Drives on a curve for half a second and measures a range.
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    fn cycle(&mut self) -> Result<Verdict, TrialError> {
        const STEPS: u64 = 5;
        for _ in 0..STEPS {
            self.now += sonarfix_sim::time::micros(PERIOD) / STEPS;
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
        let echo = self.world.echo(&ping, self.sensor, &mut self.noise, &mut self.echo_rng);
        let range = echo.map(|echo| Metres(echo.range as f32));
        let _ = self.localizer.fix(&aim, range);
        Ok(self.localizer.health().verdict)
    }
}
