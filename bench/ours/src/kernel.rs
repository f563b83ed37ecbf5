//! The parts of the kernel that correspond to the peers' work: six states, with sine, cosine and Q as arguments.
//!
//! Compared with the shipped filter, they lack the noise of each wheel, sine and cosine, the range scale's row in a
//! prediction, and the checks of the input. Compared with a peer, they do more: the correction is that of seven states,
//! since none for six exists; sums are compensated (Kahan); Q is the noise of advance and turn, not a diagonal.

use bench_workload::Filter;
use bench_workload::model::{Matrix, Range, Step, Vector};
use sonarfix::kernel::{
    AccumulatedRandomWalk, Correction, Covariance, FilterEstimate, LinearizedMotion,
    NoiseDensities, ProcessNoise, RoundingNoise,
};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Heading;
use sonarfix::range::ExpectedRange;
use sonarfix::units::Metres;

use crate::{deviation, drive, scales, shown};

/// The filter.
pub struct Kernel {
    track_width: f32,
    estimate: FilterEstimate,
    p: Covariance,
    /// Q, the same for every prediction.
    noise: ProcessNoise,
    rounding: RoundingNoise,
    walk: AccumulatedRandomWalk,
}

impl Filter for Kernel {
    fn new(state: Vector, variances: Vector) -> Self {
        let drive = drive();
        let track_width = drive.track_width.0;
        let densities = NoiseDensities::new(&drive);
        let estimate = FilterEstimate::new(&shown(state));
        let p = Covariance::independent(&deviation(variances));
        let usual = WheelTravel::new(0.04, 0.038);
        let motion = LinearizedMotion::new(track_width, &estimate, usual, |_| (0.0, 1.0));
        let noise = ProcessNoise::new(&densities, &motion, usual);
        let rounding = p.pose.rounding_noise(&noise);
        let walk = AccumulatedRandomWalk::new(&densities, 0.0);
        Self { track_width, estimate, p, noise, rounding, walk }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let travel = WheelTravel::new(step.right, step.left);
        let sin_cos = |_| (step.sin, step.cos);
        let motion = LinearizedMotion::new(self.track_width, &self.estimate, travel, sin_cos);
        let Covariance { pose, calibration, .. } = &mut self.p;
        pose.propagate(calibration, &motion, &self.noise, &self.rounding, &self.walk);
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

    /// The scale errors per wheel, as in the crate's public state.
    fn covariance(&self) -> Matrix {
        let p = self.p.to_matrix();
        core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]))
    }
}
