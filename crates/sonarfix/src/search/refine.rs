//! Gauss–Newton refinement of a placement: position, rotation and heading drift from the residuals
//! of all pings that a reflector of the map explains.

use super::candidates::Placement;
use super::score::{Beam, Target};
use super::vector::Vector;
use super::window::Ping;
use crate::trig::sin_cos;
use crate::units::Radians;

/// Longest step that is taken, metres and radians: beyond it the linearization is invalid.
const LONGEST_STEP: f32 = 0.6;
const WIDEST_TURN: f32 = 0.35;
/// Damping: the step is expected within these deviations, metres and radians.
const POSITION: f32 = 0.5;
const ROTATION: f32 = 0.3;

/// Symmetric normal equations of (x, y, rotation, drift), upper triangle by rows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Equations {
    rows: [[f32; 4]; 4],
    right: [f32; 4],
    pub count: u16,
}

/// Variances of a placement, square metres and square radians.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spread {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub rotation: f32,
}

/// What a residual is weighed by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tolerance {
    /// Deviation of a range, metres.
    pub deviation: f32,
    /// Deviation that a metre of odometry adds to a ping of long ago, apart from the estimated drift.
    pub odometry: f32,
    /// Inverse of the deviation of the angle between a beam and what answers.
    pub by_beam: f32,
}

/// A ping placed on the map.
pub(super) fn beam(ping: &Ping, placement: &Placement) -> Beam {
    let from = placement.to_map(ping.station.drifted(placement.drift));
    let (sin, cos) = sin_cos(Radians(placement.drift * ping.station.travelled));
    let axis = ping.axis.turned(Vector::new(cos, sin)).turned(placement.rotation);
    Beam { from, axis, range: ping.range() }
}

impl Equations {
    pub fn add(&mut self, ping: &Ping, placement: &Placement, target: &Target, by: Tolerance) {
        let arm = ping.station.drifted(placement.drift).turned(placement.rotation);
        let swept = ping.station.moment.turned(placement.rotation);
        let toward = target.toward;
        let h = [toward.x, toward.y, toward.dot(arm.left()), toward.dot(swept.left())];
        // Of Cauchy's robust weight.
        let ratio = target.residual / by.deviation;
        let odometry = by.odometry * ping.station.travelled;
        let variance = by.deviation * by.deviation + odometry * odometry;
        let weight = 1.0 / (variance * (1.0 + 0.5 * ratio * ratio));
        for ((row, right), hi) in self.rows.iter_mut().zip(&mut self.right).zip(h) {
            for (cell, hj) in row.iter_mut().zip(h) {
                *cell += weight * hi * hj;
            }
            *right -= weight * hi * target.residual;
        }
        // Beams are square to what answers, on the mean.
        let aside = by.by_beam * target.off_axis;
        let weight = by.by_beam * by.by_beam / (1.0 + 0.3 * aside * aside);
        let [_, _, [.., turn, _], _] = &mut self.rows;
        *turn += weight;
        let [_, _, turn, _] = &mut self.right;
        *turn += weight * target.off_axis;
        self.count += 1;
    }

    /// The placement after a step, shortened if it leads too far.
    pub fn step(&self, placement: &Placement, drift_deviation: f32) -> Option<Placement> {
        let drift_weight = 1.0 / (drift_deviation * drift_deviation);
        let damping = [
            1.0 / (POSITION * POSITION),
            1.0 / (POSITION * POSITION),
            1.0 / (ROTATION * ROTATION),
            drift_weight,
        ];
        let mut right = self.right;
        right[3] -= drift_weight * placement.drift;
        let [dx, dy, turn, drift] = self.solve(damping, right)?;
        let moved = libm::sqrtf(dx * dx + dy * dy);
        let turned = turn.abs() / WIDEST_TURN;
        let excess = if moved > turned * LONGEST_STEP { moved / LONGEST_STEP } else { turned };
        let share = if excess > 1.0 { 1.0 / excess } else { 1.0 };
        let [dx, dy, turn, drift] = [dx, dy, turn, drift].map(|step| share * step);
        let (sin, cos) = sin_cos(Radians(turn));
        let rotation = placement.rotation.turned(Vector::new(cos, sin));
        let norm = 1.0 / libm::sqrtf(rotation.length_squared());
        Some(Placement {
            at: placement.at.plus(Vector::new(dx, dy)),
            rotation: rotation.times(norm),
            drift: placement.drift + drift,
        })
    }

    /// The inverse of the information, with a prior of 10 m and π.
    pub fn spread(&self, drift_deviation: f32) -> Spread {
        let prior = [0.01, 0.01, 0.1, 1.0 / (drift_deviation * drift_deviation)];
        let by = |unit: [f32; 4]| self.solve(prior, unit).unwrap_or([100.0, 100.0, 10.0, 1.0]);
        let ([xx, xy, ..], [_, yy, ..]) = (by([1.0, 0.0, 0.0, 0.0]), by([0.0, 1.0, 0.0, 0.0]));
        let [.., rotation, _] = by([0.0, 0.0, 1.0, 0.0]);
        Spread { xx, xy, yy, rotation }
    }

    /// Elimination without pivoting: the matrix is positive definite by its diagonal.
    fn solve(&self, diagonal: [f32; 4], right: [f32; 4]) -> Option<[f32; 4]> {
        let [a, b, c, d] = self.rows;
        let mut p = [a[0] + diagonal[0], a[1], a[2], a[3], right[0]];
        let mut q = [b[0], b[1] + diagonal[1], b[2], b[3], right[1]];
        let mut r = [c[0], c[1], c[2] + diagonal[2], c[3], right[2]];
        let mut s = [d[0], d[1], d[2], d[3] + diagonal[3], right[3]];
        let eliminate = |row: &mut [f32; 5], factor: f32, by: &[f32; 5]| {
            for (cell, by) in row.iter_mut().zip(by) {
                *cell -= factor * by;
            }
        };
        for row in [&mut q, &mut r, &mut s] {
            let factor = row[0] / p[0];
            eliminate(row, factor, &p);
        }
        for row in [&mut r, &mut s] {
            let factor = row[1] / q[1];
            eliminate(row, factor, &q);
        }
        let factor = s[2] / r[2];
        eliminate(&mut s, factor, &r);
        let w = s[4] / s[3];
        let z = (r[4] - r[3] * w) / r[2];
        let y = (q[4] - q[3] * w - q[2] * z) / q[1];
        let x = (p[4] - p[3] * w - p[2] * z - p[1] * y) / p[0];
        p = [x, y, z, w, 0.0];
        p.iter().all(|value| value.is_finite()).then_some([x, y, z, w])
    }
}
