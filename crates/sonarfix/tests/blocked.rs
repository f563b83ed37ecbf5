//! The localizer when a wall does not answer, or none can be measured.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use sonarfix::aim::Policy;
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};

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
fn an_occluded_wall_is_avoided_and_returns_to_the_prior_with_time() {
    let walls = room();
    let mut localizer = localizer(&walls, 0.01);
    let favourite = localizer.aim().unwrap();
    assert!(matches!(localizer.fix(&favourite, Some(Metres(0.3))), Fix::Gated(_)));
    assert_ne!(localizer.aim().unwrap().wall, favourite.wall, "the first wall is occluded");
    // At the same bearing it is the same wall, with a lower probability of success.
    let success = |localizer: &Localizer| {
        let why = localizer.aim_at(favourite.bearing).unwrap().why;
        why.success / favourite.why.success
    };
    assert!(success(&localizer) < 0.3);
    let mut before = 0.0;
    for seconds in [1, 5, 20, 100, 1_000] {
        let now = Instant::from_ticks(seconds * 1_000_000);
        localizer.odometry(now, WheelTravel::default()).unwrap();
        assert!(success(&localizer) > before, "after {seconds} s");
        before = success(&localizer);
    }
    assert!(before > 0.95);
}

#[test]
fn another_wall_follows_a_gated_one_with_every_policy() {
    let walls = room();
    // The default is the informative policy where it is linked.
    for policy in [Policy::Nearest, Policy::default()] {
        let mut config = *localizer(&walls, 0.01).config();
        config.policy = policy;
        let mut localizer = Localizer::new(config, Map::new(&walls), start(0.01), START).unwrap();
        let first_choice = localizer.aim().unwrap();
        assert!(matches!(localizer.fix(&first_choice, Some(Metres(0.3))), Fix::Gated(_)));
        assert_ne!(localizer.aim().unwrap().wall, first_choice.wall, "{policy:?}");
    }
}

#[test]
fn the_occlusion_of_a_wall_halves_within_a_quarter_of_a_metre() {
    // One wall, parallel to the path.
    let walls = &room()[..1];
    let mut stays = localizer(walls, 0.001);
    let first = stays.aim().unwrap();
    assert!(matches!(stays.fix(&first, Some(Metres(0.3))), Fix::Gated(_)));
    let mut passes = stays.clone();
    let now = Instant::from_ticks(1_000_000);
    stays.odometry(now, WheelTravel::default()).unwrap();
    passes.odometry(now, WheelTravel::new(0.25, 0.25)).unwrap();
    let penalty =
        |localizer: &Localizer| 1.0 - localizer.aim().unwrap().why.success / first.why.success;
    // Half the penalty where the foot is 0.25 m away.
    assert!(penalty(&stays) > 0.5);
    assert!((penalty(&passes) - 0.5 * penalty(&stays)).abs() < 2e-2);
}

#[test]
fn a_missing_echo_makes_an_occlusion_likely_and_an_echo_unlikely_again() {
    let walls = &room()[..1];
    let mut localizer = localizer(walls, 0.01);
    let first = localizer.aim().unwrap();
    let _ = localizer.fix(&first, None);
    let silent = localizer.aim().unwrap();
    let after_silence = silent.why.success / first.why.success;
    assert!((0.4..0.8).contains(&after_silence), "{after_silence}");
    assert!(matches!(localizer.fix(&silent, Some(silent.range)), Fix::Accepted(_)));
    let after_echo = localizer.aim().unwrap().why.success / first.why.success;
    assert!(after_echo > after_silence, "{after_echo}");
}

#[test]
fn the_only_wall_is_measured_however_often_it_is_gated() {
    let walls = &room()[..1];
    let mut localizer = localizer(walls, 0.01);
    for _ in 0..3 {
        let aim = localizer.aim().unwrap();
        assert!(matches!(localizer.fix(&aim, Some(Metres(0.3))), Fix::Gated(_)));
    }
}

/// However uncertain the heading, the robot keeps measuring; and if no ping helps, it is lost within 30.
#[test]
fn a_localizer_with_an_uncertain_heading_keeps_measuring_or_is_lost() {
    let walls = room();
    for heading_deviation in [0.2, 0.5, 1.0, 3.0] {
        let mut localizer = localizer(&walls, heading_deviation);
        let mut lost_after = None;
        for ping in 1..=30 {
            let aim = localizer.aim().unwrap();
            let _ = localizer.fix(&aim, None);
            if localizer.health().verdict == Verdict::Lost {
                lost_after = lost_after.or(Some(ping));
            }
        }
        assert!(lost_after.is_some(), "{heading_deviation} rad");
    }
}

/// A heading that is uncertain by more than the cone recovers by driving and measuring.
#[test]
fn an_uncertain_heading_recovers() {
    let walls = room();
    let mut localizer = localizer(&walls, 0.35);
    // The true robot drives along x from the estimated start; ranges are exact.
    let mut x = 1.0;
    for step in 1..=40_u64 {
        let travel = if (step / 20) % 2 == 0 { 0.05 } else { -0.05 };
        x += travel;
        let now = Instant::from_ticks(step * 500_000);
        localizer.odometry(now, WheelTravel::new(travel, travel)).unwrap();
        let aim = localizer.aim().unwrap();
        let true_range = [1.2, 4.0 - x, 1.8, x][aim.wall.0 as usize];
        let _ = localizer.fix(&aim, Some(Metres(true_range)));
    }
    let deviation = localizer.filter().standard_deviations().heading;
    assert!(deviation < Radians(0.06), "{deviation:?}");
    assert!(localizer.pose().heading.radians().abs() < Radians(0.1));
    assert_ne!(localizer.health().verdict, Verdict::Lost);
}
