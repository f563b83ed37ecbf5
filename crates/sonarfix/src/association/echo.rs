//! The echo model: the probability density p(z | pose, beam) of what one ping returns
//! (`docs/model.md`, "Echo model", eqs. 15 and 16).
//!
//! A ping at a wall returns the range of the wall, or clutter: an object that is not in the map, a
//! spurious short or long range, or no echo. The mixture has four users:
//!
//! | user | quantity |
//! |---|---|
//! | update ([`Ekf`](crate::filter::ekf::Ekf)) | probability that the echo is the wall's |
//! | planner ([`aim`](crate::aim)) | probability that the wall answers |
//! | health ([`health`](crate::health)) | log-likelihood ratio of a wrong pose against the right one |
//! | history of pings | probability that the wall is occluded by an unmapped object |
//!
//! # Non-finite policy
//! The parameters are checked once; expected range and innovation variance come from a valid filter,
//! the measured range is finite. The density of clutter is positive, so that no quotient is 0/0; if
//! all clutter is configured away and the echo is too far off to be the wall's, it is not used.

use crate::config::MAX_RANGERS;
use crate::geometry::elementary::{exp, inverse_sqrt, ln};
use crate::geometry::numeric::at_least;
use crate::geometry::units::{Metres, SquareMetres};
use crate::sensor::echo::{BEYOND_OCCLUDED, EchoParameters, NO_ECHO_OCCLUDED, NO_ECHO_WRONG_POSE};
use crate::sensor::range::Innovation;

/// Share of pings without an echo if the beam is not square to the wall, or its foot not on it.
const NO_ECHO_OFF_WALL: f32 = 0.4;
/// Share of the density of a wall's echo for an estimate that is displaced, and its deviation over that
/// of the innovation. Chosen on simulated runs (`docs/schedule.md`).
const DISPLACED: f32 = 0.02;
const WIDENING: f32 = 3.0;
/// Probability that the object which occludes a wall returns its echo again.
const SAME_SOURCE: f32 = 0.7;
/// An echo that differs by more than so many deviations comes from elsewhere.
const ELSEWHERE: f32 = 3.0;
/// Distance travelled that halves it, metres.
const SOURCE_HALVED_WITHIN: f32 = 0.05;
/// Time that halves it, seconds: people and chairs move.
const SOURCE_HALVED_AFTER: f32 = 5.0;
/// Standard deviation of that echo for a robot that stands still, metres.
const SOURCE_DEVIATION: f32 = 0.015;
/// Smallest span of ranges over which clutter is distributed.
const MIN_SPAN: f32 = 0.05;

/// What returned the latest echo of a ping at a wall that was probably not the wall's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EchoSource {
    /// Its range at that ping.
    pub range: Metres,
    /// Distance travelled since.
    pub travelled: Metres,
    /// Seconds since.
    pub age: f32,
}

/// What is expected of one ping at a wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExpectedEcho {
    /// h, the range of the wall.
    pub range: Metres,
    /// S, the variance of the innovation.
    pub variance: SquareMetres,
    /// g: probability that the foot lies on the wall, its range is within the limits of the sonar and the
    /// beam is square.
    pub geometry: f32,
    /// o: probability that an unmapped object occludes the wall.
    pub occluded: f32,
    /// What returned an echo instead of the wall before.
    pub source: Option<EchoSource>,
    /// The shortest and the longest range that the sonar reports.
    pub limits: (Metres, Metres),
    /// Probability that it agrees with a wrong pose by chance.
    pub by_chance: f32,
    /// Odds that the ranger returns any range, whatever is there.
    pub lying: f32,
}

/// The explanation of what one ping returned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Explanation {
    /// β: probability that the echo is the wall's.
    pub association: f32,
    /// p(z), 1/m, or p(none) of a ranger that works.
    pub density: f32,
    /// Probability that an unmapped object occluded the wall.
    pub occluded: f32,
    /// Probability that the map explains the echo: the wall or another reflector.
    pub mapped: f32,
    /// Logarithm of the likelihood of a wrong pose over that of the right one.
    pub evidence: f32,
}

