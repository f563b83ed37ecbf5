//! The enable pin of the motor driver.

use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::PIN_9;
use embassy_rp::{Peri, pac};

use crate::pins::ENABLE;

/// The pin that is high while the robot may drive.
pub struct Enable(Output<'static>);

impl Enable {
    /// The motors are disabled.
    pub fn new(pin: Peri<'static, PIN_9>) -> Self {
        Self(Output::new(pin, Level::Low))
    }

    pub fn set(&mut self, may_drive: bool) {
        self.0.set_level(may_drive.into());
    }
}

/// Disables the motors; the next poll may enable them again.
pub fn disable_motors() {
    pac::SIO.gpio_out(0).value_clr().write_value(1 << ENABLE);
}
