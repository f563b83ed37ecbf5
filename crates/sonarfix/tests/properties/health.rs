//! The transitions of the verdict, as in the diagram of `health.rs`.

use proptest::prelude::*;
use sonarfix::config::GatingParameters;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict::{self, Degraded, Lost, Tracking};
use sonarfix::health::{LOST_AT, Mismatch};
use sonarfix::localizer::Start;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix::map::{Map, Wall};
use sonarfix::sensor::echo::EchoParameters;

use crate::strategies::{config_for_rooms, start_at};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Accepted,
    TooLong,
    TooShort,
    NoEcho,
    Skipped,
}
use Outcome::{Accepted, NoEcho, Skipped, TooLong, TooShort};

fn one_wall() -> [Wall; 1] {
    [Wall::new(Point::new(2.0, -5.0), Point::new(2.0, 5.0)).unwrap()]
}

fn new_localizer(walls: &[Wall]) -> Localizer<'_> {
    let start = start_at(Pose::default());
    let mut config = config_for_rooms(Point::new(0.0, 0.0));
    config.echo = EchoParameters::HC_SR04;
    // The range of an aim is that of a sonar that is never late.
    (config.echo.late, config.echo.late_per_radian) = (Metres(0.0), Metres(0.0));
    // The covariance of a lost robot is not inflated, so that the ranges stay outside the gate.
    config.gating.inflation = Metres(0.0);
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

fn apply(localizer: &mut Localizer, outcome: Outcome) -> Verdict {
    let aim = localizer.aim().unwrap();
    let range = match outcome {
        Accepted => Some(aim.range),
        TooLong => Some(aim.range + Metres(1.0)),
        TooShort => Some(aim.range - Metres(1.0)),
        NoEcho => None,
        Skipped => {
            localizer.skip();
            return localizer.health().verdict;
        }
    };
    let fix = localizer.fix(&aim, range);
    let is_as_intended = match outcome {
        Accepted => matches!(fix, Fix::Accepted(_)),
        TooLong | TooShort => matches!(fix, Fix::Gated(_)),
        NoEcho | Skipped => matches!(fix, Fix::Refused(_)),
    };
    assert!(is_as_intended, "{outcome:?} became {fix:?}");
    localizer.health().verdict
}

/// The verdicts after each outcome of a sequence.
fn verdicts(outcomes: &[Outcome]) -> Vec<Verdict> {
    let walls = one_wall();
    let mut localizer = new_localizer(&walls);
    outcomes.iter().map(|&o| apply(&mut localizer, o)).collect()
}

/// Drives back and forth in front of the wall, so that the outcomes are independent.
fn verdicts_on_the_way(outcomes: &[Outcome]) -> Vec<Verdict> {
    let walls = one_wall();
    let mut localizer = new_localizer(&walls);
    let drive = |(step, outcome): (u64, &Outcome)| {
        let now = Instant::from_ticks(50_000_000 * step);
        localizer.odometry(now, WheelTravel::default()).unwrap();
        apply(&mut localizer, *outcome)
    };
    (1..).zip(outcomes).map(drive).collect()
}

#[test]
fn contradictions_lead_to_lost_and_agreement_leads_back() {
    let until = |verdict, outcome| {
        verdicts_on_the_way(&[outcome; 30]).iter().position(|v| *v == verdict).map(|n| n + 1)
    };
    // Most of a minute between pings: no occlusion lasts, each ping counts.
    for outcome in [TooLong, NoEcho] {
        let (degraded, lost) = (until(Degraded, outcome), until(Lost, outcome));
        assert!(degraded.is_some_and(|n| n <= 5), "{outcome:?} {degraded:?}");
        assert!(lost.is_some_and(|n| n <= 15), "{outcome:?} {lost:?}");
    }
    // An unmapped object may explain a short range: it counts less, but independent ones do count.
    let (short, long) = (until(Lost, TooShort), until(Lost, TooLong));
    assert!(short.is_none_or(|short| long.is_some_and(|long| short > long)), "{short:?} {long:?}");
    let skipped = verdicts(&[Skipped; 90]);
    assert_eq!(skipped.iter().position(|v| *v == Degraded), Some(7));
    assert!(!skipped.contains(&Lost));
    // Lost → Degraded → Tracking: the evidence falls by 1.2 for each accepted range.
    let mut recovery = vec![TooLong; 15];
    recovery.extend([Accepted; 20]);
    let recovery = verdicts_on_the_way(&recovery);
    assert_eq!(recovery[14], Lost);
    let first = |verdict| recovery[15..].iter().position(|v| *v == verdict).unwrap() + 1;
    assert_eq!((first(Degraded), first(Tracking)), (7, 10));
}

