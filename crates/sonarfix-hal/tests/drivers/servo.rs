//! The servo on a mocked PWM channel.

use std::io::ErrorKind;

use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::pwm::{Mock, Transaction};
use proptest::prelude::*;
use sonarfix::geometry::units::Radians;
use sonarfix_hal::servo::{
    MeasuredPulse, PointError, PwmFrame, Servo, ServoSettings, ServoTiming, SettingError,
};

use super::{at, span};

/// 10 µs a degree, 1,500 µs ahead; longer pulses turn left.
fn settings(limits: (Radians, Radians), timing: ServoTiming) -> ServoSettings {
    let point = |width, degrees| MeasuredPulse {
        width: span(width),
        bearing: Radians::from_degrees(degrees),
    };
    ServoSettings { pulses: [point(600, -90.0), point(2_400, 90.0)], limits, timing }
}

fn degrees(limit: f32) -> (Radians, Radians) {
    (Radians::from_degrees(-limit), Radians::from_degrees(limit))
}

fn servo(pwm: &Mock) -> Servo<Mock> {
    Servo::configured(pwm.clone(), settings(degrees(80.0), ServoTiming::SG90)).unwrap()
}

#[test]
fn bearings_become_duties() {
    let mut pwm = Mock::new(&[
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(3_000),
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(3_000 + 45 * 20),
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(3_000 - 80 * 20),
    ]);
    let mut servo = servo(&pwm);
    for bearing in [0.0, 45.0, -80.0] {
        let bearing = Radians::from_degrees(bearing);
        servo.point(at(0), bearing).unwrap();
        let off = servo.target().unwrap() - bearing;
        assert!(off.abs() < Radians::from_degrees(0.05), "{off:?}");
    }
    pwm.done();
}

#[test]
fn the_same_duty_is_set_once_and_does_not_unsettle() {
    let mut pwm = Mock::new(&[
        Transaction::max_duty_cycle(255),
        Transaction::set_duty_cycle(19),
        Transaction::max_duty_cycle(255),
    ]);
    let mut servo = servo(&pwm);
    servo.point(at(0), Radians(0.0)).unwrap();
    let settles_at = servo.settles_at();
    // Eight bits make steps of 7.8°: the target is the bearing that is really reached.
    assert!((servo.target().unwrap() - Radians::from_degrees(-0.98)).abs() < Radians(0.001));
    servo.point(at(900_000), Radians::from_degrees(2.0)).unwrap();
    assert_eq!(servo.settles_at(), settles_at);
    pwm.done();
}

/// A clock that is set back does not make the servo wait for the old time: it settles as from an unknown bearing.
#[test]
fn a_servo_settles_after_the_clock_was_set_back() {
    let mut servo =
        Servo::configured(Pwm { counts: 40_000 }, settings(degrees(80.0), ServoTiming::SG90))
            .unwrap();
    servo.set_clock(at(0));
    assert!(!servo.is_settled(at(10_000_000)), "it was never told where to point");
    servo.point(at(0), Radians(0.0)).unwrap();
    let settles_in = servo.settles_at();
    servo.point(at(3_600_000_000), Radians(0.5)).unwrap();
    servo.point(at(3_600_000_000), Radians(0.0)).unwrap();
    servo.set_clock(at(0));
    assert_eq!(servo.settles_at(), settles_in);
    servo.fix(Radians(0.3));
    servo.point(at(3_600_000_000), Radians(0.3)).unwrap();
    servo.set_clock(at(5));
    assert!(servo.is_settled(at(5)));
}

#[test]
fn out_of_reach_touches_nothing() {
    let mut pwm = Mock::new(&[]);
    let mut servo = servo(&pwm);
    for bad in [Radians::from_degrees(80.1), Radians(-2.0), Radians(f32::NAN)] {
        assert_eq!(servo.point(at(0), bad), Err(PointError::OutOfReach), "{bad:?}");
    }
    assert_eq!(servo.target(), None);
    assert!(!servo.is_settled(at(u64::MAX)));
    pwm.done();
}

