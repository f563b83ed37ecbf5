//! The random streams of a run.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The random streams of a run. Each source of randomness has a stream of its own, so that two
/// policies with the same seed see the same wheel errors.
pub struct RandomStreams {
    /// Error of the initial estimate.
    pub start: ChaCha8Rng,
    /// Wheel noise.
    pub wheels: ChaCha8Rng,
    /// Range noise.
    pub ranges: ChaCha8Rng,
    /// Detection, outliers and other properties of an echo.
    pub echoes: ChaCha8Rng,
    /// Slips of a wheel that turn the odometry.
    pub slips: ChaCha8Rng,
    /// Bias and noise of the gyro.
    pub gyro: ChaCha8Rng,
    /// Noise and outliers of headings and positions from outside.
    pub absolute: ChaCha8Rng,
}

impl RandomStreams {
    /// The streams of a seed.
    pub fn new(seed: u64) -> Self {
        let stream = |n| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(n);
            rng
        };
        Self {
            start: stream(0),
            wheels: stream(1),
            ranges: stream(2),
            echoes: stream(3),
            slips: stream(4),
            gyro: stream(5),
            absolute: stream(6),
        }
    }
}
