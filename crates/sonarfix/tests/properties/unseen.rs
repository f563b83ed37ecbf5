//! The covariance while the wheels cannot be observed, against eq. (24) of `docs/model.md` in `f64`.

use proptest::prelude::*;
use sonarfix::filter::ekf::Ekf;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, MetresPerSecond, Radians};
use sonarfix::health::{DEGRADED_WITHOUT_ODOMETRY, Verdict};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};

use crate::strategies::{Room, any_room, bits, config_for_rooms};

const TICK: u64 = 100_000;
const X: usize = 0;
const Y: usize = 1;
const HEADING: usize = 2;

/// A robot that has driven a curve and measured two walls, and the number of its ticks.
fn driven<'m>(walls: &'m [Wall], room: &Room, fastest: f32) -> (Localizer<'m>, u64) {
    let mut config = config_for_rooms(Point::new(0.03, 0.01));
    config.max_wheel_speed = MetresPerSecond(fastest);
    let start = Instant::from_ticks(0);
    let mut localizer = Localizer::new(config, Map::new(walls), room.start(), start).unwrap();
    for tick in 1..=8 {
        localizer.odometry(at(tick), WheelTravel::new(0.011, 0.009)).unwrap();
        if tick > 6
            && let Ok(aim) = localizer.aim()
        {
            let _ = localizer.fix(&aim, Some(aim.range));
        }
    }
    (localizer, 8)
}

fn square_room() -> Room {
    Room { angle: 0.0, distances: [2.0; 4], robot: Pose::new(0.0, 0.0, Radians(0.5)) }
}

fn at(tick: u64) -> Instant {
    Instant::from_ticks(tick * TICK)
}

fn variance(ekf: &Ekf, state: usize) -> f64 {
    f64::from(ekf.covariance()[(state, state)])
}

fn is_near(value: f64, expected: f64) -> bool {
    // Of the order of the rounding of a few f32 operations.
    (value - expected).abs() <= 2e-6 * expected.abs()
}

/// What eq. (24) adds to the variances of position and heading after `ticks` without odometry.
fn growth(ticks: u16, fastest: f32) -> (f64, f64) {
    let rolled = f64::from(fastest) * 0.1 * f64::from(ticks);
    let turned = (2.0 * rolled / 0.2).min(f64::from(std::f32::consts::PI));
    (rolled.min(1_000.0).powi(2), turned.powi(2))
}

fn missing(localizer: &mut Localizer, ticks: core::ops::RangeInclusive<u64>) {
    ticks.for_each(|tick| localizer.odometry_missing(at(tick)));
}