/// Reflectors of the map other than the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Others {
    /// Density of their echo at the range that was measured.
    pub density: f32,
    /// Probability that none of those nearer than the target answers.
    pub silent_before: f32,
}

impl Others {
    /// There are none.
    pub const NONE: Self = Self { density: 0.0, silent_before: 1.0 };
}

/// Densities of one echo, or probabilities of no echo, by hypothesis.
struct Densities {
    /// The echo of the wall.
    wall: f32,
    /// Clutter, with the wall visible.
    clutter: f32,
    /// Anything, with the wall occluded.
    occluded: f32,
    /// The same for the evidence: an object before the wall does not return a longer range, however often.
    unrepeated: f32,
    /// Anything, at a wrong pose. An object that occluded the wall before returns its echo there as well.
    wrong_pose: f32,
    /// Anything, of a ranger whose ranges are false.
    lie: f32,
}

impl ExpectedEcho {
    // ===== Eqs. (15) and (16): p(z) and β; eq. (23): the log-likelihood ratio =====
    /// Explains an echo at this range, or that there was none.
    pub fn explain(
        &self,
        parameters: &EchoParameters,
        echo: Option<Metres>,
        others: Others,
    ) -> Explanation {
        let d = match echo {
            Some(range) => self.of_echo(parameters, range.0 - self.range.0),
            None => self.of_silence(parameters),
        };
        let o = self.occluded;
        let before = others.silent_before;
        let (free, hidden) = (before * (1.0 - o), before * o);
        let (wall, occluded) = (free * d.wall, hidden * d.occluded);
        // -0 is what adds nothing, so that a robot with one ranger has no code for it.
        let lies = if MAX_RANGERS > 1 { self.lying * d.lie } else { -0.0 };
        let density = wall + free * d.clutter + occluded + others.density;
        let total = density + lies;
        if total <= 0.0 {
            // No clutter is configured, and the echo is too far off to be the wall's.
            let evidence = MAX_EVIDENCE;
            return Explanation {
                association: 0.0,
                density: 0.0,
                occluded: o,
                mapped: 0.0,
                evidence,
            };
        }
        let unrepeated = total - occluded + hidden * d.unrepeated;
        let ratio = (d.wrong_pose + lies) / unrepeated;
        let ratio = self.by_chance + (1.0 - self.by_chance) * ratio;
        let evidence = if ratio < MAX_RATIO { ln(ratio) } else { MAX_EVIDENCE };
        let (association, occluded) = (wall / total, occluded / total);
        let mapped = association + others.density / total;
        Explanation { association, density, occluded, mapped, evidence }
    }

    /// Probability that the target answers.
    pub fn answers(&self, parameters: &EchoParameters) -> f32 {
        (1.0 - self.occluded) * self.geometry * parameters.heard(self.range)
    }

    fn of_echo(&self, parameters: &EchoParameters, innovation: f32) -> Densities {
        let share = parameters.share_at(self.range);
        let (short, long) = (share * parameters.short, share * parameters.long);
        let (g, s) = (self.geometry, self.variance.0);
        let density = density(Innovation { value: Metres(innovation), variance: SquareMetres(s) });
        let (nearest, farthest) = (self.limits.0.0, self.limits.1.0);
        let everywhere = 1.0 / (farthest - nearest);
        let (spurious, by_object) = if innovation < 0.0 {
            let per_metre = 1.0 / at_least(self.range.0 - nearest, MIN_SPAN);
            (short * per_metre, (1.0 - NO_ECHO_OCCLUDED - BEYOND_OCCLUDED) * per_metre)
        } else {
            let per_metre = 1.0 / at_least(farthest - self.range.0, MIN_SPAN);
            (long * per_metre, BEYOND_OCCLUDED * per_metre)
        };
        let anywhere = (1.0 - NO_ECHO_WRONG_POSE) * everywhere;
        let o = self.occluded;
        let repeated = self.source.map_or(by_object, |source| {
            let same = source.probability();
            let again = (1.0 - NO_ECHO_OCCLUDED) * source.density(self.range.0 + innovation);
            (1.0 - same) * by_object + same * again
        });
        Densities {
            wall: g * parameters.heard(self.range) * density,
            clutter: g * spurious + (1.0 - g) * (1.0 - NO_ECHO_OFF_WALL) * everywhere,
            occluded: repeated,
            unrepeated: if innovation < 0.0 { repeated } else { by_object },
            wrong_pose: if innovation < 0.0 {
                (1.0 - o) * anywhere + o * repeated
            } else {
                anywhere
            },
            lie: everywhere,
        }
    }

