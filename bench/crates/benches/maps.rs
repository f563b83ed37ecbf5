//! The walls near a point, and a whole aim, in buildings of any size: `cargo bench --package bench-crates --bench maps`.

#[path = "../../../crates/sonarfix-map/tests/rooms/mod.rs"]
mod rooms;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use rooms::{inside, rooms};
use sonarfix::config::Config;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix_map::bake;

/// The reach of a usual sonar.
const REACH: Metres = Metres(4.0);

fn maps(criterion: &mut Criterion) {
    for count in [8, 100, 1_000, 10_000, 100_000] {
        let image = bake(&rooms(count)).unwrap();
        let map = Map::read(&image).unwrap();
        let here = inside(count);
        let start = Start {
            pose: Pose::new(here.x.0, here.y.0, Radians(0.3)),
            position_deviation: Metres(0.01),
            heading_deviation: Radians(0.01),
        };
        let config = Config::for_track_width(Metres(0.16));
        let localizer = Localizer::new(config, map, start, Instant::from_ticks(0)).unwrap();
        assert!(localizer.aim().is_ok());
        criterion.bench_function(&format!("near/{count}"), |bench| {
            bench.iter(|| map.near(black_box(here), REACH).count());
        });
        criterion.bench_function(&format!("aim/{count}"), |bench| {
            bench.iter(|| black_box(&localizer).aim());
        });
    }
}

criterion_group!(benches, maps);
criterion_main!(benches);