#[test]
fn a_good_estimate_in_a_cluttered_room_is_not_lost() {
    // Every third range shortened by furniture; every fifth one long; every third one missed.
    let long = [TooLong, Accepted, Accepted, Accepted, Accepted];
    for pattern in [&[TooShort, Accepted, Accepted][..], &long, &[NoEcho, Accepted, Accepted]] {
        let turns = pattern.repeat(40);
        assert!(!verdicts(&turns).contains(&Lost), "{pattern:?}");
    }
    // A cupboard in front of the wall.
    assert!(!verdicts(&[TooShort; 90]).contains(&Lost));
}

/// Pings at an object before the wall: its repeated echo counts once, echoes of other objects count each.
#[test]
fn the_repeated_echo_of_one_object_counts_once() {
    let walls = one_wall();
    let mut repeated = new_localizer(&walls);
    for _ in 0..30 {
        assert_eq!(apply(&mut repeated, TooShort), Tracking);
    }
    let health = repeated.health();
    assert_eq!((health.gated_in_a_row, health.verdict), (1, Tracking), "{health:?}");

    let mut different = new_localizer(&walls);
    for count in 1_u8..=8 {
        assert_eq!(different.health().verdict, Tracking, "{:?}", different.health());
        let aim = different.aim().unwrap();
        let fix = different.fix(&aim, Some(aim.range - Metres(0.3 + 0.15 * f32::from(count))));
        assert!(matches!(fix, Fix::Gated(_)), "{fix:?}");
        assert_eq!(different.health().gated_in_a_row, u16::from(count));
    }
    assert_eq!(different.health().verdict, Degraded);
}

/// Eqs. (15), (23), (26) and (51) in `f64`, for a robot that stands square to one wall, with an exact map. No time
/// passes.
struct PageOracle {
    /// z' of eq. (26).
    source: Option<f64>,
    range: f64,
    limits: (f64, f64),
    /// The probability that the wall is occluded, less the prior.
    above_prior: f64,
    /// Of eq. (51): metres of free beams, and objects.
    free: f64,
    objects: f64,
    evidence: f64,
}

impl PageOracle {
    fn new(range: f32, limits: (Metres, Metres)) -> Self {
        let range = f64::from(range);
        let limits = (f64::from(limits.0.0), f64::from(limits.1.0));
        let (above_prior, free, objects, evidence) = (0.0, 0.0, 0.0, 0.0);
        Self { range, limits, above_prior, free, objects, evidence, source: None }
    }

    /// Eq. (51).
    fn prior(&self) -> f64 {
        let path = ((5.0 + self.free) / (0.5 + self.objects)).max(10.0);
        self.range / (self.range + path)
    }

