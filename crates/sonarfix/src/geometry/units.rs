//! Quantities with their units. A bare `f32` in the interface is dimensionless.
//!
//! The fields are public: any number is a length. Checks are made where a length gets a meaning (a
//! range, a wall, a travel).
//!
//! # Non-finite policy
//! Arithmetic propagates NaN and infinity. No value is refused here; every function of the crate that
//! changes state refuses them.

use core::ops::{Add, Mul, Neg, Sub};

/// Time since the robot was switched on, in microseconds. The core never reads a clock: the time is an
/// argument of every function that needs it.
pub type Instant = fugit::Instant<u64, 1, 1_000_000>;

/// A duration in microseconds.
pub type Duration = fugit::Duration<u64, 1, 1_000_000>;

/// A duration in seconds, at most 4,295 s.
#[expect(
    clippy::cast_precision_loss,
    reason = "durations are a small part of an hour, where microseconds are negligible"
)]
#[must_use]
pub fn seconds(duration: Duration) -> f32 {
    // The conversion of 64 bits would be a call on a microcontroller.
    u32::try_from(duration.to_micros()).unwrap_or(u32::MAX) as f32 * 1e-6
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct $name(pub f32);

        impl $name {
            /// Whether the value is neither NaN nor infinite.
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
    /// use sonarfix::geometry::units::Metres;
    /// assert_eq!(Metres(1.5) + Metres(0.5), Metres(2.0));
    /// assert_eq!(Metres(1.5) * 2.0, Metres(3.0));
    /// ```
    Metres
}

quantity! {
    /// An angle in radians, counter-clockwise; not wrapped. A direction in the map frame is a
    /// [`Heading`](crate::geometry::pose::Heading).
    ///
    /// ```
    /// use sonarfix::geometry::units::Radians;
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

quantity! {
    /// A turn rate in radians per second, counter-clockwise.
    RadiansPerSecond
}

impl RadiansPerSecond {
    /// A turn rate given in degrees per second.
    ///
    /// ```
    /// use sonarfix::geometry::units::RadiansPerSecond;
    /// assert_eq!(RadiansPerSecond::from_degrees(180.0).0, core::f32::consts::PI);
    /// ```
    #[must_use]
    pub fn from_degrees(degrees: f32) -> Self {
        Self(degrees.to_radians())
    }

    /// The turn rate in degrees per second.
    #[must_use]
    pub fn to_degrees(self) -> f32 {
        self.0.to_degrees()
    }
}

impl Radians {
    /// An angle given in degrees.
    ///
    /// ```
    /// use sonarfix::geometry::units::Radians;
    /// assert_eq!(Radians::from_degrees(180.0), Radians(core::f32::consts::PI));
    /// ```
    #[must_use]
    pub fn from_degrees(degrees: f32) -> Self {
        Self(degrees.to_radians())
    }

    /// The angle in degrees.
    #[must_use]
    pub fn to_degrees(self) -> f32 {
        self.0.to_degrees()
    }
}

/// Density of a random walk over distance: the standard deviation after one metre of travel. It grows
/// with the square root of the distance, so the uncertainty of a parked robot does not grow.
///
/// `PerRootMetre(Metres(0.0005))` is 0.5 mm/√m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PerRootMetre<T>(pub T);

/// Density of a white noise or of a random walk over time: the standard deviation after one second. It grows with the
/// square root of the time.
///
/// `PerRootSecond(Radians(1e-4))` is 1e-4 rad/√s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PerRootSecond<T>(pub T);
