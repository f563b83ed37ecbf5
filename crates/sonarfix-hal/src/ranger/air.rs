//! The speed of sound.

use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond};

use crate::time::micros;

/// A temperature in degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Celsius(pub f32);

/// The temperature is out of range (−40 °C to 85 °C), or NaN.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperatureError;

impl core::fmt::Display for TemperatureError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the temperature must be between -40 and 85 degrees Celsius")
    }
}

impl core::error::Error for TemperatureError {}

/// The air that the sound crosses.
///
/// The speed of sound in dry air is 331.3 + 0.606 T m/s for T in °C, so one degree is 0.18 % of
/// every range. The error of the configured temperature is estimated as the range scale κ
/// (`docs/model.md`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Air {
    speed: MetresPerSecond,
}

impl Air {
    /// Air at 20 °C: what "58 µs a centimetre" of an HC-SR04's datasheet means, within 0.5 %.
    pub const ROOM: Self = Self { speed: MetresPerSecond(331.3 + 0.606 * 20.0) };

    /// Air of this temperature.
    ///
    /// ```
    /// use sonarfix::geometry::units::Duration;
    /// use sonarfix_hal::ranger::{Air, Celsius};
    /// // A flight of 10 ms, on a cold morning and at noon: 5 cm apart.
    /// let flight = Duration::from_ticks(10_000);
    /// let (cold, warm) = (Air::at(Celsius(5.0))?, Air::at(Celsius(22.0))?);
    /// assert!(((warm.range(flight) - cold.range(flight)).0 - 0.0515).abs() < 1e-3);
    /// # Ok::<(), sonarfix_hal::ranger::TemperatureError>(())
    /// ```
    ///
    /// # Errors
    /// [`TemperatureError`] outside −40 °C to 85 °C.
    pub fn at(temperature: Celsius) -> Result<Self, TemperatureError> {
        if (-40.0..=85.0).contains(&temperature.0) {
            let speed = MetresPerSecond(331.3 + 0.606 * temperature.0);
            Ok(Self { speed })
        } else {
            Err(TemperatureError)
        }
    }

    /// The speed of sound.
    #[must_use]
    pub fn speed(self) -> MetresPerSecond {
        self.speed
    }

    /// The range for this time of flight.
    #[must_use]
    pub fn range(self, flight: Duration) -> Metres {
        Metres(0.5e-6 * self.speed.0 * micros(flight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_datasheets_scales_are_those_of_ordinary_rooms() {
        // LV-MaxSonar-EZ: 147 µs an inch, specified for 22.5 °C.
        let inch = Air::at(Celsius(22.5)).unwrap().range(Duration::from_ticks(147));
        assert!((inch.0 - 0.0254).abs() < 0.0001, "{inch:?}");
        // HC-SR04: 58 µs a centimetre.
        let centimetre = Air::ROOM.range(Duration::from_ticks(58));
        assert!((centimetre.0 - 0.01).abs() < 0.0001, "{centimetre:?}");
        assert_eq!(Air::at(Celsius(20.0)), Ok(Air::ROOM));
    }

    #[test]
    fn temperatures_out_of_range_are_refused() {
        for bad in [-40.1, 85.1, f32::NAN, f32::INFINITY, -f32::INFINITY] {
            assert_eq!(Air::at(Celsius(bad)), Err(TemperatureError), "{bad}");
        }
    }
}
