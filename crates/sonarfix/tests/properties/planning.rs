//! Gain, noise and duration of a planned ping, against eqs. (13), (21) and (22) of `docs/model.md` in `f64`.

use proptest::prelude::*;
use sonarfix::config::{Config, PingSchedule, ServoTiming};
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Refusal};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::servo::ServoMotion;

use crate::strategies::{any_deviation, config_for_rooms};

/// Accuracy of the map, and the distance within which its error is common to two ranges, metres.
const MAP_ACCURACY: f32 = 0.02;
const CORRELATION: f64 = 1.0;
const SPEED_OF_SOUND: f64 = 343.4;

fn at(tick: u64) -> Instant {
    Instant::from_ticks(tick * 100_000)
}

/// A robot with a sonar beside its centre that weighs heading and wheels as much as its position.
fn config() -> Config {
    let mut config = config_for_rooms(Point::new(0.07, 0.03));
    (config.weights.heading, config.weights.wheels) = (Metres(1.7), Metres(13.0));
    config.echo.map_accuracy = Metres(MAP_ACCURACY);
    config.rangers.first.max_range = Metres(8.0);
    config.rangers.first.timing.schedule = PingSchedule::AsFastAsPossible;
    config.rangers.first.timing.cycle = Duration::from_ticks(60_000);
    config.rangers.first.timing.servo = ServoTiming::SG90;
    config
}

/// A wall across x at this distance, 20 m long.
fn across(x: f32) -> Wall {
    Wall::new(Point::new(x, -10.0), Point::new(x, 10.0)).unwrap()
}

/// A wall whose foot is at this distance and angle, in degrees, of this length.
fn at_angle(distance: f32, degrees: f32, length: f32) -> Wall {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let end = |along: f32| Point::new(distance * cos - along * sin, distance * sin + along * cos);
    Wall::new(end(-0.5 * length), end(0.5 * length)).unwrap()
}

fn started(walls: &[Wall], deviation: StandardDeviations) -> Localizer<'_> {
    let state = StateEstimate::default();
    Localizer::resume(config(), Map::new(walls), state, deviation, at(0)).unwrap()
}

/// Of the range of a wall across x, whose sonar points along x at a small angle: P Hᵀ and H P Hᵀ.
fn projected(localizer: &Localizer, distance: f64) -> ([f64; 7], f64) {
    let filter = localizer.filter();
    let (state, p) = (filter.state(), filter.covariance().map(f64::from));
    let (sin, cos) = state.heading.0.to_f64().sin_cos();
    let stretch = 1.0 + state.range_scale.to_f64();
    let lever_y = 0.07 * sin + 0.03 * cos;
    // The range is (1 + κ)(X − x − λ_x), and ∂λ_x/∂ψ = −λ_y.
    let h = [-stretch, 0.0, stretch * lever_y, 0.0, 0.0, 0.0, distance];
    let m: [f64; 7] = std::array::from_fn(|row| (0..7).map(|k| p[(row, k)] * h[k]).sum());
    (m, (0..7).map(|k| h[k] * m[k]).sum())
}

trait ToF64 {
    fn to_f64(self) -> f64;
}

impl ToF64 for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// The distance of the sonar from the wall across `x`.
fn distance(localizer: &Localizer, x: f64) -> f64 {
    let state = localizer.filter().state();
    let (sin, cos) = state.heading.0.to_f64().sin_cos();
    x - state.x.0.to_f64() - (0.07 * cos - 0.03 * sin)
}

