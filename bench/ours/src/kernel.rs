//! The parts of the kernel that correspond to the peers' work: six states, with sine, cosine and Q as arguments.
//!
//! Compared with the shipped filter, they lack sine and cosine, the range scale's row of a motion that is applied to P, and the
//! checks of the input. Compared with a peer, they do more: the correction is that of seven states, since none for six exists;
//! Q is the noise of each wheel, not a diagonal. P is propagated when it is asked for: an update applies the motion first.

use bench_workload::Filter;
use bench_workload::drive::{START, VARIANCES};
use bench_workload::model::{Matrix, Range, Step, Vector};
use sonarfix::kernel::{
    AccumulatedMotion, AccumulatedRandomWalk, CalibratedDrive, Correction, Covariance,
    FilterEstimate, NoiseDensities, WheelNoise,
};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Heading;
use sonarfix::sensor::range::ExpectedRange;
use sonarfix::geometry::units::Metres;

use crate::{deviation, drive, scales, scales_of, shown};

/// The filter.
pub struct Kernel {
    track_width: f32,
    densities: NoiseDensities,
    /// At the start of the interval.
    estimate: FilterEstimate,
    p: Covariance,
    /// Since the start of the interval.
    motion: AccumulatedMotion,
    drive: CalibratedDrive,
    /// Q, the same for every prediction.
    noise: WheelNoise,
    walk: AccumulatedRandomWalk,
}

impl Kernel {
    /// Q: the variance of the turn by the noise of the right and of the left wheel in a step, rad².
    #[must_use]
    pub fn noise_of_turn() -> [f32; 2] {
        let Self { noise, .. } = Self::new(START, VARIANCES);
        [noise.right, noise.left]
    }
}

impl Filter for Kernel {
    fn new(state: Vector, variances: Vector) -> Self {
        let drive = drive();
        let track_width = drive.track_width.0;
        let densities = NoiseDensities::new(&drive);
        let estimate = FilterEstimate::new(&shown(state));
        let p = Covariance::independent(&deviation(variances));
        let drive = CalibratedDrive::new(track_width, &densities, &estimate);
        let noise = drive.noise(WheelTravel::new(0.04, 0.038));
        let walk = AccumulatedRandomWalk::new(&densities, 0.0);
        let motion = AccumulatedMotion::default();
        Self { track_width, densities, estimate, p, motion, drive, noise, walk }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let travel = WheelTravel::new(step.right, step.left);
        let sin_cos = |_| (step.sin, step.cos);
        self.motion.add(&self.drive, 0.0, travel, self.noise, sin_cos);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let f = self.motion.transition(&self.drive, &self.estimate);
        self.p.pose.propagate(&self.p.calibration, &self.walk, &f);
        self.motion.advance(&mut self.estimate);
        self.motion = AccumulatedMotion::default();
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
            self.drive = CalibratedDrive::new(self.track_width, &self.densities, &self.estimate);
        }
    }

    fn state(&self) -> Vector {
        let mut estimate = self.estimate;
        self.motion.advance(&mut estimate);
        scales(&estimate.state())
    }

    fn covariance(&self) -> Matrix {
        let f = self.motion.transition(&self.drive, &self.estimate);
        let mut p = self.p;
        p.pose.propagate(&self.p.calibration, &self.walk, &f);
        let p = p.to_matrix();
        scales_of(|i, j| p[(i, j)])
    }
}
