//! The motor drivers of an XRP have no enable pin that the chip controls. While the robot may not drive, their inputs are low, whatever the
//! PWM generates (`OUTOVER` of the pins). After a reset the inputs are low by the pull-downs of the drivers.

use embassy_rp::pac;
use embassy_rp::pac::io::vals::Outover;

use crate::pins::INPUTS;

/// The inputs of the motor drivers: numbers of their pins.
pub struct Enable([usize; 4]);

impl Enable {
    /// The motors are disabled.
    pub fn new(inputs: [usize; 4]) -> Self {
        force(inputs, Outover::LOW);
        Self(inputs)
    }

    pub fn set(&mut self, may_drive: bool) {
        force(self.0, if may_drive { Outover::NORMAL } else { Outover::LOW });
    }
}

/// Disables the motors; the next poll may enable them again.
pub fn disable_motors() {
    force(INPUTS, Outover::LOW);
}

fn force(inputs: [usize; 4], level: Outover) {
    for pin in inputs {
        pac::IO_BANK0.gpio(pin).ctrl().modify(|w| w.set_outover(level));
    }
}
