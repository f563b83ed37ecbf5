//! What the localizer does when a wall does not answer, or none can.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use sonarfix::aim::NoAim;
use sonarfix::config::Config;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Instant, Metres, Radians};

/// A room of 4 m × 3 m.
fn room() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
    let point = |(x, y): (f32, f32)| Point::new(x, y);
    let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
    corners.windows(2).map(wall).collect()
}

fn localizer(walls: &[Wall], heading_deviation: f32) -> Localizer<'_> {
    let start = Start {
        pose: Pose::new(1.0, 1.2, Radians(0.0)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(heading_deviation),
    };
    let config = Config::for_track_width(Metres(0.16));
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

#[test]
fn a_blocked_wall_is_passed_over_once() {
    let walls = room();
    let mut localizer = localizer(&walls, 0.01);
    let favourite = localizer.aim().unwrap();
    assert!(matches!(localizer.fix(&favourite, Some(Metres(0.3))), Fix::Gated(_)));
    let second = localizer.aim().unwrap();
    assert_ne!(second.wall, favourite.wall, "something stands before the first");
    // The second is blocked as well: the first has its turn again.
    assert!(matches!(localizer.fix(&second, Some(Metres(0.3))), Fix::Gated(_)));
    assert_eq!(localizer.aim().unwrap().wall, favourite.wall);
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
