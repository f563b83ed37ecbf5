//! The state of the gyro step by step: slips, windows and what is forgotten.

use proptest::prelude::*;

use super::*;
use crate::filter::motion::Drive;
use crate::geometry::units::{Metres, PerRootMetre, PerRootSecond};
use crate::state::{StandardDeviations, StateEstimate};

const TICK: Duration = Duration::from_ticks(100_000);
/// Fast, and with a constant bias.
const GYRO: GyroParameters = GyroParameters {
    range: RadiansPerSecond(100.0),
    bias_walk: PerRootSecond(RadiansPerSecond(0.0)),
    ..GyroParameters::MPU_6050
};

fn ekf() -> Ekf {
    let drive = Drive {
        track_width: Metres(0.35),
        wheel_noise: PerRootMetre(Metres(0.002)),
        scale_walk: PerRootMetre(1e-4),
        track_width_walk: PerRootMetre(Metres(1e-4)),
    };
    let deviations = StandardDeviations {
        x: Metres(0.02),
        y: Metres(0.02),
        heading: Radians(0.02),
        scale_right: 0.005,
        scale_left: 0.005,
        track_width_error: Metres(0.002),
        range_scale: 0.01,
    };
    Ekf::new(drive, StateEstimate::default(), deviations).unwrap()
}

/// The turn of a gyro that measures what the wheels and its bias explain, and so much more.
fn turn(
    ekf: &Ekf,
    fusion: &GyroFusion,
    travel: WheelTravel,
    duration: Duration,
    more: f32,
) -> MeasuredTurn {
    let state = ekf.state();
    let (right, left) =
        (travel.right.0 * (1.0 + state.scale_right), travel.left.0 * (1.0 + state.scale_left));
    let by_wheels = (right - left) / (0.35 + state.track_width_error.0);
    let angle = by_wheels + fusion.bias.rate * seconds(duration) + more;
    MeasuredTurn { angle: Radians(angle), duration }
}

fn is_near(one: f32, other: f32) -> bool {
    (one - other).abs() < 1e-4 * (1.0 + other.abs())
}

proptest! {
    /// A slip ends after half a second without one; after three seconds the gyro may be wrong.
    #[test]
    fn slips_are_counted_with_their_pauses(
        steps in prop::collection::vec((0_u8..4, 3_u64..11, 0.05_f32..0.2), 1..60),
    ) {
        let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&GYRO));
        let travel = WheelTravel::new(0.02, 0.02);
        let (mut lasts, mut quiet, mut angle, mut slips, mut conflicts) = (0.0, 0.0, 0.0, 0_u32, 0_u32);
        for (kind, ticks, off) in steps {
            let time = Duration::from_ticks(37_000 * ticks);
            // The bias after a conflict is uncertain by some degrees a second.
            let more = if kind == 0 { 1.2 * off + 0.3 } else { 0.0 };
            let turn = turn(&ekf, &fusion, travel, time, more);
            let before = ekf.standard_deviations().heading.0;
            fusion.predict(&mut ekf, travel, time, Some(turn), &GYRO).unwrap();
            let seconds = seconds(time);
            if kind == 0 {
                prop_assert_eq!(fusion.status().latest, TurnUse::WheelSlip);
                prop_assert_eq!(fusion.difference, TurnDifference::default());
                if quiet > 0.5 || lasts <= 0.0 {
                    (lasts, quiet, angle) = (0.0, 0.0, 0.0);
                    slips += 1;
                }
                lasts += quiet + seconds;
                quiet = 0.0;
                angle += more;
            } else {
                prop_assert_eq!(fusion.status().latest, TurnUse::Combined);
                quiet += seconds;
            }
            prop_assume!((quiet - 0.5_f32).abs() > 1e-4 && (lasts - 3.0_f32).abs() > 1e-4);
            if lasts >= 3.0 {
                let inflated = before.hypot(angle);
                prop_assert!((ekf.standard_deviations().heading.0 / inflated - 1.0).abs() < 1e-2);
                prop_assert_eq!(fusion.bias, fusion.bias.forgotten(GYRO.bias.0));
                (lasts, quiet, angle) = (0.0, 0.0, 0.0);
                conflicts += 1;
            }
            prop_assert_eq!((fusion.status().slips, fusion.status().conflicts), (slips, conflicts));
            let Slip { lasts: is_lasting, quiet: is_quiet, angle: is_angle } = fusion.slip;
            prop_assert!(is_near(is_lasting, lasts) && is_near(is_quiet, quiet), "{:?}", fusion.slip);
            prop_assert!((is_angle - angle).abs() < 1e-3 * (1.0 + angle), "{:?} {}", fusion.slip, angle);
        }
    }

    /// The noise is that of the turn without its bias.
    #[test]
    fn a_turn_is_combined_by_its_noise(
        (right, left) in (0.0_f32..0.1, 0.0_f32..0.1), rate in -2.0_f32..2.0, off in -0.004_f32..0.004, ticks in 5_u64..15,
        scale in 0.01_f32..0.1,
    ) {
        let parameters = GyroParameters { scale, ..GYRO };
        let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&parameters));
        fusion.bias.rate = rate;
        let (travel, time) = (WheelTravel::new(right, left), Duration::from_ticks(10_000 * ticks));
        let turn = turn(&ekf, &fusion, travel, time, off);
        let (mut expected, mut bias) = (ekf, fusion.bias);
        let free = f64::from(turn.angle.0) - f64::from(rate) * f64::from(seconds(time));
        let square = |value: f32| f64::from(value).powi(2);
        let noise = square(parameters.noise.0.0) * f64::from(seconds(time))
            + square(scale) * std::f64::consts::FRAC_PI_2 * free * free / (free.abs() + 0.01);
        #[expect(clippy::cast_possible_truncation, reason = "a variance")]
        let measured = GyroTurn { angle: turn.angle.0, seconds: seconds(time), noise: noise as f32 };
        let limits = SlipLimits { deviations: 5.0, angle: 0.005 };
        let agreement = expected.predict_with_turn(travel, &measured, limits, &mut bias).unwrap();
        fusion.predict(&mut ekf, travel, time, Some(turn), &parameters).unwrap();
        let TurnAgreement::Agree(difference) = agreement else { return Err(TestCaseError::reject("a slip")) };
        let (is, of) = (ekf.covariance(), expected.covariance());
        let heading = (is[(2, 2)] - ekf_heading(), of[(2, 2)] - ekf_heading());
        prop_assert!((heading.0 - heading.1).abs() < 1e-4 * heading.1 + 1e-9, "{heading:?}");
        prop_assert!((fusion.difference.noise / difference.noise - 1.0).abs() < 1e-4);
        prop_assert!(is_near(fusion.difference.value, difference.value));
    }
}

