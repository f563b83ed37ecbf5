//! Heading, position and pose from outside, against a joint update in `f64` whose derivatives are finite differences.

use std::f32::consts::PI;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use proptest::prelude::*;
use sonarfix::config::Config;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal, Localizer};
use sonarfix::map::Map;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix::sensor::gyro::GyroParameters;

use crate::strategies::{any_deviation, any_drive, any_state, any_travel};

type Matrix = SMatrix<f64, 7, 7>;
type Vector = SVector<f64, 7>;

/// A tick, µs.
const TICK: u64 = 100_000;
const NO_MAP: Map = Map::new(&[]);

/// The parts of a measurement: its innovation in standard deviations of S, its noise, and when it was made.
#[derive(Debug, Clone, Copy)]
struct Plan {
    kind: usize,
    deviations: [f64; 3],
    sigmas: [f64; 3],
    correlations: [f64; 3],
    ago: u64,
}

fn any_plan(deviations: f64) -> impl Strategy<Value = Plan> {
    let off = || -deviations..deviations;
    let correlation = || -0.6..0.6;
    (
        0..3_usize,
        [off(), off(), off()],
        [0.01..0.3, 0.01..0.3, 0.01..0.2],
        [correlation(), correlation(), correlation()],
        0..=TICK,
    )
        .prop_map(|(kind, deviations, sigmas, correlations, ago)| Plan {
            kind,
            deviations,
            sigmas,
            correlations,
            ago,
        })
}

impl Plan {
    /// The states that are measured.
    fn measured(&self) -> [bool; 3] {
        [[false, false, true], [true, true, false], [true, true, true]][self.kind]
    }

    /// R. Correlations of at most 0.6 with this sign rule leave it positive definite.
    fn noise(&self) -> Matrix3<f64> {
        let [a, b, c] = self.correlations;
        // A product of unit triangular factors is positive definite whatever its entries.
        let l = Matrix3::new(1.0, 0.0, 0.0, a, 1.0, 0.0, b, c, 1.0);
        let d = Matrix3::from_diagonal(&Vector3::from(self.sigmas).map(|sigma| sigma * sigma));
        l * d * l.transpose()
    }

    #[expect(clippy::cast_possible_truncation, reason = "metres and radians")]
    fn of(&self, z: Vector3<f64>) -> AbsoluteMeasurement {
        let r = self.noise().map(|v| v as f32);
        let z = z.map(|v| v as f32);
        let position = PositionNoise { xx: r[(0, 0)], xy: r[(0, 1)], yy: r[(1, 1)] };
        let (xh, yh, hh) = (r[(0, 2)], r[(1, 2)], r[(2, 2)]);
        match self.kind {
            0 => {
                AbsoluteMeasurement::Heading { angle: Radians(z.z), deviation: Radians(hh.sqrt()) }
            }
            1 => AbsoluteMeasurement::Position { point: Point::new(z.x, z.y), noise: position },
            _ => AbsoluteMeasurement::Pose {
                pose: Pose::new(z.x, z.y, Radians(z.z)),
                noise: PoseNoise { position, xh, yh, hh },
            },
        }
    }
}

fn vector(localizer: &Localizer) -> Vector {
    localizer.filter().state_vector().map(f64::from)
}

fn matrix(localizer: &Localizer) -> Matrix {
    localizer.filter().covariance().map(f64::from)
}

