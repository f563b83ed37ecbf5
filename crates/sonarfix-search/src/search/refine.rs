//! Gauss–Newton refinement of a placement: position, rotation and bend of the odometry from the
//! residuals of all pings that a reflector of the map explains.

use super::candidates::Placement;
use super::score::Target;
use super::window::{Bend, Chain, Ping};
use sonarfix::association::reflector::Beam;
use sonarfix::geometry::vector::Vector;

/// Longest step that is taken, metres and radians: beyond it the linearization is invalid.
const LONGEST_STEP: f32 = 0.6;
const WIDEST_TURN: f32 = 0.35;
/// Damping: the step is expected within these deviations, metres and radians.
const POSITION: f32 = 0.5;
const ROTATION: f32 = 0.3;

/// Parameters: x, y, rotation, drift, turn scale.
const PARAMETERS: usize = 5;

/// Normal equations of the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Equations {
    rows: [[f32; PARAMETERS]; PARAMETERS],
    right: [f32; PARAMETERS],
    pub count: u16,
}

/// What is expected of the odometry: prior deviations of a [`Bend`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    /// Radians per metre.
    pub drift: f32,
    pub turn_scale: f32,
}

impl Prior {
    // ===== Eq. (34): w_κ and w_τ =====
    /// Inverse variances for a bend: the larger it is, the less its prior tells, because wheels may be wrong by more than the robot file
    /// says.
    fn weights(self, bend: Bend) -> Bend {
        let weight = |deviation: f32, of: f32| 1.0 / (deviation * deviation + 2.0 * of * of);
        Bend {
            drift: weight(self.drift, bend.drift),
            turn_scale: weight(self.turn_scale, bend.turn_scale),
        }
    }
}

/// Variances of a placement, square metres and square radians.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spread {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub rotation: f32,
}

/// What a residual is weighted by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tolerance {
    /// Deviation of a range, metres.
    pub deviation: f32,
    /// Inverse of the deviation of the angle between a beam and what answers.
    pub by_beam: f32,
}

/// A ping placed on the map, with the derivatives of its place by the parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub beam: Beam,
    /// From the reference to the sonar.
    arm: Vector,
    by_drift: Vector,
    by_turn_scale: Vector,
    /// Derivatives of the beam's direction.
    travelled: f32,
    turned: f32,
}

impl Placed {
    /// Places the last ping of a chain that began at the reference.
    pub fn new(ping: &Ping, placement: &Placement, chain: &Chain) -> Self {
        let link = chain.last();
        let to_map = |vector: Vector| vector.turned(placement.rotation);
        let arm = to_map(chain.sonar(link));
        let from = placement.at.plus(arm);
        let axis = to_map(ping.axis.turned(link.bent));
        Self {
            beam: Beam { from, axis, range: ping.range() },
            arm,
            by_drift: to_map(chain.by_drift),
            by_turn_scale: to_map(chain.by_turn_scale),
            travelled: ping.station.travelled,
            turned: ping.station.turned,
        }
    }
}

impl Placed {
    /// The same with the derivatives of the point that a beam of light has met: it turns with the beam.
    #[inline(never)]
    pub fn at_its_point(self) -> Self {
        let ahead = self.beam.axis.times(self.beam.range.unwrap_or(0.0));
        Self {
            arm: self.arm.plus(ahead),
            by_drift: self.by_drift.plus(ahead.left().times(self.travelled)),
            by_turn_scale: self.by_turn_scale.plus(ahead.left().times(self.turned)),
            ..self
        }
    }
}

impl Equations {
    // ===== Eq. (34): rows of the least squares =====
    /// Adds the two rows of a ping.
    pub fn add(&mut self, placed: &Placed, target: &Target, by: Tolerance) {
        let toward = target.toward;
        let by_turn = toward.dot(placed.arm.left());
        let h = [
            toward.x,
            toward.y,
            by_turn,
            toward.dot(placed.by_drift),
            toward.dot(placed.by_turn_scale),
        ];
        // Of Cauchy's robust weight.
        let ratio = target.residual / by.deviation;
        let weight = 1.0 / (by.deviation * by.deviation * (1.0 + 0.5 * ratio * ratio));
        self.add_row(h, -target.residual, weight);
        // Beams are square to what answers, on the mean.
        let aside = by.by_beam * target.off_axis;
        let weight = by.by_beam * by.by_beam / (1.0 + 0.3 * aside * aside);
        self.add_turn([1.0, placed.travelled, placed.turned], target.off_axis, weight);
        self.count += 1;
    }

