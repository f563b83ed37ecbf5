//! Occlusion against geometry in `f64`.

use proptest::prelude::*;

use super::*;

/// Comparisons that a difference of this many metres decides are left to rounding.
const EDGE: f64 = 1e-4;

/// The region in which something answers before the target, in the frame of the beam.
struct Region {
    distance: f64,
    tangent: f64,
    /// How far the sonar may be displaced along the beam and across it.
    ahead: f64,
    aside: f64,
}

impl Region {
    /// Whether a point reflector here, seen from the worst displaced sonar, is in the cone and nearer than the target.
    /// `slack` widens the region.
    fn answers(&self, (ahead, aside): (f64, f64), slack: f64) -> bool {
        let from_sonar = ahead + self.ahead;
        let beside = (aside.abs() - self.aside).max(0.0);
        beside <= self.tangent * from_sonar + slack
            && from_sonar > -slack
            && ahead < self.distance + slack
            && from_sonar.hypot(beside) < self.distance + self.ahead + slack
    }

    /// Whether the part of a wall that the displaced beam can meet is partly before the target and partly before the sonar.
    fn is_crossed(&self, from: (f64, f64), to: (f64, f64), slack: f64) -> bool {
        let band = self.aside + slack;
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        let slope = to.1 - from.1;
        for (side, limit) in [(1.0, band), (-1.0, band)] {
            // side · (from.1 + t · slope) ≤ limit
            let room = limit - side * from.1;
            let slope = side * slope;
            if slope.abs() < 1e-12 {
                if room < 0.0 {
                    return false;
                }
            } else if slope > 0.0 {
                last = last.min(room / slope);
            } else {
                first = first.max(room / slope);
            }
        }
        if first > last {
            return false;
        }
        let ahead = |t: f64| from.0 + t * (to.0 - from.0);
        let (one, other) = (ahead(first), ahead(last));
        one.min(other) < self.distance + slack && one.max(other) + self.ahead > -slack
    }

    fn is_occluded(&self, from: (f64, f64), to: (f64, f64), slack: f64) -> bool {
        let (along, across) = (to.0 - from.0, to.1 - from.1);
        let length = along.hypot(across);
        let share = -(from.0 * along + from.1 * across) / length.powi(2);
        let foot = (from.0 + share * along, from.1 + share * across);
        let has_foot = share * length >= -slack && (1.0 - share) * length >= -slack;
        self.is_crossed(from, to, slack)
            || self.answers(from, slack)
            || self.answers(to, slack)
            || has_foot && self.answers(foot, slack)
    }
}

prop_compose! {
    /// A length that is often short, sometimes zero.
    fn short()(length in prop_oneof![Just(0.0_f32), 1e-3_f32..0.05, 0.05_f32..0.4]) -> f32 {
        length
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn a_wall_occludes_where_something_may_answer_first(
        angle in -3.1_f32..3.1, distance in 0.3_f32..4.0, cone in 2.0_f32..75.0,
        ahead in short(), aside in short(),
        is_near_the_edge in any::<bool>(), is_near_the_sonar in prop::bool::weighted(0.2), (near, off) in (-0.4_f32..0.4, -0.4_f32..0.4),
        (anywhere_ahead, anywhere_aside) in (-1.0_f32..5.0, -2.0_f32..2.0),
        length in prop_oneof![1e-2_f32..0.3, 0.3_f32..4.0], turn in -3.1_f32..3.1,
    ) {
        // About as far as the target, or about at the edge of the cone, or anywhere.
        let (from_ahead, from_aside) = if is_near_the_sonar {
            // Crossed by the beam within the uncertainty of the sonar, somewhere along it.
            let share = 1.25 * (off + 0.4);
            (near * ahead * 3.0 - share * length * turn.cos(), aside * off - share * length * turn.sin())
        } else if is_near_the_edge {
            let direction = (cone.to_radians() + off) * near.signum();
            let from_sonar = if off > 0.0 { distance + near } else { distance * near.abs() * 2.4 };
            (from_sonar * direction.cos(), from_sonar * direction.sin())
        } else if off > 0.0 {
            ((distance + near) * off.cos(), (distance + near) * (3.0 * near).sin())
        } else {
            (anywhere_ahead, anywhere_aside)
        };
        let (sin, cos) = angle.sin_cos();
        let tangent_of_cone = cone.to_radians().tan();
        let beam = Beam {
            origin: Point::new(1.0, -2.0),
            axis: (cos, sin),
            distance,
            tangent_of_cone,
            uncertainty_ahead: ahead,
            uncertainty_aside: aside,
        };
        prop_assert!((beam.reach().0 - (distance + ahead + aside)).abs() < 1e-5);
        let end = (from_ahead + length * turn.cos(), from_aside + length * turn.sin());
        let on_map = |(ahead, aside): (f32, f32)| {
            Point::new(1.0 + cos * ahead - sin * aside, -2.0 + sin * ahead + cos * aside)
        };
        let wall = Wall::new(on_map((from_ahead, from_aside)), on_map(end)).unwrap();
        let region = Region {
            distance: distance.into(),
            tangent: tangent_of_cone.into(),
            ahead: ahead.into(),
            aside: aside.into(),
        };
        let (from, to) = ((from_ahead.into(), from_aside.into()), (end.0.into(), end.1.into()));
        // A wide cone magnifies rounding by its tangent.
        let slack = EDGE * (1.0 + f64::from(tangent_of_cone));
        let (surely, perhaps) =
            (region.is_occluded(from, to, -slack), region.is_occluded(from, to, slack));
        let is = beam.is_occluded_by(&wall);
        prop_assert!(is || !surely, "{from:?} {to:?} occludes");
        prop_assert!(!is || perhaps, "{from:?} {to:?} does not occlude");
    }
}
