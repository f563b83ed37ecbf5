//! Which walls other than the target a beam of light may have met: before it, or behind it if the spot was beside the
//! target, as at a door (`docs/model.md`, eq. 25 with the probabilities of eq. 47).
//!
//! # Non-finite policy
//! State and walls are finite.

use heapless::Vec;

use super::{MATCH, SAME_DISTANCE, Scene, Sum, Target};
use crate::association::echo::{Others, density};
use crate::association::reflector::{Audibility, FADES, REFLECTORS};
use crate::association::visibility::Viewpoint;
use crate::config::LightBeam;
use crate::geometry::elementary::sqrt;
use crate::geometry::units::{Metres, SquareMetres};

/// A wall that the beam met with less than this probability is no hypothesis.
const POSSIBLE: f32 = 0.05;

/// A wall that may have returned the light.
struct WallInBeam {
    distance: f32,
    /// Probability that it returns the light if nothing before it does.
    answers: f32,
    /// Density of its range at the measured one.
    density: f32,
}

impl Scene<'_, '_> {
    /// [`Self::others`] for a beam of light: the direction is that of the target.
    #[inline(never)]
    pub fn others_lit(
        &self,
        view: &Viewpoint,
        beam: LightBeam,
        target: &Target,
        range: Metres,
    ) -> Others {
        let reach = Metres(range.0 + MATCH * sqrt(target.variance.0));
        let distance = target.expected.by_range_scale;
        let mut found: Vec<WallInBeam, REFLECTORS> = Vec::new();
        for (id, wall) in self.map.near(view.position(), reach) {
            let Some(spot) = view.spot(&wall, beam, target.expected.direction) else { continue };
            let at = spot.expected.by_range_scale;
            // False for NaN.
            let is_other = spot.on_wall >= POSSIBLE && (at - distance).abs() >= SAME_DISTANCE;
            if !is_other || at > reach.0 {
                continue;
            }
            let (sonar, echo) = (self.sonar, &self.config.echo);
            let is_weak = spot.incidence > sonar.cone || at > FADES * sonar.max_range.0;
            let heard = if is_weak { Audibility::Rim } else { Audibility::Foot };
            let at = Metres(at);
            let visible = 1.0 - self.history.clutter.prior_occlusion(echo, at);
            let repetition = self.history.repetition(id);
            let noise = SquareMetres(spot.noise + spot.of_map * repetition);
            let innovation = self.ekf.innovation(range, &spot.expected, noise);
            let answers = visible * spot.on_wall * heard.probability(echo.heard(at));
            insert(
                &mut found,
                WallInBeam { distance: at.0, answers, density: density(innovation) },
            );
        }
        let mut sum = Sum::new(target);
        for lit in &found {
            sum.add(lit.answers, lit.density, lit.distance > distance);
        }
        sum.others
    }
}

/// Inserts by distance; the farthest drops out of a full list.
fn insert(into: &mut Vec<WallInBeam, REFLECTORS>, lit: WallInBeam) {
    let mut carried = lit;
    let mut is_placed = false;
    for slot in into.iter_mut() {
        is_placed |= carried.distance < slot.distance;
        if is_placed {
            core::mem::swap(slot, &mut carried);
        }
    }
    // The last one of a full list is the farthest.
    let _ = into.push(carried);
}
