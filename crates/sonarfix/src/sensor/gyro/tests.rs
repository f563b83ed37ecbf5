//! Limits of turns and samples, and the reading between samples.

use proptest::prelude::*;

use super::*;
use crate::geometry::units::Instant;

const GYRO: GyroParameters = GyroParameters::MPU_6050;

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

/// A sixteenth of the time of the step and 2 ms; 1 % more than the range.
#[test]
fn a_turn_is_refused_beyond_its_limits() {
    let elapsed = Duration::from_ticks(160_000);
    let check = |ticks: u64, angle: f32| {
        let turn = MeasuredTurn { angle: Radians(angle), duration: Duration::from_ticks(ticks) };
        turn.check(&GYRO, elapsed)
    };
    for (ticks, expected) in [
        (160_000, Ok(())),
        (172_000, Ok(())),
        (148_000, Ok(())),
        (172_001, Err(TurnRefusal::WrongDuration)),
        (147_999, Err(TurnRefusal::WrongDuration)),
    ] {
        assert_eq!(check(ticks, 0.0), expected, "{ticks}");
    }
    let most = GYRO.range.0 * 0.16;
    for (share, expected) in [(1.005, Ok(())), (1.015, Err(TurnRefusal::TooFast))] {
        assert_eq!(check(160_000, share * most), expected, "{share}");
        assert_eq!(check(160_000, -share * most), expected, "-{share}");
    }
}

/// Five periods are spanned, and what is missing in them is counted.
#[test]
fn missing_samples_are_spanned_up_to_a_limit() {
    for (elapsed, expected, missing) in [
        (10_000, Ok(()), 0),
        (14_900, Ok(()), 0),
        (15_000, Ok(()), 1),
        (24_900, Ok(()), 1),
        (26_000, Ok(()), 2),
        (50_000, Ok(()), 4),
        (50_001, Err(SampleFault::Missing), 4),
        (96_000, Err(SampleFault::Missing), 9),
    ] {
        let mut integral = TurnIntegral::new(&GYRO);
        integral.sample(at(0), RadiansPerSecond(0.1)).unwrap();
        assert_eq!(integral.sample(at(elapsed), RadiansPerSecond(0.2)), expected, "{elapsed}");
        assert_eq!(integral.faults().missing, missing, "{elapsed}");
        let reading = integral.reading(at(elapsed));
        assert_eq!(reading.breaks(), Some(u32::from(expected.is_err())));
    }
}

/// Since the last sample the rate is constant, for five periods.
#[test]
fn a_reading_extrapolates_the_last_rate() {
    let mut integral = TurnIntegral::new(&GYRO);
    integral.sample(at(0), RadiansPerSecond(0.1)).unwrap();
    integral.sample(at(10_000), RadiansPerSecond(0.3)).unwrap();
    let radians = |angle: f64| angle * 2_f64.powi(40);
    for (ticks, angle, breaks) in [
        (10_000, 0.002, Some(0)),
        (14_000, 0.002 + 0.3 * 0.004, Some(0)),
        (60_000, 0.002 + 0.3 * 0.05, Some(0)),
        (60_001, 0.002, None),
    ] {
        let reading = integral.reading(at(ticks));
        assert_eq!((reading.at(), reading.breaks()), (at(ticks), breaks), "{ticks}");
        #[expect(clippy::cast_precision_loss, reason = "a small angle")]
        let is = reading.angle() as f64;
        assert!((is / radians(angle) - 1.0).abs() < 1e-6, "{ticks}: {is}");
        assert_eq!(TurnReading::new(at(ticks), reading.angle(), breaks), reading);
    }
}

#[test]
fn failed_readings_are_counted() {
    let mut integral = TurnIntegral::new(&GYRO);
    integral.unreadable();
    integral.unreadable();
    assert_eq!(integral.faults(), SampleFaults { unreadable: 2, ..SampleFaults::default() });
}

proptest! {
    #[test]
    fn a_reading_between_two_has_the_constant_rate(
        start in any::<u32>(), whole in 1_u32..2_000_000, share in 0.0_f64..=1.0, from in any::<i32>(), turned in any::<i32>(),
        breaks in (0_u32..3, 0_u32..3),
    ) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a small number")]
        let part = (share * f64::from(whole)) as u32;
        let (start, later) = (u64::from(start), u64::from(start) + u64::from(whole));
        let one = TurnReading::new(at(start), from.into(), Some(breaks.0));
        let other = TurnReading::new(at(later), i64::from(from) + i64::from(turned), Some(breaks.1));
        let is = one.between(&other, at(start + u64::from(part)));
        let expected = i64::from(from) + i64::from(turned) * i64::from(part) / i64::from(whole);
        prop_assert_eq!(is.angle(), expected);
        prop_assert_eq!(is.at(), at(start + u64::from(part)));
        prop_assert_eq!(is.breaks(), (breaks.0 == breaks.1).then_some(breaks.0));
    }

    /// Sums of counts saturate.
    #[test]
    fn faults_add_up(one in [any::<u32>(), any::<u32>(), any::<u32>()], other in [any::<u32>(), any::<u32>(), any::<u32>()]) {
        let faults = |[a, b, c]: [u32; 3]| SampleFaults {
            unreadable: a, not_finite: b, saturated: c, stuck: a ^ 7, missing: b ^ 7, mistimed: c ^ 7, erratic: a ^ 9,
        };
        let sum = faults(one).plus(faults(other));
        for (i, is) in [sum.unreadable, sum.not_finite, sum.saturated].into_iter().enumerate() {
            prop_assert_eq!(is, one[i].saturating_add(other[i]));
        }
        prop_assert_eq!(sum.erratic, (one[0] ^ 9).saturating_add(other[0] ^ 9));
        for (i, is) in [sum.stuck, sum.missing, sum.mistimed].into_iter().enumerate() {
            prop_assert_eq!(is, (one[i] ^ 7).saturating_add(other[i] ^ 7));
        }
    }
}
