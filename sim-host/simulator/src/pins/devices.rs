//! The devices of a scenario on the world's side of the wires. What the drivers know of them is the
//! robot's configuration.

use sonarfix::config::{RangerParameters, ServoTiming};
use sonarfix::geometry::units::Duration;
use sonarfix_hal::config::{RangerConfig, RobotConfig};
use sonarfix_hal::ranger::{PulseTiming, RangerKind};
use sonarfix_hal::servo::MeasuredPulse;
use sonarfix_map::devices::{INSTANT_SERVO, MG996R};
use sonarfix_map::servo::bearing_of;
use sonarfix_map::{Scenario, ServoName};
use sonarfix_pil::wires::FULL_DUTY;

use crate::plant::servo::{ServoModel, ServoPlant};
use crate::world::air;

/// Right and left wheel's travel from tick to tick, metres; negative where the encoder is mirrored.
#[must_use]
pub fn ticks(robot: &RobotConfig) -> [f64; 2] {
    [&robot.right_wheel, &robot.left_wheel].map(|wheel| wheel.signed_travel().0.into())
}

/// How a servo of this name moves.
#[must_use]
pub fn servo_model(name: ServoName) -> ServoModel {
    match name {
        ServoName::Ideal => ServoModel::ideal(),
        ServoName::Sg90 => ServoModel::sg90(),
        ServoName::Mg996r => ServoModel::mg996r(),
    }
}

/// The servo of a sonar, of this name; or the fixed mount, at the configured bearing.
#[must_use]
pub fn servo(sonar: &RangerParameters, name: ServoName) -> ServoPlant {
    match sonar.fixed_bearing() {
        None => ServoPlant::new(servo_model(name)),
        Some(bearing) => ServoPlant::fixed(bearing.0.into()),
    }
}

/// Where a duty sends the servo, radians: the simulated servo is as `driver` says.
#[must_use]
pub fn bearing(duty: u16, sonar: &RangerParameters, driver: &RangerConfig) -> f64 {
    let frame = micros(sonar.timing.servo.frame);
    bearing_of(driver.servo_pulses, f64::from(duty) / f64::from(FULL_DUTY) * frame)
}

#[expect(clippy::cast_precision_loss, reason = "a frame has some thousand µs")]
fn micros(span: Duration) -> f64 {
    span.to_micros() as f64
}

/// Mounts another servo under the sonar of a scenario's robot, whose configuration then describes it:
/// its timing, and pulses that reach the robot's limits.
pub fn mount_servo(scenario: &mut Scenario, name: ServoName) {
    let (timing, [shortest, longest]) = match name {
        ServoName::Ideal => (INSTANT_SERVO, [100, 900]),
        ServoName::Sg90 => (ServoTiming::SG90, [500, 2_500]),
        ServoName::Mg996r => (MG996R, [500, 2_500]),
    };
    scenario.hardware.servo = name;
    let robot = &mut scenario.robot;
    let (rightmost, leftmost) = robot.localizer.rangers.first.servo;
    let pulse = |width, bearing| MeasuredPulse { width: Duration::from_ticks(width), bearing };
    robot.localizer.rangers.first.timing.servo = timing;
    robot.rangers.first.servo_pulses = [pulse(shortest, rightmost), pulse(longest, leftmost)];
}

/// How long the driver of a sonar listens, µs. At the fidelity of pins there are rangers
/// that answer with a pulse, and no others.
#[must_use]
pub fn listening_time(driver: &RangerConfig) -> u64 {
    let timing = match driver.kind {
        RangerKind::Pulse(timing) => timing,
        RangerKind::Srf { .. }
        | RangerKind::Custom
        | RangerKind::Vl53l1x { .. }
        | RangerKind::Vl53l0x { .. } => PulseTiming::HC_SR04,
    };
    timing.listen.to_micros()
}

/// The timing of a pulse ranger like an HC-SR04 that reaches as far as this, in metres, in air of
/// this temperature, in °C.
#[must_use]
pub fn timing_with_reach(reach: f64, temperature: f64) -> PulseTiming {
    /// What an HC-SR04 is given after its longest flight.
    const SHORT: PulseTiming = PulseTiming::HC_SR04;
    // A tenth more, for what is beyond the reach only by its noise or by the air.
    let flight = 1.1 * 2.0 * reach / air::speed_of_sound(temperature);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some ms")]
    let longest = Duration::from_ticks((flight * 1e6) as u64);
    PulseTiming {
        longest,
        silence: longest + (SHORT.silence - SHORT.longest),
        listen: longest + (SHORT.listen - SHORT.longest),
        stuck: longest + (SHORT.stuck - SHORT.longest),
        ..SHORT
    }
}