fn wrap(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

/// A joint update by the measured components, with the model of outliers, in `f64`.
struct Oracle {
    /// h of the present state, m and rad: the pose `share` of the latest step ago.
    moved: [f64; 3],
    share: f64,
    heading: f64,
}

impl Oracle {
    /// The pose at the time of the measurement; the displacement turns with the heading.
    fn pose(&self, x: &Vector) -> Vector3<f64> {
        let (sin, cos) = (x[2] - self.heading).sin_cos();
        let [dx, dy, turn] = self.moved.map(|v| v * self.share);
        let moved = [cos * dx - sin * dy, sin * dx + cos * dy];
        Vector3::new(x[0] - moved[0], x[1] - moved[1], x[2] - turn)
    }

    fn derivatives(&self, x: &Vector) -> SMatrix<f64, 3, 7> {
        let mut all = SMatrix::<f64, 3, 7>::zeros();
        for column in 0..7 {
            let at = |by: f64| {
                let mut x = *x;
                x[column] += by;
                self.pose(&x)
            };
            all.set_column(column, &((at(1e-6) - at(-1e-6)) / 2e-6));
        }
        all
    }

    /// Association probability, state and covariance after the measurement `z`.
    fn update(&self, x: Vector, p: &Matrix, z: Vector3<f64>, plan: &Plan) -> (f64, Vector, Matrix) {
        // A row without derivatives, innovation and correlation adds a factor of one to determinant and density.
        let measured = plan.measured();
        let count = measured.iter().filter(|&&is| is).count();
        let h3 = self.derivatives(&x);
        let h = SMatrix::<f64, 3, 7>::from_fn(|i, j| if measured[i] { h3[(i, j)] } else { 0.0 });
        let noise = plan.noise();
        let r = Matrix3::from_fn(|i, j| {
            if measured[i] && measured[j] { noise[(i, j)] } else { f64::from(u8::from(i == j)) }
        });
        let mut off = z - self.pose(&x);
        off.z = wrap(off.z);
        let nu = Vector3::from_fn(|i, _| if measured[i] { off[i] } else { 0.0 });
        let s = h * p * h.transpose() + r;
        let inverse = s.try_inverse().unwrap();
        let nis = nu.dot(&(inverse * nu));
        // Density at the estimate over that of an outlier in 100 m² and all headings.
        let tau = std::f64::consts::TAU;
        let peak = 1.0 / (tau.powi(i32::try_from(count).unwrap()) * s.determinant()).sqrt();
        let uniform = [1.0 / tau, 0.01, 0.01 / tau][plan.kind];
        let outlier = 0.05 * uniform.min(peak);
        let right = 0.95 * peak * (-0.5 * nis).exp();
        let beta = right / (right + outlier);
        let beta = if beta >= 0.999 { 1.0 } else { beta };
        let gain = p * h.transpose() * inverse;
        let step = gain * nu;
        let certain = p - gain * s * gain.transpose();
        let mixed =
            (1.0 - beta) * p + beta * certain + beta * (1.0 - beta) * step * step.transpose();
        let mut corrected = x + beta * step;
        corrected[2] = wrap(corrected[2]);
        (beta, corrected, mixed)
    }
}

/// A localizer after some steps, with its state before the last one.
fn driven(
    config: &Config,
    state: StateEstimate,
    deviation: StandardDeviations,
    travels: &[WheelTravel],
) -> (Localizer<'static>, Vector) {
    let now = Instant::from_ticks(0);
    let mut localizer = Localizer::resume(*config, NO_MAP, state, deviation, now).unwrap();
    let mut before = vector(&localizer);
    for (step, travel) in (1..).zip(travels) {
        before = vector(&localizer);
        localizer.odometry(Instant::from_ticks(step * TICK), *travel).unwrap();
    }
    (localizer, before)
}

#[expect(clippy::cast_precision_loss, reason = "a tick")]
fn oracle(localizer: &Localizer, before: &Vector, ago: u64) -> Oracle {
    let x = vector(localizer);
    let moved = [x[0] - before[0], x[1] - before[1], wrap(x[2] - before[2])];
    Oracle { moved, share: ago as f64 / TICK as f64, heading: x[2] }
}

/// What is measured with these deviations of S off.
fn off(plan: &Plan, oracle: &Oracle, localizer: &Localizer) -> Vector3<f64> {
    let (x, p) = (vector(localizer), matrix(localizer));
    let h = oracle.derivatives(&x);
    let s = h * p * h.transpose() + plan.noise();
    let sigmas = s.diagonal().map(f64::sqrt);
    oracle.pose(&x) + sigmas.component_mul(&Vector3::from(plan.deviations))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// State, covariance and outcome are those of one joint update. The state to 1 % of a deviation and deviations to 0.3 %:
    /// the rounding of `f32` in correlated states, and 1e-5 of the probability.
    #[test]
    fn a_measurement_is_a_joint_update(
        drive in any_drive(),
        state in any_state(),
        deviation in any_deviation(),
        travels in proptest::collection::vec(any_travel(), 2..20),
        plan in any_plan(6.0),
    ) {
        let mut config = Config::for_track_width(drive.track_width);
        config.drive = drive;
        let (mut localizer, before) = driven(&config, state, deviation, &travels);
        let oracle = oracle(&localizer, &before, plan.ago);
        let z = off(&plan, &oracle, &localizer);
        let (x, p) = (vector(&localizer), matrix(&localizer));
        let (beta, expected, covariance) = oracle.update(x, &p, z, &plan);
        let at = Instant::from_ticks(localizer.time().ticks() - plan.ago);
        let fix = localizer.absolute(at, &plan.of(z));
        let (agreement, betas) = match fix {
            AbsoluteFix::Accepted(agreement) => (agreement, 0.799..1.001),
            AbsoluteFix::Downweighted(agreement) => (agreement, 0.019..0.801),
            AbsoluteFix::Gated(agreement) => (agreement, -0.001..0.021),
            other => return Err(TestCaseError::fail(format!("{other:?}"))),
        };
        prop_assert!(betas.contains(&beta), "{fix:?} {beta}");
        let measured = plan.measured().into_iter().filter(|is| *is).count();
        prop_assert_eq!(usize::from(agreement.dimensions), measured);
        let (is, is_p) = (vector(&localizer), matrix(&localizer));
        if !fix.is_used() {
            prop_assert_eq!((is, is_p), (x, p));
            return Ok(());
        }
        for state in 0..7 {
            let sigma = covariance[(state, state)].sqrt();
            let mut error = is[state] - expected[state];
            if state == 2 {
                error = wrap(error);
            }
            prop_assert!(error.abs() < 0.01 * sigma, "{state}: {error} {sigma}");
            let ratio = is_p[(state, state)].sqrt() / sigma;
            prop_assert!((ratio - 1.0).abs() < 3e-3, "{state}: {ratio}");
        }
    }

    /// An accepted measurement lowers all variances or leaves them; P stays symmetric and positive definite under many.
    #[test]
    fn p_stays_a_covariance(
        drive in any_drive(),
        state in any_state(),
        deviation in any_deviation(),
        travels in proptest::collection::vec(any_travel(), 30),
        plans in proptest::collection::vec(any_plan(4.0), 30),
        has_gyro in any::<bool>(),
    ) {
        let mut config = Config::for_track_width(drive.track_width);
        config.drive = drive;
        config.gyro = has_gyro.then_some(GyroParameters::MPU_6050);
        let (mut localizer, mut before) = driven(&config, state, deviation, &travels[..1]);
        for (travel, plan) in travels.iter().zip(&plans) {
            let oracle = oracle(&localizer, &before, plan.ago);
            let z = off(plan, &oracle, &localizer);
            let (p, bias) = (matrix(&localizer), localizer.gyro().map(|gyro| gyro.deviation.0));
            let at = Instant::from_ticks(localizer.time().ticks() - plan.ago);
            let fix = localizer.absolute(at, &plan.of(z));
            let after = matrix(&localizer);
            prop_assert_eq!(after, after.transpose());
            // By correlation, so that the units of the states have no effect.
            let scale = after.diagonal().map(|v| 1.0 / v.sqrt());
            let correlation = Matrix::from_fn(|i, j| after[(i, j)] * scale[i] * scale[j]);
            let least = correlation.symmetric_eigenvalues().min();
            prop_assert!(least > -1e-6, "{least}");
            let is_certain = matches!(fix, AbsoluteFix::Accepted(agreement) if agreement.nis < 4.0);
            if is_certain {
                for state in 0..7 {
                    let (was, is) = (p[(state, state)], after[(state, state)]);
                    // The variances of the wheels come from those of their mean and difference.
                    let wheels = if state == 3 || state == 4 { p[(3, 3)] + p[(4, 4)] } else { 0.0 };
                    let rounding = 1e-5 * was + 1e-6 * wheels;
                    prop_assert!(is <= was + rounding, "{state}: {was} {is}");
                }
                let is = localizer.gyro().map(|gyro| gyro.deviation.0);
                prop_assert!(is.zip(bias).is_none_or(|(is, was)| is <= was * (1.0 + 1e-5)));
            }
            before = vector(&localizer);
            let now = Instant::from_ticks(localizer.time().ticks() + TICK);
            localizer.odometry(now, *travel).unwrap();
        }
    }

    /// Headings are compared modulo a full turn.
    #[test]
    fn the_innovation_of_a_heading_is_wrapped(heading in -PI..PI, off in -0.05_f32..0.05, turns in -3_i8..=3) {
        let mut localizer = parked(Radians(heading));
        let angle = Radians(heading + off + f32::from(turns) * std::f32::consts::TAU);
        let measured = AbsoluteMeasurement::Heading { angle, deviation: Radians(0.05) };
        let fix = localizer.absolute(localizer.time(), &measured);
        prop_assert!(matches!(fix, AbsoluteFix::Accepted(_)), "{fix:?}");
        // Both deviations are 0.05 rad, so that it is corrected by the half, and 0.3 % less for an outlier.
        let turned = wrap(f64::from(localizer.pose().heading.radians().0 - heading));
        prop_assert!((turned - 0.5 * f64::from(off)).abs() < 2e-4, "{turned} {off}");
    }
}

fn parked(heading: Radians) -> Localizer<'static> {
    let state = StateEstimate { heading, ..StateEstimate::default() };
    let deviation = StandardDeviations {
        x: Metres(0.05),
        y: Metres(0.05),
        heading: Radians(0.05),
        ..StandardDeviations::from_array([0.0; 7])
    };
    let config = Config::for_track_width(Metres(0.2));
    driven(&config, state, deviation, &[]).0
}

