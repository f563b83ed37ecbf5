//! The parts of the kernel that correspond to the peers' work: six states, with sine, cosine and Q as arguments.
//!
//! Compared with the shipped filter, they lack sine and cosine, the range scale's row of a prediction, and the checks of the
//! input. Compared with a peer, they do more: the correction is that of seven states, since none for six exists; sums are
//! compensated (Kahan); Q is the noise of advance and turn, not a diagonal.

use bench_workload::Filter;
use bench_workload::drive::START;
use bench_workload::model::{Matrix, Range, Step, Vector};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::Heading;
use sonarfix::geometry::units::Metres;
use sonarfix::kernel::{
    AccumulatedRandomWalk, Correction, Covariance, FilterEstimate, LinearizedMotion,
    NoiseDensities, ProcessNoise, Transition,
};
use sonarfix::sensor::range::ExpectedRange;

use crate::{deviation, drive, scales, scales_of, shown};

/// The travel of which Q is the noise, in every step.
const USUAL: WheelTravel = WheelTravel::new(0.04, 0.038);

/// The filter.
pub struct Kernel {
    track_width: f32,
    estimate: FilterEstimate,
    p: Covariance,
    /// Q, the same for every prediction.
    noise: ProcessNoise,
    walk: AccumulatedRandomWalk,
}

impl Kernel {
    /// Q: the variance of the turn by the noise of the right and of the left wheel in a step, rad².
    #[must_use]
    pub fn noise_of_turn() -> [f32; 2] {
        let Drive { track_width, wheel_noise, .. } = drive();
        let state = shown(START);
        let width = track_width.0 + state.track_width_error.0;
        let of = |travel: f32, scale: f32| {
            let true_travel = (1.0 + scale) / width;
            wheel_noise.0.0 * wheel_noise.0.0 * travel * true_travel * true_travel
        };
        [of(USUAL.right.0, state.scale_right), of(USUAL.left.0, state.scale_left)]
    }
}

impl Filter for Kernel {
    fn new(state: Vector, variances: Vector) -> Self {
        let drive = drive();
        let track_width = drive.track_width.0;
        let densities = NoiseDensities::new(&drive);
        let estimate = FilterEstimate::new(&shown(state));
        let p = Covariance::independent(&deviation(variances));
        let motion = LinearizedMotion::new(track_width, &estimate, USUAL, |_| (0.0, 1.0));
        let noise = ProcessNoise::new(&densities, &motion, USUAL);
        let walk = AccumulatedRandomWalk::new(&densities, 0.0);
        Self { track_width, estimate, p, noise, walk }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let travel = WheelTravel::new(step.right, step.left);
        let sin_cos = |_| (step.sin, step.cos);
        let motion = LinearizedMotion::new(self.track_width, &self.estimate, travel, sin_cos);
        let f = Transition::new(&motion, &self.noise);
        self.p.pose = self.p.pose.propagated(&self.p.calibration, &self.walk, &f);
        motion.advance(&mut self.estimate);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let at = self.estimate.state();
        let expected = range.expected(at.x.0, at.y.0);
        let innovation = range.measured - expected;
        let expected = ExpectedRange {
            range: Metres(expected),
            by_x: range.by_x,
            by_y: range.by_y,
            by_heading: 0.0,
            by_range_scale: 0.0,
            direction: Heading::default(),
        };
        let prediction = self.p.project(&expected);
        if let Correction::Applied(gain) = self.p.correct(&prediction, range.variance) {
            gain.correct(&mut self.estimate, innovation);
        }
    }

    fn state(&self) -> Vector {
        scales(&self.estimate.state())
    }

    fn covariance(&self) -> Matrix {
        let p = self.p.to_matrix();
        scales_of(|i, j| p[(i, j)])
    }
}
