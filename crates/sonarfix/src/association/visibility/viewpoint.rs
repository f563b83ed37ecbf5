//! Which walls can be measured from the estimated pose, other walls aside.
//!
//! # Non-finite policy
//! Comparisons are written so that a wall whose numbers are NaN cannot be measured.

use crate::association::outcome::Refusal;
use crate::config::{Config, EchoParameters, RangerId, RangerParameters, Ranging};
use crate::filter::ekf::{Ekf, PoseCovariance};
use crate::geometry::elementary::{inverse_sqrt, sqrt};
use crate::geometry::numeric::positive_part;
use crate::geometry::pose::{Heading, Point};
use crate::geometry::units::{Metres, Radians};
use crate::geometry::vector::Vector;
use crate::map::Wall;
use crate::sensor::range::{ExpectedRange, SonarPosition};

/// Least probability that the foot lies on the wall and its range within the limits of the sonar, for a
/// wall that is measured while there are others.
const SAFE: f32 = 0.7;
/// The same if no wall is safe: to measure an unlikely wall is better than to measure none.
const LIKELY: f32 = 0.2;
/// The same when the echo has arrived.
const POSSIBLE: f32 = 0.05;

/// Share of the cone in which other walls occlude the target if no wall is safe.
const CORE_OF_CONE: f32 = 0.7;
/// Largest widening of the cone by the uncertainty of the heading: beyond that everything occludes
/// everything.
const MAX_WIDENING: Radians = Radians(0.3);

/// Standard deviations of the foot along the wall, of the range and of the heading that the estimate
/// does not contain: rounded ends of walls, limits of the sonar, dead band of the servo.
pub(super) const FOOT_MARGIN: f32 = 0.02;
pub(super) const RANGE_MARGIN: f32 = 0.001;
const HEADING_MARGIN: f32 = 0.01;
/// Standard deviation of the bearing of a servo, radians: dead band and backlash of an SG90.
const SERVO_MARGIN: f32 = 0.017_5;

/// Largest deviation of the heading at which the estimate counts as tracking, as a share of the cone.
const MAX_HEADING_DEVIATION: f32 = 0.25;

/// The same of light, whose range is not linear in the heading: the curvature, half of the range times the variance, is 3 mm at 2 m.
const MAX_LIGHT_HEADING_DEVIATION: Radians = Radians(0.05);

/// A wall as one ping measures it.
pub(crate) struct Sight {
    pub expected: ExpectedRange,
    /// Probability that foot or spot is on the wall and the range within the limits.
    pub on_wall: f32,
    /// Probability that the beam is square, or of light not too oblique.
    pub square: f32,
    /// Angle between the beam and the perpendicular.
    pub off: Radians,
    /// Variance of the range apart from that of the map, m².
    pub noise: f32,
    /// Variance of the range by the place of the wall in the map, m².
    pub of_map: f32,
    /// Place of the foot along the wall, also of light: what occludes a wall is remembered by where the robot was.
    pub place: Metres,
}

/// The estimate of the filter as seen from the sonar: computed once for all walls.
pub(crate) struct Viewpoint<'a> {
    pub sonar: &'a RangerParameters,
    position: SonarPosition,
    pub heading: Heading,
    /// Cone in which other walls occlude the target, without the uncertainty of the heading.
    cone: Radians,
    confidence: f32,
    /// Least probability of foot and range.
    pub(super) least: f32,
    covariance: PoseCovariance,
    /// Square of a distance from a limit at which it is certain to hold, whatever the direction of the wall.
    certain_squared: f32,
    /// What the echo model knows of the sensor.
    pub(super) echo: &'a EchoParameters,
    /// Angle off the perpendicular at which half of the walls answer, and its variance, rad².
    half_angle: Radians,
    rim_squared: f32,
}

