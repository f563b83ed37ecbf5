//! The gyro beside the wheels, against a filter in `f64` that takes the turn as one measurement in each step, in the joint
//! space of eight states and the noise of both wheels.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{
    Duration, Instant, Metres, PerRootSecond, Radians, RadiansPerSecond,
};
use sonarfix::localizer::{Localizer, Start, TurnUse};
use sonarfix::map::{Map, Wall};
use sonarfix::sensor::gyro::{
    GyroParameters, MeasuredTurn, SampleFault, TurnIntegral, TurnRefusal,
};

type Joint = SMatrix<f64, 10, 10>;

/// A tick, seconds.
const TICK: f64 = 0.1;
const WIDTH: f64 = 0.35;

/// States x, y, ψ, `S_R`, `S_L`, δD, κ and the bias, in `f64`.
#[derive(Clone)]
struct Oracle {
    x: SVector<f64, 8>,
    p: SMatrix<f64, 8, 8>,
    wheel: f64,
    scale_walk: f64,
    width_walk: f64,
    gyro: GyroParameters,
}

impl Oracle {
    fn new(localizer: &Localizer) -> Self {
        let (config, gyro) = (localizer.config(), localizer.config().gyro.unwrap());
        let mut p = SMatrix::<f64, 8, 8>::zeros();
        let deviations = localizer.filter().standard_deviations().to_array();
        for (state, sigma) in deviations.into_iter().chain([gyro.bias.0]).enumerate() {
            p[(state, state)] = f64::from(sigma).powi(2);
        }
        let mut x = SVector::<f64, 8>::zeros();
        for (state, value) in localizer.filter().state().to_array().into_iter().enumerate() {
            x[state] = value.into();
        }
        let square = |v: f32| f64::from(v).powi(2);
        Self {
            x,
            p,
            wheel: square(config.drive.wheel_noise.0.0),
            scale_walk: square(config.drive.scale_walk.0),
            width_walk: square(config.drive.track_width_walk.0.0),
            gyro,
        }
    }

    /// x, y, ψ after a step from `x` with noise `n` of the wheels.
    fn moved(x: &SVector<f64, 8>, travel: [f64; 2], n: [f64; 2]) -> [f64; 3] {
        let right = (travel[0] + n[0]) * (1.0 + x[3]);
        let left = (travel[1] + n[1]) * (1.0 + x[4]);
        let (turn, advance) = ((right - left) / (WIDTH + x[5]), f64::midpoint(right, left));
        let middle = x[2] + turn / 2.0;
        [x[0] + advance * middle.cos(), x[1] + advance * middle.sin(), x[2] + turn]
    }

    /// The derivatives of the pose after a step by states, bias and noise: central differences.
    fn derivatives(&self, travel: [f64; 2]) -> SMatrix<f64, 3, 10> {
        let mut all = SMatrix::<f64, 3, 10>::zeros();
        for column in 0..10 {
            let at = |by: f64| {
                let (mut x, mut n) = (self.x, [0.0; 2]);
                if column < 8 {
                    x[column] += by;
                } else {
                    n[column - 8] += by;
                }
                SVector::<f64, 3>::from(Self::moved(&x, travel, n))
            };
            all.set_column(column, &((at(1e-6) - at(-1e-6)) / 2e-6));
        }
        all
    }

    fn step(&mut self, travel: [f64; 2], angle: f64) {
        self.p[(7, 7)] += f64::from(self.gyro.bias_walk.0.0).powi(2) * TICK;
        let by = self.derivatives(travel);
        let mut joint = Joint::zeros();
        joint.fixed_view_mut::<8, 8>(0, 0).copy_from(&self.p);
        joint[(8, 8)] = self.wheel * travel[0].abs();
        joint[(9, 9)] = self.wheel * travel[1].abs();
        let mut h = by.row(2).transpose();
        h[2] = 0.0;
        h[7] = TICK;
        let turn = Self::moved(&self.x, travel, [0.0; 2])[2] - self.x[2];
        let free = angle - self.x[7] * TICK;
        let scale = f64::from(self.gyro.scale).powi(2) * std::f64::consts::FRAC_PI_2;
        let noise = f64::from(self.gyro.noise.0.0).powi(2) * TICK
            + scale * free * free / (free.abs() + 0.01);
        let m = joint * h;
        let gain = m / (h.dot(&m) + noise);
        let correction = gain * (free - turn);
        joint -= gain * m.transpose();
        let mut step = SMatrix::<f64, 8, 10>::zeros();
        step.fixed_view_mut::<8, 8>(0, 0).fill_with_identity();
        step.fixed_view_mut::<3, 10>(0, 0).copy_from(&by);
        let pose = Self::moved(&self.x, travel, [0.0; 2]);
        self.x.fixed_rows_mut::<3>(0).copy_from(&SVector::<f64, 3>::from(pose));
        self.x += step * correction;
        self.p = step * joint * step.transpose();
        let distance = f64::midpoint(travel[0].abs(), travel[1].abs());
        self.p[(3, 3)] += self.scale_walk * distance;
        self.p[(4, 4)] += self.scale_walk * distance;
        self.p[(5, 5)] += self.width_walk * distance;
    }
}

