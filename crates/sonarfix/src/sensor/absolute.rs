//! Absolute measurements: heading, position or pose in the map frame, as of a compass, a beacon, a camera, or a tap of a
//! person on the map (`docs/model.md`, "Heading, position and pose").
//!
//! # Non-finite policy
//! `AbsoluteMeasurement::check` refuses NaN, infinity and a covariance that is not positive definite.

mod decorrelation;
mod motion;
mod source;

use crate::geometry::pose::{Point, Pose};
use crate::geometry::units::{Metres, Radians};

pub(crate) use decorrelation::{PoseMatrix, PoseVector};
pub(crate) use motion::{LastStep, OutsideStep, Return};
pub(crate) use source::{Fit, Probabilities, Sources};

/// Covariance of the noise of a measured position in the map frame, m².
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PositionNoise {
    /// Variance of x.
    pub xx: f32,
    /// Covariance of x and y.
    pub xy: f32,
    /// Variance of y.
    pub yy: f32,
}

impl PositionNoise {
    /// Independent errors of x and y with this standard deviation.
    #[must_use]
    pub fn circular(deviation: Metres) -> Self {
        let variance = deviation.0 * deviation.0;
        Self { xx: variance, xy: 0.0, yy: variance }
    }
}

/// Covariance of the noise of a measured pose in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseNoise {
    /// Of the position.
    pub position: PositionNoise,
    /// Covariance of x and the heading, m rad.
    pub xh: f32,
    /// Covariance of y and the heading, m rad.
    pub yh: f32,
    /// Variance of the heading, rad².
    pub hh: f32,
}

impl PoseNoise {
    /// Independent errors with these standard deviations of x and y and of the heading.
    #[must_use]
    pub fn independent(position: Metres, heading: Radians) -> Self {
        let position = PositionNoise::circular(position);
        Self { position, xh: 0.0, yh: 0.0, hh: heading.0 * heading.0 }
    }
}

/// An absolute measurement with its noise, in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AbsoluteMeasurement {
    /// The heading, as of a compass.
    Heading {
        /// Radians, counter-clockwise from map x; any finite angle.
        angle: Radians,
        /// Standard deviation of its noise.
        deviation: Radians,
    },
    /// The position of the midpoint between the wheels, as of a beacon.
    Position {
        /// The position.
        point: Point,
        /// Its noise.
        noise: PositionNoise,
    },
    /// The pose, as of a camera.
    Pose {
        /// The pose.
        pose: Pose,
        /// Its noise.
        noise: PoseNoise,
    },
}

/// What is wrong with an absolute measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MeasurementError {
    NotFinite,
    NotPositiveDefinite,
    /// This program was built without the feature `absolute`.
    WithoutFeature,
}

/// A checked measurement as three numbers with their noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Components {
    /// What was measured; zero for the rest.
    pub value: PoseVector,
    /// R; the identity for what was not measured.
    pub noise: PoseMatrix,
    pub has_position: bool,
    pub has_heading: bool,
}

impl Components {
    /// How many numbers were measured.
    pub fn dimensions(&self) -> u8 {
        2 * u8::from(self.has_position) + u8::from(self.has_heading)
    }
}

impl AbsoluteMeasurement {
    /// The components of a valid measurement.
    ///
    /// The variants of the measurement are public, so that its type cannot lack values. This check, through which every
    /// measurement passes, does instead: without the feature the compiler removes what follows it.
    pub(crate) fn check(&self) -> Result<Components, MeasurementError> {
        if !cfg!(feature = "absolute") {
            return Err(MeasurementError::WithoutFeature);
        }
        let components = self.components();
        if !(components.value.is_finite() && components.noise.is_finite()) {
            return Err(MeasurementError::NotFinite);
        }
        match components.noise.decorrelated() {
            Some(_) => Ok(components),
            None => Err(MeasurementError::NotPositiveDefinite),
        }
    }

    fn components(&self) -> Components {
        let nothing = PoseVector::default();
        match *self {
            Self::Heading { angle, deviation } => Components {
                value: PoseVector { h: angle.0, ..nothing },
                // Squared, a negative deviation would be valid.
                noise: PoseMatrix { hh: deviation.0 * deviation.abs().0, ..PoseMatrix::IDENTITY },
                has_position: false,
                has_heading: true,
            },
            Self::Position { point, noise: PositionNoise { xx, xy, yy } } => Components {
                value: PoseVector { x: point.x.0, y: point.y.0, ..nothing },
                noise: PoseMatrix { xx, xy, yy, ..PoseMatrix::IDENTITY },
                has_position: true,
                has_heading: false,
            },
            Self::Pose { pose, noise: PoseNoise { position, xh, yh, hh } } => {
                let PositionNoise { xx, xy, yy } = position;
                let h = pose.heading.radians().0;
                Components {
                    value: PoseVector { x: pose.x.0, y: pose.y.0, h },
                    noise: PoseMatrix { xx, xy, yy, xh, yh, hh },
                    has_position: true,
                    has_heading: true,
                }
            }
        }
    }
}