    /// ν and S of an echo; `None`: there was none.
    fn add(&mut self, echo: Option<(f64, f64)>) {
        let (missed, short, long) = (0.03, 0.02, 0.02);
        let ((nearest, farthest), prior) = (self.limits, self.prior());
        let o = (prior + self.above_prior).clamp(0.0, 0.95);
        let (seen, object, wrong) = match echo {
            Some((nu, s)) => {
                let normal =
                    |s: f64| (-0.5 * nu * nu / s).exp() / (std::f64::consts::TAU * s).sqrt();
                let wall = 0.98 * normal(s) + 0.02 * normal(9.0 * s);
                let below = nu < 0.0;
                let span = if below { self.range - nearest } else { farthest - self.range };
                let (clutter, object) = if below { (short, 0.735) } else { (long, 0.065) };
                let seen = (1.0 - missed - short - long) * wall + clutter / span;
                (seen, object / span, 0.7 / (farthest - nearest))
            }
            None => (missed, 0.2, 0.3),
        };
        let range = echo.map(|(nu, _)| self.range + nu);
        let repeated = match (range, self.source) {
            (Some(z), Some(source)) => {
                let ratio = (z - source) / 0.015;
                let normal = (-0.5 * ratio * ratio).exp() / (std::f64::consts::TAU.sqrt() * 0.015);
                0.3 * object + 0.7 * 0.8 * normal
            }
            _ => object,
        };
        let is_long = echo.is_some_and(|(nu, _)| nu >= 0.0);
        let (p, p_wrong) = if is_long {
            ((1.0 - o) * seen + o * object, wrong)
        } else {
            ((1.0 - o) * seen + o * repeated, (1.0 - o) * wrong + o * repeated)
        };
        let ratio = 0.3 + 0.7 * p_wrong / p;
        self.evidence = (self.evidence + ratio.ln().min(4.0)).clamp(0.0, f64::from(LOST_AT));
        let total = (1.0 - o) * seen + o * repeated;
        let hidden = o * repeated / total;
        self.above_prior = hidden.max(0.8 * o).min(0.95) - prior;
        let is_repeated =
            range.zip(self.source).is_some_and(|(z, source)| (z - source).abs() <= 3.0 * 0.015);
        if echo.is_some() && !is_repeated {
            self.free = 0.98 * self.free + self.range * (1.0 - hidden);
            self.objects = 0.98 * self.objects + hidden;
        }
        let is_other = echo.is_some_and(|(nu, _)| nu.abs() > 0.5);
        if is_other && self.source.is_none() {
            self.source = range;
        }
    }
}

proptest! {
    /// The evidence is Page's sum of the log-likelihood ratios of all pings.
    #[test]
    fn the_evidence_is_that_of_the_oracle(
        outcomes in proptest::collection::vec(
            prop_oneof![4 => Just(Accepted), 1 => Just(TooLong), 1 => Just(TooShort), 1 => Just(NoEcho)], 1..40),
    ) {
        let walls = one_wall();
        let mut localizer = new_localizer(&walls);
        let sonar = localizer.config().rangers.first;
        let mut oracle = PageOracle::new(2.0, (sonar.min_range, sonar.max_range));
        for outcome in outcomes {
            let aim = localizer.aim().unwrap();
            let range = match outcome {
                TooLong => Some(aim.range + Metres(1.0)),
                TooShort => Some(aim.range - Metres(1.0)),
                NoEcho => None,
                _ => Some(aim.range),
            };
            let echo = match localizer.fix(&aim, range) {
                Fix::Accepted(i) | Fix::Downweighted(i) | Fix::Gated(i) => {
                    Some((f64::from(i.value.0), f64::from(i.variance.0)))
                }
                _ => None,
            };
            oracle.add(echo);
            let evidence = f64::from(localizer.health().evidence);
            prop_assert!((evidence - oracle.evidence).abs() < 2e-2, "{evidence} {}", oracle.evidence);
        }
    }

    /// The evidence stays within its bounds, an accepted range never raises it, and the verdict is
    /// never better than the evidence allows.
    #[test]
    fn the_verdict_follows_the_evidence(
        rows in proptest::collection::vec(
            (prop_oneof![Just(Accepted), Just(TooLong), Just(TooShort), Just(NoEcho), Just(Skipped)],
             1_usize..25), 1..20),
    ) {
        let walls = one_wall();
        let mut localizer = new_localizer(&walls);
        for (outcome, times) in rows {
            for _ in 0..times {
                let before = localizer.health();
                let verdict = apply(&mut localizer, outcome);
                let evidence = localizer.health().evidence;
                prop_assert!((0.0..=LOST_AT).contains(&evidence));
                prop_assert!(outcome != Accepted || evidence <= before.evidence);
                prop_assert!(outcome != Skipped || evidence.to_bits() == before.evidence.to_bits());
                prop_assert!(outcome == Accepted || evidence < LOST_AT || verdict == Lost);
                let improves = (before.verdict, verdict);
                if matches!(improves, (Lost, Degraded) | (Degraded, Tracking)) {
                    prop_assert!(outcome == Accepted && evidence < 0.5);
                }
                prop_assert!(improves != (Lost, Tracking));
            }
        }
    }
}

/// A robot with this gating in front of one wall.
fn with_gating(gating: GatingParameters, walls: &[Wall], heading_deviation: f32) -> Localizer<'_> {
    let start =
        Start { heading_deviation: Radians(heading_deviation), ..start_at(Pose::default()) };
    let mut config = config_for_rooms(Point::new(0.0, 0.0));
    config.gating = gating;
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