fn localizer(walls: &[Wall], gyro: Option<GyroParameters>) -> Localizer<'_> {
    let mut config = Config::for_track_width(Metres(WIDTH as f32));
    config.gyro = gyro;
    let start = Start {
        pose: Pose::new(1.0, 2.0, Radians(0.3)),
        position_deviation: Metres(0.01),
        heading_deviation: Radians(0.01),
    };
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

fn wall() -> Wall {
    Wall::new(Point::new(-50.0, 5.0), Point::new(50.0, 5.0)).unwrap()
}

fn turn(angle: f64) -> MeasuredTurn {
    MeasuredTurn { angle: Radians(angle as f32), duration: Duration::from_ticks(100_000) }
}

fn at(tick: u64) -> Instant {
    Instant::from_ticks(100_000 * tick)
}

/// Steps of one second each: a straight leg, a curve or a turn on the spot.
fn any_drive() -> impl Strategy<Value = Vec<(f64, f64)>> {
    let second = prop_oneof![
        (0.01_f64..0.05).prop_map(|v| (v, 0.0)),
        (0.01_f64..0.05, -0.02_f64..0.02),
        (-0.05_f64..0.05)
            .prop_filter("turns", |turn| turn.abs() > 1e-3)
            .prop_map(|turn| (0.0, turn)),
    ];
    prop::collection::vec(second, 5..40)
}

