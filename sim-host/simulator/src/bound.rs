//! The posterior Cramér–Rao bound of a run: the least error of any unbiased estimator, given the
//! motion and the measurements of the run (`docs/model.md`, "The bound").
//!
//! It is the filter's covariance recursion, evaluated at the true states with the noise of the simulation. The RMS error of an
//! efficient filter that knows this noise equals it.

use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};

use crate::dense::{DenseFilter, Line, Matrix, Model, Vector};
use crate::dense_gyro::{DenseGyroFilter, GyroModel};
use crate::world::sensor::SensorModel;

/// The noise of the wheels and of a ranger: of the simulation, or as the filter assumes it. Slips, bumps, outliers, missed cycles and the
/// resolution of a sensor are left out: they take information away, so that the bound without them is below the bound with them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a wheel's travel, m/√m.
    pub wheel_noise: f64,
    /// Random walk of a wheel's scale error, 1/√m.
    pub scale_walk: f64,
    /// Random walk of the track width, m/√m.
    pub track_width_walk: f64,
    /// Of a range, at range zero, metres.
    pub range_noise: f64,
    /// Of a range, per metre.
    pub range_noise_per_metre: f64,
    /// Of the direction of the beam of a time-of-flight ranger, radians.
    pub pointing: Option<f64>,
}

impl Noise {
    /// The least noise of a range, metres: without any the covariance becomes singular.
    const LEAST: f64 = 1e-6;
    /// Relative difference of two noises that is rounding.
    const ROUNDING: f64 = 1e-5;

    /// The noise of a simulation.
    #[must_use]
    pub fn simulated(truth: &sonarfix_map::Truth, sensor: &SensorModel) -> Self {
        Self {
            wheel_noise: truth.wheel_noise,
            scale_walk: truth.scale_walk,
            track_width_walk: truth.track_width_walk,
            range_noise: sensor.noise.max(Self::LEAST),
            range_noise_per_metre: sensor.noise_per_metre,
            pointing: sensor.light.map(|light| light.pointing),
        }
    }

    /// The noise that a filter's model assumes.
    #[must_use]
    pub fn assumed(model: &Model) -> Self {
        Self {
            wheel_noise: model.wheel_variance.sqrt(),
            scale_walk: model.scale_variance.sqrt(),
            track_width_walk: model.width_variance.sqrt(),
            range_noise: model.noise_floor,
            range_noise_per_metre: model.noise_per_metre,
            pointing: model.pointing,
        }
    }

    /// A model with this noise.
    #[must_use]
    pub fn of(&self, model: Model) -> Model {
        Model {
            wheel_variance: self.wheel_noise.powi(2),
            scale_variance: self.scale_walk.powi(2),
            width_variance: self.track_width_walk.powi(2),
            noise_floor: self.range_noise,
            noise_per_metre: self.range_noise_per_metre,
            pointing: self.pointing,
            ..model
        }
    }

    /// Whether two noises are the same but for the rounding of single precision.
    #[must_use]
    pub fn is_close_to(&self, other: &Self) -> bool {
        let numbers = |noise: &Self| {
            let of_wheels = [noise.wheel_noise, noise.scale_walk, noise.track_width_walk];
            let pointing = noise.pointing.unwrap_or(0.0);
            let of_ranger = [noise.range_noise, noise.range_noise_per_metre, pointing];
            of_wheels.into_iter().chain(of_ranger)
        };
        numbers(self)
            .zip(numbers(other))
            .all(|(one, other)| (one - other).abs() <= Self::ROUNDING * one.abs().max(other.abs()))
    }
}

/// The bound of a run in progress.
#[derive(Debug, Clone)]
pub struct Bound {
    filter: DenseFilter,
    /// The same with a gyro, if the robot has one.
    with_gyro: Option<DenseGyroFilter>,
}

impl Bound {
    /// The bound at the true start, with the covariance of the filter's initial estimate.
    #[must_use]
    pub fn new(model: Model, gyro: Option<GyroModel>, truth: Vector, p: Matrix) -> Self {
        let filter = DenseFilter { model, x: truth, p };
        let with_gyro = gyro.map(|gyro| DenseGyroFilter::new(&filter, gyro));
        Self { filter, with_gyro }
    }

    /// Predicts over a motion in a time, seconds; `travel` is the noiseless encoder reading, `truth` the state after it.
    pub fn moved(&mut self, travel: [f64; 2], seconds: f64, truth: Vector) {
        match &mut self.with_gyro {
            None => self.filter.propagate(travel),
            Some(aided) => {
                aided.x = self.filter.x;
                aided.propagate(travel, seconds);
                self.filter.p = aided.covariance();
            }
        }
        self.filter.x = truth;
    }

    /// Sets the model of the ranger that measures next.
    pub fn measures_by(&mut self, model: Model) {
        self.filter.model = model;
        if let Some(aided) = &mut self.with_gyro {
            aided.set_model(model);
        }
    }

    /// Updates with a range to a wall, by a ping at a bearing, at the current state.
    pub fn fixed(&mut self, line: &Line, bearing: f64) {
        let truth = self.filter.x;
        if let Some(aided) = &mut self.with_gyro {
            aided.x = truth;
            aided.correct(line, bearing);
            self.filter.p = aided.covariance();
            return;
        }
        // The innovation is zero: only the covariance changes.
        let (range, ..) = self.filter.model.measured(&truth, line, bearing);
        self.filter.correct_at(line, bearing, range);
        self.filter.x = truth;
    }

    /// Updates with a heading, position or pose at the current state; its components have independent noise.
    pub fn measured(&mut self, measurement: &AbsoluteMeasurement) {
        match *measurement {
            AbsoluteMeasurement::Heading { deviation, .. } => {
                self.correct_state(2, f64::from(deviation.0).powi(2));
            }
            AbsoluteMeasurement::Position { noise, .. } => self.correct_position(&noise),
            AbsoluteMeasurement::Pose { noise, .. } => {
                self.correct_position(&noise.position);
                self.correct_state(2, noise.hh.into());
            }
        }
    }

    fn correct_position(&mut self, noise: &PositionNoise) {
        self.correct_state(0, noise.xx.into());
        self.correct_state(1, noise.yy.into());
    }

    fn correct_state(&mut self, state: usize, noise: f64) {
        match &mut self.with_gyro {
            None => self.filter.correct_state(state, noise),
            Some(aided) => {
                aided.correct_state(state, noise);
                self.filter.p = aided.covariance();
            }
        }
    }

    /// The bound on each state's standard deviation.
    #[must_use]
    pub fn standard_deviations(&self) -> Vector {
        self.filter.standard_deviations()
    }

    /// The bound on each state's variance.
    #[must_use]
    pub fn variance(&self) -> Vector {
        self.filter.p.diagonal()
    }
}
