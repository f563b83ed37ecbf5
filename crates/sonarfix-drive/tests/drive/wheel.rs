//! The speed controller: what holds for any input, and closed loops with a motor.

use proptest::prelude::*;
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond};
use sonarfix_drive::wheel::{
    LONGEST_PERIOD, Limits, Motor, SettingsError, SpeedController, UpdateError,
};

use crate::motor::{LIMITS, MEASURED, MotorModel};

/// Time between two updates.
const PERIOD: u64 = 20;

/// A controller with a motor.
struct Loop {
    controller: SpeedController,
    motor: MotorModel,
    duty: f32,
}

impl Loop {
    fn new(motor: MotorModel) -> Self {
        Self { controller: controller(), motor, duty: 0.0 }
    }

    /// Drives for so many milliseconds; the speeds of each, smoothed over 100 ms as a person sees them.
    fn drive(&mut self, speed: f32, millis: u64) -> Vec<f64> {
        let mut speeds = Vec::new();
        for milli in 0..millis {
            if milli % PERIOD == 0 {
                let ticks = self.motor.ticks();
                let period = Duration::from_ticks(1_000 * PERIOD);
                self.duty = self.controller.update(MetresPerSecond(speed), ticks, period).unwrap();
            }
            self.motor.step(self.duty);
            speeds.push(self.motor.speed);
        }
        speeds.windows(100).map(|window| window.iter().sum::<f64>() / 100.0).collect()
    }

    /// Takes the voltage off.
    fn stop(&mut self) {
        self.controller.stop();
        self.duty = 0.0;
    }

    fn roll(&mut self, millis: u64) {
        for _ in 0..millis {
            self.motor.step(self.duty);
        }
    }
}

fn controller() -> SpeedController {
    SpeedController::new(MEASURED, LIMITS).unwrap()
}

/// Motors that differ from the measured one: a battery between 20 % less and 20 % more, half to one and a half of the
/// friction, half to twice the lag.
fn any_motor() -> impl Strategy<Value = MotorModel> {
    [0.8..1.2, 0.5..1.5, 0.5..2.0].prop_map(MotorModel::differing)
}

proptest! {
    /// The mean speed is that of the command within 3 % after 1.5 s. Before that, no 100 ms are faster than it by more than 20 % and
    /// the speed by which the friction was measured too large.
    #[test]
    fn the_speed_settles(motor in any_motor(), speed in 0.05_f32..0.3, is_back: bool) {
        let speed = if is_back { -speed } else { speed };
        let mut rig = Loop::new(motor);
        let speeds = rig.drive(speed, 3_000);
        let wanted = f64::from(speed);
        let most = 1.2 * wanted.abs() + rig.motor.excess_by_friction();
        for at in &speeds {
            prop_assert!(at.abs() < most, "{} of {}", at, wanted);
        }
        let settled = &speeds[1_500..];
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let mean = settled.iter().sum::<f64>() / settled.len() as f64;
        prop_assert!((mean - wanted).abs() < 0.03 * wanted.abs(), "{} of {}", mean, wanted);
    }

    /// A command of zero ends at a duty of zero and a wheel at rest within half a second; a stop takes the voltage off at once,
    /// and the wheel rests within 300 ms.
    #[test]
    fn the_wheel_stops(motor in any_motor(), speed in -0.3_f32..0.3) {
        let mut rig = Loop::new(motor);
        rig.drive(speed, 1_500);
        let mut other = Loop { controller: rig.controller, motor: rig.motor.clone(), duty: rig.duty };
        rig.drive(0.0, 500);
        prop_assert_eq!(rig.duty.to_bits(), 0);
        prop_assert!(rig.motor.is_at_rest());
        other.stop();
        other.roll(300);
        prop_assert!(other.motor.is_at_rest());
        // It begins again as it began first.
        prop_assert_eq!(other.controller, controller());
    }

    /// A wheel that was blocked does not race when it is free again: anti-windup. While it is blocked the duty is at its limit.
    #[test]
    fn a_blocked_wheel_does_not_race_afterwards(motor in any_motor(), speed in 0.1_f32..0.2) {
        let mut rig = Loop::new(motor);
        rig.motor.is_blocked = true;
        rig.drive(speed, 10_000);
        prop_assert!(rig.controller.is_saturated());
        rig.motor.is_blocked = false;
        let speeds = rig.drive(speed, 3_000);
        let wanted = f64::from(speed);
        // Within a second of its release the excess of the integral is gone.
        for at in &speeds[1_000..] {
            prop_assert!((at - wanted).abs() < 0.1 * wanted + 0.01, "{} of {}", at, wanted);
        }
    }

    /// Whatever the encoder reads, the duty is within its limit, and the mirrored input has the mirrored duty.
    #[test]
    fn the_duty_is_limited_and_symmetric(
        inputs in prop::collection::vec((-2.0_f32..2.0, -100_000_i64..100_000, 1_u64..200_000), 1..50),
        duty in 0.2_f32..=1.0,
    ) {
        let limits = Limits { duty, ..LIMITS };
        let mut one = SpeedController::new(MEASURED, limits).unwrap();
        let mut other = one;
        for (speed, position, period) in inputs {
            let period = Duration::from_ticks(period);
            let ahead = one.update(MetresPerSecond(speed), position, period).unwrap();
            let back = other.update(MetresPerSecond(-speed), -position, period).unwrap();
            prop_assert!(ahead.abs() <= duty, "{}", ahead);
            prop_assert_eq!(ahead.abs().to_bits(), back.abs().to_bits());
            prop_assert!(ahead * back <= 0.0);
        }
    }

    /// A refused update changes nothing.
    #[test]
    fn a_refused_update_is_inert(speed in -0.4_f32..0.4, position: i32) {
        let mut wheel = controller();
        let period = Duration::from_ticks(10_000);
        wheel.update(MetresPerSecond(speed), 0, period).unwrap();
        let before = wheel;
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let update = wheel.update(MetresPerSecond(bad), position.into(), period);
            prop_assert_eq!(update, Err(UpdateError::Speed));
        }
        for bad in [Duration::from_ticks(0), LONGEST_PERIOD + Duration::from_ticks(1)] {
            let update = wheel.update(MetresPerSecond(speed), position.into(), bad);
            prop_assert_eq!(update, Err(UpdateError::Period));
        }
        prop_assert_eq!(wheel, before);
    }
}