fn compass(degrees: f32) -> AbsoluteMeasurement {
    let (angle, deviation) = (Radians::from_degrees(degrees), Radians::from_degrees(2.0));
    AbsoluteMeasurement::Heading { angle, deviation }
}

fn beacon(x: f32) -> AbsoluteMeasurement {
    let noise = PositionNoise::circular(Metres(0.05));
    AbsoluteMeasurement::Position { point: Point::new(x, 0.0), noise }
}

/// What cannot be used has a name and changes nothing.
#[test]
fn each_refusal_is_named_and_changes_nothing() {
    use AbsoluteRefusal::{AfterLastStep, BeforeLastStep, NotFinite, NotPositiveDefinite};
    let mut localizer = parked(Radians(0.0));
    localizer.odometry(Instant::from_ticks(TICK), WheelTravel::new(0.02, 0.02)).unwrap();
    localizer.odometry(Instant::from_ticks(2 * TICK), WheelTravel::new(0.02, 0.02)).unwrap();
    let position = |x, xx, xy, yy| AbsoluteMeasurement::Position {
        point: Point::new(x, 0.0),
        noise: PositionNoise { xx, xy, yy },
    };
    let heading = |angle, deviation| AbsoluteMeasurement::Heading {
        angle: Radians(angle),
        deviation: Radians(deviation),
    };
    let mut noise = PoseNoise::independent(Metres(0.1), Radians(0.1));
    noise.xh = 0.01;
    let singular = AbsoluteMeasurement::Pose { pose: Pose::new(0.0, 0.0, Radians(0.0)), noise };
    let good = compass(0.0);
    let (now, nan) = (2 * TICK, f32::NAN);
    for (at, measurement, expected) in [
        (now, position(nan, 0.01, 0.0, 0.01), NotFinite),
        (now, position(0.0, 0.01, f32::INFINITY, 0.01), NotFinite),
        (now, heading(nan, 0.1), NotFinite),
        (now, position(0.0, 0.01, 0.01, 0.01), NotPositiveDefinite),
        (now, position(0.0, 0.01, 0.0, -0.01), NotPositiveDefinite),
        (now, heading(0.0, 0.0), NotPositiveDefinite),
        (now, heading(0.0, -0.1), NotPositiveDefinite),
        (now, singular, NotPositiveDefinite),
        (TICK - 1, good, BeforeLastStep),
        (2 * TICK + 1, good, AfterLastStep),
    ] {
        let (filter, health) = (*localizer.filter(), localizer.health());
        let fix = localizer.absolute(Instant::from_ticks(at), &measurement);
        assert_eq!(fix, AbsoluteFix::Refused(expected), "{at} {measurement:?}");
        assert_eq!((*localizer.filter(), localizer.health()), (filter, health));
    }
    for at in [TICK, 2 * TICK] {
        assert!(localizer.absolute(Instant::from_ticks(at), &good).is_used());
    }
    // What happened before a new pose is not known of it, nor is the path without odometry.
    let start = sonarfix::localizer::Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: Metres(0.1),
        heading_deviation: Radians(0.1),
    };
    localizer.set_pose(&start).unwrap();
    let fix = localizer.absolute(Instant::from_ticks(2 * TICK - 1), &good);
    assert_eq!(fix, AbsoluteFix::Refused(BeforeLastStep));
    localizer.odometry_missing(Instant::from_ticks(3 * TICK));
    localizer.odometry(Instant::from_ticks(4 * TICK), WheelTravel::new(0.02, 0.02)).unwrap();
    let fix = localizer.absolute(Instant::from_ticks(4 * TICK - 1), &good);
    assert_eq!(fix, AbsoluteFix::Refused(BeforeLastStep));
    assert!(localizer.absolute(Instant::from_ticks(4 * TICK), &good).is_used());
}

