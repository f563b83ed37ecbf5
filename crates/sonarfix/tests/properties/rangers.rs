//! Several rangers: the choice among them, and their ranges.

use proptest::prelude::*;
use sonarfix::config::{Config, RangerId, RangerParameters};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Refusal};
use sonarfix::map::Map;

use crate::strategies::{Room, any_room, bits, config_for_rooms};

/// A ranger at a mount, on a servo with these limits.
fn sonar(mount: (f32, f32), (right, left): (f32, f32), floor: f32) -> RangerParameters {
    let mut sonar = config_for_rooms(Point::new(mount.0, mount.1)).rangers.first;
    sonar.servo = (Radians(right), Radians(left));
    sonar.noise.floor = Metres(floor);
    sonar
}

prop_compose! {
    fn any_sonar()(
        mount in (-0.2_f32..0.2, -0.2_f32..0.2), right in -3.1_f32..1.0, width in 0.0_f32..2.0,
        is_fixed in any::<bool>(), floor in 0.002_f32..0.02,
    ) -> RangerParameters {
        sonar(mount, (right, if is_fixed { right } else { right + width }), floor)
    }
}

fn robot(sonars: &[RangerParameters]) -> Config {
    let mut config = config_for_rooms(Point::default());
    config.rangers.first = sonars[0];
    for sonar in &sonars[1..] {
        config.rangers.push(*sonar).unwrap();
    }
    config
}

proptest! {
    /// The choice is the best of those of robots with one of the rangers each.
    #[test]
    fn the_choice_is_the_best_of_all_rangers(room in any_room(), sonars in prop::array::uniform3(any_sonar())) {
        let walls = room.walls();
        let now = Instant::from_ticks(0);
        let aim = |config: Config| Localizer::new(config, Map::new(&walls), room.start(), now).unwrap().aim();
        let all = aim(robot(&sonars));
        let alone = sonars.map(|sonar| aim(robot(&[sonar])));
        let policy = robot(&sonars).policy;
        let best = alone.iter().flatten().map(|aim| aim.score(policy)).fold(f32::MIN, f32::max);
        prop_assert_eq!(all.is_ok(), alone.iter().any(Result::is_ok));
        if let Ok(aim) = all {
            prop_assert!(aim.score(policy) >= best && aim.score(policy) <= best, "{:?} {}", aim, best);
            let own = alone[aim.ranger.index()].unwrap();
            prop_assert_eq!((aim.wall, aim.bearing, aim.range), (own.wall, own.bearing, own.range));
        }
    }

    /// The order of the rangers changes nothing but their numbers, to the bit.
    #[test]
    fn the_order_of_the_rangers_changes_no_bit(
        room in any_room(), sonars in prop::array::uniform3(any_sonar()), turn in 1_usize..3,
        noise in prop::collection::vec(-0.01_f32..0.01, 1..12),
    ) {
        let walls = room.walls();
        let now = Instant::from_ticks(0);
        let mut turned = sonars;
        turned.rotate_left(turn);
        let begin = |sonars: &[RangerParameters]| Localizer::new(robot(sonars), Map::new(&walls), room.start(), now).unwrap();
        let (mut one, mut other) = (begin(&sonars), begin(&turned));
        for (step, noise) in (1..).zip(noise) {
            let at = Instant::from_ticks(0).checked_add_duration(Duration::from_ticks(step * 100_000)).unwrap();
            for localizer in [&mut one, &mut other] {
                localizer.odometry(at, WheelTravel::new(0.004, 0.003)).unwrap();
            }
            let (Ok(aim), Ok(same)) = (one.aim(), other.aim()) else {
                prop_assert_eq!(one.aim().is_ok(), other.aim().is_ok());
                continue;
            };
            // Equal scores are decided by the order.
            let policy = one.config().policy;
            prop_assume!((aim.ranger.index() + 3 - turn) % 3 == same.ranger.index());
            prop_assert!(aim.score(policy).to_bits() == same.score(policy).to_bits());
            let range = Some(aim.range + Metres(noise));
            prop_assert_eq!(one.fix(&aim, range), other.fix(&same, range));
            prop_assert_eq!(bits(one.filter()), bits(other.filter()));
        }
    }
}

/// A ping of a ranger that the robot does not have is refused and changes nothing.
#[test]
fn an_unknown_ranger_is_refused() {
    let room = Room {
        angle: 0.2,
        distances: [2.0, 1.5, 3.0, 2.5],
        robot: Pose::new(1.0, -1.0, Radians(0.3)),
    };
    let walls = room.walls();
    let ahead = sonar((0.1, 0.0), (-3.0, 3.0), 0.005);
    let now = Instant::from_ticks(0);
    let mut localizer =
        Localizer::new(robot(&[ahead, ahead]), Map::new(&walls), room.start(), now).unwrap();
    let mut aim = localizer.aim().unwrap();
    assert!(matches!(localizer.clone().fix(&aim, Some(aim.range)), Fix::Accepted(_)));
    let before = bits(localizer.filter());
    aim.ranger = RangerId(2);
    let fix = localizer.fix(&aim, Some(aim.range));
    assert_eq!(fix, Fix::Refused(Refusal::UnknownRanger));
    assert_eq!(bits(localizer.filter()), before);
    assert!(localizer.aim_along(RangerId(2), Radians(0.0)).is_err());
}