/// Two localizers after the same travel, which the encoders of the first reported after failures of so many ticks; and
/// the travel, of this length a tick.
fn after_a_failure<'m>(
    walls: &'m [Wall],
    room: &Room,
    ticks: u16,
    a_tick: [f32; 2],
) -> (Localizer<'m>, Localizer<'m>, WheelTravel) {
    let (mut without, now) = driven(walls, room, 1.0);
    let mut with = without.clone();
    let end = now + u64::from(ticks);
    missing(&mut with, now + 1..=end - 1);
    let [right, left] = a_tick.map(|metres| metres * f32::from(ticks));
    let travel = WheelTravel::new(right, left);
    for localizer in [&mut with, &mut without] {
        localizer.odometry(at(end), travel).unwrap();
    }
    (with, without, travel)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Position and heading grow by the distance at the maximum wheel speed; nothing else changes.
    #[test]
    fn deviations_grow_with_the_unseen_time(
        room in any_room(), fastest in 0.15_f32..3.0, ticks in 1_u16..2_000,
    ) {
        let walls = room.walls();
        let (mut localizer, now) = driven(&walls, &room, fastest);
        let before = *localizer.filter();
        let mut last = 0.0;
        for tick in 1..=u64::from(ticks) {
            localizer.odometry_missing(at(now + tick));
            let x = variance(localizer.filter(), X);
            prop_assert!(x > last, "tick {tick}");
            last = x;
        }
        let after = *localizer.filter();
        let (position, heading) = growth(ticks, fastest);
        for (state, added) in [(X, position), (Y, position), (HEADING, heading)] {
            let expected = variance(&before, state) + added;
            prop_assert!(is_near(variance(&after, state), expected), "{state}: {expected}");
        }
        prop_assert_eq!(before.state(), after.state());
        let (p, q) = (before.covariance(), after.covariance());
        for (row, column) in (0..7).flat_map(|row| (0..7).map(move |column| (row, column))) {
            let has_grown = row == column && row <= HEADING;
            prop_assert!(has_grown || p[(row, column)].to_bits() == q[(row, column)].to_bits());
        }
        let health = localizer.health();
        let reported = f64::from(health.heading_deviation.0).powi(2);
        prop_assert!((reported / variance(&after, HEADING) - 1.0).abs() < 1e-4);
        prop_assert!(f64::from(health.position_deviation.0).powi(2) >= 0.999 * last);
    }

    /// Samples that fail for less than half a second leave no trace in the estimate.
    #[test]
    fn a_short_failure_changes_no_bit(
        room in any_room(), ticks in 1_u16..5, right in -0.01_f32..0.01, left in -0.01_f32..0.01,
    ) {
        let walls = room.walls();
        let (with, without, _) = after_a_failure(&walls, &room, ticks, [right, left]);
        prop_assert_eq!(bits(with.filter()), bits(without.filter()));
        prop_assert_eq!(with.health().verdict, Verdict::Tracking);
        prop_assert!(!with.is_odometry_missing());
        prop_assert_eq!(with.aim(), without.aim());
    }

    /// After a longer failure the turn is known, and the position to the distance rolled.
    #[test]
    fn after_a_long_failure_the_path_is_unknown(
        room in any_room(), ticks in 7_u16..500, right in -0.01_f32..0.01, left in -0.01_f32..0.01,
    ) {
        let walls = room.walls();
        let (with, without, travel) = after_a_failure(&walls, &room, ticks, [right, left]);
        let distance = f64::from(travel.distance().0).powi(2);
        for (state, added) in [(X, distance), (Y, distance), (HEADING, 0.0)] {
            let expected = variance(without.filter(), state) + added;
            let is = variance(with.filter(), state);
            prop_assert!((is - expected).abs() <= 1e-5 * expected, "{state}: {is} {expected}");
        }
        prop_assert_eq!(with.filter().state(), without.filter().state());
        prop_assert_ne!(with.health().verdict, Verdict::Tracking);
    }

    /// A sample that was refused later may have been discarded: what it grew by remains.
    #[test]
    fn after_a_refused_sample_the_growth_remains(room in any_room(), ticks in 7_u16..500) {
        let walls = room.walls();
        let (mut localizer, now) = driven(&walls, &room, 1.0);
        let before = *localizer.filter();
        let end = now + u64::from(ticks);
        missing(&mut localizer, now + 1..=end - 1);
        let grown = bits(localizer.filter());
        localizer.odometry(at(end), WheelTravel::new(1e3, 1e3)).unwrap_err();
        prop_assert_eq!(bits(localizer.filter()), grown, "a refused sample changes no bit");
        localizer.odometry(at(end + 1), WheelTravel::default()).unwrap();
        let (position, heading) = growth(ticks + 1, 1.0);
        for (state, added) in [(X, position), (Y, position), (HEADING, heading)] {
            let expected = variance(&before, state) + added;
            prop_assert!(is_near(variance(localizer.filter(), state), expected), "{state}");
        }
    }

    /// A new pose has its deviations; they grow from then on, and that growth remains.
    #[test]
    fn a_new_pose_begins_the_growth_again(
        room in any_room(), before in 1_u64..500, after in 1_u16..100,
    ) {
        let walls = room.walls();
        let (mut localizer, now) = driven(&walls, &room, 1.0);
        missing(&mut localizer, now + 1..=now + before);
        let now = now + before;
        let start = Start { pose: Pose::default(), ..room.start() };
        localizer.set_pose(&start).unwrap();
        let new = *localizer.filter();
        prop_assert_eq!(localizer.filter().standard_deviations().x, Metres(0.03));
        let end = now + u64::from(after) + 1;
        missing(&mut localizer, now + 1..=end - 1);
        localizer.odometry(at(end), WheelTravel::default()).unwrap();
        let (position, heading) = growth(after + 1, 1.0);
        for (state, added) in [(X, position), (Y, position), (HEADING, heading)] {
            let expected = variance(&new, state) + added;
            prop_assert!(is_near(variance(localizer.filter(), state), expected), "{state}");
        }
    }
}