    fn of_silence(&self, parameters: &EchoParameters) -> Densities {
        let g = self.geometry;
        Densities {
            wall: 0.0,
            clutter: g * parameters.share_at(self.range) * parameters.missed
                + (1.0 - g) * NO_ECHO_OFF_WALL,
            occluded: NO_ECHO_OCCLUDED,
            unrepeated: NO_ECHO_OCCLUDED,
            wrong_pose: (1.0 - self.occluded) * NO_ECHO_WRONG_POSE
                + self.occluded * NO_ECHO_OCCLUDED,
            lie: 0.0,
        }
    }
}

/// N'(ν; 0, S): the density of the echo of a wall. The error of an estimate that an outlier or a slip of the
/// wheels has displaced exceeds its covariance, so that a share of the density is wider.
pub(crate) fn density(innovation: Innovation) -> f32 {
    let per_sigma = inverse_sqrt(innovation.variance.0);
    let ratio = innovation.value.0 * per_sigma;
    let exponent = -0.5 * ratio * ratio;
    let narrow = (1.0 - DISPLACED) * exp(exponent);
    let wide = DISPLACED / WIDENING * exp(exponent / (WIDENING * WIDENING));
    ONE_OVER_ROOT_TWO_PI * per_sigma * (narrow + wide)
}

impl EchoSource {
    /// Probability that it returns its echo again, if the wall is occluded.
    fn probability(&self) -> f32 {
        let ratio = self.travelled.0 / SOURCE_HALVED_WITHIN;
        SAME_SOURCE / ((1.0 + ratio * ratio) * (1.0 + self.age / SOURCE_HALVED_AFTER))
    }

    /// Whether it is still near, while an echo at `range` comes from elsewhere.
    pub fn hides(&self, range: Metres) -> bool {
        self.is_near() && !self.is_at(range)
    }

    /// Whether it is still near, and an echo at `range` is its own.
    pub fn repeats(&self, range: Metres) -> bool {
        self.is_near() && self.is_at(range)
    }

    fn is_near(&self) -> bool {
        self.probability() > 0.5 * SAME_SOURCE
    }

    fn is_at(&self, range: Metres) -> bool {
        let limit = ELSEWHERE * (SOURCE_DEVIATION + self.travelled.0);
        (range - self.range).0.abs() <= limit
    }

    /// Density of its echo at a range: the source stands still while the robot moves, in any direction.
    fn density(&self, range: f32) -> f32 {
        let travelled = self.travelled.0;
        let variance = SOURCE_DEVIATION * SOURCE_DEVIATION + travelled * travelled;
        let per_sigma = inverse_sqrt(variance);
        let ratio = (range - self.range.0) * per_sigma;
        ONE_OVER_ROOT_TWO_PI * per_sigma * exp(-0.5 * ratio * ratio)
    }
}

const ONE_OVER_ROOT_TWO_PI: f32 = 0.398_942_3;