#[test]
fn a_failing_channel_leaves_the_servo_where_it_was() {
    let error = MockError::Io(ErrorKind::NotConnected);
    let mut pwm = Mock::new(&[
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(3_000),
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(4_000).with_error(error.clone()),
        // The same bearing is set again after a failure.
        Transaction::max_duty_cycle(40_000),
        Transaction::set_duty_cycle(4_000),
    ]);
    let mut servo = servo(&pwm);
    servo.point(at(0), Radians(0.0)).unwrap();
    let fifty = Radians::from_degrees(50.0);
    let later = servo.settles_at();
    assert_eq!(servo.point(later, fifty), Err(PointError::Pwm(error)));
    assert!(servo.is_settled(later));
    assert!(servo.bearing(later).unwrap().abs() < Radians(1e-4));
    servo.point(later, fifty).unwrap();
    assert!(!servo.is_settled(later));
    pwm.done();
}

#[test]
fn invalid_servo_settings_are_refused() {
    let pwm = || Pwm { counts: 40_000 };
    let new = |limits, timing| Servo::configured(pwm(), settings(limits, timing)).map(|_| ());
    assert_eq!(new(degrees(80.0), ServoTiming::SG90), Ok(()));
    assert_eq!(new(degrees(-80.0), ServoTiming::SG90), Err(SettingError::Limits));
    assert_eq!(new(degrees(f32::NAN), ServoTiming::SG90), Err(SettingError::Limits));
    // 160° are −100 µs.
    assert_eq!(new(degrees(160.0), ServoTiming::SG90), Err(SettingError::Pulse));
    let frameless = ServoTiming { frame: span(0), ..ServoTiming::SG90 };
    assert_eq!(new(degrees(80.0), frameless), Err(SettingError::Pulse));
}

/// Settings beyond the limits of the board's PWM channel are refused.
#[test]
fn settings_beyond_the_channel_are_refused_and_change_nothing() {
    let hobby = PwmFrame { period: span(20_000), shortest: span(500), longest: span(2_500) };
    let mut servo = Servo::new(Pwm { counts: 40_000 }, hobby);
    assert_eq!(servo.point(at(0), Radians(0.0)), Err(PointError::NotConfigured));
    servo.configure(&settings(degrees(90.0), ServoTiming::SG90)).unwrap();
    servo.point(at(0), Radians(1.0)).unwrap();
    let target = servo.target();
    // 110° are 2,600 µs.
    let too_far = settings(degrees(110.0), ServoTiming::SG90);
    assert_eq!(servo.configure(&too_far), Err(SettingError::Pulse));
    let digital = ServoTiming { frame: span(3_000), ..ServoTiming::SG90 };
    assert_eq!(servo.configure(&settings(degrees(90.0), digital)), Err(SettingError::Frame));
    servo.configure(&settings(degrees(90.0), ServoTiming::SG90)).unwrap();
    assert_eq!(servo.target(), target);
    servo.configure(&settings(degrees(60.0), ServoTiming::SG90)).unwrap();
    assert_eq!(servo.target(), None);
}

proptest! {
    /// At any resolution of the timer the target is within half a count of the commanded bearing, and the servo settles
    /// no earlier than its timing allows from its last position.
    #[test]
    fn any_bearing_is_met_within_half_a_count(
        counts in 1_000_u16..=u16::MAX,
        bearings in prop::collection::vec(-80.0_f32..80.0, 2..8),
    ) {
        let pwm = Pwm { counts };
        let mut servo =
            Servo::configured(pwm, settings(degrees(80.0), ServoTiming::SG90)).unwrap();
        let half_count = 0.5 * 20_000.0 / f32::from(counts) / 10.0 + 0.001;
        let (mut now, mut before) = (at(0), None);
        for bearing in bearings {
            servo.point(now, Radians::from_degrees(bearing)).unwrap();
            let target = servo.target().unwrap();
            let off = (target - Radians::from_degrees(bearing)).abs();
            prop_assert!(off <= Radians::from_degrees(half_count), "{off:?}");
            if let Some(from) = before.filter(|&from| from != target) {
                let turn: Radians = target - from;
                let slew = 120_000.0 * turn.abs().0.to_degrees() / 60.0;
                let taken = (servo.settles_at() - now).to_micros();
                prop_assert!((taken as f32 - (20_000.0 + slew + 60_000.0)).abs() < 2.0);
            }
            before = Some(target);
            now = servo.settles_at();
            prop_assert!(servo.is_settled(now) && !servo.is_settled(now - span(1)));
        }
    }
}

/// A PWM channel of any resolution.
struct Pwm {
    counts: u16,
}

impl embedded_hal::pwm::ErrorType for Pwm {
    type Error = core::convert::Infallible;
}

impl embedded_hal::pwm::SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        self.counts
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Self::Error> {
        assert!(duty <= self.counts);
        Ok(())
    }
}
