//! The form of the filter of the Crazyflie (`kalman_core.c`): dense matrices, multiplied and transposed by CMSIS-DSP.
//!
//! A predict is P ← F P Fᵀ + Q; an update is Joseph's form of one scalar. After both P is made symmetric and its entries are
//! limited, as there.

use bench_cmsis::{multiply, transpose};

use crate::model::{Matrix, Motion, Range, STATES, Step, Vector};
use crate::{Filter, diagonal};

/// Limits of an entry of P, and the least variance.
const MOST: f32 = 100.0;
const LEAST: f32 = 1e-12;

/// The filter.
pub struct Crazyflie {
    x: Vector,
    p: Matrix,
}

impl Filter for Crazyflie {
    fn new(state: Vector, variances: Vector) -> Self {
        Self { x: state, p: diagonal(&variances) }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let motion = Motion::new(&self.x, step);
        let f = motion.jacobian();
        self.x = motion.moved(&self.x);
        self.sandwich(&f);
        for (i, noise) in step.noise.into_iter().enumerate() {
            self.p[i][i] += noise;
        }
        self.limit();
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let h = [[range.by_x, range.by_y, 0.0, 0.0, 0.0, 0.0]];
        let innovation = range.measured - range.expected(self.x[0], self.x[1]);
        let mut column = [[0.0]; STATES];
        transpose(&h, &mut column);
        let mut m = [[0.0]; STATES];
        multiply(&self.p, &column, &mut m);
        let mut s = range.variance;
        for i in 0..STATES {
            s += h[0][i] * m[i][0];
        }
        let mut k = [[0.0]; STATES];
        for i in 0..STATES {
            k[i][0] = m[i][0] / s;
            self.x[i] += k[i][0] * innovation;
        }
        // K H − I, whose sign is squared.
        let mut rest = [[0.0; STATES]; STATES];
        multiply(&k, &h, &mut rest);
        for (i, row) in rest.iter_mut().enumerate() {
            row[i] -= 1.0;
        }
        self.sandwich(&rest);
        for i in 0..STATES {
            for j in 0..STATES {
                self.p[i][j] += k[i][0] * range.variance * k[j][0];
            }
        }
        self.limit();
    }

    fn state(&self) -> Vector {
        self.x
    }

    fn covariance(&self) -> Matrix {
        self.p
    }
}

impl Crazyflie {
    /// P ← A P Aᵀ.
    #[inline]
    fn sandwich(&mut self, a: &Matrix) {
        let (mut transposed, mut product) = ([[0.0; STATES]; STATES], [[0.0; STATES]; STATES]);
        multiply(a, &self.p, &mut product);
        transpose(a, &mut transposed);
        multiply(&product, &transposed, &mut self.p);
    }

    /// Makes P symmetric, and limits its entries.
    #[inline]
    fn limit(&mut self) {
        for i in 0..STATES {
            for j in i..STATES {
                let mean = 0.5 * self.p[i][j] + 0.5 * self.p[j][i];
                let entry = if mean.is_nan() || mean > MOST {
                    MOST
                } else if i == j && mean < LEAST {
                    LEAST
                } else {
                    mean
                };
                self.p[i][j] = entry;
                self.p[j][i] = entry;
            }
        }
    }
}
