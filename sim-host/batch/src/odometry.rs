//! Wheel odometry between two instants, with its derivatives by the calibration and its covariance.

#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

use nalgebra::{Matrix3, Vector3};

/// Wheel travel of one encoder interval, right and left, metres by the nominal wheels.
pub type Travel = [f64; 2];

/// Share of the noise of a wheel's travel that the wheel beside it has: a wheel at rest is turned on its place, and slips. Without it
/// the noises of distance and turns would be one there, and their ratio known exactly.
const BESIDE: f64 = 0.05;

/// Relative errors of the nominal drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Nominal track width, metres.
    pub track_width: f64,
    /// Scale errors: the wheel rolls 1 + this times the nominal travel.
    pub right: f64,
    /// Of the left wheel.
    pub left: f64,
    /// The track width is 1 + this times the nominal one.
    pub track: f64,
}

/// Noise of the wheels' travel, metres per square root of a metre. Each part is the noise that two independent wheels have whose
/// distance, or whose turns, are as noisy; with independent wheels both are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelNoise {
    /// That of the distance: the mean of both wheels.
    pub distance: f64,
    /// That of the turns: the difference of both wheels.
    pub turn: f64,
}

impl WheelNoise {
    /// That of independent wheels.
    #[must_use]
    pub const fn independent(noise: f64) -> Self {
        Self { distance: noise, turn: noise }
    }
}

/// The covariance of a motion by the noise of a wheel: coefficients of the squares of both parts and of their product.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Parts {
    distance: Matrix3<f64>,
    turn: Matrix3<f64>,
    mixed: Matrix3<f64>,
}

impl Parts {
    fn none() -> Self {
        Self { distance: Matrix3::zeros(), turn: Matrix3::zeros(), mixed: Matrix3::zeros() }
    }

    fn covariance(&self, noise: WheelNoise) -> Matrix3<f64> {
        let WheelNoise { distance, turn } = noise;
        self.distance * distance.powi(2) + self.turn * turn.powi(2) + self.mixed * (distance * turn)
    }

    /// The derivative of the covariance by the logarithm of the track width: only turns depend on it.
    fn by_track(&self, noise: WheelNoise) -> Matrix3<f64> {
        let WheelNoise { distance, turn } = noise;
        self.turn * (-2.0 * turn.powi(2)) - self.mixed * (distance * turn)
    }

    /// After a step that carries the motion so far, with its derivatives by distance and turn of the wheel.
    fn after(&self, carry: &Matrix3<f64>, [by_distance, by_turn]: [Vector3<f64>; 2]) -> Self {
        let carried = |part: &Matrix3<f64>| carry * part * carry.transpose();
        let cross = by_distance * by_turn.transpose();
        Self {
            distance: carried(&self.distance) + by_distance * by_distance.transpose(),
            turn: carried(&self.turn) + by_turn * by_turn.transpose(),
            mixed: carried(&self.mixed) + cross + cross.transpose(),
        }
    }

    fn scaled(&self, by: f64) -> Self {
        Self { distance: self.distance * by, turn: self.turn * by, mixed: self.mixed * by }
    }
}

/// The covariance of a motion by the noise of both wheels, right and left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionNoise([Parts; 2]);

impl MotionNoise {
    /// The covariance with a noise of the wheels.
    #[must_use]
    pub fn covariance(&self, noise: WheelNoise) -> Matrix3<f64> {
        let [right, left] = &self.0;
        right.covariance(noise) + left.covariance(noise)
    }

    /// The derivatives of the covariance by the three relative errors (right, left, track).
    #[must_use]
    pub fn by_drive(&self, noise: WheelNoise, drive: &Drive) -> [Matrix3<f64>; 3] {
        let [right, left] = &self.0;
        [
            right.covariance(noise) * (2.0 / (1.0 + drive.right)),
            left.covariance(noise) * (2.0 / (1.0 + drive.left)),
            (right.by_track(noise) + left.by_track(noise)) / (1.0 + drive.track),
        ]
    }

    /// That of wheels which roll these multiples of the distances, right and left.
    #[must_use]
    pub fn scaled(&self, [by_right, by_left]: [f64; 2]) -> Self {
        let [right, left] = &self.0;
        Self([right.scaled(by_right), left.scaled(by_left)])
    }
}