/// A source that repeats an outlier is evidence once; one that is right again is used again.
#[test]
fn a_repeated_outlier_is_evidence_once() {
    let mut localizer = parked(Radians(0.0));
    let mut evidence = vec![];
    for _ in 0..20 {
        assert!(matches!(
            localizer.absolute(localizer.time(), &compass(90.0)),
            AbsoluteFix::Gated(_)
        ));
        evidence.push(localizer.health().evidence);
    }
    // ln(0.3 + 0.7/0.05), and then next to nothing.
    assert!((evidence[0] - 2.66).abs() < 0.01, "{evidence:?}");
    assert!(evidence[19] - evidence[0] < 0.8, "{evidence:?}");
    assert_ne!(localizer.health().verdict, Verdict::Lost);
    assert!(localizer.absolute(localizer.time(), &compass(0.0)).is_used());
}

/// Each measurement that agrees lowers the probability of the next outlier to 0.8 of what it was.
#[test]
fn measurements_that_agree_make_a_source_credible() {
    let mut localizer = parked(Radians(0.0));
    let gated = localizer.absolute(localizer.time(), &compass(90.0));
    assert!(matches!(gated, AbsoluteFix::Gated(_)));
    for _ in 0..4 {
        assert!(localizer.absolute(localizer.time(), &compass(0.0)).is_used());
    }
    let before = localizer.health().evidence;
    let gated = localizer.absolute(localizer.time(), &compass(90.0));
    assert!(matches!(gated, AbsoluteFix::Gated(_)));
    // An outlier was certain, as far as 0.95 is; now it is evidence again.
    let outlier = 0.95 * 0.8_f32.powi(4);
    let expected = (0.3 + 0.7 / outlier).ln();
    let evidence = localizer.health().evidence - before;
    assert!((evidence - expected).abs() < 0.01, "{evidence} {expected}");
}

