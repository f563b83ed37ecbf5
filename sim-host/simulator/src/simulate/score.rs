//! The result of a run in progress: the bound, dead reckoning, counts and errors.

use sonarfix::aim::Aim;
use sonarfix::config::RangerId;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::robot::Faults;

use super::computer::no_pose;
use super::error::SimulationError;
use super::simulation::Simulation;
use crate::bound::Bound;
use crate::dense::Vector;
use crate::dense_gyro::GyroModel;
use crate::observe;
use crate::odometry::DeadReckoning;
use crate::plant::{Plant, Travel};
use crate::statistics::{NisSum, RunResult};
use crate::time::seconds;
use crate::trace::{Pose, Recorder, Tick, Truth};

/// Accumulates the result of a run.
pub struct Score<'a> {
    simulation: &'a Simulation,
    odometry: DeadReckoning,
    bound: Bound,
    /// Travel since the bound was last updated.
    rolled: Travel,
    /// True bias of the gyro, rad/s.
    gyro_bias: Option<f64>,
    /// Time of the last tick, seconds.
    last_tick: f64,
    result: RunResult,
    nis: NisSum,
}

impl<'a> Score<'a> {
    pub fn new(
        simulation: &'a Simulation,
        start: Option<Start>,
        truth: Vector,
    ) -> Result<Self, SimulationError> {
        let model = simulation.model_of(RangerId::FIRST);
        let is_known = start.is_some();
        let localizer =
            simulation.localizer(start.unwrap_or_else(no_pose), Instant::from_ticks(0))?;
        let gyro = localizer.config().gyro.as_ref().map(GyroModel::of);
        let p = observe::covariance(localizer.filter());
        // Dead reckoning needs a start; without an estimate it is the true one.
        let start = if is_known {
            observe::pose(&localizer)
        } else {
            let [x, y, heading, ..]: [f64; 7] = truth.into();
            Pose { x, y, heading }
        };
        Ok(Self {
            simulation,
            odometry: DeadReckoning::new(start, model.track_width),
            bound: Bound::new(model, gyro, truth, p),
            rolled: Travel::default(),
            gyro_bias: None,
            last_tick: 0.0,
            result: RunResult::default(),
            nis: NisSum::default(),
        })
    }

    /// Takes the true bias of the gyro, rad/s, for the records from now on.
    pub fn biased(&mut self, gyro_bias: Option<f64>) {
        self.gyro_bias = gyro_bias;
    }

    /// Adds wheel travel.
    pub fn rolled(&mut self, travel: Travel) {
        self.rolled = self.rolled.plus(&travel);
    }

    /// Updates bound and dead reckoning with the travel so far.
    pub fn arrive(&mut self, truth: Vector) {
        let travel = std::mem::take(&mut self.rolled);
        self.bound.moved(travel.noiseless, travel.seconds, truth);
        self.odometry.moved(travel.measured);
    }

    /// Counts a cycle without a measurable wall.
    pub fn no_aim(&mut self) {
        self.result.fixes.refused += 1;
    }

    /// Adds the outcome of a measurement.
    pub fn fix(&mut self, aim: &Aim, fix: &Fix) {
        let counts = &mut self.result.fixes;
        match fix {
            Fix::Accepted(innovation) | Fix::Downweighted(innovation) => {
                counts.accepted += 1;
                // A down-weighted range is probably not the wall's: ν²/S is not its statistic.
                if matches!(fix, Fix::Accepted(_)) {
                    self.nis.add(innovation.nis().into());
                }
                let wall = usize::try_from(aim.wall.0).ok();
                self.bound.measures_by(self.simulation.model_of(aim.ranger));
                if let Some(line) = wall.and_then(|wall| self.simulation.lines.get(wall)) {
                    self.bound.fixed(line, aim.bearing.0.into());
                }
            }
            Fix::Gated(_) => counts.gated += 1,
            _ => counts.refused += 1,
        }
    }

    /// Adds the outcome of a heading, position or pose from outside, and records it.
    pub fn absolute(
        &mut self,
        measured_at: Instant,
        measurement: &AbsoluteMeasurement,
        fix: &AbsoluteFix,
        recorder: &mut impl Recorder,
    ) {
        recorder.absolute(|| observe::absolute_record(measured_at, measurement, fix));
        self.result.absolute.count(fix);
        if fix.is_used() {
            self.bound.measured(measurement);
        }
        if let AbsoluteFix::Accepted(agreement) = fix {
            self.nis.add_vector(agreement.nis.into(), agreement.dimensions);
        }
    }

    /// Counts a heading or position from outside that the loop has refused.
    pub fn refused_absolute(&mut self) {
        self.result.absolute.refused += 1;
    }

    /// Adds faults that the loop reported.
    pub fn faults(&mut self, more: Faults) {
        self.result.faults = self.result.faults.plus(more);
    }

    /// Records the start of the localizer.
    pub fn started(&self, localizer: &Localizer, plant: &Plant, recorder: &mut impl Recorder) {
        recorder.started(|| self.record(self.last_tick, localizer, plant));
    }

    fn record(&self, time: f64, localizer: &Localizer, plant: &Plant) -> Tick {
        Tick {
            time,
            truth: Some(Truth { gyro_bias: self.gyro_bias, ..plant.truth() }),
            estimate: observe::estimate(localizer),
            bound: Some(self.bound.standard_deviations().into()),
            odometry: self.odometry.pose(),
        }
    }

    /// Adds an encoder tick.
    pub fn tick(
        &mut self,
        time: f64,
        localizer: &Localizer,
        plant: &Plant,
        recorder: &mut impl Recorder,
    ) {
        self.result.error = observe::error(localizer.filter(), &plant.state());
        self.result.path.add(&self.result.error);
        let covariance = observe::position_covariance(localizer.filter());
        let health = localizer.health();
        let verdict = health.verdict;
        let without_range = seconds(health.time_since_fix.to_micros());
        let without_odometry = time - seconds(localizer.time().ticks());
        self.result.integrity.add_blindness(without_range.max(without_odometry), verdict);
        self.result.integrity.add(time - self.last_tick, &self.result.error, &covariance, verdict);
        self.last_tick = time;
        recorder.tick(|| self.record(time, localizer, plant));
    }

    /// The result, after the last tick.
    pub fn result(mut self, localizer: &Localizer) -> Result<RunResult, SimulationError> {
        let covariance = observe::covariance(localizer.filter());
        let (nees, estimated) =
            observe::nees(&self.result.error, &covariance).ok_or(SimulationError::Covariance)?;
        self.result.bound_variance = self.bound.variance();
        self.result.nees = nees;
        self.result.estimated_states = estimated;
        self.result.nis = self.nis;
        self.result.set_lost(localizer.health().verdict);
        Ok(self.result)
    }
}
