//! Random runs of a filter, for a given number of steps, on all cores: no variance may reach zero,
//! every number must stay finite, and the correlation matrix must stay positive definite.
//!
//! A run is a robot, a prior from 0.1 m to 100 m and about 20,000 steps: motions of every kind, long
//! intervals without ranges, ranges with deviations down to 0.1 mm to slanted and to straight walls,
//! single or repeated at the same few walls. A step is one `predict` or one `update`. After every
//! update and every 16th predict all of P is checked, in `f64`.
//!
//! `cargo xtask endurance` runs it. A seed determines a run: `--seed N --steps 1` repeats it.

use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{DMatrix, SMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

#[derive(Debug, Parser)]
#[command(about = "Random runs of a filter")]
struct Args {
    /// Minimum number of steps; the last run is completed.
    #[arg(long, default_value_t = 1_000_000)]
    steps: u64,
    /// Seed of the first run; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Steps of one run; its last leg may exceed it slightly.
const RUN: u64 = 20_000;
/// Predictions between checks of P.
const LOOK_EVERY: u64 = 16;

/// A failure, and its step.
#[derive(Debug)]
struct Failure {
    seed: u64,
    predicts: u64,
    updates: u64,
    what: String,
}

/// The result of a run.
#[derive(Debug, Clone, Copy)]
struct Record {
    predicts: u64,
    updates: u64,
    /// Smallest eigenvalue of the correlation matrix over all checks.
    smallest_eigenvalue: f64,
    /// Seed of the run with this eigenvalue.
    seed: u64,
}

impl Record {
    fn plus(self, other: Self) -> Self {
        let sharper =
            if other.smallest_eigenvalue < self.smallest_eigenvalue { other } else { self };
        Self {
            predicts: self.predicts + other.predicts,
            updates: self.updates + other.updates,
            ..sharper
        }
    }
}

struct Run {
    rng: ChaCha8Rng,
    ekf: Ekf,
    mount: Point,
    record: Record,
}

impl Run {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let track_width = rng.random_range(0.1..0.6);
        let drive = Drive {
            track_width: Metres(track_width),
            wheel_noise: PerRootMetre(Metres(log_uniform(&mut rng, 1e-4, 2e-2))),
            scale_walk: PerRootMetre(log_uniform(&mut rng, 1e-6, 1e-4)),
            track_width_walk: PerRootMetre(Metres(log_uniform(&mut rng, 1e-7, 1e-5))),
        };
        let mut within = |limit: f32| rng.random_range(-limit..limit);
        let state = StateEstimate {
            x: Metres(within(20.0)),
            y: Metres(within(20.0)),
            heading: Radians(within(3.1)),
            scale_right: within(0.02),
            scale_left: within(0.02),
            track_width_error: Metres(within(0.03 * track_width)),
            range_scale: within(0.02),
        };
        let position = Metres(log_uniform(&mut rng, 0.1, 100.0));
        let deviation = StandardDeviations {
            x: position,
            y: position,
            heading: Radians(log_uniform(&mut rng, 1e-3, 0.5)),
            scale_right: log_uniform(&mut rng, 1e-4, 0.03),
            scale_left: log_uniform(&mut rng, 1e-4, 0.03),
            track_width_error: Metres(track_width * log_uniform(&mut rng, 1e-4, 0.05)),
            // In a third of the runs the range scale is known exactly.
            range_scale: if rng.random_ratio(1, 3) {
                0.0
            } else {
                log_uniform(&mut rng, 1e-3, 0.03)
            },
        };
        let off = if rng.random_ratio(1, 4) { 0.0 } else { 0.2 };
        let mount = Point::new(rng.random_range(-off..=off), rng.random_range(-off..=off));
        let ekf = Ekf::new(drive, state, deviation).expect("a sound start");
        let record = Record { predicts: 0, updates: 0, smallest_eigenvalue: f64::INFINITY, seed };
        Self { rng, ekf, mount, record }
    }

    fn steps(&self) -> u64 {
        self.record.predicts + self.record.updates
    }

    fn execute(mut self) -> Result<Record, Failure> {
        while self.steps() < RUN {
            let leg = match self.rng.random_range(0..8_u8) {
                0..4 => {
                    let travel = self.any_travel();
                    self.roll(travel, 1..40)
                }
                // A long interval with odometry only, for up to 100 m.
                4 => {
                    let distance = log_uniform(&mut self.rng, 1e-4, 0.1);
                    let curve = self.rng.random_range(0.99..1.01);
                    self.roll(WheelTravel::new(distance, curve * distance), 200..1_000)
                }
                5 => self.listen(1..4, 1..60),
                6 => self.listen(1..3, 100..500),
                _ => self.listen(1..2, 1..2),
            };
            let Record { seed, predicts, updates, .. } = self.record;
            leg.map_err(|what| Failure { seed, predicts, updates, what })?;
        }
        Ok(self.record)
    }

    /// Any travel of 100 ms: ahead, back, on the spot, about one wheel, on any curve.
    fn any_travel(&mut self) -> WheelTravel {
        let rng = &mut self.rng;
        let mut wheel = || {
            let distance = log_uniform(rng, 1e-5, 0.1);
            if rng.random() { distance } else { -distance }
        };
        let (one, other) = (wheel(), wheel());
        match self.rng.random_range(0..4_u8) {
            0 => WheelTravel::new(one, one),
            1 => WheelTravel::new(one, -one),
            2 => WheelTravel::new(one, 0.0),
            _ => WheelTravel::new(one, other),
        }
    }

    /// Some steps of the same travel.
    fn roll(&mut self, travel: WheelTravel, times: std::ops::Range<u32>) -> Result<(), String> {
        for _ in 0..self.rng.random_range(times) {
            self.ekf.predict(travel).map_err(|error| format!("predict({travel:?}): {error}"))?;
            self.record.predicts += 1;
            if self.record.predicts.is_multiple_of(LOOK_EVERY) {
                self.check()?;
            }
        }
        Ok(())
    }

    /// Some ranges to the same few walls, with errors up to 2.5 of their deviations.
    fn listen(
        &mut self,
        walls: std::ops::Range<usize>,
        times: std::ops::Range<usize>,
    ) -> Result<(), String> {
        let walls = self.rng.random_range(walls);
        let walls: Vec<Wall> = (0..walls).map(|_| self.any_wall()).collect();
        let noise = log_uniform(&mut self.rng, 1e-8, 1e-3);
        let times = self.rng.random_range(times);
        for wall in walls.iter().cycle().take(times) {
            let expected = ExpectedRange::new(wall, self.mount, &self.ekf.state());
            let noise = SquareMetres(noise);
            let variance = self.ekf.innovation(expected.range, &expected, noise).variance.0;
            // A range error of metres would drive the calibration out of the realistic region.
            let surprise = self.rng.random_range(-2.5..2.5) * variance.max(0.0).sqrt();
            let range = expected.range + Metres(surprise.clamp(-0.3, 0.3));
            self.ekf
                .update(range, &expected, noise)
                .map_err(|error| format!("update({range:?}, {expected:?}, {noise:?}): {error}"))?;
            self.record.updates += 1;
            self.check()?;
        }
        Ok(())
    }

    /// A wall at a distance of 0.3 m to 12 m, slanted in two of three cases.
    fn any_wall(&mut self) -> Wall {
        let state = self.ekf.state();
        let quarter = f32::from(self.rng.random_range(0..4_u8)) * core::f32::consts::FRAC_PI_2;
        let direction =
            if self.rng.random_ratio(1, 3) { quarter } else { self.rng.random_range(-3.1..3.1) };
        let (sin, cos) = direction.sin_cos();
        let distance = log_uniform(&mut self.rng, 0.3, 12.0);
        let foot = (state.x.0 + cos * distance, state.y.0 + sin * distance);
        let half = self.rng.random_range(0.5..5.0);
        let end = |along: f32| Point::new(foot.0 - sin * along, foot.1 + cos * along);
        Wall::new(end(-half), end(half)).expect("a wall of a metre or more")
    }

    /// Checks that P is a covariance.
    fn check(&mut self) -> Result<(), String> {
        let p = self.ekf.covariance().map(f64::from);
        let state = self.ekf.state_vector();
        if !state.iter().all(|v| v.is_finite()) || !p.iter().all(|v| v.is_finite()) {
            return Err(format!("not finite: {state} {p}"));
        }
        let estimated: Vec<usize> = (0..7)
            .filter(|&i| i < 6 || p[(i, i)] != 0.0 || p.row(i).iter().any(|v| *v != 0.0))
            .collect();
        if let Some(&i) = estimated.iter().find(|&&i| p[(i, i)] <= 0.0) {
            return Err(format!("variance {i} is {:e}", p[(i, i)]));
        }
        let smallest = smallest_eigenvalue(&p, &estimated);
        if smallest <= 0.0 {
            return Err(format!("smallest eigenvalue of the correlation {smallest:e}: {p:e}"));
        }
        if smallest < self.record.smallest_eigenvalue {
            self.record.smallest_eigenvalue = smallest;
        }
        Ok(())
    }
}

fn smallest_eigenvalue(p: &SMatrix<f64, 7, 7>, estimated: &[usize]) -> f64 {
    let n = estimated.len();
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let (i, j) = (estimated[i], estimated[j]);
        p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt()
    });
    correlation.symmetric_eigenvalues().min()
}

