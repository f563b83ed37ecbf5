//! Random robots, walls and travels, and the runs made from them.

use proptest::prelude::*;
use sonarfix::aim::{Aim, Choice, NoAim};
use sonarfix::config::{Config, RangerId};
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Wall;
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::ExpectedRange;

/// A robot with a track width of 10 cm to 60 cm and low to high wheel noise.
pub fn any_drive() -> impl Strategy<Value = Drive> {
    (0.1_f32..0.6, 1e-4_f32..5e-3, 1e-6_f32..1e-4).prop_map(|(track_width, noise, walk)| Drive {
        track_width: Metres(track_width),
        wheel_noise: PerRootMetre(Metres(noise)),
        scale_walk: PerRootMetre(walk),
        track_width_walk: PerRootMetre(Metres(walk * track_width)),
    })
}

/// A drive without noise.
pub fn silent(drive: Drive) -> Drive {
    Drive {
        wheel_noise: PerRootMetre(Metres(0.0)),
        scale_walk: PerRootMetre(0.0),
        track_width_walk: PerRootMetre(Metres(0.0)),
        ..drive
    }
}

/// A state within 20 m of the origin, with a heading away from ±π so that a step does not wrap it,
/// and systematic errors of a few per cent.
pub fn any_state() -> impl Strategy<Value = StateEstimate> {
    (
        -20.0_f32..20.0,
        -20.0_f32..20.0,
        -2.5_f32..2.5,
        -0.03_f32..0.03,
        -0.03_f32..0.03,
        -0.01_f32..0.01,
        -0.05_f32..0.05,
    )
        .prop_map(|numbers| StateEstimate::from_array(numbers.into()))
}

/// Deviations of a robot whose pose is roughly known.
pub fn any_deviation() -> impl Strategy<Value = StandardDeviations> {
    (
        1e-3_f32..0.5,
        1e-3_f32..0.5,
        1e-3_f32..0.2,
        1e-4_f32..0.03,
        1e-4_f32..0.03,
        1e-4_f32..0.01,
        1e-4_f32..0.03,
    )
        .prop_map(|numbers| StandardDeviations::from_array(numbers.into()))
}

/// Straight on, backwards, a curve, a turn on the spot, one wheel alone: travels of 100 ms.
pub fn any_travel() -> impl Strategy<Value = WheelTravel> {
    let metres = || 0.002_f32..0.08;
    prop_oneof![
        metres().prop_map(|s| WheelTravel::new(s, s)),
        metres().prop_map(|s| WheelTravel::new(-s, -s)),
        metres().prop_map(|s| WheelTravel::new(s, -s)),
        metres().prop_map(|s| WheelTravel::new(-s, s)),
        metres().prop_map(|s| WheelTravel::new(s, 0.0)),
        (metres(), metres()).prop_map(|(r, l)| WheelTravel::new(r, l)),
        (metres(), metres()).prop_map(|(r, l)| WheelTravel::new(-r, -l)),
    ]
}

/// Positions of a sonar: at the centre, or off it.
pub fn any_mount() -> impl Strategy<Value = Point> {
    prop_oneof![
        1 => Just(Point::new(0.0, 0.0)),
        3 => (-0.2_f32..0.2, -0.2_f32..0.2).prop_map(|(x, y)| Point::new(x, y)),
    ]
}

/// A wall seen from near the origin: direction and distance of its foot, place of the foot along
/// it, length, and order of its ends.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    pub direction: f32,
    pub distance: f32,
    pub foot: f32,
    pub length: f32,
    pub flipped: bool,
}

impl Sight {
    /// The ends of that wall, for an observer at `from`.
    pub fn ends(&self, from: Point) -> (Point, Point) {
        let (sin, cos) = self.direction.sin_cos();
        let foot = (from.x.0 + cos * self.distance, from.y.0 + sin * self.distance);
        let end = |along: f32| Point::new(foot.0 - sin * along, foot.1 + cos * along);
        let (one, other) = (end(-self.foot * self.length), end((1.0 - self.foot) * self.length));
        if self.flipped { (other, one) } else { (one, other) }
    }

    pub fn wall(&self, from: Point) -> Wall {
        let (one, other) = self.ends(from);
        Wall::new(one, other).unwrap()
    }
}

/// A wall 0.3 m to 8 m away, on any side; a third of them parallel to an axis.
pub fn any_sight() -> impl Strategy<Value = Sight> {
    let direction = prop_oneof![
        1 => (-2_i8..2).prop_map(|q| f32::from(q) * core::f32::consts::FRAC_PI_2),
        2 => -3.1_f32..3.1,
    ];
    (direction, 0.3_f32..8.0, 0.2_f32..0.8, 0.5_f32..10.0, any::<bool>()).prop_map(
        |(direction, distance, foot, length, flipped)| Sight {
            direction,
            distance,
            foot,
            length,
            flipped,
        },
    )
}

/// One call of a filter.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// This travel, a number of times.
    Roll(WheelTravel, u8),
    /// A range of a wall with an error of so many deviations of its innovation, with this noise
    /// variance.
    Range { sight: Sight, mount: Point, sigmas: f32, noise: f32 },
}

