//! The parts of the kernel that do the peers' work: six states, sine and cosine passed in, Q given.
//!
//! What they lack of the filter that ships: its noise of each wheel, sine and cosine, the range
//! scale's row in a prediction, and the checks that refuse bad input. What they do more than a peer:
//! the correction is the seven-state one, of which there is no copy for six; sums are compensated
//! (Kahan); Q is the noise of advance and turn, not a diagonal.

use bench_workload::Filter;
use bench_workload::model::{Matrix, Range, Step, Vector};
use sonarfix::kernel::{self, Correction, Covariance, Derivatives, Mean, Noise, Rates, Remainder};
use sonarfix::motion::WheelTravel;

use crate::{deviation, drive, scales, shown};

/// The filter.
pub struct Kernel {
    rates: Rates,
    mean: Mean,
    rest: Remainder,
    p: Covariance,
    /// Q, the same for every step.
    noise: Noise,
}

impl Filter for Kernel {
    fn new(state: Vector, variances: Vector) -> Self {
        let rates = Rates::new(&drive());
        let mean = Mean::new(&shown(state));
        let p = Covariance::independent(&deviation(variances));
        let usual = WheelTravel::new(0.04, 0.038);
        let noise = Noise::new(&rates, &mean, usual, 0.0, &p.six.pose);
        Self { rates, mean, rest: Remainder::default(), p, noise }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let travel = WheelTravel::new(step.right, step.left);
        let step = kernel::Step::new(&self.rates, &self.mean, travel, |_| (step.sin, step.cos));
        self.p.six.propagate(&step, &self.noise);
        self.mean.advance(&mut self.rest, &step);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let at = self.mean.state();
        let innovation = range.measured - range.expected(at.x, at.y);
        let h = Derivatives { x: range.by_x, y: range.by_y, h: 0.0, k: 0.0 };
        if let Correction::Taken(gain) = self.p.correct(&h, range.variance) {
            self.mean.take(&mut self.rest, &gain, innovation);
        }
    }

    fn state(&self) -> Vector {
        scales(&self.mean.state())
    }

    /// The scale errors wheel by wheel, as the crate shows them.
    fn covariance(&self) -> Matrix {
        let p = self.p.to_matrix();
        core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]))
    }
}
