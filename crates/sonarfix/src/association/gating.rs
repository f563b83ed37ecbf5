//! Decisions from the association probability of an echo (`docs/model.md`, eqs. 16 and 17): whether a
//! range is used, how the outcome is called, and when the covariance of a lost robot is inflated.
//!
//! # Non-finite policy
//! Comparisons are written so that NaN is not used.

use crate::config::{GatingParameters, MAX_INFLATION_STEPS};
use crate::filter::ekf::PoseUncertainty;
use crate::geometry::units::{Metres, Radians};

/// Association probability below which a range is not used: its correction would be lost in that of
/// the next accepted one.
const MIN_ASSOCIATION: f32 = 0.02;
/// Association probability from which a range counts as accepted.
const ACCEPTED_FROM: f32 = 0.8;
/// Association probability from which it is rounded to certainty, so that a clean echo costs no more
/// than without the model and has the same bits.
const CERTAIN_FROM: f32 = 0.999;
/// Probability that the map explains an echo below which it contradicts the pose.
const CONTRADICTS_BELOW: f32 = 0.5;
/// Probability of occlusion from which a further contradiction of the same wall is no independent one.
const KNOWN_OCCLUSION: f32 = 0.5;

/// Standard deviation of the heading up to which it is inflated: beyond that a beam that the planner
/// chooses is seldom square to its wall.
const MAX_INFLATED_HEADING: Radians = Radians(0.26);

/// Use of one range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Use {
    /// Corrects the estimate; counts as accepted.
    Accept,
    /// Corrects the estimate with a low weight.
    Downweight,
    /// Does not correct the estimate.
    Reject,
}

/// The use of a range with this association probability.
pub(crate) fn use_of(association: f32) -> Use {
    if association >= ACCEPTED_FROM {
        Use::Accept
    } else if association >= MIN_ASSOCIATION {
        Use::Downweight
    } else {
        Use::Reject
    }
}

/// The weight of a range with this association probability.
pub(crate) fn weight(association: f32) -> f32 {
    if association >= CERTAIN_FROM { 1.0 } else { association }
}

/// Whether a ping contradicts the pose, given the probability with which its wall was occluded before.
pub(crate) fn contradicts(mapped: f32, occluded_before: f32) -> bool {
    mapped < CONTRADICTS_BELOW && !is_known(occluded_before)
}

/// Whether an occlusion, or an outlier, of this probability was to be expected.
pub(crate) fn is_known(occluded_before: f32) -> bool {
    occluded_before >= KNOWN_OCCLUSION
}

// ===== Eq. (17): covariance inflation =====
/// The deviations to add to the position and the heading of a lost robot; `None` if both are at
/// their limits.
pub(crate) fn inflation(
    parameters: &GatingParameters,
    uncertainty: PoseUncertainty,
) -> Option<(Metres, Radians)> {
    let step = parameters.inflation;
    let is_position_small = uncertainty.position < step * MAX_INFLATION_STEPS;
    let position = if is_position_small { step } else { Metres(0.0) };
    let is_heading_small = uncertainty.heading < MAX_INFLATED_HEADING;
    let heading = Radians(if is_heading_small { step.0 } else { 0.0 });
    let grows = position > Metres(0.0) || heading > Radians(0.0);
    grows.then_some((position, heading))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_association_decides_use_and_weight_from_its_limits_on() {
        let used = [0.019_9, 0.02, 0.799_9, 0.8].map(use_of);
        assert_eq!(used, [Use::Reject, Use::Downweight, Use::Downweight, Use::Accept]);
        for (association, expected) in
            [(0.5_f32, 0.5_f32), (0.998_9, 0.998_9), (0.999, 1.0), (0.999_5, 1.0)]
        {
            assert_eq!(weight(association).to_bits(), expected.to_bits());
        }
    }

    /// An echo that is probably not the wall's contradicts the pose, unless the wall was probably occluded before.
    #[test]
    fn a_known_occlusion_explains_a_contradiction() {
        let cases = [(0.49, 0.49), (0.5, 0.49), (0.49, 0.5), (0.5, 0.5)];
        let expected = [true, false, false, false];
        assert_eq!(cases.map(|(association, before)| contradicts(association, before)), expected);
    }

    #[test]
    fn each_deviation_is_inflated_below_its_limit() {
        let parameters =
            GatingParameters { inflation: Metres(0.125), ..GatingParameters::default() };
        let added = |position, heading| {
            inflation(
                &parameters,
                PoseUncertainty { position: Metres(position), heading: Radians(heading) },
            )
        };
        let (step, turn) = (Metres(0.125), Radians(0.125));
        let (none, straight) = (Metres(0.0), Radians(0.0));
        assert_eq!(added(1.249, 0.259), Some((step, turn)));
        assert_eq!(added(0.01, 0.26), Some((step, straight)));
        assert_eq!(added(0.01, 0.3), Some((step, straight)));
        assert_eq!(added(1.25, 0.01), Some((none, turn)));
        assert_eq!(added(2.0, 0.01), Some((none, turn)));
        assert_eq!(added(1.25, 0.26), None);
    }
}