/// A travel repeated, or a range with noise variance in `noise`.
pub fn any_event(noise: core::ops::Range<f32>) -> impl Strategy<Value = Event> {
    // The exponent is uniform, not the variance: low and high noise are equally frequent.
    let exponent = noise.start.log10()..noise.end.log10();
    prop_oneof![
        (any_travel(), 1_u8..40).prop_map(|(travel, times)| Event::Roll(travel, times)),
        (any_sight(), any_mount(), -2.5_f32..2.5, exponent).prop_map(
            |(sight, mount, sigmas, exponent)| Event::Range {
                sight,
                mount,
                sigmas,
                noise: 10.0_f32.powf(exponent),
            }
        ),
    ]
}

/// Executes an event; `each` receives the filter before and after every prediction and correction.
pub fn live(ekf: &mut Ekf, event: Event, mut each: impl FnMut(&Ekf, Option<&ExpectedRange>, &Ekf)) {
    match event {
        Event::Roll(travel, times) => {
            for _ in 0..times {
                let before = *ekf;
                ekf.predict(travel).unwrap();
                each(&before, None, ekf);
            }
        }
        Event::Range { sight, mount, sigmas, noise } => {
            let before = *ekf;
            let state = ekf.state();
            let wall = sight.wall(state.pose().position());
            let expected = ExpectedRange::new(&wall, mount, &state);
            let noise = SquareMetres(noise);
            let variance = ekf.innovation(expected.range, &expected, noise).variance.0;
            // An error of metres would move the calibration away from values of real robots.
            let surprise = (sigmas * variance.abs().sqrt()).clamp(-0.3, 0.3);
            let range = Metres(expected.range.0 + surprise);
            ekf.update(range, &expected, noise).unwrap();
            each(&before, Some(&expected), ekf);
        }
    }
}

/// A filter with a full covariance, after random travels and ranges from a random start; and its
/// drive.
pub fn any_filter() -> impl Strategy<Value = (Drive, Ekf)> {
    (
        any_drive(),
        any_state(),
        any_deviation(),
        proptest::collection::vec(any_event(1e-6..1e-3), 4..12),
    )
        .prop_map(|(drive, state, deviation, events)| {
            let mut ekf = Ekf::new(drive, state, deviation).unwrap();
            for event in events {
                live(&mut ekf, event, |_, _, _| {});
            }
            (drive, ekf)
        })
}

/// Such a filter alone.
pub fn any_ekf() -> impl Strategy<Value = Ekf> {
    any_filter().prop_map(|(_, ekf)| ekf)
}

/// Every bit of a filter's estimate.
pub fn bits(ekf: &Ekf) -> Vec<u32> {
    let (state, covariance) = (ekf.state_vector(), ekf.covariance());
    state.iter().chain(covariance.iter()).map(|v| v.to_bits()).collect()
}

/// A rectangular room, rotated by any angle, with a robot somewhere inside at any heading.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    pub angle: f32,
    /// From the robot to the walls: ahead, left, behind, right in the axes of the room.
    pub distances: [f32; 4],
    pub robot: Pose,
}

impl Room {
    /// Its walls, in the order of [`Self::distances`].
    pub fn walls(&self) -> [Wall; 4] {
        let (sin, cos) = self.angle.sin_cos();
        let [ahead, left, behind, right] = self.distances;
        let corner = |u: f32, v: f32| {
            Point::new(self.robot.x.0 + cos * u - sin * v, self.robot.y.0 + sin * u + cos * v)
        };
        let wall = |one, other| Wall::new(one, other).unwrap();
        [
            wall(corner(ahead, -right), corner(ahead, left)),
            wall(corner(ahead, left), corner(-behind, left)),
            wall(corner(-behind, -right), corner(-behind, left)),
            wall(corner(-behind, -right), corner(ahead, -right)),
        ]
    }

    /// The robot in it, with a deviation of a few centimetres.
    pub fn start(&self) -> Start {
        start_at(self.robot)
    }
}

/// A start with deviations of 3 cm and half a degree.
pub fn start_at(pose: Pose) -> Start {
    Start { pose, position_deviation: Metres(0.03), heading_deviation: Radians(0.01) }
}

/// Rooms of 2 m to 10 m, the robot at least 1 m from every wall.
pub fn any_room() -> impl Strategy<Value = Room> {
    (
        -3.0_f32..3.0,
        prop::array::uniform4(1.0_f32..5.0),
        -10.0_f32..10.0,
        -10.0_f32..10.0,
        -3.1_f32..3.1,
    )
        .prop_map(|(angle, distances, x, y, heading)| Room {
            angle,
            distances,
            robot: Pose::new(x, y, Radians(heading)),
        })
}

/// A configuration whose sonar reaches every wall of such a room.
pub fn config_for_rooms(mount: Point) -> Config {
    let mut config = Config::for_track_width(Metres(0.2));
    config.rangers.first.mount = mount;
    config.rangers.first.max_range = Metres(12.0);
    config.prior.range_scale = 0.01;
    // Oracles have seven states.
    config.prior.mount = Metres(0.0);
    // No clutter, which has its own tests.
    config.echo = EchoParameters::NONE;
    config.gating.confidence = 1.0;
    config
}

/// The choice of the first ranger in slices, as a loop makes it, and the number of slices.
pub fn in_slices(localizer: &Localizer) -> (Result<Aim, NoAim>, u32) {
    let mut choice = Choice::new(RangerId::FIRST);
    let mut slices = 0;
    loop {
        slices += 1;
        if let Some(end) = localizer.choose(&mut choice) {
            return (end, slices);
        }
        assert!(slices < 1_000, "the choice does not end");
    }
}
