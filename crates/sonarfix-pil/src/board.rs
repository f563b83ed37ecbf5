//! The drivers of a robot on its wires, from a description that can be sent.

use serde::{Deserialize, Serialize};
use sonarfix::units::{Metres, Radians};
use sonarfix_hal::encoder::{GeometryError, WheelGeometry, Wheels};
use sonarfix_hal::ranger::{Air, Captured, Celsius, PulseRanger, PulseTiming, TemperatureError};
use sonarfix_hal::robot::{Devices, Settings, SettingsError};
use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo, SettingError};

use crate::wires::{CounterWire, ServoWire, TriggerWire, Wires};

/// The drivers on a robot's wires.
pub type WiredDevices<'w> = Devices<
    &'w CounterWire,
    &'w CounterWire,
    &'w ServoWire,
    PulseRanger<&'w TriggerWire, Captured<'w>>,
>;

/// What a robot is built of, as far as its drivers must know.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Board {
    /// The right wheel.
    pub right: Wheel,
    /// The left wheel.
    pub left: Wheel,
    /// The servo.
    pub servo: ServoBuild,
    /// What the sonar's board does when.
    pub sonar: PulseTiming,
    /// The temperature that its driver is set to.
    pub air: Celsius,
    /// The loop's settings.
    pub settings: Settings,
}

/// A wheel with its encoder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wheel {
    /// Its diameter.
    pub diameter: Metres,
    /// Ticks of a turn.
    pub ticks_per_revolution: f32,
    /// Whether the encoder counts down as the robot drives ahead.
    pub is_reversed: bool,
}

/// A servo as it was measured on the bench.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ServoBuild {
    /// Two pulses that were tried.
    pub tried: (MeasuredPulse, MeasuredPulse),
    /// The rightmost and the leftmost bearing that it may be sent to, relative to the heading.
    pub limits: (Radians, Radians),
    /// How fast it turns.
    pub pace: Pace,
}

/// Which device cannot be driven, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupError {
    /// An encoder.
    Wheel(GeometryError),
    /// The servo.
    Servo(SettingError),
    /// The sonar's air.
    Air(TemperatureError),
    /// The loop.
    Loop(SettingsError),
}

impl core::fmt::Display for SetupError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Wheel(error) => write!(f, "encoder: {error}"),
            Self::Servo(error) => write!(f, "servo: {error}"),
            Self::Air(error) => write!(f, "sensor: {error}"),
            Self::Loop(error) => write!(f, "loop: {error}"),
        }
    }
}

impl core::error::Error for SetupError {}

impl Wheel {
    fn geometry(&self) -> Result<WheelGeometry, SetupError> {
        let wheel = WheelGeometry::new(self.diameter, self.ticks_per_revolution);
        let wheel = wheel.map_err(SetupError::Wheel)?;
        Ok(if self.is_reversed { wheel.reversed() } else { wheel })
    }
}

impl Board {
    /// Both wheels, as the loop knows them.
    ///
    /// # Errors
    /// [`SetupError::Wheel`].
    pub fn wheels(&self) -> Result<Wheels, SetupError> {
        Ok(Wheels { right: self.right.geometry()?, left: self.left.geometry()? })
    }

    /// The drivers on the wires.
    ///
    /// # Errors
    /// [`SetupError`], by the device that cannot be driven.
    pub fn devices<'w>(&self, wires: &'w Wires) -> Result<WiredDevices<'w>, SetupError> {
        let (one, other) = self.servo.tried;
        let calibration = Calibration::new(one, other).map_err(SetupError::Servo)?;
        let ServoBuild { limits, pace, .. } = self.servo;
        let servo = Servo::new(&wires.servo, calibration, limits, pace);
        let air = Air::at(self.air).map_err(SetupError::Air)?;
        let line = Captured::new(&wires.echo);
        Ok(Devices {
            right: &wires.right,
            left: &wires.left,
            servo: servo.map_err(SetupError::Servo)?,
            ranger: PulseRanger::new(&wires.trigger, line, self.sonar, air),
        })
    }
}
