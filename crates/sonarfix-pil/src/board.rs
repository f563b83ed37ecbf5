//! The drivers of a robot on its wires.

use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::gyro::Mpu6050;
use sonarfix_hal::ranger::{Captured, PulseRanger};
use sonarfix_hal::robot::{Devices, Hardware, WithGyro};
use sonarfix_hal::servo::{PwmFrame, Servo};

use crate::wires::{CounterWire, GyroWire, ServoWire, TriggerWire, Wires};

/// The drivers on a robot's wires.
pub type WiredDevices<'w> = WithGyro<
    Devices<
        &'w CounterWire,
        &'w CounterWire,
        &'w ServoWire,
        PulseRanger<&'w TriggerWire, Captured<'w>>,
    >,
    Mpu6050<&'w GyroWire>,
>;

/// Creates the drivers on the wires for this robot. The PWM channel has the period of its servo.
///
/// # Errors
/// [`Unsupported`], by what the drivers do not support.
pub fn devices<'w>(
    config: &RobotConfig,
    wires: &'w Wires,
) -> Result<WiredDevices<'w>, Unsupported> {
    let frame = PwmFrame::of(config.localizer.sonar.timing.servo.frame);
    let mut devices = WithGyro {
        devices: Devices {
            right: &wires.right,
            left: &wires.left,
            servo: Servo::new(&wires.servo, frame),
            ranger: PulseRanger::new(&wires.trigger, Captured::new(&wires.echo)),
        },
        gyro: Mpu6050::new(&wires.gyro),
    };
    devices.configure(config)?;
    Ok(devices)
}
