//! Predict, update and aim on this machine: `cargo bench --package bench-crates --bench filter`.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use sonarfix::config::Config;
use sonarfix::filter::ekf::Ekf;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians, SquareMetres};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix::sensor::range::ExpectedRange;

/// A room of 4 m × 3 m.
fn room() -> [Wall; 4] {
    let [a, b, c, d] =
        [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(|(x, y)| Point::new(x, y));
    [(a, b), (b, c), (c, d), (d, a)].map(|(from, to)| Wall::new(from, to).unwrap())
}

/// A localizer after 2 m through the room, with fixes.
fn under_way(walls: &[Wall]) -> Localizer<'_> {
    let start = Start {
        pose: Pose::new(1.0, 1.0, Radians(0.1)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    };
    let config = Config::for_track_width(Metres(0.16));
    let mut localizer =
        Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap();
    for tick in 1..=100 {
        let now = Instant::from_ticks(tick * 100_000);
        localizer.odometry(now, WheelTravel::new(0.02, 0.0199)).unwrap();
        let aim = localizer.aim().unwrap();
        assert!(matches!(localizer.fix(&aim, Some(aim.range)), Fix::Accepted(_)));
    }
    localizer
}

fn filter(criterion: &mut Criterion) {
    let walls = room();
    let localizer = under_way(&walls);
    let ekf: Ekf = *localizer.filter();
    let travel = WheelTravel::new(0.04, 0.039);
    let [wall, ..] = &walls;
    let expected = ExpectedRange::new(wall, Point::new(0.1, 0.0), &ekf.state());
    let (range, noise) = (expected.range + Metres(0.002), SquareMetres(25e-6));

    criterion.bench_function("predict", |bench| {
        bench.iter_batched_ref(|| ekf, |ekf| ekf.predict(black_box(travel)), BatchSize::SmallInput);
    });
    criterion.bench_function("update", |bench| {
        bench.iter_batched_ref(
            || ekf,
            |ekf| ekf.update(black_box(range), black_box(&expected), noise),
            BatchSize::SmallInput,
        );
    });
    criterion.bench_function("aim among 4 walls", |bench| {
        bench.iter(|| black_box(&localizer).aim());
    });
}

criterion_group!(benches, filter);
criterion_main!(benches);
