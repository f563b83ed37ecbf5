//! The beam of a time-of-flight ranger: range and derivatives against `f64`, the correction, the choice of the bearing.

use proptest::prelude::*;
use sonarfix::config::{Config, LightBeam, Ranging};
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians, SquareMetres};
use sonarfix::localizer::{Fix, Localizer, Refusal, Start};
use sonarfix::map::{Map, Wall};
use sonarfix::sensor::range::ExpectedRange;

use crate::oracle::{
    HEADING, RANGE_SCALE, ROUNDING, Row, SCALE_LEFT, SCALE_RIGHT, Vector, X, Y, covariance_of,
    is_positive_definite, jacobian_of, state_of,
};
use crate::strategies::{
    any_ekf, any_mount, any_room, any_sight, any_state, bits, config_for_rooms, in_slices, start_at,
};

/// A beam and a wall, in `f64`.
struct Beam {
    ends: [(f64, f64); 2],
    mount: (f64, f64),
    bearing: f64,
}

impl Beam {
    fn new((from, to): (Point, Point), mount: Point, bearing: f32) -> Self {
        let wide = |at: Point| (f64::from(at.x.0), f64::from(at.y.0));
        Self { ends: [wide(from), wide(to)], mount: wide(mount), bearing: bearing.into() }
    }

    /// Position of the ranger and direction of the beam.
    fn ray(&self, state: &Vector) -> ((f64, f64), (f64, f64)) {
        let (sin, cos) = state[HEADING].sin_cos();
        let (ahead, left) = self.mount;
        let from = (state[X] + cos * ahead - sin * left, state[Y] + sin * ahead + cos * left);
        let angle = state[HEADING] + self.bearing;
        (from, (angle.cos(), angle.sin()))
    }

    /// Where the beam meets the line of the wall: metres along the beam, and the share of the wall's length. The point
    /// from + r u is on the line p + s (q − p); both unknowns by Cramer's rule.
    fn crossing(&self, state: &Vector) -> (f64, f64) {
        let (from, u) = self.ray(state);
        let [p, q] = self.ends;
        let (w, v) = ((p.0 - from.0, p.1 - from.1), (q.0 - p.0, q.1 - p.1));
        let determinant = u.1 * v.0 - u.0 * v.1;
        ((w.1 * v.0 - w.0 * v.1) / determinant, (u.0 * w.1 - u.1 * w.0) / determinant)
    }

    /// Eq. (45).
    fn range(&self, state: &Vector) -> f64 {
        (1.0 + state[RANGE_SCALE]) * self.crossing(state).0
    }

    /// H, by central differences.
    fn by_state(&self, state: &Vector) -> Row {
        let step = 1e-6;
        Row::from_fn(|_, j| {
            let mut h = Vector::zeros();
            h[j] = step;
            (self.range(&(state + h)) - self.range(&(state - h))) / (2.0 * step)
        })
    }
}

/// A beam that meets the wall of a sight at this incidence: its bearing.
fn bearing_at(direction: f32, incidence: f32, state: &StateEstimate) -> f32 {
    direction + incidence - state.heading.0
}

fn light() -> Ranging {
    Ranging::Light(LightBeam::VL53L1X)
}

fn config_with_light(mount: Point) -> Config {
    let mut config = config_for_rooms(mount);
    config.rangers.first.ranging = light();
    config.rangers.first.cone = Radians::from_degrees(45.0);
    config
}

fn localizer(walls: &[Wall], start: Start, mount: Point) -> Localizer<'_> {
    let config = config_with_light(mount);
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