impl<'a> Viewpoint<'a> {
    pub fn new(config: &'a Config, sonar: &'a RangerParameters, ekf: &Ekf) -> Self {
        let (state, covariance) = (ekf.state(), ekf.pose_covariance());
        Self {
            certain_squared: certain_squared(&covariance),
            covariance,
            sonar,
            position: SonarPosition::new(sonar.mount, &state),
            heading: ekf.heading(),
            cone: match sonar.ranging {
                Ranging::Sound => sonar.cone,
                Ranging::Light(beam) => beam.spot,
            },
            confidence: config.gating.confidence,
            least: SAFE,
            echo: &config.echo,
            half_angle: half_angle(sonar, &config.echo),
            rim_squared: config.echo.rim.0 * config.echo.rim.0,
        }
    }

    /// Drops the margins, for when no wall is safe.
    pub fn drop_margins(&mut self) {
        self.cone = self.cone * CORE_OF_CONE;
        (self.confidence, self.least) = (0.0, LIKELY);
    }

    /// The same estimate for an echo that has arrived.
    pub fn of_echo(self) -> Self {
        Self { least: POSSIBLE, ..self }
    }

    /// The sonar at the estimate.
    pub(super) fn sonar_position(&self) -> &SonarPosition {
        &self.position
    }

    /// For the ranger whose mount is estimated: the unit vector ahead of the robot, in map axes.
    #[inline]
    pub fn ahead_of(&self, ranger: RangerId) -> Option<Vector> {
        (cfg!(feature = "mount") && ranger == RangerId::FIRST).then_some(self.position.ahead)
    }

    /// Variance of the heading, rad².
    pub(super) fn heading_variance(&self) -> f32 {
        self.covariance.hh
    }

    /// A wall as a ping at `bearing` measures it.
    ///
    /// # Errors
    /// [`Refusal::FootOffWall`], [`Refusal::OutOfRange`] or [`Refusal::NotSquare`] if that is too improbable.
    pub fn sight(&self, wall: &Wall, bearing: Radians) -> Result<Sight, Refusal> {
        let beam = match self.sonar.ranging {
            Ranging::Sound => return self.heard(wall, bearing),
            Ranging::Light(beam) => beam,
        };
        self.lit(wall, beam, self.heading.turned(bearing))
    }

    fn heard(&self, wall: &Wall, bearing: Radians) -> Result<Sight, Refusal> {
        let (expected, on_wall) = self.expected_range(wall)?;
        let off = self.off_square(&expected, bearing);
        let variance = self.covariance.hh + SERVO_MARGIN * SERVO_MARGIN;
        let range = expected.range + self.echo.lateness(off, variance);
        let expected = ExpectedRange { range, ..expected };
        let square = self.of_square(off)?;
        let place = wall.along(self.position());
        let noise = self.sonar.noise.variance(expected.range).0;
        Ok(Sight {
            expected,
            on_wall,
            square,
            off,
            noise,
            of_map: self.echo.map_variance(wall.accuracy()),
            place,
        })
    }

    /// Estimated position of the sonar.
    pub fn position(&self) -> Point {
        self.position.point
    }

    /// The cone plus the uncertainty of the heading: where an echo may come from.
    pub fn wide_cone(&self) -> Radians {
        let uncertainty = Radians(sqrt(self.covariance.hh)) * self.confidence;
        self.cone + if uncertainty < MAX_WIDENING { uncertainty } else { MAX_WIDENING }
    }

    /// Square of the position uncertainty along the unit vector (x, y), m².
    pub fn uncertainty_squared(&self, x: f32, y: f32) -> f32 {
        self.confidence * self.confidence * self.variance(x, y)
    }

    /// Variance of the position along the unit vector (x, y), m².
    pub(super) fn variance(&self, x: f32, y: f32) -> f32 {
        let p = &self.covariance;
        positive_part((p.xx * x + (p.xy + p.xy) * y) * x + p.yy * y * y)
    }