proptest! {
    /// Estimate, deviations and bias are those of the oracle. The core sums differences up over a second, in which they have
    /// the same derivatives here. What it leaves out, the correlation of advance and turn in a curve, is within the bound.
    #[test]
    fn a_second_of_turns_is_as_good_as_ten_measurements(
        seconds in any_drive(), bias in -0.05_f64..0.05, is_known in any::<bool>(),
        noise in prop::collection::vec(-1.5_f64..1.5, 400),
    ) {
        let walls = [wall()];
        // The noise by the scale error depends on the estimated bias, which in its first second is not the oracle's.
        let (bias, gyro) = if is_known {
            let bias_walk = PerRootSecond(RadiansPerSecond(0.0));
            let bias = RadiansPerSecond(1e-4);
            (0.0, GyroParameters { bias, bias_walk, ..GyroParameters::MPU_6050 })
        } else {
            (bias, GyroParameters { scale: 0.0, ..GyroParameters::MPU_6050 })
        };
        let mut localizer = localizer(&walls, Some(gyro));
        let mut oracle = Oracle::new(&localizer);
        let mut tick = 0;
        for (advance, turned) in seconds {
            for _ in 0..10 {
                tick += 1;
                let travel = [advance + turned * WIDTH / 2.0, advance - turned * WIDTH / 2.0];
                let white = 2.8e-5 * noise[tick as usize % noise.len()];
                let angle = turned + bias * TICK + white;
                let measured = WheelTravel::new(travel[0] as f32, travel[1] as f32);
                localizer.odometry_with_turn(at(tick), measured, Some(turn(angle))).unwrap();
                oracle.step(travel, angle);
            }
        }
        let status = localizer.gyro().unwrap();
        prop_assert_eq!((status.slips, status.conflicts), (0, 0));
        let state = localizer.filter().state().to_array();
        let deviations = localizer.filter().standard_deviations().to_array();
        for i in 0..7 {
            let exact = oracle.p[(i, i)].sqrt();
            let deviation = f64::from(deviations[i]);
            prop_assert!((deviation - exact).abs() <= 0.03 * exact, "{i}: {deviation} {exact}");
            let error = (f64::from(state[i]) - oracle.x[i]).abs();
            let wrapped = if i == 2 { libm::remainder(error, std::f64::consts::TAU).abs() } else { error };
            prop_assert!(wrapped <= 0.1 * exact + 1e-6, "{i}: {} {} {exact}", state[i], oracle.x[i]);
        }
        let exact = oracle.p[(7, 7)].sqrt();
        let deviation = f64::from(status.deviation.0);
        prop_assert!((deviation - exact).abs() <= 0.03 * exact, "bias {deviation} {exact}");
        prop_assert!((f64::from(status.bias.0) - oracle.x[7]).abs() <= 0.1 * exact + 1e-6);
        let p = localizer.filter().covariance().cast::<f64>();
        let scale = SMatrix::<f64, 6, 6>::from_fn(|i, j| p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt());
        prop_assert!(scale.symmetric_eigenvalues().min() > 0.0);
    }

    /// A turn that is refused changes nothing: the estimate is that without it.
    #[test]
    fn a_refused_turn_is_as_none(right in -0.05_f32..0.05, left in -0.05_f32..0.05, kind in 0..4) {
        let walls = [wall()];
        let mut with = localizer(&walls, Some(GyroParameters::MPU_6050));
        let mut without = localizer(&walls, None);
        let travel = WheelTravel::new(right, left);
        let (angle, ticks, why) = [
            (f32::NAN, 100_000, TurnRefusal::NotFinite),
            (f32::INFINITY, 100_000, TurnRefusal::NotFinite),
            (0.0, 80_000, TurnRefusal::WrongDuration),
            (-0.5, 100_000, TurnRefusal::TooFast),
        ][kind as usize];
        let turn = MeasuredTurn { angle: Radians(angle), duration: Duration::from_ticks(ticks) };
        with.odometry_with_turn(at(1), travel, Some(turn)).unwrap();
        without.odometry(at(1), travel).unwrap();
        prop_assert_eq!(with.gyro().unwrap().latest, TurnUse::Refused(why));
        prop_assert_eq!(with.filter(), without.filter());
    }

    /// Without a gyro in the configuration a turn has no effect on any bit.
    #[test]
    fn a_turn_without_a_gyro_is_ignored(right in -0.05_f32..0.05, left in -0.05_f32..0.05, angle in any::<f32>()) {
        let walls = [wall()];
        let (mut with, mut without) = (localizer(&walls, None), localizer(&walls, None));
        let travel = WheelTravel::new(right, left);
        let turn = MeasuredTurn { angle: Radians(angle), duration: Duration::from_ticks(100_000) };
        with.odometry_with_turn(at(1), travel, Some(turn)).unwrap();
        without.odometry(at(1), travel).unwrap();
        prop_assert!(with.gyro().is_none());
        prop_assert_eq!(with.filter(), without.filter());
    }

    /// The sum of the turns between any readings is the whole turn: no part of it is lost or doubled.
    #[test]
    fn turns_between_readings_add_up(
        rates in prop::collection::vec(-4.0_f32..4.0, 2..200), period in 1_000_u64..10_000, every in 1_usize..20,
    ) {
        // Each rate in two samples: one that differs from both of its neighbours may be a spike.
        let rates: Vec<f32> = rates.into_iter().flat_map(|rate| [rate; 2]).collect();
        let mut integral = TurnIntegral::new(&GyroParameters::MPU_6050);
        let mut exact = 0.0;
        let mut sum = 0.0;
        let instant = |i: usize| Instant::from_ticks(i as u64 * period);
        integral.sample(instant(0), RadiansPerSecond(rates[0])).unwrap();
        let mut last = integral.reading(instant(0));
        for (i, pair) in rates.windows(2).enumerate() {
            integral.sample(instant(i + 1), RadiansPerSecond(pair[1])).unwrap();
            exact += 0.5 * f64::from(pair[0] + pair[1]) * period as f64 * 1e-6;
            if (i + 1) % every == 0 || i + 2 == rates.len() {
                let now = integral.reading(instant(i + 1));
                let middle = last.between(&now, instant(i + 1) - Duration::from_ticks(period / 3));
                sum += f64::from(middle.since(&last).unwrap().angle.0);
                sum += f64::from(now.since(&middle).unwrap().angle.0);
                last = now;
            }
        }
        prop_assert!((sum - exact).abs() < 1e-6 * rates.len() as f64, "{sum} {exact}");
    }
}

