//! Random windows of pings for the search: no pose may be other than finite, and pings that all meet one
//! wall may never give a unique answer.
//!
//! A window is a random drive with 12 to 40 pings in a random room of 4 to 12 walls. In every second one
//! the ranges are random; in the others they are those of a single wall with noise and missed echoes. The
//! search answers as soon as one cycle has found a single answer at low odds, so that a wrong one
//! is not hidden by it.
//!
//! `cargo xtask search-windows` runs it. A seed determines a window: `--seed N --windows 1` repeats it.

use std::process::ExitCode;

use clap::Parser;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_search::search::{Answer, Search, SearchParameters};

#[derive(Debug, Parser)]
#[command(about = "Random windows of pings for the search")]
struct Args {
    /// Number of windows.
    #[arg(long, default_value_t = 20_000)]
    windows: u64,
    /// Seed of the first window; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// A search of a small window, which a million of them make affordable.
type Small<'m> = Search<'m, 40, 4>;

/// Cycles after which the answer is taken, and the most evaluations until then.
const CYCLES: u32 = 6;
const EVALUATIONS: u32 = 200_000;

fn main() -> ExitCode {
    let args = Args::parse();
    let seeds = (0..args.windows).into_par_iter().map(|n| args.seed.wrapping_add(n));
    let failure = seeds.filter_map(|seed| window(seed).err().map(|what| (seed, what)));
    match failure.find_any(|_| true) {
        None => {
            println!("{} windows from seed {}: no failure", args.windows, args.seed);
            ExitCode::SUCCESS
        }
        Some((seed, what)) => {
            println!("{what}; repeat: cargo xtask search-windows --seed {seed} --windows 1");
            ExitCode::FAILURE
        }
    }
}

fn sonar() -> RangerParameters {
    let mut sonar = Config::for_track_width(Metres(0.2)).rangers.first;
    sonar.mount = Point::new(0.1, 0.0);
    sonar.cone = Radians::from_degrees(15.0);
    sonar.max_range = Metres(3.5);
    sonar
}

/// A wall that is an exact line in the odometry frame, or any ranges.
enum Ranges {
    Any,
    OneWall { direction: f32, distance: f32 },
}

fn window(seed: u64) -> Result<(), String> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let walls = walls(&mut rng);
    let parameters = SearchParameters { odds: 8.0, ..SearchParameters::default() };
    let mut search: Small = Search::new(&sonar(), Map::new(&walls), parameters);
    let ranges = if seed.is_multiple_of(2) {
        Ranges::Any
    } else {
        let direction = rng.random_range(-3.1..3.1);
        Ranges::OneWall { direction, distance: rng.random_range(0.5..3.0) }
    };
    let (mut at, mut heading) = ([0.0_f32; 2], 0.0_f32);
    for _ in 0..rng.random_range(12..=40) {
        let (advance, turn) = (rng.random_range(-0.1..0.4_f32), rng.random_range(-0.5..0.5_f32));
        let (sin, cos) = (heading + 0.5 * turn).sin_cos();
        at = [at[0] + advance * cos, at[1] + advance * sin];
        heading += turn;
        search.odometry(Metres(advance), Radians(turn)).map_err(|error| error.to_string())?;
        let (bearing, range) = ranges.ping(at, heading, &mut rng);
        search.ping(Radians(bearing), range.map(Metres)).map_err(|error| error.to_string())?;
    }
    let mut evaluations = 0;
    while search.cycles() < CYCLES && evaluations < EVALUATIONS {
        search.poll(1_000);
        evaluations += 1_000;
        check(&search, &ranges)?;
    }
    Ok(())
}

fn check(search: &Small, ranges: &Ranges) -> Result<(), String> {
    for found in search.hypotheses() {
        let is_finite = found.pose.is_finite()
            && found.position_deviation.is_finite()
            && found.heading_deviation.is_finite()
            && found.fit.is_finite();
        if !is_finite {
            return Err(format!("not finite: {found:?}"));
        }
    }
    match (ranges, search.answer()) {
        (Ranges::OneWall { .. }, Answer::Unique(found)) => {
            Err(format!("unique from the pings of one wall: {found:?}"))
        }
        _ => Ok(()),
    }
}

impl Ranges {
    /// Bearing and range of a ping.
    fn ping(&self, at: [f32; 2], heading: f32, rng: &mut ChaCha8Rng) -> (f32, Option<f32>) {
        match *self {
            Self::Any => {
                let range = rng.random_bool(0.8).then(|| rng.random_range(0.05..4.0));
                (rng.random_range(-3.1..3.1), range)
            }
            Self::OneWall { direction, distance } => {
                let cone = sonar().cone.0;
                let bearing = direction - heading + rng.random_range(-cone..cone);
                let (sin, cos) = direction.sin_cos();
                let mount = sonar().mount.x.0;
                let from = [at[0] + mount * heading.cos(), at[1] + mount * heading.sin()];
                let range = distance - (from[0] * cos + from[1] * sin);
                let noise = rng.random_range(-0.01..0.01_f32);
                let is_heard = range > 0.1 && range < 3.5 && rng.random_bool(0.9);
                (bearing, is_heard.then_some(range + noise))
            }
        }
    }
}

/// An outline with a corner pushed in, and some single walls inside.
fn walls(rng: &mut ChaCha8Rng) -> Vec<Wall> {
    let (x, y) = (rng.random_range(2.0..8.0_f32), rng.random_range(2.0..8.0_f32));
    let (u, v) = (x * rng.random_range(0.3..0.9_f32), y * rng.random_range(0.3..0.9_f32));
    let outline = [[0.0, 0.0], [x, 0.0], [x, v], [u, v], [u, y], [0.0, y]];
    let mut walls = Vec::new();
    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
    let inner: Vec<[[f32; 2]; 2]> = (0..rng.random_range(0..=6))
        .map(|_| [(); 2].map(|()| [rng.random_range(0.0..x), rng.random_range(0.0..y)]))
        .collect();
    for [from, to] in ends.map(|(from, to)| [*from, *to]).chain(inner) {
        // Ends that coincide give no wall.
        let point = |[x, y]: [f32; 2]| Point::new(x, y);
        walls.extend(Wall::new(point(from), point(to)));
    }
    walls
}