proptest! {
    /// Eqs. (45) and (46): from either side, with any mount, heading, range scale, and incidence up to 60°.
    #[test]
    fn range_along_a_beam_and_its_jacobian_equal_differences(
        sight in any_sight(), mount in any_mount(), state in any_state(), incidence in -1.05_f32..1.05,
    ) {
        let at = state.pose().position();
        let bearing = bearing_at(sight.direction, incidence, &state);
        let expected = ExpectedRange::along_beam(&sight.wall(at), mount, Radians(bearing), &state);
        let beam = Beam::new(sight.ends(at), mount, bearing);
        let exact = state_of(&Ekf::new(
            config_for_rooms(mount).drive, state, StandardDeviations::default(),
        ).unwrap());
        let (along, _) = beam.crossing(&exact);
        if along < -1e-4 {
            prop_assert!(expected.is_none());
            return Ok(());
        }
        prop_assume!(along > 1e-3);
        let expected = expected.unwrap();
        // A direction of up to 7 rad is rounded to 4e-7; at 60° that is 1.7 r tan 60° of range, and coordinates of
        // 40 m are rounded a few times.
        let lengths = 8.0 * ROUNDING * (40.0 + 8.0 * along) * 4.0;
        let off = (f64::from(expected.range.0) - beam.range(&exact)).abs();
        prop_assert!(off <= lengths, "range off by {off}, allowed {lengths}");
        let (h, exact) = (jacobian_of(&expected), beam.by_state(&exact));
        for i in 0..7 {
            let size = if i == HEADING || i == RANGE_SCALE { 40.0 + 40.0 * along } else { 40.0 };
            let allowed = 8.0 * ROUNDING * size * 4.0 + 1e-6;
            prop_assert!((h[i] - exact[i]).abs() <= allowed, "d/d{i}: {} instead of {}", h[i], exact[i]);
        }
        prop_assert!((f64::from(expected.direction.from((state.heading + Radians(bearing)).into()).0)).abs() < 1e-5);
    }

    /// A correction by a beam grows no variance, and leaves P symmetric and positive definite.
    #[test]
    fn a_correction_by_a_beam_grows_no_variance(
        ekf in any_ekf(), sight in any_sight(), mount in any_mount(), incidence in -0.9_f32..0.9,
        noise in 1e-6_f32..1e-3, sigmas in -2.0_f32..2.0,
    ) {
        let mut ekf = ekf;
        let state = ekf.state();
        let bearing = Radians(bearing_at(sight.direction, incidence, &state));
        let wall = sight.wall(state.pose().position());
        let expected = ExpectedRange::along_beam(&wall, mount, bearing, &state);
        prop_assume!(expected.is_some());
        let (expected, noise) = (expected.unwrap(), SquareMetres(noise));
        let before = covariance_of(&ekf);
        let deviation = ekf.innovation(expected.range, &expected, noise).variance.0.sqrt();
        let range = Metres(expected.range.0 + (sigmas * deviation).clamp(-0.3, 0.3));
        ekf.update(range, &expected, noise).unwrap();
        let after = covariance_of(&ekf);
        for i in 0..7 {
            // The variance of a wheel is rounded in the size of both, because mean and difference are held.
            let wheels = before[(SCALE_RIGHT, SCALE_RIGHT)] + before[(SCALE_LEFT, SCALE_LEFT)];
            let size = if [SCALE_RIGHT, SCALE_LEFT].contains(&i) { wheels } else { before[(i, i)] };
            let limit = before[(i, i)] + 4.0 * ROUNDING * size;
            prop_assert!(after[(i, i)] <= limit, "state {i}: {} after {}", after[(i, i)], before[(i, i)]);
        }
        let p = ekf.covariance();
        prop_assert_eq!(p, p.transpose());
        prop_assert!(is_positive_definite(&after));
    }

    /// The beam that is chosen meets its wall first, at the range that is expected, and the chosen one has the largest
    /// gain and probability of its fan.
    #[test]
    fn the_chosen_beam_meets_its_wall_first_and_is_the_most_informative(
        room in any_room(), mount in any_mount(),
    ) {
        let walls = room.walls();
        let localizer = localizer(&walls, room.start(), mount);
        let Ok(aim) = localizer.aim() else { return Err(TestCaseError::reject("no wall")) };
        // Six slices list three beams each.
        let (sliced, slices) = in_slices(&localizer);
        prop_assert_eq!(sliced, Ok(aim));
        prop_assert!(slices > 6, "{slices} slices");
        let config = localizer.config();
        let state = state_of(localizer.filter());
        let met = |bearing: f32| {
            let crossings = walls.iter().enumerate().map(|(number, wall)| {
                let beam = Beam::new((wall.from(), wall.to()), mount, bearing);
                (number, beam.crossing(&state))
            });
            crossings
                .filter(|(_, (along, share))| *along > 0.0 && (0.0..=1.0).contains(share))
                .min_by(|(_, (one, _)), (_, (other, _))| one.total_cmp(other))
        };
        let (wall, (along, _)) = met(aim.bearing.0).unwrap();
        prop_assert_eq!(wall, aim.wall.0 as usize);
        // At 45° the curvature of eq. (47) adds ½ · 3 · (0.01² + 0.02²) of the range to it.
        let off = f64::from(aim.range.0) - along;
        prop_assert!(off > -1e-4 && off < 1e-4 + 7.6e-4 * along, "{along} {aim:?}");
        let score = aim.why.gain.0 * aim.why.success;
        let (right, left) = config.rangers.first.servo;
        for number in 0_u8..17 {
            let bearing = right + (left - right) * (f32::from(number) / 16.0);
            if let Ok(other) = localizer.aim_at(bearing) {
                prop_assert!(other.why.gain.0 * other.why.success <= score * 1.001, "{other:?} {aim:?}");
            }
        }
    }

    /// An exact range is accepted, and an oblique one corrects the heading of a ranger at the centre, which no sonar does.
    #[test]
    fn a_beam_corrects_the_heading(room in any_room(), bearing in -3.0_f32..3.0) {
        let walls = room.walls();
        let mut config = config_with_light(Point::default());
        config.rangers.first.ranging = Ranging::Light(LightBeam { pointing: Radians(0.002), ..LightBeam::VL53L1X });
        config.prior.range_scale = 0.0;
        let mut start = room.start();
        start.heading_deviation = Radians(0.03);
        start.position_deviation = Metres(0.005);
        let mut localizer =
            Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim_at(Radians(bearing));
        prop_assume!(aim.is_ok());
        let aim = aim.unwrap();
        let before = localizer.filter().standard_deviations().heading.0;
        let expected = ExpectedRange::along_beam(
            &walls[aim.wall.0 as usize], Point::default(), aim.bearing, &localizer.filter().state(),
        ).unwrap();
        let fix = localizer.fix(&aim, Some(aim.range));
        prop_assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        let after = localizer.filter().standard_deviations().heading.0;
        prop_assert!(after <= before);
        if expected.by_heading.abs() > 0.3 {
            prop_assert!(after < 0.97 * before, "{before} {after} {expected:?}");
        }
    }

    /// NaN, no echo, a range beyond the limits, and a beam beside its wall are refused and change no bit.
    #[test]
    fn what_a_beam_cannot_measure_is_refused(room in any_room(), mount in any_mount()) {
        let walls = room.walls();
        let localizer = localizer(&walls, room.start(), mount);
        let Ok(aim) = localizer.aim() else { return Err(TestCaseError::reject("no wall")) };
        let behind = sonarfix::aim::Aim { bearing: aim.bearing + Radians(2.5), ..aim };
        let cases = [
            (aim, None, Refusal::NoEcho),
            (aim, Some(f32::NAN), Refusal::NotFinite),
            (aim, Some(50.0), Refusal::OutOfRange),
            (behind, Some(aim.range.0), Refusal::FootOffWall),
        ];
        for (aim, range, refusal) in cases {
            let mut localizer = localizer.clone();
            let before = bits(localizer.filter());
            let fix = localizer.fix(&aim, range.map(Metres));
            prop_assert_eq!(fix, Fix::Refused(refusal));
            prop_assert_eq!(bits(localizer.filter()), before);
        }
    }
}

