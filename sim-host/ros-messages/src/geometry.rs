//! Planar poses, headings and covariances in messages. Headings are radians counter-clockwise about z.

use crate::messages::{Covariance, Point, Pose, Quaternion, Vector3};

/// The heading of a rotation, and how far the x axis that it turns is from level; `None` if it is no rotation.
///
/// A rotation has a norm of one; up to a tenth off is accepted, because programs publish rounded numbers.
#[must_use]
pub fn heading(rotation: &Quaternion) -> Option<f64> {
    let ahead = rotate(rotation, [1.0, 0.0, 0.0])?;
    Some(ahead[1].atan2(ahead[0]))
}

/// A vector, turned; `None` if the quaternion is no rotation.
#[must_use]
pub fn rotate(rotation: &Quaternion, [vx, vy, vz]: [f64; 3]) -> Option<[f64; 3]> {
    let Quaternion { x, y, z, w } = *rotation;
    let norm = (x * x + y * y + z * z + w * w).sqrt();
    if !(0.9..=1.1).contains(&norm) {
        return None;
    }
    let [x, y, z, w] = [x, y, z, w].map(|part| part / norm);
    // v + 2 q × (q × v + w v)
    let [cx, cy, cz] =
        [y * vz - z * vy + w * vx, z * vx - x * vz + w * vy, x * vy - y * vx + w * vz];
    Some([vx + 2.0 * (y * cz - z * cy), vy + 2.0 * (z * cx - x * cz), vz + 2.0 * (x * cy - y * cx)])
}

/// The rotation to a heading.
#[must_use]
pub fn quaternion(heading: f64) -> Quaternion {
    let (z, w) = (0.5 * heading).sin_cos();
    Quaternion { x: 0.0, y: 0.0, z, w }
}

/// A planar pose: metres, metres, radians.
#[must_use]
pub fn pose([x, y, heading]: [f64; 3]) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: quaternion(heading) }
}

/// The planar part of a pose; `None` if a number is not finite or the orientation no rotation.
#[must_use]
pub fn planar(pose: &Pose) -> Option<[f64; 3]> {
    let heading = heading(&pose.orientation)?;
    let planar = [pose.position.x, pose.position.y, heading];
    planar.iter().all(|number| number.is_finite()).then_some(planar)
}

/// A point as a vector.
#[must_use]
pub fn vector(x: f64, y: f64) -> Vector3 {
    Vector3 { x, y, z: 0.0 }
}

/// The covariance of x, y and heading (m², m rad, rad²) as that of x, y, z, roll, pitch, yaw.
#[must_use]
pub fn covariance(planar: [[f64; 3]; 3]) -> Covariance {
    const PLACES: [usize; 3] = [0, 1, 5];
    let mut full = Covariance::default();
    for (row, values) in PLACES.into_iter().zip(planar) {
        for (column, value) in PLACES.into_iter().zip(values) {
            if let Some(place) = full.0.get_mut(row).and_then(|row| row.get_mut(column)) {
                *place = value;
            }
        }
    }
    full
}

/// The standard deviations of the position in its worse direction along x and y (metres) and of the heading (radians);
/// `None` if one is not finite or negative.
#[must_use]
pub fn deviations(covariance: &Covariance) -> Option<[f64; 2]> {
    let [[xx, ..], [_, yy, ..], _, _, _, [.., hh]] = covariance.0;
    let is_variance = |value: f64| value.is_finite() && value >= 0.0;
    let is_whole = [xx, yy, hh].into_iter().all(is_variance);
    is_whole.then(|| [(if xx > yy { xx } else { yy }).sqrt(), hh.sqrt()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_survives() {
        for degrees in [-179.0_f64, -90.0, 0.0, 33.0, 180.0] {
            let angle = degrees.to_radians();
            assert!((heading(&quaternion(angle)).unwrap() - angle).abs() < 1e-12, "{degrees}");
        }
        assert_eq!(heading(&Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 }), None);
        assert_eq!(heading(&Quaternion { w: f64::NAN, ..quaternion(0.0) }), None);
    }

    #[test]
    fn the_covariance_is_in_the_places_of_ros() {
        let full = covariance([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]]);
        let flat = full.0.concat();
        let places = [(0, 1.0), (1, 2.0), (5, 3.0), (6, 2.0), (7, 4.0), (11, 5.0)];
        for (place, value) in places.into_iter().chain([(30, 3.0), (31, 5.0), (35, 6.0)]) {
            assert_eq!(flat[place].to_bits(), f64::to_bits(value), "{place}");
        }
        assert_eq!(flat.iter().filter(|value| **value > 0.0).count(), 9);
        assert_eq!(deviations(&full), Some([2.0, 6.0_f64.sqrt()]));
    }
}
