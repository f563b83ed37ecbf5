//! A robot that is picked up and put down elsewhere must say that it is lost.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::config::Config;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Pose;
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_map::{Floor, Scenario};
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

const TRIALS: u64 = 1_000;
/// "Within 15 fixes in 95 % of the trials."
const FIXES: usize = 15;
const SHARE: f64 = 0.95;

/// A robot that turns on the spot so slowly that every look is square, for ease of the truth.
struct Trial<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    localizer: Localizer<'a>,
    /// x, y, heading.
    truth: [f64; 3],
    now: u64,
    noise: ChaCha8Rng,
    luck: ChaCha8Rng,
}

impl Trial<'_> {
    /// Rolls on a curve for half a second and takes a fix.
    fn go_on(&mut self) -> Verdict {
        for _ in 0..5 {
            self.now += 100_000;
            let (advance, turn) = (0.02, 0.02);
            let half = 0.5 * 0.2 * turn;
            let travel = WheelTravel::new((advance + half) as f32, (advance - half) as f32);
            self.localizer.odometry(Instant::from_ticks(self.now), travel).unwrap();
            let middle = self.truth[2] + turn / 2.0;
            self.truth[0] += advance * middle.cos();
            self.truth[1] += advance * middle.sin();
            self.truth[2] += turn;
        }
        let Ok(aim) = self.localizer.aim() else {
            self.localizer.skip();
            return self.localizer.health().verdict;
        };
        let [x, y, heading] = self.truth;
        let ping = Ping {
            time: 0.0,
            sonar_after: &|_| [x, y],
            direction: heading + f64::from(aim.bearing.0),
        };
        let echo = self.world.echo(&ping, self.sensor, &mut self.noise, &mut self.luck);
        let range = echo.map(|echo| Metres(echo.range as f32));
        let _ = self.localizer.fix(&aim, range);
        self.localizer.health().verdict
    }
}

/// After how many fixes each trial's robot says that it is lost.
fn fixes_until_lost() -> Vec<usize> {
    let floor = Floor::parse(ROOM, "room.toml").unwrap();
    let (walls, world) = (floor.walls(), World::new(&floor));
    // An ideal sonar with a noise of 5 mm, that hears up to 4 m.
    let mut scenario = Scenario::paper().unwrap();
    scenario.truth.range_noise = 0.005;
    scenario.robot.config.sonar.max_range = Metres(4.0);
    let sensor = SensorModel::ideal(&scenario);
    let trial = |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Anywhere in the southern part, so that a metre off still is inside the room.
        let truth =
            [rng.random_range(1.7..4.3), rng.random_range(1.7..3.3), rng.random_range(-3.0..3.0)];
        let start = Start {
            pose: Pose::new(truth[0] as f32, truth[1] as f32, Radians(truth[2] as f32)),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.02),
        };
        let config = Config::for_track_width(Metres(0.2));
        let map = Map::new(&walls);
        let localizer = Localizer::new(config, map, start, Instant::from_ticks(0)).unwrap();
        let away: f64 = rng.random_range(-3.0..3.0);
        let luck = rng.clone();
        let (world, sensor) = (&world, &sensor);
        let mut trial = Trial { world, sensor, localizer, truth, now: 0, noise: rng, luck };
        for _ in 0..20 {
            assert_eq!(trial.go_on(), Verdict::Tracking, "before it is picked up");
        }
        trial.truth[0] += away.cos();
        trial.truth[1] += away.sin();
        trial.truth[2] += std::f64::consts::FRAC_PI_2;
        (1..=100).find(|_| trial.go_on() == Verdict::Lost).unwrap_or(101)
    };
    (0..TRIALS).map(trial).collect()
}

#[test]
fn a_robot_that_is_carried_off_says_so() {
    let mut fixes = fixes_until_lost();
    fixes.sort_unstable();
    let in_time = fixes.iter().filter(|&&n| n <= FIXES).count() as f64 / fixes.len() as f64;
    println!(
        "median {}, 95 % {}, worst {}; within {FIXES}: {in_time}",
        fixes[500], fixes[949], fixes[999]
    );
    assert!(in_time >= SHARE, "{in_time}");
}
