//! The drivers of a robot on its wires.

use sonarfix::config::{MAX_RANGERS, RangerId, ServoTiming};
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::gyro::Mpu6050;
use sonarfix_hal::ranger::{Captured, OneOf, PulseRanger, Vl53l0x, Vl53l1x};
use sonarfix_hal::robot::{Devices, Hardware, WithGyro, WithRangers};
use sonarfix_hal::servo::{PwmFrame, Servo};

use crate::wires::{
    CounterWire, GyroWire, RangerWires, ServoWire, TriggerWire, Vl53l0xWire, Vl53l1xWire, Wires,
};

/// The drivers on a robot's wires.
pub type WiredDevices<'w> = WithGyro<WithRangers<OneRanger<'w>, FURTHER>, Mpu6050<&'w GyroWire>>;

type OneRanger<'w> = Devices<
    &'w CounterWire,
    &'w CounterWire,
    &'w ServoWire,
    OneOf<PulseRanger<&'w TriggerWire, Captured<'w>>, TimeOfFlight<'w>>,
>;

type TimeOfFlight<'w> = OneOf<Vl53l1x<&'w Vl53l1xWire>, Vl53l0x<&'w Vl53l0xWire>>;

/// The rangers beside the first.
const FURTHER: usize = MAX_RANGERS - 1;

/// Creates the drivers on the wires for this robot. The PWM channel has the period of its servo.
///
/// # Errors
/// [`Unsupported`], by what the drivers do not support.
pub fn devices<'w>(
    config: &RobotConfig,
    wires: &'w Wires,
) -> Result<WiredDevices<'w>, Unsupported> {
    let Wires { right, left, rangers: [first, further @ ..], gyro } = wires;
    let frame_of = |ranger: usize| {
        let ranger = u8::try_from(ranger).map_or(RangerId::FIRST, RangerId);
        let timing = config.localizer.rangers.get(ranger).map(|sonar| sonar.timing.servo);
        PwmFrame::of(timing.unwrap_or(ServoTiming::INSTANT).frame)
    };
    let ranger = |wires: &'w RangerWires| {
        let pulse = PulseRanger::new(&wires.trigger, Captured::new(&wires.echo));
        let light = OneOf::new(Vl53l1x::new(&wires.vl53l1x), Vl53l0x::new(&wires.vl53l0x));
        OneOf::new(pulse, light)
    };
    let mut number = 0;
    let servos = further.each_ref().map(|wires| {
        number += 1;
        Servo::new(&wires.servo, frame_of(number))
    });
    let servo = Servo::new(&first.servo, frame_of(0));
    let one = Devices { right, left, servo, ranger: ranger(first) };
    let devices = WithRangers { devices: one, servos, rangers: further.each_ref().map(ranger) };
    let mut devices = WithGyro { devices, gyro: Mpu6050::new(gyro) };
    devices.configure(config)?;
    Ok(devices)
}