/// However long it takes, the deviations are at most those of an unknown pose, and the localizer accepts what comes.
#[test]
fn the_growth_has_a_limit() {
    let room = square_room();
    let walls = room.walls();
    let (mut localizer, now) = driven(&walls, &room, 2.0);
    for hours in [1, 1_000, 10_000_000] {
        localizer.odometry_missing(at(now + hours * 36_000));
        let deviation = localizer.filter().standard_deviations();
        assert!((deviation.x.0 - 1_000.0).abs() < 0.1, "{deviation:?}");
        assert!((deviation.heading.0 - std::f32::consts::PI).abs() < 0.01, "{deviation:?}");
        assert_eq!(localizer.health().verdict, Verdict::Lost);
    }
    let late = at(now + 10_000_000 * 36_000 + 1);
    localizer.odometry(late, WheelTravel::new(0.01, 0.01)).unwrap();
    localizer.set_pose(&room.start()).unwrap();
    assert!(localizer.aim().is_ok());
    assert_eq!(localizer.health().verdict, Verdict::Tracking);
}

/// The verdict of a failure that is shorter than half a second does not depend on the growth.
#[test]
fn the_growth_alone_degrades_after_half_a_second() {
    let room = square_room();
    let walls = room.walls();
    let (mut localizer, now) = driven(&walls, &room, 2.0);
    let verdict = |localizer: &mut Localizer, tick| {
        localizer.odometry_missing(at(now + tick));
        localizer.health().verdict
    };
    let limit = DEGRADED_WITHOUT_ODOMETRY.ticks() / TICK;
    let verdicts: Vec<Verdict> = (1..=31).map(|tick| verdict(&mut localizer, tick)).collect();
    let first = |of| verdicts.iter().position(|verdict| *verdict == of).map(|n| n as u64 + 1);
    assert_eq!((first(Verdict::Degraded), first(Verdict::Lost)), (Some(limit + 1), Some(31)));
}

/// 0.1 s at 0.5 m/s: 5 cm and, with a track width of 20 cm, 0.5 rad.
#[test]
fn the_growth_of_one_tick_is_that_of_the_maximum_speed() {
    let room = square_room();
    let walls = room.walls();
    let (mut localizer, now) = driven(&walls, &room, 0.5);
    let before = *localizer.filter();
    localizer.odometry_missing(at(now + 1));
    for (state, deviation) in [(X, 0.05_f64), (Y, 0.05), (HEADING, 0.5)] {
        let added = variance(localizer.filter(), state) - variance(&before, state);
        assert!((added.sqrt() - deviation).abs() < 1e-4, "{state}: {added}");
    }
    assert!(localizer.is_odometry_missing());
}

/// A failure of exactly half a second is a short one, whether its end is a sample or a refused one.
#[test]
fn half_a_second_is_a_short_failure() {
    let room = square_room();
    let walls = room.walls();
    let limit = u16::try_from(DEGRADED_WITHOUT_ODOMETRY.ticks() / TICK).unwrap();
    let (with, without, _) = after_a_failure(&walls, &room, limit, [0.01, 0.01]);
    assert_eq!(bits(with.filter()), bits(without.filter()));

    // The travel that was refused then is contained in the next sample: the turn is known.
    let (mut localizer, now) = driven(&walls, &room, 1.0);
    let heading = variance(localizer.filter(), HEADING);
    let end = now + u64::from(limit);
    missing(&mut localizer, now + 1..=end - 1);
    localizer.odometry(at(end), WheelTravel::new(1e3, 1e3)).unwrap_err();
    localizer.odometry(at(end + 1), WheelTravel::default()).unwrap();
    assert!(is_near(variance(localizer.filter(), HEADING), heading));
}
