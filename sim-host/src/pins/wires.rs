//! What runs between the robot's controller and its devices.

use std::cell::Cell;
use std::convert::Infallible;

use embedded_hal::digital::{ErrorType as DigitalError, InputPin, OutputPin};
use embedded_hal::pwm::{ErrorType as PwmError, SetDutyCycle};
use sonarfix_hal::encoder::TickCount;
use sonarfix_hal::ranger::EchoCapture;

/// The two channels of an encoder, and the count that is made of them.
#[derive(Debug, Default)]
pub struct EncoderWires {
    /// Level of channel A.
    pub a: Cell<bool>,
    /// Level of channel B.
    pub b: Cell<bool>,
    /// What the decoder counted.
    pub count: TickCount,
}

/// All wires of a robot.
#[derive(Debug, Default)]
pub struct Wires {
    /// The right wheel's encoder.
    pub right: EncoderWires,
    /// The left wheel's encoder.
    pub left: EncoderWires,
    /// A duty that was set and not yet taken note of.
    pub duty: Cell<Option<u16>>,
    /// Level of the sonar's trigger.
    pub trigger: Cell<bool>,
    /// Whether the trigger fell since that was last looked at.
    pub triggered: Cell<bool>,
    /// The echo line's edges.
    pub echo: EchoCapture,
}

/// A channel of an encoder, at the controller.
#[derive(Debug)]
pub struct ChannelPin<'w>(pub &'w Cell<bool>);

impl DigitalError for ChannelPin<'_> {
    type Error = Infallible;
}

impl InputPin for ChannelPin<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}

/// The sonar's trigger, at the controller.
#[derive(Debug)]
pub struct TriggerPin<'w>(pub &'w Wires);

impl DigitalError for TriggerPin<'_> {
    type Error = Infallible;
}

impl OutputPin for TriggerPin<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        if self.0.trigger.replace(false) {
            self.0.triggered.set(true);
        }
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.trigger.set(true);
        Ok(())
    }
}

/// The servo's PWM channel, at the controller.
#[derive(Debug)]
pub struct ServoChannel<'w>(pub &'w Cell<Option<u16>>);

/// Counts of a frame: a 16-bit timer.
pub const FULL_DUTY: u16 = u16::MAX;

impl PwmError for ServoChannel<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for ServoChannel<'_> {
    fn max_duty_cycle(&self) -> u16 {
        FULL_DUTY
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set(Some(duty));
        Ok(())
    }
}
