//! Rooms that nobody tuned to: how consistent the filter is, and how often the verdict is wrong, in generated rooms.

mod family;

use std::fmt::Write;

use rayon::prelude::*;
use sonarfix::health::Verdict;
use sonarfix_map::FileError;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

pub use family::Family;

/// Limits of a right pose, metres and radians.
const NEAR: f64 = 0.1;
const NEAR_HEADING: f64 = 0.1;
/// A position error beyond this is a failure, metres.
const FAR: f64 = 0.2;

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RoomError {
    /// The room is invalid.
    #[error(transparent)]
    Room(#[from] FileError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] SimulationError),
}

/// The sums of the runs of one family.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// Runs.
    runs: u32,
    /// Normalised estimation error squared, over the number of states, of the runs that are not lost.
    nees: f64,
    /// Terms of it.
    consistent: u32,
    /// Normalised innovations squared.
    nis: (f64, u64),
    /// Error of the range scale over its deviation, of the runs that are not lost, and its square.
    scale: (f64, f64),
    /// Mean square of the position error along the path, m².
    mean_square: f64,
    /// Runs that ended lost.
    lost: u32,
    /// Runs in which the verdict became `Lost` at a right pose, and in which it became so at all.
    falsely: u32,
    called: u32,
    /// Runs with a position error above 20 cm.
    far: u32,
    /// Share of the time that is not `Tracking`.
    untracked: f64,
}

/// The results of all families with their names.
pub type Results = Vec<(&'static str, Sums)>;

/// Runs the rooms with the seeds from `first`, `runs` of each family, unless it is interrupted.
///
/// # Errors
/// The [`RoomError`] of the first run that fails.
pub fn run(first: u64, runs: u32, progress: &impl Progress) -> Result<Results, RoomError> {
    Family::ALL
        .into_iter()
        .map(|family| Ok((family.name(), of(family, first, runs, progress)?)))
        .collect()
}

fn of(family: Family, first: u64, runs: u32, progress: &impl Progress) -> Result<Sums, RoomError> {
    let seeds = (0..u64::from(runs)).into_par_iter().filter(|_| !progress.is_interrupted());
    let one = |run| {
        let sums = one(family, first.wrapping_add(run));
        progress.finished();
        sums
    };
    let all: Vec<Sums> = seeds.map(one).collect::<Result<_, _>>()?;
    Ok(all.into_iter().fold(Sums::default(), Sums::plus))
}

fn one(family: Family, seed: u64) -> Result<Sums, RoomError> {
    let simulation = Simulation::new(family.scenario(seed)?);
    let mut watch = Watch::default();
    let result = simulation.run(seed, &mut watch)?;
    let (sum, count) = result.nis.parts();
    let states = f64::from(u32::try_from(result.estimated_states).unwrap_or(1));
    let [.., scale_error] = *result.error.as_slice() else { return Ok(Sums::default()) };
    let scale = if result.lost { 0.0 } else { scale_error / watch.scale_deviation };
    Ok(Sums {
        runs: 1,
        nees: if result.lost { 0.0 } else { result.nees / states },
        consistent: u32::from(!result.lost),
        nis: (sum, count),
        scale: (scale, scale * scale),
        mean_square: result.path.position_mean_square(),
        lost: u32::from(result.lost),
        falsely: u32::from(watch.falsely),
        called: u32::from(watch.called),
        far: u32::from(result.integrity.worst() > FAR),
        untracked: f64::from(watch.untracked) / f64::from(watch.ticks.max(1)),
    })
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self {
            runs: self.runs + other.runs,
            nees: self.nees + other.nees,
            consistent: self.consistent + other.consistent,
            nis: (self.nis.0 + other.nis.0, self.nis.1 + other.nis.1),
            scale: (self.scale.0 + other.scale.0, self.scale.1 + other.scale.1),
            mean_square: self.mean_square + other.mean_square,
            lost: self.lost + other.lost,
            falsely: self.falsely + other.falsely,
            called: self.called + other.called,
            far: self.far + other.far,
            untracked: self.untracked + other.untracked,
        }
    }
}

/// The verdicts of a run, judged by the pose at which they are given.
#[derive(Debug, Default)]
struct Watch {
    verdict: Verdict,
    falsely: bool,
    called: bool,
    untracked: u32,
    ticks: u32,
    scale_deviation: f64,
}

impl Recorder for Watch {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        let Some(truth) = tick.truth else { return };
        let (estimate, truth) = (tick.estimate, truth.pose);
        let off = (estimate.pose.x - truth.x).hypot(estimate.pose.y - truth.y);
        let turned = within_half_turn(estimate.pose.heading - truth.heading);
        if estimate.verdict == Verdict::Lost && self.verdict != Verdict::Lost {
            self.called = true;
            self.falsely |= off < NEAR && turned.abs() < NEAR_HEADING;
        }
        self.verdict = estimate.verdict;
        self.untracked += u32::from(estimate.verdict != Verdict::Tracking);
        self.ticks += 1;
        self.scale_deviation = estimate.deviation[6];
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}
}

/// An angle in (−π, π].
fn within_half_turn(angle: f64) -> f64 {
    let turns = (angle / std::f64::consts::TAU).round();
    angle - turns * std::f64::consts::TAU
}

const HEAD: &str = "\
| room | runs | NEES/7 | NIS | scale, σ | its RMS, σ | RMS, mm | lost | called lost | falsely | above 20 cm | not tracking |
|---|---|---|---|---|---|---|---|---|---|---|---|
";

/// The results as a table.
#[must_use]
pub fn markdown(results: &[(&str, Sums)]) -> String {
    let mut page = HEAD.to_owned();
    for (name, sums) in results {
        let (runs, consistent) = (f64::from(sums.runs), f64::from(sums.consistent));
        // Writing to a String does not fail.
        let _ = writeln!(
            page,
            "| {name} | {} | {:.2} | {:.2} | {:+.2} | {:.2} | {:.1} | {} | {} | {} | {} | {:.2} % |",
            sums.runs,
            sums.nees / consistent,
            sums.nis.0 / as_f64(sums.nis.1),
            sums.scale.0 / consistent,
            (sums.scale.1 / consistent).sqrt(),
            1e3 * (sums.mean_square / runs).sqrt(),
            sums.lost,
            sums.called,
            sums.falsely,
            sums.far,
            100.0 * sums.untracked / runs,
        );
    }
    page
}

#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