/// A door in the wall ahead: beside it the beam meets the wall, through it the one behind.
fn at_a_door(aside: f32) -> [Wall; 3] {
    let wall = |from: (f32, f32), to: (f32, f32)| {
        Wall::new(Point::new(from.0, from.1), Point::new(to.0, to.1)).unwrap()
    };
    [
        wall((1.0, -3.0), (1.0, aside)),
        wall((1.0, aside + 0.9), (1.0, 3.0)),
        wall((2.5, -3.0), (2.5, 3.0)),
    ]
}

#[test]
fn through_a_door_the_wall_behind_it_is_measured() {
    let mut config = config_with_light(Point::default());
    config.echo.free_path = Metres(10.0);
    let walls = at_a_door(-0.45);
    let start = start_at(Pose::new(0.0, 0.0, Radians(0.0)));
    let mut localizer =
        Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
    let aim = localizer.aim_at(Radians(0.0)).unwrap();
    assert_eq!(aim.wall.0, 2);
    assert!(matches!(localizer.fix(&aim, Some(Metres(2.5))), Fix::Accepted(_)));
}

/// The field of view ends 2 cm beside the frame of the door: the wall behind it explains the range, which is no evidence
/// against the pose. Without that wall it is.
#[test]
fn the_wall_behind_a_door_explains_a_range_at_its_edge() {
    let mut config = config_with_light(Point::default());
    config.echo.free_path = Metres(10.0);
    let with_room = at_a_door(0.26);
    let start = start_at(Pose::new(0.0, 0.0, Radians(0.0)));
    let evidence = |walls: &[Wall]| {
        let mut localizer =
            Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap();
        localizer.odometry(Instant::from_ticks(100_000), WheelTravel::new(0.0, 0.0)).unwrap();
        let aim = localizer.aim_at(Radians(0.0)).unwrap();
        assert_eq!(aim.wall.0, 0);
        let fix = localizer.fix(&aim, Some(Metres(2.5)));
        assert!(matches!(fix, Fix::Gated(_) | Fix::Downweighted(_)), "{fix:?}");
        localizer.health().evidence
    };
    let (with, without) = (evidence(&with_room), evidence(&with_room[..2]));
    assert!(with < without - 0.3, "{with} {without}");
}