    /// The range expected from a wall, and the probability that its foot lies on it and the range is
    /// within the limits of the sonar.
    ///
    /// # Errors
    /// [`Refusal::FootOffWall`] or [`Refusal::OutOfRange`] if that is too improbable.
    pub fn expected_range(&self, wall: &Wall) -> Result<(ExpectedRange, f32), Refusal> {
        let position = self.position();
        let along = wall.along(position).0;
        let rest = wall.length().0 - along;
        let on_wall = self.probability_along((wall.b(), -wall.a()), FOOT_MARGIN, along, rest);
        // Neither comparison holds for NaN.
        let is_on_wall = on_wall >= self.least;
        if !is_on_wall {
            return Err(Refusal::FootOffWall);
        }
        let distance = wall.signed_distance(position).0.abs();
        let range = self.position.stretch * distance;
        let (nearest, farthest) = (self.sonar.min_range.0, self.sonar.max_range.0);
        let (below, above) = (range - nearest, farthest - range);
        let in_range = self.probability_along((wall.a(), wall.b()), RANGE_MARGIN, below, above);
        let is_in_range = in_range >= self.least;
        if !is_in_range {
            return Err(Refusal::OutOfRange);
        }
        Ok((ExpectedRange::from_sonar(wall, &self.position), on_wall * in_range))
    }

    /// [`probability_within`] of the position along a unit vector, with a margin. The variance is computed only if it matters.
    fn probability_along(&self, (x, y): (f32, f32), margin: f32, below: f32, above: f32) -> f32 {
        let least = if below < above { below } else { above };
        if least > 0.0 && least * least >= self.certain_squared {
            return 1.0;
        }
        probability_within(below, above, self.variance(x, y) + margin * margin)
    }

    /// Whether the heading is known well enough to tell what is in a beam.
    pub fn is_heading_known(&self) -> bool {
        let limit = max_heading_deviation(self.sonar, self.echo).0;
        self.covariance.hh <= limit * limit
    }

    /// Angle between a beam at `bearing` and the perpendicular of the expected wall.
    pub fn off_square(&self, expected: &ExpectedRange, bearing: Radians) -> Radians {
        expected.direction.from(self.heading.turned(bearing))
    }

    /// Probability that a beam at the angle `off` from the perpendicular is square.
    ///
    /// # Errors
    /// [`Refusal::NotSquare`] if that is too improbable.
    fn of_square(&self, off: Radians) -> Result<f32, Refusal> {
        let probability = self.probability_of_square(off);
        // Does not hold for NaN.
        let is_possible = probability >= self.least;
        if is_possible { Ok(probability) } else { Err(Refusal::NotSquare) }
    }

    /// Whether a beam at the angle `off` from the perpendicular is square to the expected wall.
    pub fn is_square(&self, off: Radians) -> bool {
        off.abs() <= self.sonar.cone
    }

    /// Whether a wall may answer a beam at the angle `off` from its perpendicular that was not planned: an echo is explained by
    /// what is known of the sensor, also where the planner would not measure.
    pub fn may_answer(&self, off: Radians) -> bool {
        if self.echo.half_angle > Radians(0.0) {
            self.probability_of_square(off) >= POSSIBLE
        } else {
            self.is_square(off)
        }
    }

    /// Probability that a beam at the angle `off` from the perpendicular is square, or near enough for the sonar to hear the
    /// wall, given the uncertainty of the heading.
    pub fn probability_of_square(&self, off: Radians) -> f32 {
        let half = self.half_angle.0;
        let variance = self.covariance.hh + HEADING_MARGIN * HEADING_MARGIN + self.rim_squared;
        probability_within(half + off.0, half - off.0, variance)
    }
}

/// Largest deviation of the heading at which the estimate counts as tracking: that of the least demanding ranger.
pub(crate) fn max_heading_deviation_of(config: &Config) -> Radians {
    let of = |ranger: &RangerParameters| max_heading_deviation(ranger, &config.echo);
    let (first, others) = (of(&config.rangers.first), config.rangers.after_first().map(of));
    others.fold(first, |most, other| if other > most { other } else { most })
}