/// A heading that agrees confirms no position; a position does.
#[test]
fn only_a_position_is_evidence_for_the_pose() {
    let mut localizer = parked(Radians(0.0));
    localizer.odometry(Instant::from_ticks(TICK), WheelTravel::new(0.02, 0.02)).unwrap();
    let now = localizer.time();
    let fix = localizer.absolute(now, &beacon(3.0));
    assert!(matches!(fix, AbsoluteFix::Gated(_)), "{fix:?}");
    let before = localizer.health();
    assert!(before.evidence > 2.0 && before.gated_in_a_row == 1);
    assert!(matches!(localizer.absolute(now, &compass(0.0)), AbsoluteFix::Accepted(_)));
    let after = localizer.health();
    assert!(after.evidence >= before.evidence && after.gated_in_a_row == 1);
    assert!(after.rolled_since_fix > Metres(0.0) && after.accepted_in_a_row == 0);
    assert!(localizer.absolute(now, &beacon(0.02)).is_used());
    let after = localizer.health();
    assert!(after.evidence < before.evidence);
    assert!(after.rolled_since_fix <= Metres(0.0) && after.time_since_fix.is_zero());
}

/// Without ranges and positions, headings do not keep the verdict.
#[test]
fn headings_alone_do_not_keep_the_verdict() {
    let mut localizer = parked(Radians(0.0));
    for tick in 1..=700 {
        localizer.odometry(Instant::from_ticks(tick * TICK), WheelTravel::new(0.02, 0.02)).unwrap();
        let fix = localizer.absolute(localizer.time(), &compass(0.0));
        assert!(fix.is_used());
    }
    assert_eq!(localizer.health().verdict, Verdict::Degraded);
}