/// Half of the field of view is 24 cm at the wall, which is 1 m ahead.
#[test]
fn a_wall_is_measured_if_the_whole_field_of_view_is_on_it() {
    let start = start_at(Pose::new(0.0, 0.0, Radians(0.0)));
    for (aside, is_measured) in [(0.10, false), (0.26, true)] {
        let walls = at_a_door(aside);
        let config = config_with_light(Point::default());
        let localizer =
            Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0)).unwrap();
        let aim = localizer.aim_at(Radians(0.0));
        assert_eq!(aim.is_ok_and(|aim| aim.wall.0 == 0), is_measured, "{aside} m");
    }
}

#[test]
fn a_beam_has_limits() {
    let with = |spot, pointing| {
        let mut config = config_with_light(Point::default());
        let (spot, pointing) = (Radians(spot), Radians(pointing));
        config.rangers.first.ranging =
            Ranging::Light(LightBeam { spot, pointing, ..LightBeam::VL53L1X });
        config.check().map_err(|error| error.field)
    };
    assert_eq!(with(0.1, 0.0), Ok(()));
    for spot in [0.0, f32::NAN, 0.4] {
        assert_eq!(with(spot, 0.01), Err("sonar.ranging.spot"));
    }
    for pointing in [-0.1, f32::NAN] {
        assert_eq!(with(0.1, pointing), Err("sonar.ranging.pointing"));
    }
    let mut config = config_with_light(Point::default());
    config.rangers.first.cone = Radians(1.4);
    assert_eq!(config.check().unwrap_err().field, "sonar.cone");
}