/// R of a range, with the error of the map after this distance since the last range of the wall.
fn noise(range: f64, travelled: Option<f64>) -> f64 {
    let sonar = config().rangers.first.noise;
    let proportional = f64::from(sonar.per_metre) * range;
    let repeated = travelled.map_or(1.0, |travelled| {
        let ratio = (2.0 * CORRELATION / travelled).min(50.0);
        (1.0 + ratio * ratio).sqrt()
    });
    f64::from(sonar.floor.0).powi(2)
        + proportional.powi(2)
        + MAP_ACCURACY.to_f64().powi(2) * repeated
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Eq. (21) with all weights, and a covariance that travels have correlated.
    #[test]
    fn the_gain_is_the_expected_decrease_of_the_weighted_variances(
        deviation in any_deviation(), x in 1.5_f32..6.0, steps in 1_u64..30, curve in -0.001_f32..0.001,
    ) {
        let walls = [across(x)];
        let deviation = StandardDeviations { heading: Radians(0.01), ..deviation };
        let mut localizer = started(&walls, deviation);
        // A range relates the range scale to the wheels.
        let Ok(aim) = localizer.aim() else { return Ok(()) };
        let fix = localizer.fix(&aim, Some(aim.range));
        prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        for tick in 1..=2 * steps {
            localizer.odometry(at(tick), WheelTravel::new(0.02 + curve, 0.02 - curve)).unwrap();
            if tick == steps
                && let Ok(aim) = localizer.aim()
            {
                let fix = localizer.fix(&aim, Some(aim.range));
                prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
            }
        }
        let Ok(aim) = localizer.aim() else { return Ok(()) };
        let travelled = 0.02 * f64::from(u32::try_from(steps).unwrap());
        let distance = distance(&localizer, x.into());
        let (m, variance) = projected(&localizer, distance);
        let range = aim.range.0.to_f64();
        let [mx, my, mh, right, left, ..] = m;
        let (common, difference) = (f64::midpoint(right, left), right - left);
        let wheels = 13.0_f64.powi(2) * (common * common + 0.25 * difference * difference);
        let weighted = mx * mx + my * my + (1.7 * mh).powi(2) + wheels;
        let gain = weighted / (noise(range, Some(travelled)) + variance);
        let is = aim.why.gain.0.to_f64();
        prop_assert!((is - gain).abs() <= 2e-3 * gain, "{is} {gain}");
    }

    /// A second range of a wall corrects less, because the error of the map is common to both, by the distance since the first. The
    /// variance of its innovation is that of one range.
    #[test]
    fn repeated_ranges_of_a_wall_share_the_error_of_the_map(
        x in 3.0_f32..6.0, steps in 1_u16..60, length in 0.0005_f32..0.02,
    ) {
        let walls = [across(x)];
        let mut localizer = started(&walls, StandardDeviations {
            x: Metres(0.02), y: Metres(0.02), heading: Radians(0.005), ..StandardDeviations::default()
        });
        // The distance is that since the range, not that since the start.
        localizer.odometry(at(10), WheelTravel::new(0.4, 0.4)).unwrap();
        let fresh = localizer.clone();
        let first = localizer.aim().unwrap();
        let fix = localizer.fix(&first, Some(first.range));
        let check = |fix: Fix, variance: f64, range: f64| -> Result<(), TestCaseError> {
            let Fix::Accepted(innovation) = fix else {
                return Err(TestCaseError::fail(format!("{fix:?}")));
            };
            let expected = variance + noise(range, None);
            let is = innovation.variance.0.to_f64();
            prop_assert!((is - expected).abs() < 2e-3 * expected, "{is} {expected}");
            Ok(())
        };
        check(fix, projected(&fresh, distance(&fresh, x.into())).1, first.range.0.to_f64())?;
        let mut before = localizer.clone();
        for tick in 1..=steps {
            for localizer in [&mut before, &mut localizer] {
                localizer.odometry(at(10 + u64::from(tick)), WheelTravel::new(length, length)).unwrap();
            }
        }
        let aim = localizer.aim().unwrap();
        let (_, variance) = projected(&before, distance(&before, x.into()));
        let fix = localizer.fix(&aim, Some(aim.range));
        let travelled = f64::from(length) * f64::from(steps);
        let range = aim.range.0.to_f64();
        check(fix, variance, range)?;
        let repeated = noise(range, Some(travelled));
        let expected = variance * repeated / (variance + repeated);
        let (_, is) = projected(&localizer, distance(&localizer, x.into()));
        prop_assert!((is - expected).abs() < 5e-3 * expected, "{is} {expected}");
    }

    /// The time of a ping: the servo's turn from the last bearing or the rest of the ranger, and the flight of the sound.
    #[test]
    fn the_duration_of_a_ping_is_that_of_turn_and_flight(
        near in 1.0_f32..2.0, far in 2.5_f32..6.0, angle in 10.0_f32..80.0, is_far_first in any::<bool>(),
    ) {
        // One to the left, one to the right, at right angles.
        let walls = [at_angle(far, angle, 6.0), at_angle(near, angle - 90.0, 6.0)];
        let deviation = StandardDeviations {
            x: Metres(0.05), y: Metres(0.05), heading: Radians(0.005), ..StandardDeviations::default()
        };
        let mut localizer = started(&walls, deviation);
        let first = if is_far_first { angle } else { angle - 90.0 };
        let aim = localizer.aim_at(Radians::from_degrees(first)).unwrap();
        let fix = localizer.fix(&aim, Some(aim.range));
        prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        let next = localizer.aim().unwrap();
        prop_assert_ne!(next.wall, aim.wall);
        let servo = ServoMotion::new(&ServoTiming::SG90);
        let flight = |range: Metres| 2.0 * range.0.to_f64() / SPEED_OF_SOUND;
        let rest = (0.06 - flight(aim.range)).max(0.0);
        let turn = servo.settling(next.bearing - aim.bearing).to_f64();
        let expected = turn.max(rest) + flight(next.range);
        let is = f64::from(u32::try_from(next.why.time.ticks()).unwrap()) * 1e-6;
        prop_assert!((is - expected).abs() < 5e-5, "{is} {expected}, {next:?}");
    }

    /// The servo does not turn for less than its turn is worth: the next ping at the same wall has the same bearing.
    #[test]
    fn a_small_turn_is_not_made(
        // Nearer to where the servo stands, the first turn would be a small one.
        x in 1.5_f32..4.0, angle in prop_oneof![-60.0_f32..-10.0, 10.0_f32..60.0],
        turn in 0.002_f32..0.01,
    ) {
        let walls = [at_angle(x, angle, 6.0)];
        let deviation = StandardDeviations {
            x: Metres(0.05), y: Metres(0.05), heading: Radians(0.005), ..StandardDeviations::default()
        };
        let mut localizer = started(&walls, deviation);
        let first = localizer.aim().unwrap();
        let fix = localizer.fix(&first, Some(first.range));
        prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        let aside = 0.5 * turn * config().drive.track_width.0;
        localizer.odometry(at(20), WheelTravel::new(aside, -aside)).unwrap();
        let next = localizer.aim().unwrap();
        prop_assert_eq!(next.bearing, first.bearing);
        // With a fixed period a turn costs nothing, and it is made.
        let mut config = config();
        config.rangers.first.timing.schedule = PingSchedule::Every(Duration::from_ticks(1_000_000));
        let state = StateEstimate::default();
        let mut localizer = Localizer::resume(config, Map::new(&walls), state, deviation, at(0)).unwrap();
        let first = localizer.aim().unwrap();
        let fix = localizer.fix(&first, Some(first.range));
        prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        localizer.odometry(at(2_000), WheelTravel::new(aside, -aside)).unwrap();
        let next = localizer.aim().unwrap();
        let turned = f64::from((next.bearing - first.bearing).0);
        prop_assert!((turned + f64::from(turn)).abs() < 2e-3, "{turned} {turn}");
    }

    /// The accuracy of a wall replaces that of the map: aims and fixes are the same to the bit.
    #[test]
    fn the_accuracy_of_a_wall_replaces_that_of_the_map(
        deviation in any_deviation(), x in 1.5_f32..6.0, steps in 1_u64..10, off in -0.02_f32..0.02,
    ) {
        let deviation = StandardDeviations { heading: Radians(0.01), ..deviation };
        let own = [across(x).with_accuracy(Metres(MAP_ACCURACY))];
        let of_map = [across(x)];
        let mut config = config();
        config.echo.map_accuracy = own[0].accuracy().unwrap();
        let mut coarse = config;
        coarse.echo.map_accuracy = Metres(0.2);
        let start = |config: Config, walls| {
            Localizer::resume(config, Map::new(walls), StateEstimate::default(), deviation, at(0)).unwrap()
        };
        let (mut one, mut other) = (start(coarse, &own), start(config, &of_map));
        for tick in 1..=steps {
            let aim = one.aim();
            prop_assert_eq!(&aim, &other.aim());
            let Ok(aim) = aim else { break };
            let range = Some(Metres(aim.range.0 + off));
            prop_assert_eq!(one.fix(&aim, range), other.fix(&aim, range));
            for localizer in [&mut one, &mut other] {
                localizer.odometry(at(tick), WheelTravel::new(0.02, 0.02)).unwrap();
            }
        }
        let bits = |localizer: &Localizer| localizer.filter().covariance().map(f32::to_bits);
        prop_assert_eq!(bits(&one), bits(&other));
    }

    /// Of two walls that a beam is square to, the nearer one, whichever is the first in the map.
    #[test]
    fn at_a_bearing_the_nearest_wall_is_measured(
        near in 1.1_f32..2.0, further in 1.3_f32..2.5, half in 11.0_f32..13.0, is_first in any::<bool>(),
    ) {
        let mut config = config();
        config.rangers.first.cone = Radians::from_degrees(15.0);
        config.rangers.first.mount = Point::default();
        let (one, other) = (at_angle(near, half, 0.2), at_angle(near * further, -half, 0.2));
        let walls = if is_first { [one, other] } else { [other, one] };
        let deviation = StandardDeviations {
            x: Metres(1e-3), y: Metres(1e-3), heading: Radians(1e-3), ..StandardDeviations::default()
        };
        let state = StateEstimate::default();
        let localizer =
            Localizer::resume(config, Map::new(&walls), state, deviation, at(0)).unwrap();
        let aim = localizer.aim_at(Radians(0.0)).unwrap();
        prop_assert_eq!(aim.wall, WallId(u32::from(!is_first)));
    }
}

