//! The robot that is really there: it follows its path exactly, and its encoders carry the errors.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sonarfix_map::{Path, Truth as TrueParameters};

use crate::dense::Vector;
use crate::trace::{Calibration, Pose, Truth};

/// What the wheels did between two instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// What the encoders read, right and left, metres.
    pub measured: [f64; 2],
    /// What they would have read without noise.
    pub noiseless: [f64; 2],
}

/// The true robot on its path.
#[derive(Debug, Clone)]
pub struct Plant<'a> {
    path: &'a Path,
    parameters: TrueParameters,
    nominal_track_width: f64,
    /// Seconds since the run began.
    time: f64,
}

impl<'a> Plant<'a> {
    /// The robot at the start of its path.
    #[must_use]
    pub fn new(path: &'a Path, parameters: &TrueParameters, nominal_track_width: f64) -> Self {
        Self { path, parameters: *parameters, nominal_track_width, time: 0.0 }
    }

    /// Drives on to `time` seconds and reads the encoders.
    pub fn drive_to(&mut self, time: f64, rng: &mut ChaCha8Rng) -> Travel {
        let p = &self.parameters;
        let mut rolled = [0.0, 0.0];
        for piece in self.path.motion_between(self.time, time) {
            let half_turn = 0.5 * p.track_width * piece.turn;
            rolled[0] += piece.advance + half_turn;
            rolled[1] += piece.advance - half_turn;
        }
        let noiseless = [rolled[0] / (1.0 + p.scale_right), rolled[1] / (1.0 + p.scale_left)];
        let measured = noiseless.map(|travel| {
            travel + p.wheel_noise * travel.abs().sqrt() * rng.sample::<f64, _>(StandardNormal)
        });
        let root_distance = (0.5 * (noiseless[0].abs() + noiseless[1].abs())).sqrt();
        self.let_parameters_walk(root_distance, rng);
        self.time = time;
        Travel { measured, noiseless }
    }

    fn let_parameters_walk(&mut self, root_distance: f64, rng: &mut ChaCha8Rng) {
        let p = &mut self.parameters;
        // No draw where nothing walks: a constant robot's noise does not depend on this.
        if p.scale_walk > 0.0 {
            p.scale_right += p.scale_walk * root_distance * rng.sample::<f64, _>(StandardNormal);
            p.scale_left += p.scale_walk * root_distance * rng.sample::<f64, _>(StandardNormal);
        }
        if p.track_width_walk > 0.0 {
            let step: f64 = rng.sample(StandardNormal);
            p.track_width += p.track_width_walk * root_distance * step;
        }
    }

    /// The truth now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let pose = self.path.pose_at(self.time);
        let p = &self.parameters;
        let calibration = Calibration {
            scale_right: p.scale_right,
            scale_left: p.scale_left,
            track_width: p.track_width,
            range_scale: p.range_scale,
        };
        let pose = Pose { x: pose.x, y: pose.y, heading: pose.heading };
        Truth { pose, calibration: Some(calibration) }
    }

    /// The truth now, as the states of the filter.
    #[must_use]
    pub fn state(&self) -> Vector {
        let pose = self.path.pose_at(self.time);
        let p = &self.parameters;
        let width_error = p.track_width - self.nominal_track_width;
        Vector::from([
            pose.x,
            pose.y,
            pose.heading,
            p.scale_right,
            p.scale_left,
            width_error,
            p.range_scale,
        ])
    }
}
