//! How cluttered the place is: the free path of a beam, learned from the pings (`docs/model.md`, eq. 51).
//!
//! # Non-finite policy
//! The sums are finite: each ping adds at most the longest range and one object.

use crate::geometry::units::Metres;
use crate::sensor::echo::EchoParameters;

/// Objects that the free path of the echo model counts for. Chosen on generated rooms with the seeds 1000 to 1059
/// (`docs/rooms.md`).
const PRIOR_OBJECTS: f32 = 0.5;
/// What remains of the sums after a ping: a memory of fifty pings.
const REMAINS: f32 = 0.98;

/// Beams and the unmapped objects in them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Clutter {
    /// Length of the beams that no object has occluded, metres.
    free: f32,
    /// Expected number of objects.
    objects: f32,
}

impl Clutter {
    // ===== Eq. (51) =====
    /// Probability that an unmapped object occludes a reflector at this range, before a ping at it. The free path is at
    /// least that of the echo model: a wrong pose looks as if it was cluttered.
    pub fn prior_occlusion(self, parameters: &EchoParameters, range: Metres) -> f32 {
        let given = parameters.free_path.0;
        let learned = (PRIOR_OBJECTS * given + self.free) / (PRIOR_OBJECTS + self.objects);
        parameters.occlusion_within(range, if learned > given { learned } else { given })
    }

    /// Records an echo from a reflector at `range` that an object has occluded with the probability `occluded`.
    pub fn record(&mut self, range: Metres, occluded: f32) {
        self.free = self.free * REMAINS + range.0 * (1.0 - occluded);
        self.objects = self.objects * REMAINS + occluded;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEN_METRES: EchoParameters =
        EchoParameters { free_path: Metres(10.0), ..EchoParameters::NONE };

    fn after(pings: u32, occluded: f32) -> f32 {
        let mut clutter = Clutter::default();
        (0..pings).for_each(|_| clutter.record(Metres(2.0), occluded));
        clutter.prior_occlusion(&TEN_METRES, Metres(2.0))
    }

    /// Against the sums of the geometric series in `f64`.
    #[test]
    fn the_free_path_is_the_mean_of_the_beams_and_of_half_a_given_one() {
        for (pings, occluded) in [(0, 0.0), (1, 0.02), (20, 0.0), (300, 0.1)] {
            let sum = (1.0 - 0.98_f64.powi(pings)) / (1.0 - 0.98);
            let hit = f64::from(occluded);
            let path = (5.0 + 2.0 * (1.0 - hit) * sum) / (0.5 + hit * sum);
            let found = f64::from(after(u32::try_from(pings).unwrap(), occluded));
            assert!((found - 2.0 / (2.0 + path)).abs() < 1e-5, "{pings} {occluded}: {found}");
        }
    }

    #[test]
    fn the_free_path_is_at_least_the_given_one() {
        assert!((after(20, 1.0) - 2.0 / 12.0).abs() < 1e-6);
    }

    #[test]
    fn without_a_free_path_in_the_model_nothing_is_occluded() {
        let mut clutter = Clutter::default();
        clutter.record(Metres(2.0), 1.0);
        let prior = clutter.prior_occlusion(&EchoParameters::NONE, Metres(2.0));
        assert_eq!(prior.to_bits(), 0.0_f32.to_bits());
    }
}