/// Drives straight with a bias of 1°/s; every wheel travel may have a slip of the right wheel.
fn drive(
    localizer: &mut Localizer,
    ticks: std::ops::Range<u64>,
    slip: f64,
    gyro: impl Fn(u64) -> Option<f64>,
) {
    for tick in ticks {
        let slipped = slip * WIDTH;
        let travel = WheelTravel::new((0.04 + slipped) as f32, 0.04);
        let turn = gyro(tick).map(turn);
        localizer.odometry_with_turn(at(tick + 1), travel, turn).unwrap();
    }
}

/// A repeatable noise of one deviation.
fn white(tick: u64) -> f64 {
    2.8e-5 * libm::sin(12.9898 * tick as f64) * 1.4
}

const BIAS: f64 = 0.017_453;

/// A localizer that has stood for some ticks.
fn standing(walls: &[Wall], ticks: u64) -> Localizer<'_> {
    let mut localizer = localizer(walls, Some(GyroParameters::MPU_6050));
    for tick in 0..ticks {
        let measured = Some(turn(BIAS * TICK + white(tick)));
        localizer.odometry_with_turn(at(tick + 1), WheelTravel::default(), measured).unwrap();
    }
    localizer
}

#[test]
fn standing_finds_the_bias_in_five_seconds_and_keeps_the_pose() {
    let walls = [wall()];
    let before = standing(&walls, 0).pose();
    let localizer = standing(&walls, 50);
    let status = localizer.gyro().unwrap();
    let error = (f64::from(status.bias.0) - BIAS).to_degrees();
    assert!(error.abs() < 0.02, "{error}");
    assert!(status.deviation.to_degrees() < 0.005);
    assert_eq!(status.latest, TurnUse::Standing);
    assert_eq!(localizer.pose(), before);
}

#[test]
fn a_slip_of_a_wheel_does_not_turn_the_estimate() {
    let walls = [wall()];
    let gyro = |tick| Some(BIAS * TICK + white(tick));
    let mut localizer = standing(&walls, 50);
    drive(&mut localizer, 50..100, 0.0, gyro);
    let before = localizer.pose().heading;
    // 10° in half a second.
    drive(&mut localizer, 100..105, 0.035, gyro);
    assert_eq!(localizer.gyro().unwrap().latest, TurnUse::WheelSlip);
    drive(&mut localizer, 105..120, 0.0, gyro);
    let status = localizer.gyro().unwrap();
    assert_eq!((status.slips, status.conflicts, status.latest), (1, 0, TurnUse::Combined));
    let turned = localizer.pose().heading.from(before).to_degrees();
    assert!(turned.abs() < 0.1, "{turned}");
}

#[test]
fn a_gyro_that_contradicts_for_long_is_doubted_and_the_heading_uncertain() {
    let walls = [wall()];
    let mut localizer = localizer(&walls, Some(GyroParameters::MPU_6050));
    drive(&mut localizer, 0..100, 0.0, |tick| Some(BIAS * TICK + white(tick)));
    // The bias jumps by 30°/s.
    drive(&mut localizer, 100..140, 0.0, |tick| Some(0.52 * TICK + white(tick)));
    let status = localizer.gyro().unwrap();
    assert!(status.conflicts >= 1, "{status:?}");
    assert!(localizer.filter().standard_deviations().heading.to_degrees() > 60.0);
}

#[test]
fn a_failed_gyro_leaves_the_wheels() {
    let walls = [wall()];
    let mut with = localizer(&walls, Some(GyroParameters::MPU_6050));
    let mut without = localizer(&walls, None);
    drive(&mut with, 0..100, 0.0, |_| None);
    drive(&mut without, 0..100, 0.0, |_| None);
    assert_eq!(with.filter(), without.filter());
    assert_eq!(with.gyro().unwrap().latest, TurnUse::Missing);
}

/// The result of each sample of a rate, every 10 ms, and whether the turn was measured without an interruption.
fn sampled(rates: &[f32]) -> (Vec<Result<(), SampleFault>>, bool) {
    let mut integral = TurnIntegral::new(&GyroParameters::MPU_6050);
    let at = |sample: usize| Instant::from_ticks(10_000 * sample as u64);
    let mut results = vec![integral.sample(at(0), RadiansPerSecond(rates[0]))];
    let start = integral.reading(at(0));
    for (sample, rate) in rates.iter().enumerate().skip(1) {
        results.push(integral.sample(at(sample), RadiansPerSecond(*rate)));
    }
    let is_whole = integral.reading(at(rates.len())).since(&start).is_some();
    (results, is_whole)
}