/// The distances whose noise both wheels have, of distances that they roll.
#[must_use]
pub fn noisy_distances([right, left]: [f64; 2]) -> [f64; 2] {
    let of = |own: f64, other: f64| (own.abs() + BESIDE * other.abs()) / (1.0 + BESIDE);
    [of(right, left), of(left, right)]
}

/// The motion over some encoder intervals, in the frame of its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Position and heading at the end.
    pub pose: Vector3<f64>,
    /// Its derivatives by the three relative errors (right, left, track).
    pub by_drive: Matrix3<f64>,
    /// Its covariance.
    pub noise: MotionNoise,
}

/// The motion between two poses of a trajectory as a residual, with its information and its derivatives by both poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Relative pose less the motion: metres, metres, radians.
    pub residual: Vector3<f64>,
    /// Inverse of its covariance.
    pub information: Matrix3<f64>,
    /// Derivative by the first pose.
    pub by_from: Matrix3<f64>,
    /// Derivative by the second pose.
    pub by_to: Matrix3<f64>,
}

impl Motion {
    /// Compares the motion with two poses. `floor` are standard deviations of x, y and heading that a step has besides the noise of
    /// the wheels. `None` if the covariance is singular.
    #[must_use]
    pub fn between(
        &self,
        [from, to]: [&Vector3<f64>; 2],
        noise: WheelNoise,
        floor: [f64; 3],
    ) -> Option<Edge> {
        let (sin, cos) = from.z.sin_cos();
        let back = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        let relative = back * (to - from);
        let mut residual = relative - self.pose;
        residual.z = wrap(residual.z);
        let mut by_from = -back;
        by_from[(0, 2)] = relative.y;
        by_from[(1, 2)] = -relative.x;
        let mut covariance = self.noise.covariance(noise);
        for (k, floor) in floor.iter().enumerate() {
            covariance[(k, k)] += floor * floor;
        }
        let information = covariance.cholesky()?.inverse();
        Some(Edge { residual, information, by_from, by_to: back })
    }
}

/// Integrates exact arcs, to the third order of their angle.
#[must_use]
pub fn integrate(steps: &[Travel], drive: &Drive) -> Motion {
    let width = drive.track_width * (1.0 + drive.track);
    let mut pose: Vector3<f64> = Vector3::zeros();
    let mut by_drive = Matrix3::zeros();
    let mut noise = MotionNoise([Parts::none(); 2]);
    for &[nominal_right, nominal_left] in steps {
        let (right, left) =
            (nominal_right * (1.0 + drive.right), nominal_left * (1.0 + drive.left));
        let (advance, turn) = (f64::midpoint(right, left), (right - left) / width);
        let chord_share = 1.0 - turn * turn / 24.0;
        let chord = advance * chord_share;
        let (sin, cos) = (pose.z + 0.5 * turn).sin_cos();
        // Derivatives of the chord and of the turn become those of the pose.
        let column = |by_advance: f64, by_turn: f64| {
            let by_chord = by_advance * chord_share - advance * turn / 12.0 * by_turn;
            let aside = 0.5 * chord * by_turn;
            Vector3::new(by_chord * cos - aside * sin, by_chord * sin + aside * cos, by_turn)
        };
        let by_track = column(0.0, -turn / (1.0 + drive.track));
        let carry = Matrix3::new(1.0, 0.0, -chord * sin, 0.0, 1.0, chord * cos, 0.0, 0.0, 1.0);
        let (by_distance, by_turn) = (column(0.5, 0.0), column(0.0, 1.0 / width));
        let here = Matrix3::from_columns(&[
            (by_distance + by_turn) * nominal_right,
            (by_distance - by_turn) * nominal_left,
            by_track,
        ]);
        by_drive = carry * by_drive + here;
        // The noise is that of the measured travel, in nominal metres.
        let [of_right, of_left] = noisy_distances([nominal_right, nominal_left]).map(f64::sqrt);
        let (of_right, of_left) = (of_right * (1.0 + drive.right), of_left * (1.0 + drive.left));
        let wheels = [
            [by_distance * of_right, by_turn * of_right],
            [by_distance * of_left, by_turn * -of_left],
        ];
        let [right, left] = wheels;
        noise = MotionNoise([noise.0[0].after(&carry, right), noise.0[1].after(&carry, left)]);
        pose += Vector3::new(chord * cos, chord * sin, turn);
    }
    Motion { pose, by_drive, noise }
}