/// Largest evidence of one ping, so that a single one does not decide.
const MAX_EVIDENCE: f32 = 4.0;
/// exp([`MAX_EVIDENCE`]).
const MAX_RATIO: f32 = 54.598_15;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::elementary::sqrt;
    use crate::sensor::echo::repetition;

    prop_compose! {
        fn any_parameters()(
            missed in 0.0_f32..0.3, short in 0.0_f32..0.3, long in 0.0_f32..0.3, path in 0.5_f32..20.0,
            sure in 0.0_f32..4.0,
        ) -> EchoParameters {
            let (free_path, map_accuracy, sure_within) = (Metres(path), Metres(0.01), Metres(sure));
            EchoParameters { missed, short, long, free_path, map_accuracy, sure_within, ..EchoParameters::NONE }
        }
    }

    prop_compose! {
        fn any_expectation()(
            range in 0.3_f32..3.5, sigma in 0.003_f32..0.5, geometry in 0.05_f32..1.0, occluded in 0.0_f32..0.95,
        ) -> ExpectedEcho {
            let variance = SquareMetres(sigma * sigma);
            let limits = (Metres(0.1), Metres(4.0));
            ExpectedEcho { range: Metres(range), variance, geometry, occluded, source: None, limits, by_chance: 0.3, lying: 0.0 }
        }
    }

    /// Eq. (15) in `f64`: the shares of wall, clutter and occluding object, and the wrong pose.
    fn densities(e: &ExpectedEcho, p: &EchoParameters, echo: Option<Metres>) -> [f64; 4] {
        let (g, o) = (f64::from(e.geometry), f64::from(e.occluded));
        let share = if e.range < p.sure_within { 0.04 } else { 1.0 };
        let [missed, short, long] = [p.missed, p.short, p.long].map(|it| share * f64::from(it));
        let (h, s) = (f64::from(e.range.0), f64::from(e.variance.0));
        let Some(z) = echo else {
            return [0.0, (1.0 - o) * (g * missed + (1.0 - g) * 0.4), o * 0.2, 0.3];
        };
        let nu = f64::from(z.0) - h;
        let normal = |s: f64| (-0.5 * nu * nu / s).exp() / (core::f64::consts::TAU * s).sqrt();
        let normal = 0.98 * normal(s) + 0.02 * normal(9.0 * s);
        let span = if nu < 0.0 { h - 0.1 } else { 4.0 - h };
        let (spurious, object) = if nu < 0.0 { (short, 0.735) } else { (long, 0.065) };
        let everywhere = 1.0 / 3.9;
        [
            (1.0 - o) * g * (1.0 - missed - short - long) * normal,
            (1.0 - o) * (g * spurious / span + (1.0 - g) * 0.6 * everywhere),
            o * object / span,
            0.7 * everywhere,
        ]
    }

    /// q' of eq. (26) in `f64`.
    fn repeated(q: f64, source: EchoSource, z: f64) -> f64 {
        let s = f64::from(source.travelled.0);
        let w = 0.7 / ((1.0 + (s / 0.05).powi(2)) * (1.0 + f64::from(source.age) / 5.0));
        let variance = 0.015_f64.powi(2) + s * s;
        let off = z - f64::from(source.range.0);
        let normal =
            (-0.5 * off * off / variance).exp() / (core::f64::consts::TAU * variance).sqrt();
        (1.0 - w) * q + w * 0.8 * normal
    }

    proptest! {
        /// Eq. (26): the probabilities are those of eq. (15) with q' instead of q.
        #[test]
        fn a_repeated_echo_has_the_density_of_its_source(
            expected in any_expectation(), parameters in any_parameters(),
            at in 0.3_f32..3.5, off in -0.1_f32..0.1, travelled in 0.0_f32..0.3, age in 0.0_f32..20.0,
        ) {
            let source = EchoSource { range: Metres(at), travelled: Metres(travelled), age };
            let z = at + off;
            let [wall, clutter, occluded, wrong] = densities(&expected, &parameters, Some(Metres(z)));
            let (o, far) = (f64::from(expected.occluded), f64::from(expected.occluded).max(1e-9));
            let q = repeated(occluded / far, source, f64::from(z));
            let total = wall + clutter + o * q;
            prop_assume!(total > 1e-6);
            let found = ExpectedEcho { source: Some(source), ..expected }
                .explain(&parameters, Some(Metres(z)), Others::NONE);
            prop_assert!((f64::from(found.association) - wall / total).abs() < 2e-4);
            prop_assert!((f64::from(found.occluded) - o * q / total).abs() < 2e-4);
            // A longer range is evidence, however often it was measured.
            let ratio = if z < expected.range.0 {
                ((1.0 - o) * wrong + o * q) / total
            } else {
                wrong / (wall + clutter + occluded)
            };
            let evidence = (0.3 + 0.7 * ratio).ln().min(4.0);
            prop_assert!((f64::from(found.evidence) - evidence).abs() < 2e-3);
        }

        /// The probabilities of wall, clutter and object sum to one, and are those of eq. (15).
        #[test]
        fn association_probabilities_sum_to_one(
            expected in any_expectation(), parameters in any_parameters(), echo in proptest::option::of(0.11_f32..3.99),
        ) {
            let echo = echo.map(Metres);
            let [wall, clutter, occluded, wrong] = densities(&expected, &parameters, echo);
            let total = wall + clutter + occluded;
            prop_assume!(total > 1e-6);
            let found = expected.explain(&parameters, echo, Others::NONE);
            let rest = clutter / total;
            let sum = f64::from(found.association) + f64::from(found.occluded) + rest;
            prop_assert!((sum - 1.0).abs() < 1e-4, "{sum}");
            prop_assert!((f64::from(found.association) - wall / total).abs() < 1e-4);
            let is_long = echo.is_some_and(|echo| echo >= expected.range);
            let o = if is_long { 0.0 } else { f64::from(expected.occluded) };
            let object = if is_long { 0.0 } else { occluded };
            let evidence = (0.3 + 0.7 * ((1.0 - o) * wrong + object) / total).ln().min(4.0);
            prop_assert!((f64::from(found.evidence) - evidence).abs() < 1e-3);
            prop_assert!(found.evidence >= -1.205 && found.evidence <= MAX_EVIDENCE);
        }

        /// Without clutter an echo within two deviations is the wall's but for the bound of `docs/model.md`, "Echo
        /// model"; below 0.001 the correction is that of certainty, bit for bit.
        #[test]
        fn without_clutter_an_echo_is_the_walls_within_its_bound(
            expected in any_expectation(), deviations in -2.0_f32..2.0,
        ) {
            let expected = ExpectedEcho { occluded: 0.0, ..expected };
            let sigma = sqrt(expected.variance.0);
            let echo = Metres(expected.range.0 + deviations * sigma);
            let found = expected.explain(&EchoParameters::NONE, Some(echo), Others::NONE);
            let geometry = f64::from(expected.geometry);
            let bound = (1.0 - geometry) / geometry * 10.91 * f64::from(sigma) / 3.9;
            prop_assert!(1.0 - f64::from(found.association) <= bound + 1e-6, "{found:?} {bound}");
            if bound < 0.000_99 {
                prop_assert_eq!(crate::association::gating::weight(found.association).to_bits(), 1.0_f32.to_bits());
            }
        }

        /// The information of repeated ranges: n of them with correlation ρ hold as much as the batch.
        #[test]
        fn map_variance_is_that_of_a_correlated_sequence(spacing in 0.05_f32..5.0) {
            let parameters = EchoParameters { map_accuracy: Metres(0.01), ..EchoParameters::NONE };
            let rho = (-f64::from(spacing)).exp();
            let exact = 1e-4 * (1.0 + rho) / (1.0 - rho);
            let variance = f64::from(parameters.map_variance(None));
            let found = variance * f64::from(repetition(Metres(spacing)));
            prop_assert!((found / exact - 1.0).abs() < 0.1, "{found} {exact}");
            prop_assert!(found >= variance);
        }
    }

    /// An object 12 cm before the wall answers five pings from one place. Each ping widens S, as eq. (16)
    /// does; the echo does not become the wall's.
    #[test]
    fn the_repeated_echo_of_an_object_does_not_become_the_walls() {
        let parameters = EchoParameters::HC_SR04;
        let (h, z) = (Metres(1.6), Metres(1.48));
        let mut occluded = parameters.prior_occlusion(h);
        let mut source = None;
        for deviation in [0.03_f32, 0.05, 0.07, 0.08, 0.09] {
            let variance = SquareMetres(deviation * deviation);
            let limits = (Metres(0.05), Metres(4.0));
            let expected = ExpectedEcho {
                range: h,
                variance,
                geometry: 1.0,
                occluded,
                source,
                limits,
                by_chance: 0.3,
                lying: 0.0,
            };
            let found = expected.explain(&parameters, Some(z), Others::NONE);
            assert!(found.association < 0.4, "{found:?}");
            occluded = found.occluded.max(0.8 * occluded);
            source = Some(EchoSource { range: z, travelled: Metres(0.015), age: 0.06 });
        }
    }

    #[test]
    fn a_repeated_wall_contradicts_as_far_as_it_is_not_known_to_be_occluded() {
        let parameters = EchoParameters::HC_SR04;
        let expected = ExpectedEcho {
            range: Metres(2.0),
            variance: SquareMetres(1e-4),
            geometry: 1.0,
            occluded: parameters.prior_occlusion(Metres(2.0)),
            source: None,
            limits: (Metres(0.05), Metres(4.0)),
            by_chance: 0.3,
            lying: 0.0,
        };
        let short = Some(Metres(1.0));
        let first = expected.explain(&parameters, short, Others::NONE);
        assert!(first.evidence > 0.5 && first.occluded > 0.8, "{first:?}");
        let again = ExpectedEcho { occluded: first.occluded, ..expected };
        assert!(again.explain(&parameters, short, Others::NONE).evidence < 0.2);
        // A range that is too long is evidence, however well the wall is known to be occluded.
        assert!(again.explain(&parameters, Some(Metres(3.0)), Others::NONE).evidence > 0.5);
    }

    proptest! {
        /// The logarithms of the score, by the definitions of their fields.
        #[test]
        fn log_shares_are_those_of_the_mixture_over_the_ranges(
            parameters in any_parameters(), longest in 1.0_f32..6.0, anywhere in 0.05_f32..0.5,
        ) {
            let shares = parameters.log_shares(Metres(longest), anywhere);
            let wide = |value: f32| f64::from(value);
            let range = 0.5 * wide(longest);
            let occluded = range / (range + wide(parameters.free_path.0));
            let per_metre = 1.0 / (range * wide(anywhere));
            let sure = (wide(parameters.sure_within.0) / wide(longest)).min(1.0);
            let [missed, short, long] = [parameters.missed, parameters.short, parameters.long]
                .map(|it| (0.04 * sure + 1.0 - sure) * wide(it));
            let expected = [
                (shares.answers, 1.0 - missed - short - long),
                (shares.misses, missed + short + long),
                (shares.before, (short + occluded * 0.735) * per_metre),
                (shares.behind, (long + occluded * 0.065) * per_metre),
                (shares.silence, (missed + occluded * 0.2) / 0.3),
            ];
            for (is, share) in expected {
                let expected = share.max(0.01).ln();
                prop_assert!((wide(is) - expected).abs() < 1e-3, "{} {}", is, expected);
            }
        }

        /// What another reflector explains is taken from the target's share, and counts as mapped.
        #[test]
        fn an_echo_of_another_reflector_is_mapped(
            parameters in any_parameters(), expected in any_expectation(), density in 0.01_f32..5.0,
            sigmas in -1.5_f32..1.5,
        ) {
            let range = expected.range + Metres(sigmas * sqrt(expected.variance.0));
            let alone = expected.explain(&parameters, Some(range), Others::NONE);
            let others = Others { density, ..Others::NONE };
            let with = expected.explain(&parameters, Some(range), others);
            prop_assert!((alone.mapped - alone.association).abs() < 1e-6);
            // β is the target's density over the total, to which that of the other is added.
            let of_other = 1.0 - with.association / alone.association;
            prop_assert!(
                (with.mapped - with.association - of_other).abs() < 1e-4, "{with:?} {alone:?}"
            );
        }
    }
}