/// A heading measured beside the wheels shows the bias of a gyro.
#[test]
fn headings_show_the_bias_of_a_gyro() {
    let mut config = Config::for_track_width(Metres(0.2));
    config.gyro = Some(GyroParameters::MPU_6050);
    let deviation = StandardDeviations {
        heading: Radians(0.01),
        x: Metres(0.01),
        y: Metres(0.01),
        // The track width is so uncertain that the wheels do not show it.
        track_width_error: Metres(0.05),
        scale_right: 0.1,
        scale_left: 0.1,
        range_scale: 0.0,
    };
    let (mut localizer, _) = driven(&config, StateEstimate::default(), deviation, &[]);
    let bias = 0.02_f32;
    for tick in 1..=600_u64 {
        let turn = sonarfix::sensor::gyro::MeasuredTurn {
            angle: Radians(bias * 0.1),
            duration: sonarfix::geometry::units::Duration::from_ticks(TICK),
        };
        let now = Instant::from_ticks(tick * TICK);
        localizer.odometry_with_turn(now, WheelTravel::new(0.02, 0.02), Some(turn)).unwrap();
        assert!(localizer.absolute(now, &compass(0.0)).is_used());
    }
    let gyro = localizer.gyro().unwrap();
    let error = (gyro.bias.0 - bias).abs();
    assert!(gyro.deviation.0 < 0.002 && error < 4.0 * gyro.deviation.0, "{gyro:?}");
}

/// The bias of a gyro takes part in the uncertainty of the association. Its gain follows from its correction.
#[test]
fn the_bias_is_uncertain_by_the_association() {
    let mut config = Config::for_track_width(Metres(0.2));
    config.gyro = Some(GyroParameters::MPU_6050);
    let deviation = StandardDeviations::from_array([0.01, 0.01, 0.01, 0.1, 0.1, 0.02, 0.0]);
    let (mut localizer, _) = driven(&config, StateEstimate::default(), deviation, &[]);
    for tick in 1..=50_u64 {
        let turn = sonarfix::sensor::gyro::MeasuredTurn {
            angle: Radians(0.0),
            duration: sonarfix::geometry::units::Duration::from_ticks(TICK),
        };
        let now = Instant::from_ticks(tick * TICK);
        localizer.odometry_with_turn(now, WheelTravel::new(0.02, 0.02), Some(turn)).unwrap();
    }
    let (before, p) = (localizer.gyro().unwrap(), matrix(&localizer)[(2, 2)]);
    let noise = Radians::from_degrees(1.0);
    let s = p + f64::from(noise.0).powi(2);
    for deviations in [3.0, 3.5, 4.0] {
        let mut localizer = localizer.clone();
        #[expect(clippy::cast_possible_truncation, reason = "radians")]
        let angle = Radians(
            (f64::from(localizer.pose().heading.radians().0) + deviations * s.sqrt()) as f32,
        );
        let fix = localizer
            .absolute(localizer.time(), &AbsoluteMeasurement::Heading { angle, deviation: noise });
        assert!(matches!(fix, AbsoluteFix::Accepted(_) | AbsoluteFix::Downweighted(_)), "{fix:?}");
        let tau = std::f64::consts::TAU;
        let right = 0.95 * (-0.5 * deviations * deviations).exp() / (tau * s).sqrt();
        let beta = right / (right + 0.05 / tau);
        let after = localizer.gyro().unwrap();
        let moved = f64::from(after.bias.0 - before.bias.0);
        let nu = deviations * s.sqrt();
        let gain = moved / (beta * nu);
        let was = f64::from(before.deviation.0).powi(2);
        let expected = was - beta * gain * gain * s + (1.0 - beta) / beta * moved * moved;
        let is = f64::from(after.deviation.0).powi(2);
        // The part by the association alone is 2 % to 40 % of the variance.
        let spread = (1.0 - beta) / beta * moved * moved;
        assert!(
            (is - expected).abs() < 0.05 * spread,
            "{deviations}: {is} {expected} {spread} {was}"
        );
    }
}