/// Gating parameters with which only the ranges can degrade the verdict.
fn only_ranges_degrade() -> GatingParameters {
    let mut gating = config_for_rooms(Point::default()).gating;
    gating.max_distance_without_fix = Metres(1e3);
    gating.max_position_deviation = Metres(1e3);
    gating
}

#[test]
fn distance_without_a_range_degrades() {
    let walls = one_wall();
    let mut gating = only_ranges_degrade();
    gating.max_distance_without_fix = Metres(0.1);
    let mut localizer = with_gating(gating, &walls, 0.01);
    let mut after = |tenths: u64, travel| {
        let now = Instant::from_ticks(100_000 * tenths);
        localizer.odometry(now, WheelTravel::new(travel, travel)).unwrap();
        localizer.health().verdict
    };
    assert_eq!((after(1, 0.09), after(2, 0.02)), (Tracking, Degraded));
}

#[test]
fn uncertainty_of_position_or_heading_degrades() {
    let walls = one_wall();
    let skipped = |gating, heading| {
        let mut localizer = with_gating(gating, &walls, heading);
        localizer.skip();
        localizer.health().verdict
    };
    // The position's deviation is 0.03 m.
    let position_limit = |limit| {
        let mut gating = only_ranges_degrade();
        gating.max_position_deviation = Metres(limit);
        gating
    };
    assert_eq!(
        (skipped(position_limit(0.031), 0.01), skipped(position_limit(0.029), 0.01)),
        (Tracking, Degraded)
    );
    // The heading's limit is a quarter of the cone.
    let limit = 0.25 * config_for_rooms(Point::default()).rangers.first.cone.0;
    assert_eq!(
        (
            skipped(only_ranges_degrade(), 0.99 * limit),
            skipped(only_ranges_degrade(), 1.01 * limit)
        ),
        (Tracking, Degraded)
    );
}

/// Ranges that are all inside the gate, but all too far out.
#[test]
fn ranges_too_far_out_on_average_degrade() {
    let walls = one_wall();
    let mut localizer = with_gating(only_ranges_degrade(), &walls, 0.01);
    let mut degraded = false;
    for _ in 0..40 {
        let aim = localizer.aim().unwrap();
        let Fix::Accepted(expected) = localizer.clone().fix(&aim, Some(aim.range)) else {
            panic!()
        };
        let out = 2.4 * expected.variance.0.sqrt();
        let fix = localizer.fix(&aim, Some(aim.range + Metres(out)));
        assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        degraded |= localizer.health().nis > 2.0;
        assert_eq!(localizer.health().verdict, if degraded { Degraded } else { Tracking });
        let is_too_small = degraded || localizer.noise_factor() > 2.0;
        let expected = is_too_small.then_some(Mismatch::NoiseTooSmall);
        assert_eq!(localizer.mismatch(), expected);
    }
    assert!(degraded);
}

/// Pings without an echo contradict the pose; they do not inflate the covariance of a lost robot, because a failed ranger
/// causes them at a right pose as well.
#[test]
fn a_missing_echo_does_not_inflate_the_covariance_of_a_lost_robot() {
    let walls = one_wall();
    let mut config = *new_localizer(&walls).config();
    config.gating.inflation = Metres(0.01);
    let start = start_at(Pose::default());
    let zero = Instant::from_ticks(0);
    let mut localizer = Localizer::new(config, Map::new(&walls), start, zero).unwrap();
    for step in 1..=20 {
        // Most of a minute between pings: no occlusion lasts.
        let now = Instant::from_ticks(50_000_000 * step);
        localizer.odometry(now, WheelTravel::default()).unwrap();
        apply(&mut localizer, NoEcho);
    }
    assert_eq!(localizer.health().verdict, Lost);
    assert_eq!(localizer.health().inflations, 0);
    localizer.odometry(Instant::from_ticks(1_100_000_000), WheelTravel::default()).unwrap();
    let aim = localizer.aim().unwrap();
    assert!(matches!(localizer.fix(&aim, Some(aim.range + Metres(1.0))), Fix::Gated(_)));
    assert_eq!(localizer.health().inflations, 1);
}