/// The same of one ranger.
fn max_heading_deviation(sonar: &RangerParameters, echo: &EchoParameters) -> Radians {
    match sonar.ranging {
        Ranging::Sound => half_angle(sonar, echo) * MAX_HEADING_DEVIATION,
        Ranging::Light(_) => MAX_LIGHT_HEADING_DEVIATION,
    }
}

/// Angle off the perpendicular at which a ranger hears half of the walls: that of its echo model, otherwise its cone.
fn half_angle(sonar: &RangerParameters, echo: &EchoParameters) -> Radians {
    let is_known = sonar.ranging == Ranging::Sound && echo.half_angle > Radians(0.0);
    if is_known { echo.half_angle } else { sonar.cone }
}

/// The range of an echo, if it is one that the sonar can report.
///
/// # Errors
/// [`Refusal::NoEcho`], [`Refusal::NotFinite`] or [`Refusal::OutOfRange`].
pub(crate) fn check_range(
    sonar: &RangerParameters,
    range: Option<Metres>,
) -> Result<Metres, Refusal> {
    let range = range.ok_or(Refusal::NoEcho)?;
    if !range.is_finite() {
        return Err(Refusal::NotFinite);
    }
    if range < sonar.min_range || range > sonar.max_range {
        return Err(Refusal::OutOfRange);
    }
    Ok(range)
}

/// Standard deviations beyond which a limit is certain to hold: the probability that it does not is 3e-5.
const CERTAIN: f32 = 4.0;

/// From this on [`probability_within`] is 1 with every variance of the position: none exceeds the sum of those of x and y by more than
/// its rounding.
fn certain_squared(covariance: &PoseCovariance) -> f32 {
    const ROUNDING: f32 = 1.001;
    let most = covariance.xx + covariance.yy + FOOT_MARGIN * FOOT_MARGIN;
    CERTAIN * CERTAIN * ROUNDING * most
}

/// Probability that a normal variable with this variance lies less than `below` below its mean and less than
/// `above` above it.
#[inline]
pub(super) fn probability_within(below: f32, above: f32, variance: f32) -> f32 {
    let least = if below < above { below } else { above };
    if least > 0.0 && least * least >= CERTAIN * CERTAIN * variance {
        return 1.0;
    }
    uncertain_probability(below, above, variance)
}

#[inline(never)]
fn uncertain_probability(below: f32, above: f32, variance: f32) -> f32 {
    let per_sigma = inverse_sqrt(variance);
    0.5 * (odd_probability(above * per_sigma) + odd_probability(below * per_sigma))
}

/// erf(x/√2) of a number of either sign.
fn odd_probability(sigmas: f32) -> f32 {
    central_probability(sigmas.abs()).copysign(sigmas)
}

