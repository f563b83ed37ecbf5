//! From ticks to metres.
//!
//! # Non-finite policy
//! [`WheelGeometry::new`] refuses a diameter or a resolution that is not a positive finite
//! number, so no travel is ever NaN.

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::Metres;

/// Why a wheel's geometry was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GeometryError {
    /// The diameter is zero, negative, NaN or infinite.
    Diameter,
    /// The number of ticks is zero, negative, NaN or infinite, or makes a tick of no length.
    TicksPerRevolution,
    /// The travel from one tick to the next is zero, negative, NaN or infinite.
    Travel,
}

impl core::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Diameter => "the wheel's diameter must be positive and finite",
            Self::TicksPerRevolution => "the ticks per revolution must be positive and finite",
            Self::Travel => "the travel from one tick to the next must be positive and finite",
        })
    }
}

impl core::error::Error for GeometryError {}

/// The travel of a wheel from one tick to the next, by its nominal diameter.
///
/// ```
/// use sonarfix::geometry::units::Metres;
/// use sonarfix_hal::encoder::WheelGeometry;
/// // A 65 mm wheel on a gear motor: 11 lines × 4 edges × 34.014 turns of the motor.
/// let wheel = WheelGeometry::new(Metres(0.065), 11.0 * 4.0 * 34.014)?;
/// assert!((wheel.tick().0 - 0.000_136_4).abs() < 1e-7);
/// # Ok::<(), sonarfix_hal::encoder::GeometryError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelGeometry {
    /// Negative for an encoder that counts backwards.
    metres_per_tick: f32,
}

impl WheelGeometry {
    /// A wheel of this diameter and number of ticks per revolution, which need not be a whole number.
    ///
    /// # Errors
    /// [`GeometryError`], by which argument is wrong.
    pub fn new(diameter: Metres, ticks_per_revolution: f32) -> Result<Self, GeometryError> {
        let positive = |value: f32| value > 0.0 && value.is_finite();
        if !positive(diameter.0) {
            return Err(GeometryError::Diameter);
        }
        let travel = Metres(core::f32::consts::PI * diameter.0 / ticks_per_revolution);
        if !positive(ticks_per_revolution) {
            return Err(GeometryError::TicksPerRevolution);
        }
        Self::rolling(travel).map_err(|_| GeometryError::TicksPerRevolution)
    }

    /// A wheel with this travel from one tick to the next.
    ///
    /// # Errors
    /// [`GeometryError::Travel`] if that is not a positive, finite length.
    pub fn rolling(per_tick: Metres) -> Result<Self, GeometryError> {
        if per_tick.0 > 0.0 && per_tick.is_finite() {
            Ok(Self { metres_per_tick: per_tick.0 })
        } else {
            Err(GeometryError::Travel)
        }
    }

    /// The same wheel with an encoder that counts down when it rolls forwards: one side of a
    /// robot whose motors are mounted as mirror images.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self { metres_per_tick: -self.metres_per_tick }
    }

    /// Length of one tick, whatever its direction.
    #[must_use]
    pub fn tick(self) -> Metres {
        Metres(self.metres_per_tick.abs())
    }

    /// The travel of `half_ticks` halves of a tick.
    #[expect(clippy::cast_precision_loss, reason = "a travel of 2²⁴ half ticks is kilometres")]
    fn travel(self, half_ticks: i64) -> Metres {
        Metres(half_ticks as f32 * (0.5 * self.metres_per_tick))
    }
}

/// Both wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheels {
    /// The right wheel.
    pub right: WheelGeometry,
    /// The left wheel.
    pub left: WheelGeometry,
}

impl Wheels {
    /// Two wheels of the same geometry.
    #[must_use]
    pub fn alike(wheel: WheelGeometry) -> Self {
        Self { right: wheel, left: wheel }
    }

    /// The travel of both wheels, from halves of ticks: the loop splits ticks in two
    /// (see [`robot`](crate::robot)).
    pub(crate) fn travel(self, right_halves: i64, left_halves: i64) -> WheelTravel {
        WheelTravel { right: self.right.travel(right_halves), left: self.left.travel(left_halves) }
    }

    /// The longer of both wheels' ticks.
    pub(crate) fn coarser_tick(self) -> Metres {
        let (right, left) = (self.right.tick(), self.left.tick());
        if right > left { right } else { left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn travel_keeps_its_sign_and_half_counts() {
        let wheel = WheelGeometry::new(Metres(1.0 / core::f32::consts::PI), 1000.0).unwrap();
        let wheels = Wheels { right: wheel, left: wheel.reversed() };
        let travel = wheels.travel(3, 2);
        assert!((travel.right.0 - 0.0015).abs() < 1e-9);
        assert!((travel.left.0 + 0.001).abs() < 1e-9);
    }

    #[test]
    fn an_invalid_wheel_is_refused() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let error = WheelGeometry::new(Metres(bad), 360.0);
            assert_eq!(error, Err(GeometryError::Diameter), "{bad}");
            let error = WheelGeometry::new(Metres(0.05), bad);
            assert_eq!(error, Err(GeometryError::TicksPerRevolution), "{bad}");
        }
        let vanishing = WheelGeometry::new(Metres(1e-30), 1e30);
        assert_eq!(vanishing, Err(GeometryError::TicksPerRevolution));
    }
}