/// Variance of the heading at the start.
fn ekf_heading() -> f32 {
    0.02 * 0.02
}

/// Differences of a second correct the bias together.
#[test]
fn differences_are_summed_over_a_second() {
    let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&GYRO));
    let travel = WheelTravel::new(0.02, 0.02);
    let before = fusion.bias.variance();
    for step in 1..=10_u8 {
        let turn = turn(&ekf, &fusion, travel, TICK, 1e-4);
        fusion.predict(&mut ekf, travel, TICK, Some(turn), &GYRO).unwrap();
        if step < 10 {
            assert!(is_near(fusion.difference.by_b, 0.1 * f32::from(step)), "{step}");
            assert!(is_near(fusion.bias.variance(), before), "{step}");
        }
    }
    assert_eq!(fusion.difference, TurnDifference::default());
    assert!(fusion.bias.variance() < 0.1 * before);
    assert!(fusion.bias.rate > 0.0);
}

/// The variance of a bias is that of the turn of a second.
#[test]
fn a_standing_robot_measures_its_bias_once_a_second() {
    let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&GYRO));
    let still = WheelTravel::default();
    let turn = MeasuredTurn { angle: Radians(0.001), duration: TICK };
    let prior = f64::from(GYRO.bias.0).powi(2);
    let mut information = 1.0 / prior;
    for step in 1..=30_u8 {
        fusion.predict(&mut ekf, still, TICK, Some(turn), &GYRO).unwrap();
        assert_eq!(fusion.status().latest, TurnUse::Standing);
        let (angle, time) = fusion.standing.unwrap();
        let collected = f32::from(step % 10);
        assert!(is_near(time, 0.1 * collected) && is_near(angle, 0.001 * collected), "{step}");
        if step % 10 == 0 {
            // Of the mean rate over a second.
            information += 1.0 / f64::from(GYRO.noise.0.0).powi(2);
        }
        let variance = f64::from(fusion.bias.variance());
        assert!((variance * information - 1.0).abs() < 0.05, "{step}: {variance} {information}");
    }
    assert!((fusion.bias.rate - 0.01).abs() < 1e-4, "{}", fusion.bias.rate);
    // A part is missing: another measurement begins.
    fusion.predict(&mut ekf, still, TICK, None, &GYRO).unwrap();
    assert_eq!((fusion.standing, fusion.status().latest), (Some((0.0, 0.0)), TurnUse::Missing));
    let before = fusion.bias;
    for _ in 0..9 {
        fusion.predict(&mut ekf, still, TICK, Some(turn), &GYRO).unwrap();
    }
    assert_eq!(fusion.bias.rate.to_bits(), before.rate.to_bits());
    fusion.predict(&mut ekf, still, TICK, Some(turn), &GYRO).unwrap();
    assert!(fusion.bias.rate.to_bits() != before.rate.to_bits());
}

/// By the random walk, up to the prior.
#[test]
fn the_bias_walks_up_to_its_prior() {
    let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&GYRO));
    let walk = PerRootSecond(RadiansPerSecond(0.02));
    let parameters = GyroParameters { bias: RadiansPerSecond(0.05), bias_walk: walk, ..GYRO };
    fusion.bias = GyroBias::unknown(0.01);
    for step in 1..=100_u8 {
        fusion.predict(&mut ekf, WheelTravel::new(0.01, 0.01), TICK, None, &parameters).unwrap();
        let expected = (1e-4 + 4e-4 * 0.1 * f64::from(step)).min(2.5e-3);
        let is = f64::from(fusion.bias.variance());
        assert!((is / expected - 1.0).abs() < 1e-3, "{step}: {is} {expected}");
    }
}

#[test]
fn what_is_replaced_is_independent_of_the_bias() {
    let (mut ekf, mut fusion) = (ekf(), GyroFusion::new(&GYRO));
    let travel = WheelTravel::new(0.03, 0.01);
    for _ in 0..13 {
        let turn = turn(&ekf, &fusion, travel, TICK, 1e-4);
        fusion.predict(&mut ekf, travel, TICK, Some(turn), &GYRO).unwrap();
    }
    let mut expected = fusion.bias;
    expected.forget_pose();
    assert!(expected != fusion.bias && fusion.difference != TurnDifference::default());
    let mut of_pose = fusion;
    of_pose.forget_pose();
    assert_eq!((of_pose.bias, of_pose.difference), (expected, fusion.difference));
    let mut of_all = fusion;
    of_all.forget_states();
    assert!(fusion.bias.independent() != fusion.bias);
    assert_eq!(
        (of_all.bias, of_all.difference),
        (fusion.bias.independent(), TurnDifference::default())
    );
}