/// Probability that a normal variable lies within `sigmas` standard deviations: erf(x/√2) after
/// Abramowitz and Stegun 7.1.27, error at most 5e-4; zero if `sigmas` is not positive.
fn central_probability(sigmas: f32) -> f32 {
    if sigmas > 0.0 {
        let x = sigmas * core::f32::consts::FRAC_1_SQRT_2;
        let sum = 1.0 + x * (0.278_393 + x * (0.230_389 + x * (0.000_972 + x * 0.078_108)));
        let square = sum * sum;
        1.0 - 1.0 / (square * square)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn central_probability_matches_the_tables() {
        let table = [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.682_689), (2.0, 0.954_500), (3.0, 0.997_300)];
        for (sigmas, probability) in table {
            assert!((central_probability(sigmas) - probability).abs() < 5e-4, "{sigmas}");
        }
        assert!((central_probability(1e9) - 1.0).abs() < 1e-6);
    }

    /// Up to the limit of the sonar, and not beyond it.
    #[test]
    fn a_heading_is_known_up_to_its_limit() {
        use crate::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
        let config = Config::for_track_width(Metres(0.2));
        let limit = max_heading_deviation(&config.rangers.first, &config.echo);
        for (share, is_known) in
            [(0.0, true), (0.5, true), (0.99, true), (1.01, false), (9.0, false)]
        {
            let heading = limit * share;
            let deviation = StandardDeviations { heading, ..StandardDeviations::default() };
            let ekf = Ekf::new(config.drive, StateEstimate::default(), deviation).unwrap();
            assert_eq!(
                Viewpoint::new(&config, &config.rangers.first, &ekf).is_heading_known(),
                is_known,
                "{share}"
            );
        }
    }

    fn ekf_with(heading: f32) -> Ekf {
        use crate::filter::ekf::{StandardDeviations, StateEstimate};
        let heading = Radians(heading);
        let deviation = StandardDeviations { heading, ..StandardDeviations::default() };
        let drive = Config::for_track_width(Metres(0.2)).drive;
        Ekf::new(drive, StateEstimate::default(), deviation).unwrap()
    }

    /// Eq. (50) in `f64`, whatever the cone in which walls are chosen; without a half-angle the cone is taken, and is hard.
    #[test]
    fn what_a_sonar_hears_does_not_depend_on_the_cone() {
        let ekf = ekf_with(0.02);
        for cone in [8.0_f32, 12.0, 20.0, 40.0] {
            let mut config = Config::for_track_width(Metres(0.2));
            config.rangers.first.cone = Radians::from_degrees(cone);
            (config.echo.half_angle, config.echo.rim) = (Radians(0.56), Radians(0.03));
            let view = Viewpoint::new(&config, &config.rangers.first, &ekf);
            let (half, rim) = (f64::from(config.echo.half_angle.0), f64::from(config.echo.rim.0));
            let sigma = (0.02_f64.powi(2) + 0.01_f64.powi(2) + rim * rim).sqrt()
                * core::f64::consts::SQRT_2;
            for degrees in -12..=12_i16 {
                let off = Radians::from_degrees(5.0 * f32::from(degrees));
                let at = f64::from(off.0);
                let inside = libm::erf((half + at) / sigma) + libm::erf((half - at) / sigma);
                let probability = f64::from(view.probability_of_square(off));
                assert!((probability - 0.5 * inside).abs() < 1e-3, "{cone} {degrees}");
                assert_eq!(view.may_answer(off), 0.5 * inside >= 0.05, "{cone} {degrees}");
            }
            assert_eq!(view.is_square(Radians(0.5)), cone > 30.0);
            config.echo = EchoParameters::HC_SR04;
            let view = Viewpoint::new(&config, &config.rangers.first, &ekf);
            let [inside, outside] =
                [0.99, 1.01].map(|share| view.may_answer(config.rangers.first.cone * share));
            assert!(inside && !outside, "{cone}");
        }
    }

    /// Eq. (49) in the range expected of an echo.
    #[test]
    fn an_echo_is_expected_as_late_as_its_model_says() {
        use crate::map::Wall;
        let ekf = ekf_with(0.02);
        let mut config = Config::for_track_width(Metres(0.2));
        let wall = Wall::new(Point::new(2.0, -2.0), Point::new(2.0, 2.0)).unwrap();
        let expected = |config: &Config, bearing: f32| {
            let view = Viewpoint::new(config, &config.rangers.first, &ekf).of_echo();
            view.sight(&wall, Radians(bearing)).unwrap().expected.range.0
        };
        config.echo = EchoParameters::NONE;
        assert!((expected(&config, 0.1) - 2.0).abs() < 1e-6);
        config.echo = EchoParameters::HC_SR04;
        for bearing in [-0.15_f32, 0.0, 0.1] {
            let variance = 0.02_f64.powi(2) + 0.017_5_f64.powi(2);
            let angle =
                (f64::from(bearing).powi(2) + 2.0 / core::f64::consts::PI * variance).sqrt();
            let late = 0.000_23 + 0.014_3 * angle;
            assert!((f64::from(expected(&config, bearing)) - 2.0 - late).abs() < 1e-6, "{bearing}");
        }
    }
}
