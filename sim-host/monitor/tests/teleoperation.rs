//! Driving by keys.

use std::time::{Duration, Instant};

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_link::Motion;
use sonarfix_monitor::teleoperation::{Direction, HELD, Teleoperation};

const STAND: Option<Motion> =
    Some(Motion { speed: MetresPerSecond(0.0), turn: RadiansPerSecond(0.0) });

#[test]
fn a_key_that_is_released_stops_the_robot() {
    let began = Instant::now();
    let mut keys = Teleoperation::default();
    assert_eq!(keys.motion(began), None);
    keys.press(Direction::Ahead, began);
    let ahead = keys.motion(began).unwrap();
    assert!(ahead.speed.0 > 0.0 && ahead.turn.0.abs() < 1e-9);
    // A keyboard repeats a key that is held.
    for repeat in 1..100 {
        let now = began + Duration::from_millis(500 * repeat);
        assert_eq!(keys.motion(now), Some(ahead));
        keys.press(Direction::Ahead, now);
    }
    let last = began + Duration::from_millis(500 * 99);
    assert_eq!(keys.motion(last + HELD), Some(ahead));
    assert_eq!(keys.motion(last + HELD + Duration::from_millis(1)), STAND);
    assert_eq!(keys.motion(last), STAND, "it begins again with a key alone");
}

#[test]
fn a_stop_stops_at_once_and_a_release_says_nothing_more() {
    let now = Instant::now();
    let mut keys = Teleoperation::default();
    for direction in [Direction::Ahead, Direction::Back, Direction::Left, Direction::Right] {
        keys.press(direction, now);
        assert!(keys.motion(now) != STAND && keys.text().0.contains("SPACE STOPS"));
        keys.stop();
        assert_eq!(keys.motion(now), STAND);
        keys.press(direction, now);
        keys.release();
        assert_eq!(keys.motion(now), None);
    }
    // Space alone takes hold of a robot that drives by its own motor code.
    keys.stop();
    assert_eq!(keys.motion(now), STAND);
}

#[test]
fn the_directions_are_those_of_the_map() {
    let now = Instant::now();
    let mut keys = Teleoperation::default();
    let mut motion = |direction| {
        keys.press(direction, now);
        keys.motion(now).unwrap()
    };
    assert!(motion(Direction::Back).speed.0 < 0.0);
    assert!(motion(Direction::Left).turn.0 > 0.0);
    assert!(motion(Direction::Right).turn.0 < 0.0);
}

#[test]
fn the_speed_has_limits() {
    let now = Instant::now();
    let mut keys = Teleoperation::default();
    keys.press(Direction::Ahead, now);
    let mut speed = |is_faster| {
        (0..100).for_each(|_| keys.change_speed(is_faster));
        keys.motion(now).unwrap().speed.0
    };
    let (fastest, slowest) = (speed(true), speed(false));
    assert!((fastest - 1.0).abs() < 1e-6 && (slowest - 0.02).abs() < 1e-6, "{fastest} {slowest}");
}
