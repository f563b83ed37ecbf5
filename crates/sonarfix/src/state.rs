//! The seven states: as the crate shows them, and as the filter holds them.
//!
//! # Non-finite policy
//! Nothing here refuses a value; [`Ekf`](crate::ekf::Ekf) takes no state that is not finite.

use nalgebra::SVector;

use crate::covariance::Gain;
use crate::motion::Step;
use crate::pose::{Heading, Pose};
use crate::units::Radians;

/// Number of states.
pub const STATES: usize = 7;

/// The seven states, in the order of the state vector and of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Position along map x, metres.
    pub x: f32,
    /// Position along map y, metres.
    pub y: f32,
    /// Heading ψ, radians in (−π, π].
    pub heading: f32,
    /// Scale error of the right wheel, `S_R`: true travel is (1 + `S_R`) times the measured one.
    pub scale_right: f32,
    /// Scale error of the left wheel, `S_L`.
    pub scale_left: f32,
    /// Error of the track width δD, metres: the true one is D + δD.
    pub track_width_error: f32,
    /// Scale error of the ranger κ: a measured range is (1 + κ) times the true one.
    pub range_scale: f32,
}

impl State {
    /// Position and heading.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.x, self.y, Radians(self.heading))
    }

    pub(crate) fn to_vector(self) -> SVector<f32, STATES> {
        SVector::from([
            self.x,
            self.y,
            self.heading,
            self.scale_right,
            self.scale_left,
            self.track_width_error,
            self.range_scale,
        ])
    }

    pub(crate) fn is_finite(self) -> bool {
        self.to_vector().iter().all(|v| v.is_finite())
    }
}

/// The state as the filter holds it: the scale errors as their mean and their difference, for the
/// covariance's sake (`covariance.rs` says why).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
    pub(crate) scale_common: f32,
    pub(crate) scale_difference: f32,
    pub(crate) track_width_error: f32,
    pub(crate) range_scale: f32,
}

impl Mean {
    /// From the state that the crate shows.
    #[must_use]
    pub fn new(state: &State) -> Self {
        let mut mean = Self {
            x: state.x,
            y: state.y,
            heading: state.heading,
            scale_common: 0.5 * (state.scale_right + state.scale_left),
            scale_difference: state.scale_right - state.scale_left,
            track_width_error: state.track_width_error,
            range_scale: state.range_scale,
        };
        mean.wrap();
        mean
    }

    /// The state that the crate shows.
    #[must_use]
    pub fn state(&self) -> State {
        let (scale_right, scale_left) = wheels(self.scale_common, self.scale_difference);
        State {
            x: self.x,
            y: self.y,
            heading: self.heading,
            scale_right,
            scale_left,
            track_width_error: self.track_width_error,
            range_scale: self.range_scale,
        }
    }

    /// Moves along a step (`docs/model.md`, eq. 7).
    #[inline]
    pub fn advance(&mut self, rest: &mut Remainder, step: &Step) {
        add(&mut self.x, &mut rest.x, step.way_x);
        add(&mut self.y, &mut rest.y, step.way_y);
        add(&mut self.heading, &mut rest.heading, step.turn);
        self.wrap();
    }

    /// X̂ + K ν (`docs/model.md`, eq. 14).
    #[inline]
    pub fn take(&mut self, rest: &mut Remainder, gain: &Gain, innovation: f32) {
        add(&mut self.x, &mut rest.x, gain.x * innovation);
        add(&mut self.y, &mut rest.y, gain.y * innovation);
        add(&mut self.heading, &mut rest.heading, gain.h * innovation);
        self.scale_common += gain.c * innovation;
        self.scale_difference += gain.d * innovation;
        self.track_width_error += gain.w * innovation;
        self.range_scale += gain.k * innovation;
        self.wrap();
    }

    #[inline]
    fn wrap(&mut self) {
        self.heading = Heading::new(Radians(self.heading)).radians().0;
    }
}

/// What rounding has left over of the sums that grow by small steps.
///
/// 40 m from the origin one step of an `f32` is 4 µm, and a leg is a thousand additions: the
/// rounding alone would move the estimate by a fiftieth of its own deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Remainder {
    x: f32,
    y: f32,
    heading: f32,
}

/// Adds a change to a sum together with what rounding left over of the earlier ones (Kahan).
fn add(sum: &mut f32, rest: &mut f32, change: f32) {
    let change = change + *rest;
    let before = *sum;
    *sum = before + change;
    *rest = change - (*sum - before);
}

/// The values of the right and the left wheel, from those of the common part and the difference.
pub(crate) fn wheels(common: f32, difference: f32) -> (f32, f32) {
    (common + 0.5 * difference, common - 0.5 * difference)
}