/// Noise that is no fault.
fn quiet(samples: usize) -> Vec<f32> {
    (0..samples).map(|sample| 1e-3 * (sample % 7) as f32).collect()
}

/// A rate that jumps to and fro twice within two seconds, by more than 1 rad/s, is erratic from then on, until it has not done so for
/// two seconds.
#[test]
fn a_rate_that_jumps_to_and_fro_is_erratic() {
    for (gap, spike) in [(2, 1.1), (50, -3.0), (198, 4.0)] {
        let mut rates = quiet(800);
        rates[100] += spike;
        rates[101 + gap] += spike;
        let (results, is_whole) = sampled(&rates);
        let first = 102 + gap; // the sample that shows that the second was a spike
        for (sample, result) in results.iter().enumerate() {
            let expected = match sample {
                n if n < first || n >= first + 200 => Ok(()),
                _ => Err(SampleFault::Erratic),
            };
            assert_eq!(*result, expected, "gap {gap}, sample {sample}");
        }
        assert!(!is_whole);
    }
}

/// What a robot can do is no fault: one jump to and fro, a step, a fast oscillation of less than 1 rad/s, two jumps 2 s apart.
#[test]
fn motion_is_not_erratic() {
    let mut single = quiet(500);
    single[100] += 4.0;
    let mut apart = single.clone();
    apart[301] -= 4.0;
    let step = quiet(500).into_iter().enumerate();
    let step = step.map(|(n, rate)| rate + 4.0 * f32::from(u8::from(n % 100 > 50))).collect();
    let swing = quiet(500).into_iter().enumerate();
    let swing = swing.map(|(n, rate)| rate + 0.49 * f32::from(u8::from(n % 2 == 0))).collect();
    for rates in [single, apart, step, swing] {
        let (results, is_whole) = sampled(&rates);
        assert!(is_whole && results.iter().all(Result::is_ok), "{rates:?}");
    }
}

#[test]
fn faults_of_samples_have_names_and_interrupt_the_integral() {
    let parameters = GyroParameters::MPU_6050;
    let mut integral = TurnIntegral::new(&parameters);
    let at = |millis: u64| Instant::from_ticks(1_000 * millis);
    let rate = |value: f32| RadiansPerSecond(value);
    let mut millis = 0;
    let mut good = |integral: &mut TurnIntegral, wait: u64| {
        millis += wait;
        (integral.sample(at(millis), rate(1e-3 * (millis % 7) as f32)), millis)
    };
    assert_eq!(good(&mut integral, 0).0, Ok(()));
    let start = integral.reading(at(0));
    for _ in 0..20 {
        assert_eq!(good(&mut integral, 10).0, Ok(()));
    }
    assert!(integral.reading(at(200)).since(&start).is_some());
    // A sample that is not a number is missing, and the next ones span it.
    assert_eq!(integral.sample(at(210), rate(f32::NAN)), Err(SampleFault::NotFinite));
    assert_eq!(good(&mut integral, 20).0, Ok(()));
    assert!(integral.reading(at(220)).since(&start).is_some());
    assert_eq!(integral.sample(at(220), rate(0.0)), Err(SampleFault::TimeRanBackwards));
    // Too many of them do not.
    assert_eq!(good(&mut integral, 60).0, Err(SampleFault::Missing));
    assert_eq!(integral.reading(at(280)).since(&start), None);
    let later = integral.reading(at(280));
    assert_eq!(good(&mut integral, 10).0, Ok(()));
    assert!(integral.reading(at(290)).since(&later).is_some());
    // While none arrives there is no reading.
    assert_eq!(integral.reading(at(350)).since(&later), None);
    assert_eq!(integral.sample(at(300), parameters.range), Err(SampleFault::Saturated));
    assert_eq!(integral.reading(at(300)).since(&later), None);
    for sample in 0..100 {
        let result = integral.sample(at(310 + 10 * sample), rate(0.1));
        let expected = if sample < 50 { Ok(()) } else { Err(SampleFault::Stuck) };
        assert_eq!(result, expected, "{sample}");
    }
    assert_eq!(integral.sample(at(1_310), rate(0.11)), Ok(()));
    let faults = integral.faults();
    assert_eq!((faults.not_finite, faults.saturated, faults.stuck), (1, 1, 50));
    assert_eq!((faults.mistimed, faults.missing, faults.unreadable), (1, 6, 0));
}