/// A number with a uniformly distributed exponent.
fn log_uniform(rng: &mut ChaCha8Rng, from: f32, to: f32) -> f32 {
    rng.random_range(from.ln()..to.ln()).exp()
}

fn main() -> ExitCode {
    let args = Args::parse();
    let runs = args.steps.div_ceil(RUN).max(1);
    let bar = ProgressBar::new(runs).with_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {eta} left").expect("a template"),
    );
    let execute = |run: u64| {
        let record = Run::new(args.seed + run).execute();
        bar.inc(1);
        record
    };
    let total = (0..runs).into_par_iter().map(execute).try_reduce_with(|a, b| Ok(a.plus(b)));
    bar.finish_and_clear();
    match total {
        Some(Ok(record)) => {
            println!(
                "{} runs, seeds {}–{}: {} predicts and {} updates; smallest eigenvalue of the \
                 correlation {:.2e} (seed {})",
                runs,
                args.seed,
                args.seed + runs - 1,
                record.predicts,
                record.updates,
                record.smallest_eigenvalue,
                record.seed
            );
            ExitCode::SUCCESS
        }
        Some(Err(failure)) => {
            eprintln!(
                "seed {}, after {} predicts and {} updates: {}\n\
                 live it again: cargo xtask endurance --seed {} --steps 1",
                failure.seed, failure.predicts, failure.updates, failure.what, failure.seed
            );
            ExitCode::FAILURE
        }
        None => ExitCode::SUCCESS,
    }
}
