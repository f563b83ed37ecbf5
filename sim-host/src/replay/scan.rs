//! A scan, and what a sonar with a wide cone would have heard in its place.

use crate::angle;

/// Ranges all round, or part of the way round, taken at one instant from the sonar's mount.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// Bearing of the first beam, radians from the heading.
    pub first: f64,
    /// From one beam to the next, radians; negative for a scan that runs clockwise.
    pub step: f64,
    /// Metres; 0 where nothing came back.
    pub ranges: Vec<f32>,
}

/// Where a sonar looks, and what it can hear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Listening {
    /// Where it points, radians from the heading.
    pub bearing: f64,
    /// Half of its cone, radians.
    pub cone: f64,
    /// The shortest and the longest range it reports, metres.
    pub reach: (f64, f64),
}

impl Scan {
    /// The earliest echo: the nearest return inside the cone and within reach.
    #[must_use]
    pub fn earliest(&self, listening: &Listening) -> Option<f64> {
        let Listening { bearing, cone, reach: (nearest, farthest) } = *listening;
        // The edge of the cone belongs to it, whatever the last digit of a product says.
        let cone = cone + 1e-9;
        let mut beam = self.first;
        let mut earliest: Option<f64> = None;
        for (count, range) in (1_u32..).zip(&self.ranges) {
            let range = f64::from(*range);
            let nearer = earliest.is_none_or(|earliest| range < earliest);
            let heard = range > 0.0 && range >= nearest && range <= farthest;
            if nearer && heard && angle::wrap(beam - bearing).abs() <= cone {
                earliest = Some(range);
            }
            beam = self.first + f64::from(count) * self.step;
        }
        earliest
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn heard(bearing: f64) -> Option<f64> {
        let scan = Scan {
            first: -1.0,
            step: 0.5,
            //           −1    −0.5 0    0.5  1
            ranges: vec![0.01, 3.0, 2.0, 0.0, 9.0],
        };
        scan.earliest(&Listening { bearing, cone: 0.5, reach: (0.05, 5.0) })
    }

    #[test]
    fn the_nearest_return_in_the_cone_is_heard() {
        assert_eq!(heard(-0.5), Some(2.0), "both edges belong to the cone");
        assert_eq!(heard(-0.6), Some(3.0), "a nearer one outside does not");
        assert_eq!(heard(-1.0), Some(3.0), "nearer than the sonar can hear");
    }

    #[test]
    fn no_return_is_no_echo() {
        assert_eq!(heard(0.75), None, "nothing came back, and 9 m is too far");
        assert_eq!(heard(2.5), None, "no beam looked there");
    }

    #[test]
    fn the_cone_reaches_across_the_back() {
        let scan = Scan { first: PI - 0.1, step: 0.2, ranges: vec![2.0, 1.0] };
        let mut listening = Listening { bearing: PI, cone: 0.15, reach: (0.0, 5.0) };
        assert_eq!(scan.earliest(&listening), Some(1.0));
        listening.bearing = -PI + 0.12;
        assert_eq!(scan.earliest(&listening), Some(1.0));
        listening.bearing = PI - 0.12;
        assert_eq!(scan.earliest(&listening), Some(2.0));
    }
}
