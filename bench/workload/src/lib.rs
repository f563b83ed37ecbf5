//! The same work, done by the filters that would be picked instead of Sonarfix's: a robot with two
//! wheels and a sonar, six states in `f32`.
//!
//! - [`model`]: the state, how a step of the wheels moves it, and what a range says of it.
//! - [`drive`]: the drive that every filter is taken on.
//! - [`filters`]: the peers, one file each. Ours is in `bench-ours`.
//!
//! A test of `bench-host` holds every filter against an `f64` one, so that none does less work than
//! another.

#![no_std]

pub mod drive;
pub mod filters;
pub mod model;

use model::{Matrix, STATES, Vector};

/// A filter at work.
pub trait Filter {
    /// A filter at a state, with independent errors of these variances.
    fn new(state: Vector, variances: Vector) -> Self;

    /// State, Jacobian, P and diagonal Q over one step of the wheels.
    fn predict(&mut self, step: &model::Step);

    /// State and P after one range.
    fn update(&mut self, range: &model::Range);

    /// The estimate.
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
