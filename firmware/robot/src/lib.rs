//! The common part of the boards: the drivers on a board's pins, and the regions of flash.
//!
//! It contains no parameter of a robot: wheels, servo, ranger and loop are configured by the baked configuration
//! ([`RobotConfig`](sonarfix_hal::config::RobotConfig)). It contains the capabilities of the boards: a servo at 50 Hz,
//! and a ranger with a trigger and an echo pin.

#![no_std]

pub mod memory;

use embedded_hal::digital::OutputPin;
use embedded_storage::nor_flash::NorFlash;
use sonarfix::units::Duration;
use sonarfix_app::{App, Board, Polled};
use sonarfix_hal::ranger::{Captured, EchoCapture, PulseRanger};
use sonarfix_hal::servo::{PwmFrame, Servo};
use sonarfix_link::message::ResetCause;
use sonarfix_motors::Estimate;

/// The pulses of the boards' servo channels: 50 Hz, and the widths that hobby servos accept without running against
/// their stops (0.5 to 2.5 ms by their datasheets).
pub const SERVO_FRAME: PwmFrame = PwmFrame {
    period: Duration::from_ticks(20_000),
    shortest: Duration::from_ticks(450),
    longest: Duration::from_ticks(2_550),
};

/// Firmware version, reset cause, and the number of resets in a row.
#[must_use]
pub fn board(reset: ResetCause, resets: u8) -> Board {
    Board { firmware: version(), reset, resets }
}

/// The servo's driver.
pub const fn servo<P>(pwm: P) -> Servo<P> {
    Servo::new(pwm, SERVO_FRAME)
}

/// The driver of a ranger with a trigger and an echo pin.
pub fn ranger<T: OutputPin>(
    trigger: T,
    echo: &'static EchoCapture,
) -> PulseRanger<T, Captured<'static>> {
    PulseRanger::new(trigger, Captured::new(echo))
}

/// The estimate for the motor code; `None` while the motors are disabled.
pub fn estimate<F: NorFlash>(app: &App<F>, polled: &Polled) -> Option<Estimate> {
    let localizer = app.localizer().filter(|_| polled.may_drive)?;
    Some(Estimate { pose: localizer.pose(), verdict: localizer.health().verdict })
}

fn version() -> [u8; 3] {
    let number = |text: &str| text.parse().unwrap_or(0);
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}
