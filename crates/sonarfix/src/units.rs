//! Quantities with their units, so that a bare `f32` is always a dimensionless number.
//!
//! The types are thin: the field is public, because a length may be any number, and the checks
//! are made where a length begins to mean something (a range, a wall, a travel).
//!
//! # Non-finite policy
//! Arithmetic passes NaN and infinity on. Nothing here refuses them; every entry of the crate
//! that changes state does.

use core::ops::{Add, Mul, Neg, Sub};

/// Time since the robot was switched on, in microseconds. The core never reads a clock: every
/// call that needs the time is told it.
pub type Instant = fugit::Instant<u64, 1, 1_000_000>;

/// A span of time, in microseconds.
pub type Duration = fugit::Duration<u64, 1, 1_000_000>;

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct $name(pub f32);

        impl $name {
            /// Whether the value is a number and not infinite.
            #[must_use]
            pub fn is_finite(self) -> bool {
                self.0.is_finite()
            }

            /// The value without its sign.
            #[must_use]
            pub fn abs(self) -> Self {
                Self(self.0.abs())
            }
        }

        impl Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }

        impl Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }

        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl Mul<f32> for $name {
            type Output = Self;
            fn mul(self, factor: f32) -> Self {
                Self(self.0 * factor)
            }
        }
    };
}

quantity! {
    /// A length in metres.
    ///
    /// ```
    /// use sonarfix::units::Metres;
    /// assert_eq!(Metres(1.5) + Metres(0.5), Metres(2.0));
    /// assert_eq!(Metres(1.5) * 2.0, Metres(3.0));
    /// ```
    Metres
}

quantity! {
    /// An angle in radians, counter-clockwise; not wrapped. A direction in the map frame is a
    /// [`Heading`](crate::pose::Heading).
    ///
    /// ```
    /// use sonarfix::units::Radians;
    /// assert_eq!(Radians(1.0) - Radians(0.25), Radians(0.75));
    /// ```
    Radians
}

quantity! {
    /// A variance of a length, in square metres.
    SquareMetres
}

quantity! {
    /// A speed in metres per second.
    MetresPerSecond
}

impl Radians {
    /// An angle given in degrees.
    ///
    /// ```
    /// use sonarfix::units::Radians;
    /// assert_eq!(Radians::from_degrees(180.0), Radians(core::f32::consts::PI));
    /// ```
    #[must_use]
    pub fn from_degrees(degrees: f32) -> Self {
        Self(degrees.to_radians())
    }
}

/// The strength of a random walk along the way: the standard deviation that one metre of travel
/// adds. It grows with the square root of the distance, so a parked robot keeps its certainty.
///
/// `PerRootMetre(Metres(0.0005))` reads "0.5 mm/√m".
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PerRootMetre<T>(pub T);
