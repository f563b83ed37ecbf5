//! The path of each scalar measurement: view, predict, explain, use, record.
//!
//! | step | by | result |
//! |---|---|---|
//! | view | the sensor | what the estimate expects of the measurement: number, derivatives, noise |
//! | predict | the filter | the innovation and its variance |
//! | explain | the sensor | the probability that the number is what is expected, and the evidence against the pose |
//! | use | the gate | the estimate is corrected by that probability, or not at all |
//! | record | the sensor, then health | what later measurements need to know; the verdict |
//!
//! A sensor is one file that implements [`Measurement`] and passes its measurements to [`Localizer::measure`], as
//! `ping.rs` does for a range along a chosen bearing.
//!
//! # Non-finite policy
//! A sensor refuses a number that is not finite when it views it.

use super::Localizer;
use crate::aim::Situation;
use crate::association::echo::Explanation;
use crate::association::gating::{self, Use};
use crate::association::history::History;
use crate::association::outcome::{Fix, Refusal};
use crate::config::Config;
use crate::filter::covariance::{GyroBias, PredictedMeasurement};
use crate::filter::ekf::Ekf;
use crate::filter::gyro_fusion::GyroFusion;
use crate::geometry::units::{Instant, Metres, SquareMetres};
use crate::geometry::vector::Vector;
use crate::health::Verdict;
use crate::sensor::range::{ExpectedRange, Innovation};

/// What the estimate expects of a measurement.
pub(super) struct View {
    /// The expected number with its derivatives by the state.
    pub expected: ExpectedRange,
    /// Variance of the number.
    pub noise: SquareMetres,
    /// What is added to it because its error is common to earlier numbers, m².
    pub repeated: f32,
    /// For a range of the ranger whose mount is estimated: the unit vector ahead of the robot, in map axes.
    pub ahead: Option<Vector>,
    /// The measured number, or the reason for which it is missing. The sensor explains a missing number as well.
    pub measured: Result<Metres, Refusal>,
}

/// What a measurement adds to those before it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct News {
    /// Whether it contradicts the pose, independently of earlier measurements.
    pub contradicts: bool,
    /// Whether its number is that of an object that has returned one before.
    pub is_repeated: bool,
}

/// A measured number, or its absence.
pub(super) trait Measurement {
    /// What [`Self::explain`] and [`Self::record`] need of the view.
    type Seen;

    /// What the estimate expects.
    ///
    /// # Errors
    /// [`Refusal`], by the reason for which the number cannot be compared with the estimate.
    fn view(&self, robot: &Situation<'_>) -> Result<(View, Self::Seen), Refusal>;

    /// How probable it is that the number is the expected one, for an innovation of this variance.
    fn explain(
        &self,
        robot: &Situation<'_>,
        view: &View,
        seen: &Self::Seen,
        variance: SquareMetres,
    ) -> Explanation;

    /// Stores what later measurements need to know of this one.
    fn record(&self, past: Past<'_>, view: &View, seen: &Self::Seen, found: &Explanation) -> News;

    /// Whether the sensor has failed, as far as its measurements tell: one that was not used says nothing about the pose.
    fn has_failed(&self, _config: &Config, _history: &History) -> bool {
        false
    }
}

/// Where a sensor stores what it has measured, and when.
pub(super) struct Past<'a> {
    pub config: &'a Config,
    pub history: &'a mut History,
    pub now: Instant,
}

/// The outcome of a measurement, and its evidence against the pose.
struct Outcome {
    fix: Fix,
    evidence: f32,
    news: News,
}

impl Localizer<'_> {
    /// Corrects the estimate by a measurement, or records why it was not used.
    pub(super) fn measure(&mut self, measurement: &impl Measurement) -> Fix {
        self.association = 0.0;
        let news = News::default();
        let mut outcome = Outcome { fix: Fix::Refused(Refusal::NoEcho), evidence: 0.0, news };
        if let Err(refusal) = self.try_measure(measurement, &mut outcome) {
            outcome.fix = Fix::Refused(refusal);
        }
        let Outcome { fix, evidence, news: News { contradicts, is_repeated } } = outcome;
        let has_failed = measurement.has_failed(&self.config, &self.history);
        if has_failed && fix.innovation_used().is_none() {
            return fix;
        }
        let uncertainty = self.ekf.pose_uncertainty();
        self.health.record_fix(&fix, evidence, is_repeated, uncertainty, &self.limits);
        if contradicts {
            self.inflate_if_lost();
        }
        fix
    }

    /// Writes the outcome in place: a result that contains it is copied byte by byte.
    #[inline]
    fn try_measure<M: Measurement>(
        &mut self,
        measurement: &M,
        outcome: &mut Outcome,
    ) -> Result<(), Refusal> {
        let robot = self.situation(self.config.policy);
        let (view, seen) = measurement.view(&robot)?;
        let prediction = robot.ekf.predict_measurement(&view.expected, view.ahead);
        let value = view.measured.unwrap_or(view.expected.range);
        let innovation = prediction.innovation(value, view.noise);
        let variance = SquareMetres(innovation.variance.0 + view.repeated);
        let found = measurement.explain(&robot, &view, &seen, variance);
        let fix = if let Err(refusal) = view.measured {
            Fix::Refused(refusal)
        } else {
            let bias = GyroFusion::bias_of(&mut self.gyro);
            let (ekf, noise) = (&mut self.ekf, SquareMetres(view.noise.0 + view.repeated));
            use_number(ekf, &prediction, innovation, noise, found.association, bias)?
        };
        if fix.innovation_used().is_some() {
            self.ekf.adapt_noise(&self.config.drive, self.health.nis);
            self.pose_changed();
            self.mount_changed();
        }
        self.association = found.association;
        let past = Past { config: &self.config, history: &mut self.history, now: self.time };
        let news = measurement.record(past, &view, &seen, &found);
        *outcome = Outcome { fix, evidence: found.evidence, news };
        Ok(())
    }

    /// Inflates the covariance of the pose while the verdict is `Lost`, so that later echoes can be
    /// associated with their walls.
    pub(super) fn inflate_if_lost(&mut self) {
        if self.health.verdict != Verdict::Lost {
            return;
        }
        let uncertainty = self.ekf.pose_uncertainty();
        if let Some((position, heading)) = gating::inflation(&self.config.gating, uncertainty)
            && self.ekf.inflate_pose(position, heading).is_ok()
        {
            self.health.record_inflation();
            self.pose_changed();
        }
    }
}

/// Corrects the estimate by a number with this association probability.
#[inline]
fn use_number(
    ekf: &mut Ekf,
    prediction: &PredictedMeasurement,
    innovation: Innovation,
    noise: SquareMetres,
    association: f32,
    bias: Option<&mut GyroBias>,
) -> Result<Fix, Refusal> {
    let used = gating::use_of(association);
    if used == Use::Reject {
        return Ok(Fix::Gated(innovation));
    }
    let weight = gating::weight(association);
    ekf.update_predicted(prediction, innovation.value, noise, weight, bias)
        .map_err(Refusal::Filter)?;
    Ok(match used {
        Use::Accept => Fix::Accepted(innovation),
        _ => Fix::Downweighted(innovation),
    })
}
