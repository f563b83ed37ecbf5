//! What the localizer does when a wall does not answer, or none can.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use sonarfix::aim::{NoAim, Policy};
use sonarfix::config::Config;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Instant, Metres, Radians};

/// A room of 4 m × 3 m.
fn room() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
    let point = |(x, y): (f32, f32)| Point::new(x, y);
    let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
    corners.windows(2).map(wall).collect()
}

const START: Instant = Instant::from_ticks(0);

fn start(heading_deviation: f32) -> Start {
    Start {
        pose: Pose::new(1.0, 1.2, Radians(0.0)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(heading_deviation),
    }
}

fn localizer(walls: &[Wall], heading_deviation: f32) -> Localizer<'_> {
    let config = Config::for_track_width(Metres(0.16));
    Localizer::new(config, Map::new(walls), start(heading_deviation), START).unwrap()
}

#[test]
fn a_blocked_wall_is_believed_less_and_regains_it_with_time() {
    let walls = room();
    let mut localizer = localizer(&walls, 0.01);
    let favourite = localizer.aim().unwrap();
    assert!(matches!(localizer.fix(&favourite, Some(Metres(0.3))), Fix::Gated(_)));
    assert_ne!(localizer.aim().unwrap().wall, favourite.wall, "something stands before the first");
    // At the same bearing, it is the same wall, and is said to be less likely to answer.
    let belief = |localizer: &Localizer| {
        let why = localizer.aim_at(favourite.bearing).unwrap().why;
        why.success / favourite.why.success
    };
    assert!((belief(&localizer) - 0.2).abs() < 1e-3);
    let mut before = 0.0;
    for seconds in [1, 5, 20, 100, 1_000] {
        let now = Instant::from_ticks(seconds * 1_000_000);
        localizer.odometry(now, WheelTravel::default()).unwrap();
        assert!(belief(&localizer) > before, "after {seconds} s");
        before = belief(&localizer);
    }
    assert!(before > 0.95);
}

#[test]
fn whatever_the_policy_a_blocked_wall_is_left() {
    let walls = room();
    for policy in [Policy::Nearest, Policy::Informative] {
        let config = Config { policy, ..*localizer(&walls, 0.01).config() };
        let mut localizer = Localizer::new(config, Map::new(&walls), start(0.01), START).unwrap();
        let favourite = localizer.aim().unwrap();
        assert!(matches!(localizer.fix(&favourite, Some(Metres(0.3))), Fix::Gated(_)));
        assert_ne!(localizer.aim().unwrap().wall, favourite.wall, "{policy:?}");
    }
}

#[test]
fn past_what_stands_there_a_wall_is_believed_again() {
    // One wall, along the robot's way.
    let walls = &room()[..1];
    let mut stays = localizer(walls, 0.001);
    let first = stays.aim().unwrap();
    assert!(matches!(stays.fix(&first, Some(Metres(0.3))), Fix::Gated(_)));
    let mut passes = stays.clone();
    let now = Instant::from_ticks(1_000_000);
    stays.odometry(now, WheelTravel::default()).unwrap();
    passes.odometry(now, WheelTravel::new(0.25, 0.25)).unwrap();
    let doubt =
        |localizer: &Localizer| 1.0 - localizer.aim().unwrap().why.success / first.why.success;
    // Half the doubt where the foot is 0.25 m away.
    assert!(doubt(&stays) > 0.5);
    assert!((doubt(&passes) - 0.5 * doubt(&stays)).abs() < 1e-2);
}

#[test]
fn no_echo_is_half_as_bad_and_an_echo_mends_most_of_it() {
    let walls = &room()[..1];
    let mut localizer = localizer(walls, 0.01);
    let first = localizer.aim().unwrap();
    let _ = localizer.fix(&first, None);
    let silent = localizer.aim().unwrap();
    assert!((silent.why.success / first.why.success - 0.5).abs() < 1e-3);
    assert!(matches!(localizer.fix(&silent, Some(silent.range)), Fix::Accepted(_)));
    let mended = localizer.aim().unwrap();
    assert!((mended.why.success / first.why.success - 0.85).abs() < 1e-2);
}

#[test]
fn the_only_wall_is_looked_at_however_often_it_is_blocked() {
    let walls = &room()[..1];
    let mut localizer = localizer(walls, 0.01);
    for _ in 0..3 {
        let aim = localizer.aim().unwrap();
        assert!(matches!(localizer.fix(&aim, Some(Metres(0.3))), Fix::Gated(_)));
    }
}

#[test]
fn a_localizer_that_cannot_look_says_so() {
    let walls = room();
    // The heading is less certain than the cone is wide, and nothing will ever mend it.
    let mut localizer = localizer(&walls, 0.2);
    for _ in 0..10 {
        assert_eq!(localizer.aim(), Err(NoAim::HeadingUncertain));
        localizer.skip();
    }
    assert_eq!(localizer.health().verdict, Verdict::Degraded);
}
