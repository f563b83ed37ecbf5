//! A scan, and the range of a sonar with a wide cone in its place.

use sonarfix::config::RangerParameters;
use sonarfix::geometry::units::Radians;
use sonarfix_sim::angle;

/// Duration of a measurement of a sonar that sweeps, microseconds: an HC-SR04 on an SG90.
const PING_PERIOD: i64 = 120_000;
/// Largest number of pings that one scan stands for: half a turn in steps of 20°.
pub const MOST_PINGS_PER_SCAN: u32 = 9;

/// The pings of a sonar that sweeps while scans are recorded.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sweep {
    /// Time of the last ping, microseconds.
    until: i64,
}

impl Sweep {
    /// How many pings a scan at this time stands for, microseconds: those since the last one.
    pub fn pings_until(&mut self, time: i64) -> u32 {
        let most = i64::from(MOST_PINGS_PER_SCAN);
        let pings = ((time - self.until) / PING_PERIOD).clamp(0, most);
        self.until = if pings < most { self.until + pings * PING_PERIOD } else { time };
        u32::try_from(pings).unwrap_or(0)
    }
}

/// A return is that of a mirror if none within this angle beside it is nearer: 4°. At 4 m, the ranges of a wall differ
/// by 10 mm over this angle beside the foot of the perpendicular, the noise of a scanner.
const BESIDE: f64 = 0.07;

/// Ranges over a full or partial circle, taken at one instant from the sonar's mount.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// Bearing of the first beam, radians from the heading.
    pub first: f64,
    /// Angle between beams, radians; negative for a clockwise scan.
    pub step: f64,
    /// Ranges, metres; 0 without a return.
    pub ranges: Vec<f32>,
}

/// The direction and the limits of a sonar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Bearing, radians from the heading.
    pub bearing: f64,
    /// Half of its cone, radians.
    pub cone: f64,
    /// The shortest and the longest range it reports, metres.
    pub reach: (f64, f64),
}

impl Scan {
    /// Bearings of the first and the last beam, radians.
    #[must_use]
    pub fn field_of_view(&self) -> [f64; 2] {
        let last = (1..self.ranges.len()).fold(self.first, |bearing, _| bearing + self.step);
        [self.first, last]
    }

    /// The earliest echo of a sonar whose beam is reflected as by a mirror: the nearest return inside the cone and
    /// within reach that no return within 4° beside it undercuts. The foot of a perpendicular and an edge are such
    /// returns; a wall that is met at an angle has none, and a sonar does not hear it.
    #[must_use]
    pub fn specular(&self, sonar: &Cone) -> Option<f64> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some beams")]
        let beside = (BESIDE / self.step.abs()).clamp(1.0, 1e3) as usize;
        self.nearest(sonar, |at, range| {
            let around = at.saturating_sub(beside)..self.ranges.len().min(at + beside + 1);
            let around = self.ranges.get(around).unwrap_or_default();
            !around.iter().any(|&other| other < range && sonar.is_in_reach(other.into()))
        })
    }

    /// The earliest echo: the nearest return inside the cone and within reach.
    #[must_use]
    pub fn earliest(&self, sonar: &Cone) -> Option<f64> {
        self.nearest(sonar, |_, _| true)
    }

    /// The nearest return inside the cone and within reach that is heard, by its number and its range.
    fn nearest(&self, sonar: &Cone, is_heard: impl Fn(usize, f32) -> bool) -> Option<f64> {
        // The edge belongs to the cone, regardless of rounding.
        let cone = sonar.cone + 1e-9;
        let mut beam = self.first;
        let mut nearest: Option<f64> = None;
        for (at, (count, &range)) in (1_u32..).zip(&self.ranges).enumerate() {
            let is_nearer = nearest.is_none_or(|nearest| f64::from(range) < nearest);
            let is_detected =
                sonar.is_in_reach(range.into()) && angle::wrap(beam - sonar.bearing).abs() <= cone;
            if is_nearer && is_detected && is_heard(at, range) {
                nearest = Some(range.into());
            }
            beam = self.first + f64::from(count) * self.step;
        }
        nearest
    }
}

impl Cone {
    /// That of a robot's sonar at a bearing.
    #[must_use]
    pub fn of(sonar: &RangerParameters, bearing: Radians) -> Self {
        Self {
            bearing: bearing.0.into(),
            cone: sonar.cone.0.into(),
            reach: (sonar.min_range.0.into(), sonar.max_range.0.into()),
        }
    }

    fn is_in_reach(&self, range: f64) -> bool {
        let (nearest, farthest) = self.reach;
        range > 0.0 && range >= nearest && range <= farthest
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn is_detected(bearing: f64) -> Option<f64> {
        let scan = Scan {
            first: -1.0,
            step: 0.5,
            //           −1    −0.5 0    0.5  1
            ranges: vec![0.01, 3.0, 2.0, 0.0, 9.0],
        };
        scan.earliest(&Cone { bearing, cone: 0.5, reach: (0.05, 5.0) })
    }

    #[test]
    fn the_nearest_return_in_the_cone_is_used() {
        assert_eq!(is_detected(-0.5), Some(2.0), "both edges belong to the cone");
        assert_eq!(is_detected(-0.6), Some(3.0), "a nearer one outside does not");
        assert_eq!(is_detected(-1.0), Some(3.0), "nearer than the minimum range");
    }

    /// A wall 2 m ahead, at right angles to the first beam's direction plus 0.5: only the foot of its perpendicular is heard.
    #[test]
    fn a_wall_met_at_an_angle_is_not_heard() {
        let step = 0.01;
        let beams = (0_u8..150).map(|beam| 2.0 / (f32::from(beam) * 0.01 - 0.5).cos());
        let scan = Scan { first: 0.0, step, ranges: beams.collect() };
        let heard = |bearing| scan.specular(&Cone { bearing, cone: 0.2, reach: (0.05, 8.0) });
        assert_eq!(heard(0.5), Some(2.0));
        assert_eq!(heard(0.65), Some(2.0));
        assert_eq!(heard(0.9), None);
        assert_eq!(heard(0.2), None);
    }

    #[test]
    fn a_scan_stands_for_the_pings_since_the_last_one() {
        let mut sweep = Sweep { until: 1_000_000 };
        assert_eq!(sweep.pings_until(1_250_000), 2);
        // 10 ms were left over.
        assert_eq!(sweep.pings_until(1_350_000), 0);
        assert_eq!(sweep.pings_until(1_360_000), 1);
        assert_eq!(sweep.pings_until(9_000_000), MOST_PINGS_PER_SCAN);
        assert_eq!(sweep.pings_until(9_119_999), 0, "what is above the limit is dropped");
    }

    #[test]
    fn no_return_is_no_echo() {
        assert_eq!(is_detected(0.75), None, "no return, and 9 m is too far");
        assert_eq!(is_detected(2.5), None, "no beam there");
    }

    #[test]
    fn the_cone_reaches_across_the_back() {
        let scan = Scan { first: PI - 0.1, step: 0.2, ranges: vec![2.0, 1.0] };
        let mut sonar = Cone { bearing: PI, cone: 0.15, reach: (0.0, 5.0) };
        assert_eq!(scan.earliest(&sonar), Some(1.0));
        sonar.bearing = -PI + 0.12;
        assert_eq!(scan.earliest(&sonar), Some(1.0));
        sonar.bearing = PI - 0.12;
        assert_eq!(scan.earliest(&sonar), Some(2.0));
    }
}