/// Of two walls of exactly the same score the first in the map is measured.
#[test]
fn of_equal_walls_the_first_is_measured() {
    let mut config = config();
    config.rangers.first.mount = Point::default();
    config.rangers.first.timing.schedule = PingSchedule::Every(Duration::from_ticks(1_000_000));
    let beside = |y: f32| Wall::new(Point::new(-3.0, y), Point::new(3.0, y)).unwrap();
    let deviation = StandardDeviations { y: Metres(0.05), ..StandardDeviations::default() };
    for walls in [[beside(1.0), beside(-1.0)], [beside(-1.0), beside(1.0)]] {
        let state = StateEstimate::default();
        let localizer =
            Localizer::resume(config, Map::new(&walls), state, deviation, at(0)).unwrap();
        let aim = localizer.aim().unwrap();
        assert_eq!((aim.wall, aim.why.candidates), (WallId(0), 2));
    }
}

/// A range at the limits of the sonar is used or gated; the next one outside is refused.
#[test]
fn the_limits_of_the_sonar_are_inside_its_reach() {
    let walls = [across(3.0)];
    let deviation = StandardDeviations { x: Metres(0.05), ..StandardDeviations::default() };
    let fix = |range: f32| {
        let mut localizer = started(&walls, deviation);
        let aim = localizer.aim().unwrap();
        localizer.fix(&aim, Some(Metres(range)))
    };
    let sonar = config().rangers.first;
    for (limit, outside) in [
        (sonar.min_range.0, sonar.min_range.0.next_down()),
        (sonar.max_range.0, sonar.max_range.0.next_up()),
    ] {
        assert!(!matches!(fix(limit), Fix::Refused(_)), "{:?}", fix(limit));
        assert_eq!(fix(outside), Fix::Refused(Refusal::OutOfRange));
    }
}
