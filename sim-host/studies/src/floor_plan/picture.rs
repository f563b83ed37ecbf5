//! Drawings of plans, and of runs on them.

use rayon::prelude::*;
use sonarfix::aim::Policy;
use sonarfix_report::heat_map::{Heat, HeatMap};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Outcome, Trace};
use sonarfix_sim::world::reflector::Source;

use super::FloorPlan;
use super::compare::{CompareError, simulation};

/// The traces of the runs of a plan under one policy.
#[derive(Debug)]
pub struct Runs {
    simulation: Simulation,
    traces: Vec<Trace>,
}

/// Number of measurement cycles by outcome.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcomes {
    /// Ranges accepted.
    pub accepted: usize,
    /// Accepted ranges whose echo did not come from the wall that was aimed at.
    pub misled: usize,
    /// Ranges beyond the gate.
    pub gated: usize,
    /// Cycles without a usable range or without a measurable wall.
    pub refused: usize,
}

impl Runs {
    /// Runs a plan with the seeds from 0 and keeps the traces.
    ///
    /// # Errors
    /// [`CompareError`].
    pub fn new(plan: &FloorPlan, policy: Policy, runs: u32) -> Result<Self, CompareError> {
        let simulation = simulation(plan, policy)?;
        let traces = (0..u64::from(runs)).into_par_iter().map(|seed| {
            let mut trace = simulation.empty_trace();
            let done = simulation.run(seed, &mut trace);
            done.map_err(|source| CompareError::Run { seed: plan.seed, source })?;
            Ok::<_, CompareError>(trace)
        });
        let traces = traces.collect::<Result<_, _>>()?;
        Ok(Self { simulation, traces })
    }

    /// The RMS of the position error along the path, millimetres.
    #[must_use]
    pub fn errors(&self) -> Vec<Heat> {
        let Some(first) = self.traces.first() else {
            return Vec::new();
        };
        let heat = |index: usize| {
            let (mut squares, mut count) = (0.0, 0.0);
            let ticks = self.traces.iter().filter_map(|trace| trace.ticks.get(index));
            for tick in ticks {
                let truth = tick.truth?.pose;
                let estimate = tick.estimate.pose;
                squares += (estimate.x - truth.x).powi(2) + (estimate.y - truth.y).powi(2);
                count += 1.0;
            }
            let truth = first.ticks.get(index)?.truth?.pose;
            let value = 1e3 * f64::sqrt(squares / count);
            Some(Heat { at: [truth.x, truth.y], value, marked: false })
        };
        (0..first.ticks.len()).filter_map(heat).collect()
    }

    /// The outcomes of the measurement cycles of all runs.
    #[must_use]
    pub fn outcomes(&self) -> Outcomes {
        let mut outcomes = Outcomes::default();
        for fix in self.fixes() {
            match fix.outcome {
                Outcome::Accepted | Outcome::Downweighted => outcomes.accepted += 1,
                Outcome::Gated => outcomes.gated += 1,
                Outcome::Refused => outcomes.refused += 1,
            }
            outcomes.misled += usize::from(is_misled(fix));
        }
        outcomes
    }

    /// The accepted outlier with the largest innovation, in words.
    #[must_use]
    pub fn most_misleading(&self) -> String {
        let misled = self.fixes().filter(|fix| is_misled(fix));
        let size = |fix: &&FixRecord| fix.innovation.unwrap_or(0.0).abs();
        let Some(worst) = misled.max_by(|a, b| size(a).total_cmp(&size(b))) else {
            return "–".to_owned();
        };
        let walls = self.simulation.scenario.floor.named_walls();
        let name = |wall: Option<usize>| {
            wall.and_then(|wall| walls.get(wall)).map_or("nothing", |wall| wall.name()).to_owned()
        };
        let source = match worst.source {
            Some(Source::Wall(wall)) => name(Some(wall)),
            Some(Source::Corner) => "a corner".to_owned(),
            Some(Source::Edge) => "an edge".to_owned(),
            Some(Source::Obstacle) => "unmapped furniture".to_owned(),
            Some(Source::DoubleBounce) => "two walls in turn".to_owned(),
            Some(Source::Outlier) | None => "no reflector".to_owned(),
        };
        let [x, y] = worst.sonar;
        format!(
            "{:+.0} mm at ({x:.2}, {y:.2}) m: aimed at {}, echo from {source}",
            1e3 * worst.innovation.unwrap_or(0.0),
            name(worst.wall),
        )
    }

    /// The map for a drawing of the errors of these runs.
    #[must_use]
    pub fn place(&self) -> HeatMap {
        HeatMap::of(&self.simulation.scenario)
    }

    fn fixes(&self) -> impl Iterator<Item = &FixRecord> {
        self.traces.iter().flat_map(|trace| &trace.fixes)
    }
}

/// Whether a range was accepted although its echo did not come from the wall that was aimed at.
fn is_misled(fix: &FixRecord) -> bool {
    fix.outcome.is_used() && fix.source != fix.wall.map(Source::Wall)
}