/// A pose composed with a motion that starts there, and the derivative by the motion.
#[must_use]
pub fn compose(pose: &Vector3<f64>, motion: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let (sin, cos) = pose.z.sin_cos();
    let rotation = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    (pose + rotation * motion, rotation)
}

/// An angle in (−π, π].
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// Angles turned to the left and to the right, radians; a turn counts once it exceeds 20°, so that a straight leg with
/// small corrections has none.
#[must_use]
pub fn turned(headings: impl Iterator<Item = f64>) -> [f64; 2] {
    const LEAST: f64 = 0.35;
    let [mut left, mut right] = [0.0, 0.0];
    // Heading without wrapping, and its value at the last counted turn.
    let mut unwrapped: Option<(f64, f64)> = None;
    for heading in headings {
        let Some((now, counted)) = &mut unwrapped else {
            unwrapped = Some((heading, heading));
            continue;
        };
        *now += wrap(heading - *now);
        let turn = *now - *counted;
        if turn.abs() >= LEAST {
            *counted = *now;
            left += turn.max(0.0);
            right += (-turn).max(0.0);
        }
    }
    [left, right]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drive(right: f64, left: f64, track: f64) -> Drive {
        Drive { track_width: 0.12, right, left, track }
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_differences(
            steps in prop::collection::vec([-0.03..0.03_f64, -0.03..0.03_f64], 1..20),
            right in -0.1..0.1_f64, left in -0.1..0.1_f64, track in -0.2..0.2_f64,
        ) {
            const H: f64 = 1e-6;
            let motion = integrate(&steps, &drive(right, left, track));
            let errors = [right, left, track];
            for k in 0..3 {
                let at = |h: f64| {
                    let mut errors = errors;
                    errors[k] += h;
                    integrate(&steps, &drive(errors[0], errors[1], errors[2])).pose
                };
                let difference = (at(H) - at(-H)) / (2.0 * H);
                prop_assert!((motion.by_drive.column(k) - difference).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn a_full_circle_ends_where_it_began_with_the_noise_of_its_length() {
        // Radius 0.5 m in 1,000 steps.
        let turn = std::f64::consts::TAU / 1e3;
        let steps = vec![[(0.5 + 0.06) * turn, (0.5 - 0.06) * turn]; 1_000];
        let motion = integrate(&steps, &drive(0.0, 0.0, 0.0));
        assert!(motion.pose.xy().norm() < 1e-6, "{}", motion.pose);
        assert!((motion.pose.z - std::f64::consts::TAU).abs() < 1e-9);
        let rolled = std::f64::consts::TAU;
        let heading = (0.56 * rolled + 0.44 * rolled) / 0.12_f64.powi(2);
        let covariance = motion.noise.covariance(WheelNoise::independent(1.0));
        assert!((covariance[(2, 2)] - heading).abs() < 1e-6 * heading);
    }

    /// On a straight leg the noise of the distance is that along it, and the noise of the turns that of the heading.
    #[test]
    fn a_straight_leg_separates_the_noises_of_distance_and_turns() {
        let steps = vec![[0.01, 0.01]; 100];
        let noise = integrate(&steps, &drive(0.0, 0.0, 0.0)).noise;
        let covariance = noise.covariance(WheelNoise { distance: 0.02, turn: 0.003 });
        assert!((covariance[(0, 0)] - 0.02_f64.powi(2) / 2.0).abs() < 1e-12);
        assert!((covariance[(2, 2)] - 2.0 * (0.003_f64 / 0.12).powi(2)).abs() < 1e-12);
        assert!(covariance[(0, 2)].abs() < 1e-12);
    }
    /// The encoder of a wheel that is larger than the nominal one has the same noise, and the noise of the motion is larger.
    #[test]
    fn the_noise_is_that_of_the_measured_travel() {
        let steps = vec![[0.01, 0.01]; 100];
        let covariance =
            |drive| integrate(&steps, &drive).noise.covariance(WheelNoise::independent(0.01));
        let ratio =
            covariance(drive(0.1, 0.1, 0.0))[(0, 0)] / covariance(drive(0.0, 0.0, 0.0))[(0, 0)];
        assert!((ratio - 1.21).abs() < 1e-9, "{ratio}");
    }
}
