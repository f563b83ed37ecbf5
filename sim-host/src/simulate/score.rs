//! What is kept of a run: the bound, dead reckoning, the counts, the errors.

use sonarfix::aim::Aim;
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::units::Instant;
use sonarfix_hal::robot::Faults;

use super::{Simulation, SimulationError};
use crate::bound::Bound;
use crate::dense::Vector;
use crate::observe;
use crate::odometry::DeadReckoning;
use crate::plant::{Plant, Travel};
use crate::statistics::{NisSum, RunResult};
use crate::trace::{Recorder, Tick};

/// The books of a run.
pub struct Score<'a> {
    simulation: &'a Simulation,
    odometry: DeadReckoning,
    bound: Bound,
    /// Rolled since the bound was last brought up to date.
    rolled: Travel,
    /// Time of the last tick, seconds.
    ticked: f64,
    result: RunResult,
    nis: NisSum,
}

impl<'a> Score<'a> {
    pub fn new(
        simulation: &'a Simulation,
        start: Start,
        truth: Vector,
    ) -> Result<Self, SimulationError> {
        let model = simulation.model;
        let localizer = simulation.localizer(start, Instant::from_ticks(0))?;
        let deviation = localizer.filter().deviation();
        let deviation = Vector::from([
            deviation.x.into(),
            deviation.y.into(),
            deviation.heading.into(),
            deviation.scale_right.into(),
            deviation.scale_left.into(),
            deviation.track_width_error.into(),
            deviation.range_scale.into(),
        ]);
        let start = observe::estimate(&localizer).pose;
        Ok(Self {
            simulation,
            odometry: DeadReckoning::new(start, model.track_width),
            bound: Bound::new(model, truth, &deviation),
            rolled: Travel::default(),
            ticked: 0.0,
            result: RunResult::default(),
            nis: NisSum::default(),
        })
    }

    /// The wheels have rolled.
    pub fn rolled(&mut self, travel: Travel) {
        for (sum, more) in self.rolled.measured.iter_mut().zip(travel.measured) {
            *sum += more;
        }
        for (sum, more) in self.rolled.noiseless.iter_mut().zip(travel.noiseless) {
            *sum += more;
        }
    }

    /// Brings bound and dead reckoning up to now.
    pub fn arrive(&mut self, truth: Vector) {
        let travel = std::mem::take(&mut self.rolled);
        self.bound.moved(travel.noiseless, truth);
        self.odometry.moved(travel.measured);
    }

    /// There was nothing to look at.
    pub fn no_aim(&mut self) {
        self.result.fixes.refused += 1;
    }

    /// The filter made this of a look.
    pub fn fix(&mut self, aim: &Aim, fix: &Fix) {
        let counts = &mut self.result.fixes;
        match fix {
            Fix::Accepted(innovation) | Fix::Weakened(innovation) => {
                counts.accepted += 1;
                self.nis.add(innovation.nis().into());
                let wall = usize::try_from(aim.wall.0).ok();
                if let Some(line) = wall.and_then(|wall| self.simulation.lines.get(wall)) {
                    self.bound.fixed(line);
                }
            }
            Fix::Gated(_) => counts.gated += 1,
            Fix::Refused(_) => counts.refused += 1,
        }
    }

    /// The loop reported more faults.
    pub fn faults(&mut self, more: Faults) {
        self.result.faults = self.result.faults.plus(more);
    }

    /// An encoder tick is over.
    pub fn tick(
        &mut self,
        time: f64,
        localizer: &Localizer,
        plant: &Plant,
        recorder: &mut impl Recorder,
    ) {
        self.result.error = observe::error(localizer.filter(), &plant.state());
        self.result.path.add(&self.result.error);
        let covariance = observe::covariance(localizer.filter());
        let verdict = localizer.health().verdict;
        self.result.claim.add(time - self.ticked, &self.result.error, &covariance, verdict);
        self.ticked = time;
        recorder.tick(|| Tick {
            time,
            truth: Some(plant.truth()),
            estimate: observe::estimate(localizer),
            bound: Some(self.bound.deviation().into()),
            odometry: self.odometry.pose(),
        });
    }

    /// The run is over, with its last tick.
    pub fn result(mut self, localizer: &Localizer) -> Result<RunResult, SimulationError> {
        let covariance = observe::covariance(localizer.filter());
        let (nees, estimated) =
            observe::nees(&self.result.error, &covariance).ok_or(SimulationError::Covariance)?;
        self.result.bound_variance = self.bound.variance();
        self.result.nees = nees;
        self.result.estimated_states = estimated;
        self.result.nis = self.nis;
        self.result.judge(localizer.health().verdict);
        Ok(self.result)
    }
}
