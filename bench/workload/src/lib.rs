//! One task for several filter libraries: a robot with two wheels and a sonar, six states in `f32`.
//!
//! - [`model`]: the state, its motion by wheel travel, and the expected range.
//! - [`drive`]: the drive of every filter.
//! - [`filters`]: the peers, one file each. Sonarfix is in `bench-ours`.
//!
//! A test of `bench-host` compares every filter with one in `f64`, so that all do the same work.

#![no_std]

pub mod drive;
pub mod filters;
pub mod model;

use model::{Matrix, STATES, Vector};

/// A filter.
pub trait Filter {
    /// A filter at a state, with independent errors of these variances.
    fn new(state: Vector, variances: Vector) -> Self;

    /// Predicts over one wheel travel: state, Jacobian, P and diagonal Q.
    fn predict(&mut self, step: &model::Step);

    /// Updates state and P by one range.
    fn update(&mut self, range: &model::Range);

    /// The state estimate.
    fn state(&self) -> Vector;

    /// The covariance.
    fn covariance(&self) -> Matrix;
}

/// A diagonal matrix.
#[must_use]
pub fn diagonal(entries: &Vector) -> Matrix {
    let mut matrix = [[0.0; STATES]; STATES];
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] = entries[i];
    }
    matrix
}
