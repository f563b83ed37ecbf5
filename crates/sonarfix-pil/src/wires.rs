//! The simulated pins of a robot's devices.

use core::cell::Cell;
use core::convert::Infallible;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use serde::{Deserialize, Serialize};
use sonarfix::units::Instant;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::EchoCapture;

/// The sensors' signals up to a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensors {
    /// The time of the poll.
    pub at: Instant,
    /// The right wheel's encoder.
    pub right: Counted,
    /// The left wheel's encoder.
    pub left: Counted,
    /// When the echo line went high since the last poll, if it did.
    pub rose: Option<Instant>,
    /// When it went low after that, if it did.
    pub fell: Option<Instant>,
}

/// The counter of an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counted {
    /// Ticks; wraps around.
    pub ticks: u32,
    /// Illegal quadrature transitions; wraps around.
    pub illegal: u32,
    /// Whether a reading of the counter fails.
    pub has_failed: bool,
}

/// The actuators' signals of a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Actuators {
    /// The servo's duty, of [`FULL_DUTY`], if it was set.
    pub duty: Option<u16>,
    /// Whether the sonar's trigger is high.
    pub is_raised: bool,
    /// Whether the trigger has fallen, which starts a ping.
    pub has_fallen: bool,
}

/// All wires of a robot, at the microcontroller.
#[derive(Debug, Default)]
pub struct Wires {
    /// The right encoder's counter.
    pub right: CounterWire,
    /// The left encoder's counter.
    pub left: CounterWire,
    /// The servo's PWM channel.
    pub servo: ServoWire,
    /// The sonar's trigger.
    pub trigger: TriggerWire,
    /// The edges of the echo line.
    pub echo: EchoCapture,
}

impl Wires {
    /// Applies the sensors' signals to the wires.
    pub fn apply(&self, sensors: &Sensors) {
        self.right.0.set(sensors.right);
        self.left.0.set(sensors.left);
        if let Some(at) = sensors.rose {
            self.echo.rose(at);
        }
        if let Some(at) = sensors.fell {
            self.echo.fell(at);
        }
    }

    /// Returns the actuators' signals since the last call.
    pub fn take(&self) -> Actuators {
        Actuators {
            duty: self.servo.0.take(),
            is_raised: self.trigger.is_raised.get(),
            has_fallen: self.trigger.has_fallen.take(),
        }
    }
}

/// A counter with a value that the PC sets.
#[derive(Debug, Default)]
pub struct CounterWire(Cell<Counted>);

/// The reading of a counter has failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadError;

impl Counter for &CounterWire {
    type Error = ReadError;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, ReadError> {
        let Counted { ticks, has_failed, .. } = self.0.get();
        if has_failed { Err(ReadError) } else { Ok(ticks) }
    }

    fn illegal(&mut self) -> u32 {
        self.0.get().illegal
    }
}

/// Timer counts in a period of the servo's PWM: a 16-bit timer.
pub const FULL_DUTY: u16 = u16::MAX;

/// A PWM channel that records its duty.
#[derive(Debug, Default)]
pub struct ServoWire(Cell<Option<u16>>);

impl pwm::ErrorType for &ServoWire {
    type Error = Infallible;
}

impl SetDutyCycle for &ServoWire {
    fn max_duty_cycle(&self) -> u16 {
        FULL_DUTY
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set(Some(duty));
        Ok(())
    }
}

/// A trigger pin that records a falling edge.
#[derive(Debug, Default)]
pub struct TriggerWire {
    is_raised: Cell<bool>,
    has_fallen: Cell<bool>,
}

impl digital::ErrorType for &TriggerWire {
    type Error = Infallible;
}

impl OutputPin for &TriggerWire {
    fn set_low(&mut self) -> Result<(), Infallible> {
        if self.is_raised.replace(false) {
            self.has_fallen.set(true);
        }
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.is_raised.set(true);
        Ok(())
    }
}
