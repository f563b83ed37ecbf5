//! The common part of the boards: the drivers on a board's pins, and the regions of flash.
//!
//! It contains no parameter of a robot: wheels, servo, ranger and loop are configured by the baked configuration
//! ([`RobotConfig`](sonarfix_hal::config::RobotConfig)). It contains the capabilities of the boards: servos at 50 Hz,
//! and rangers with a trigger and an echo pin, or of light on an I²C bus.

#![no_std]

pub mod faults;
pub mod guarded;
pub mod memory;

use embedded_hal::digital::OutputPin;
use embedded_hal::i2c::I2c;
use embedded_storage::nor_flash::NorFlash;
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix_app::watchdog::POLL_AT_LEAST_EVERY;
use sonarfix_app::{App, Board, Polled};
#[cfg(feature = "drive")]
use sonarfix_hal::config::WheelConfig;
#[cfg(feature = "drive")]
use sonarfix_hal::encoder::{Counter, Unwrapped};
use sonarfix_hal::ranger::{Captured, EchoCapture, OneOf, PulseRanger, Vl53l0x, Vl53l1x};
use sonarfix_hal::robot::{Hardware, PACE};
use sonarfix_hal::servo::{PwmFrame, Servo};
use sonarfix_link::message::ResetCause;
use sonarfix_motors::Estimate;
#[cfg(feature = "drive")]
use sonarfix_motors::commanded::{Inputs, Wheel};

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

/// A ranger with a trigger and an echo pin, or one of light on a bus, as the robot file has it.
pub type AnyRanger<T, B> = OneOf<PulseRanger<T, Captured<'static>>, OneOf<Vl53l1x<B>, Vl53l0x<B>>>;

/// The drivers of a ranger whose kind the robot file states.
pub fn any_ranger<T: OutputPin, B: I2c + Copy>(
    trigger: T,
    echo: &'static EchoCapture,
    bus: B,
) -> AnyRanger<T, B> {
    OneOf::new(ranger(trigger, echo), OneOf::new(Vl53l1x::new(bus), Vl53l0x::new(bus)))
}

/// The estimate for the motor code; `None` while the motors are disabled.
pub fn estimate<F: NorFlash>(app: &App<F>, polled: &Polled) -> Option<Estimate> {
    let localizer = app.localizer().filter(|_| polled.may_drive)?;
    Some(Estimate { pose: localizer.pose(), verdict: localizer.health().verdict })
}

/// The inputs of the motor code of a board that a PC drives; `None` while the motors are disabled. It reads both encoders, of
/// which `positions` are those without wrap-around.
#[cfg(feature = "drive")]
pub fn inputs<F: NorFlash>(
    app: &App<F>,
    polled: &Polled,
    now: Instant,
    (right, left): (&mut impl Counter, &mut impl Counter),
    positions: &mut [Unwrapped; 2],
) -> Option<Inputs> {
    let estimate = estimate(app, polled)?;
    let config = app.configuration()?;
    let track_width = config.localizer.drive.track_width;
    let [right_position, left_position] = positions;
    let positions = (right_position.read(right).ok(), left_position.read(left).ok());
    let wheel =
        |position, wheel: &WheelConfig| Wheel { position, travel_per_tick: wheel.signed_travel() };
    let wheels = match positions {
        (Some(right), Some(left)) => {
            Some([wheel(right, &config.right_wheel), wheel(left, &config.left_wheel)])
        }
        _ => None,
    };
    let speeds = app.motion().map(|motion| motion.wheels(track_width));
    Some(Inputs { now, estimate, speeds, wheels })
}

/// When a board polls again, after a poll at `polled`: when something is due ([`App::next_poll`]), and in time for the motor
/// code and for the watchdog. Bytes that have arrived wait until several can be read together.
pub fn next_poll<F: NorFlash>(
    app: &App<F>,
    hardware: &mut impl Hardware,
    polled: Instant,
    may_drive: bool,
) -> NextPoll {
    let longest = if may_drive { sonarfix_motors::PERIOD } else { POLL_AT_LEAST_EVERY };
    let due = app.next_poll(hardware).min(after(polled, longest));
    NextPoll { due, with_bytes: after(polled, PACE) }
}

/// When a board polls again.
#[derive(Debug, Clone, Copy)]
pub struct NextPoll {
    due: Instant,
    with_bytes: Instant,
}

impl NextPoll {
    /// That of the first poll.
    pub const AT_ONCE: Self =
        Self { due: Instant::from_ticks(0), with_bytes: Instant::from_ticks(0) };

    /// The instant, if bytes have arrived or not.
    #[must_use]
    pub fn at(&self, has_bytes: bool) -> Instant {
        if has_bytes { self.due.min(self.with_bytes) } else { self.due }
    }
}

fn after(instant: Instant, span: Duration) -> Instant {
    instant.checked_add_duration(span).unwrap_or(instant)
}

fn version() -> [u8; 3] {
    let number = |text: &str| text.parse().unwrap_or(0);
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}
