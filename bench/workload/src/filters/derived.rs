//! Code generated from the equations, as symforce and similar tools do it; [`code`] is the output of `generate/generate.py`.
//!
//! P is its upper triangle.

#[rustfmt::skip]
mod code;

use crate::Filter;
use crate::model::{Matrix, Range, STATES, Step, Vector};

use code::Triangle;

/// P ← P − K H P.
pub type Plain = Derived<false>;
/// Joseph's form.
pub type Stabilised = Derived<true>;

/// The filter.
pub struct Derived<const STABILISED: bool> {
    state: Vector,
    p: Triangle,
}

impl<const STABILISED: bool> Filter for Derived<STABILISED> {
    fn new(state: Vector, variances: Vector) -> Self {
        let mut p = [0.0; 21];
        for (i, variance) in variances.into_iter().enumerate() {
            p[place(i, i)] = variance;
        }
        Self { state, p }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        code::predict(&mut self.state, &mut self.p, step);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        if STABILISED {
            code::update_stabilised(&mut self.state, &mut self.p, range);
        } else {
            code::update(&mut self.state, &mut self.p, range);
        }
    }

    fn state(&self) -> Vector {
        self.state
    }

    fn covariance(&self) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| self.p[place(i.min(j), i.max(j))]))
    }
}

/// The place of an entry of the upper triangle, row by row.
fn place(row: usize, column: usize) -> usize {
    row * (2 * STATES + 1 - row) / 2 + column - row
}
