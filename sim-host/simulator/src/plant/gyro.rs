//! A gyro: the true turn with scale error, bias and noise.

use rand_chacha::ChaCha8Rng;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_map::GyroTruth;

use crate::random;

/// A gyro with its errors. Noise and random walk of the bias are those that the robot assumes.
#[derive(Debug, Clone)]
pub struct Gyro {
    /// rad/s.
    bias: f64,
    scale: f64,
    /// rad/√s.
    noise: f64,
    /// rad/s/√s.
    bias_walk: f64,
}

impl Gyro {
    /// A gyro with these true parameters; the bias is drawn if it has none.
    #[must_use]
    pub fn new(truth: &GyroTruth, assumed: &GyroParameters, rng: &mut ChaCha8Rng) -> Self {
        let drawn = f64::from(assumed.bias.0) * random::normal(rng);
        Self {
            bias: truth.bias.unwrap_or(drawn),
            scale: truth.scale,
            noise: assumed.noise.0.0.into(),
            bias_walk: assumed.bias_walk.0.0.into(),
        }
    }

    /// The integral of the rate over a turn, radians, in a time, seconds.
    pub fn integral(&mut self, turn: f64, seconds: f64, rng: &mut ChaCha8Rng) -> f64 {
        let root = seconds.sqrt();
        let white = self.noise * root * random::normal(rng);
        let measured = turn * (1.0 + self.scale) + self.bias * seconds + white;
        self.bias += self.bias_walk * root * random::normal(rng);
        measured
    }

    /// The bias now, rad/s.
    #[must_use]
    pub fn bias(&self) -> f64 {
        self.bias
    }
}