    fn add_row(&mut self, h: [f32; PARAMETERS], value: f32, weight: f32) {
        for ((row, right), hi) in self.rows.iter_mut().zip(&mut self.right).zip(h) {
            let weighted = weight * hi;
            for (cell, hj) in row.iter_mut().zip(h) {
                *cell += weighted * hj;
            }
            *right += weighted * value;
        }
    }

    /// Adds a row that does not depend on the position.
    fn add_turn(&mut self, h: [f32; PARAMETERS - 2], value: f32, weight: f32) {
        let [.., a, b, c] = &mut self.rows;
        let [.., d, e, f] = &mut self.right;
        for ((row, right), hi) in [(a, d), (b, e), (c, f)].into_iter().zip(h) {
            let weighted = weight * hi;
            let [.., a, b, c] = row;
            for (cell, hj) in [a, b, c].into_iter().zip(h) {
                *cell += weighted * hj;
            }
            *right += weighted * value;
        }
    }

    // ===== Eq. (34): Δ =====
    /// The placement after a step, shortened if it leads too far.
    pub fn step(&self, placement: &Placement, prior: Prior) -> Option<Placement> {
        let by_prior = prior.weights(placement.bend);
        let position = 1.0 / (POSITION * POSITION);
        let damping =
            [position, position, 1.0 / (ROTATION * ROTATION), by_prior.drift, by_prior.turn_scale];
        let mut right = self.right;
        let [.., by_drift, by_turn_scale] = &mut right;
        *by_drift -= by_prior.drift * placement.bend.drift;
        *by_turn_scale -= by_prior.turn_scale * placement.bend.turn_scale;
        let mut columns = [right];
        self.solve(damping, &mut columns)?;
        let [[dx, dy, turn, drift, turn_scale]] = columns;
        let moved = libm::sqrtf(dx * dx + dy * dy);
        let turned = turn.abs() / WIDEST_TURN;
        let excess = if moved > turned * LONGEST_STEP { moved / LONGEST_STEP } else { turned };
        let share = if excess > 1.0 { 1.0 / excess } else { 1.0 };
        let rotation = placement.rotation.turned(Vector::of_angle(share * turn));
        let norm = 1.0 / libm::sqrtf(rotation.length_squared());
        Some(Placement {
            at: placement.at.plus(Vector::new(share * dx, share * dy)),
            rotation: rotation.times(norm),
            bend: Bend {
                drift: placement.bend.drift + share * drift,
                turn_scale: placement.bend.turn_scale + share * turn_scale,
            },
        })
    }

    /// The inverse of the information, with a prior of 10 m and π.
    pub fn spread(&self, prior: Prior) -> Spread {
        let by_prior = prior.weights(Bend::NONE);
        let diagonal = [0.01, 0.01, 0.1, by_prior.drift, by_prior.turn_scale];
        let mut columns =
            [[1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]];
        if self.solve(diagonal, &mut columns).is_none() {
            return Spread { xx: 100.0, xy: 0.0, yy: 100.0, rotation: 10.0 };
        }
        let [[xx, xy, ..], [_, yy, ..], [_, _, rotation, ..]] = columns;
        Spread { xx, xy, yy, rotation }
    }

    /// Elimination without pivoting: the matrix is positive definite by its diagonal. Columns of right sides become their solutions.
    #[inline(never)]
    fn solve(&self, diagonal: [f32; PARAMETERS], columns: &mut [[f32; PARAMETERS]]) -> Option<()> {
        let mut rows = self.rows;
        for (k, add) in diagonal.into_iter().enumerate() {
            *rows.get_mut(k)?.get_mut(k)? += add;
        }
        for k in 0..PARAMETERS {
            let (done, below) = rows.split_at_mut_checked(k + 1)?;
            let by = done.get(k)?;
            for (i, row) in (k + 1..).zip(below) {
                let factor = row.get(k)? / by.get(k)?;
                for (cell, by) in row.iter_mut().zip(by) {
                    *cell -= factor * by;
                }
                for column in columns.iter_mut() {
                    let by = *column.get(k)?;
                    *column.get_mut(i)? -= factor * by;
                }
            }
        }
        for column in columns {
            for k in (0..PARAMETERS).rev() {
                let row = rows.get(k)?;
                let (known, solved) = column.split_at_mut_checked(k + 1)?;
                let value = known.last_mut()?;
                for (cell, other) in row.iter().skip(k + 1).zip(solved).rev() {
                    *value -= cell * *other;
                }
                *value /= row.get(k)?;
                value.is_finite().then_some(())?;
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests;
