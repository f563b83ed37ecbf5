//! The robot that the boards here are built into, and the regions of flash that they all have.
//!
//! Measure yours: wheels, servo and sonar are the functions below. What the configuration holds is
//! not here.

#![no_std]

pub mod memory;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use sonarfix::units::{Duration, Metres, Radians};
use sonarfix_app::Body;
use sonarfix_hal::encoder::{WheelGeometry, Wheels};
use sonarfix_hal::ranger::{Air, Captured, EchoCapture, PulseRanger, PulseTiming};
use sonarfix_hal::robot::Settings;
use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo};
use sonarfix_link::message::Reset;

/// The wheels: 65 mm on gear motors with 11 lines. The left one's encoder is mounted as a mirror
/// image. `None` if the constants are no wheel.
#[must_use]
pub fn body(reset: Reset) -> Option<Body> {
    // 11 lines × 4 edges × 34.014 turns of the motor.
    let wheel = WheelGeometry::new(Metres(0.065), 1_496.6).ok()?;
    let wheels = Wheels { right: wheel, left: wheel.reversed() };
    Some(Body { wheels, settings: Settings::default(), firmware: version(), reset })
}

/// The servo, an SG90: two pulses that were tried on the bench, and how far it may turn. `None` if
/// the constants are no servo.
pub fn servo<P: SetDutyCycle>(pwm: P) -> Option<Servo<P>> {
    let tried = |width, degrees| MeasuredPulse {
        width: Duration::from_ticks(width),
        bearing: Radians::from_degrees(degrees),
    };
    let calibration = Calibration::new(tried(1_000, -45.0), tried(2_000, 45.0)).ok()?;
    let limits = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
    Servo::new(pwm, calibration, limits, Pace::SG90).ok()
}

/// The sonar, an HC-SR04.
pub fn sonar<T: OutputPin>(
    trigger: T,
    echo: &'static EchoCapture,
) -> PulseRanger<T, Captured<'static>> {
    PulseRanger::new(trigger, Captured::new(echo), PulseTiming::HC_SR04, Air::ROOM)
}

fn version() -> [u8; 3] {
    let number = |text: &str| text.parse().unwrap_or(0);
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}