/// A motor that is too weak for the command runs at its full speed, and the controller reports it.
#[test]
fn a_weak_motor_saturates() {
    let mut rig = Loop::new(MotorModel::differing([0.5, 1.0, 1.0]));
    let speeds = rig.drive(0.4, 3_000);
    assert!(rig.controller.is_saturated());
    assert!((speeds.last().unwrap() - 0.25).abs() < 1e-3, "{speeds:?}");
    // A commanded speed that it reaches is reached, without the excess of the time before.
    let speeds = rig.drive(0.15, 1_500);
    assert!(!rig.controller.is_saturated());
    assert!((speeds.last().unwrap() - 0.15).abs() < 0.01, "{:?}", speeds.last());
}

#[test]
fn invalid_settings_are_refused_by_name() {
    let zero = Duration::from_ticks(0);
    let motors = [
        (Motor { full_speed: MetresPerSecond(0.0), ..MEASURED }, SettingsError::FullSpeed),
        (Motor { full_speed: MetresPerSecond(f32::NAN), ..MEASURED }, SettingsError::FullSpeed),
        (Motor { dead_band: 1.0, ..MEASURED }, SettingsError::DeadBand),
        (Motor { dead_band: f32::NAN, ..MEASURED }, SettingsError::DeadBand),
        (Motor { time_constant: zero, ..MEASURED }, SettingsError::TimeConstant),
        (Motor { travel_per_tick: Metres(0.0), ..MEASURED }, SettingsError::TravelPerTick),
        (Motor { travel_per_tick: Metres(f32::NAN), ..MEASURED }, SettingsError::TravelPerTick),
    ];
    for (motor, error) in motors {
        assert_eq!(SpeedController::new(motor, LIMITS), Err(error));
    }
    let limits = [
        (Limits { response: zero, ..LIMITS }, SettingsError::Response),
        (Limits { ramp: zero, ..LIMITS }, SettingsError::Ramp),
        (Limits { duty: 0.15, ..LIMITS }, SettingsError::Duty),
        (Limits { duty: 1.1, ..LIMITS }, SettingsError::Duty),
        (Limits { duty: f32::NAN, ..LIMITS }, SettingsError::Duty),
    ];
    for (limits, error) in limits {
        assert_eq!(SpeedController::new(MEASURED, limits), Err(error));
    }
}
