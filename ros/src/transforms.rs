//! The tree of frames, from `/tf` and `/tf_static`.

use std::collections::{HashMap, VecDeque};

use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{Quaternion, TransformStamped};

use crate::problem::Nanoseconds;

/// The most transforms that are kept of a moving frame, and the most frames.
const MOST_SAMPLES: usize = 1000;
const MOST_FRAMES: usize = 1000;
/// The longest path from a frame to another.
const LONGEST_PATH: usize = 64;

/// Position and rotation of a frame in its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    position: [f64; 3],
    rotation: Rotation,
}

/// A rotation: x, y, z, w.
type Rotation = [f64; 4];

impl Placement {
    const NONE: Self = Self { position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    fn of(message: &TransformStamped) -> Option<Self> {
        let moved = &message.transform.translation;
        let Quaternion { x, y, z, w } = message.transform.rotation;
        geometry::heading(&message.transform.rotation)?;
        let position = [moved.x, moved.y, moved.z];
        let is_finite = position.iter().all(|number| number.is_finite());
        is_finite.then_some(Self { position, rotation: [x, y, z, w] })
    }

    fn message(rotation: Rotation) -> Quaternion {
        let [x, y, z, w] = rotation;
        Quaternion { x, y, z, w }
    }

    /// This placement in a frame that is itself placed in another.
    fn within(&self, outer: &Self) -> Option<Self> {
        let [dx, dy, dz] = geometry::rotate(&Self::message(outer.rotation), self.position)?;
        let [x, y, z] = outer.position;
        let rotation = product(outer.rotation, self.rotation);
        Some(Self { position: [x + dx, y + dy, z + dz], rotation })
    }

    /// Between this placement and a later one, at a share of the time.
    fn towards(&self, later: &Self, share: f64) -> Self {
        let mix = |from: f64, to: f64| from + share * (to - from);
        let [x, y, z] = self.position;
        let [later_x, later_y, later_z] = later.position;
        let dot: f64 = self.rotation.iter().zip(later.rotation).map(|(a, b)| a * b).sum();
        // A quaternion and its negative are the same rotation.
        let sign = if dot < 0.0 { -1.0 } else { 1.0 };
        let mut rotation = self.rotation;
        for (own, other) in rotation.iter_mut().zip(later.rotation) {
            *own = mix(*own, sign * other);
        }
        let norm = rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
        rotation = rotation.map(|part| part / norm);
        Self { position: [mix(x, later_x), mix(y, later_y), mix(z, later_z)], rotation }
    }

    /// The planar part: x and y, metres, and the heading, radians.
    fn planar(&self) -> Option<[f64; 3]> {
        let [x, y, _] = self.position;
        Some([x, y, geometry::heading(&Self::message(self.rotation))?])
    }
}

fn product([ax, ay, az, aw]: Rotation, [bx, by, bz, bw]: Rotation) -> Rotation {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// A frame in its parent.
#[derive(Debug, Clone)]
struct Frame {
    parent: String,
    is_static: bool,
    samples: VecDeque<(Nanoseconds, Placement)>,
}

/// Why there is no transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoTransform {
    /// The frames are not connected.
    Unconnected,
    /// They are connected, but not at this time; a later transform may change that.
    Untimely,
}

/// The tree of frames.
#[derive(Debug, Clone, Default)]
pub struct Transforms {
    frames: HashMap<String, Frame>,
}

impl Transforms {
    /// Takes a transform; false if its numbers are not finite or no rotation.
    pub fn take(&mut self, message: &TransformStamped, is_static: bool) -> bool {
        let Some(placement) = Placement::of(message) else { return false };
        let child = trimmed(&message.child_frame_id);
        let parent = trimmed(&message.header.frame_id);
        if self.frames.len() >= MOST_FRAMES && !self.frames.contains_key(child) {
            return true;
        }
        let new = || Frame { parent: parent.to_owned(), is_static, samples: VecDeque::new() };
        let frame = self.frames.entry(child.to_owned()).or_insert_with(new);
        if frame.parent != parent || frame.is_static != is_static || is_static {
            *frame = new();
        }
        frame.add(message.header.stamp.nanoseconds(), placement);
        true
    }

    /// Forgets the moving frames, because the clock was set back.
    pub fn forget_moving(&mut self) {
        self.frames.retain(|_, frame| frame.is_static);
    }

    /// The planar placement of `frame` in `base` at a time: x and y, metres, and the heading, radians.
    ///
    /// # Errors
    /// [`NoTransform`], by the reason.
    pub fn find(
        &self,
        base: &str,
        frame: &str,
        at: Nanoseconds,
        tolerance: Nanoseconds,
    ) -> Result<[f64; 3], NoTransform> {
        let (base, mut name) = (trimmed(base), trimmed(frame));
        let mut placement = Placement::NONE;
        for _ in 0..LONGEST_PATH {
            if name == base {
                return placement.planar().ok_or(NoTransform::Unconnected);
            }
            let frame = self.frames.get(name).ok_or(NoTransform::Unconnected)?;
            let step = frame.at(at, tolerance).ok_or(NoTransform::Untimely)?;
            placement = placement.within(&step).ok_or(NoTransform::Unconnected)?;
            name = &frame.parent;
        }
        Err(NoTransform::Unconnected)
    }
}

/// A name as tf2 compares it: without the slash that early versions had.
fn trimmed(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl Frame {
    fn add(&mut self, at: Nanoseconds, placement: Placement) {
        let place = self.samples.partition_point(|(time, _)| *time < at);
        match self.samples.get_mut(place) {
            Some(sample) if sample.0 == at => sample.1 = placement,
            _ => self.samples.insert(place, (at, placement)),
        }
        if self.samples.len() > MOST_SAMPLES {
            self.samples.pop_front();
        }
    }

    fn at(&self, at: Nanoseconds, tolerance: Nanoseconds) -> Option<Placement> {
        if self.is_static {
            return self.samples.back().map(|(_, placement)| *placement);
        }
        let place = self.samples.partition_point(|(time, _)| *time < at);
        let before = place.checked_sub(1).and_then(|before| self.samples.get(before));
        match (before, self.samples.get(place)) {
            (_, Some((time, placement))) if *time == at => Some(*placement),
            (Some((from, before)), Some((to, after))) => {
                #[expect(clippy::cast_precision_loss, reason = "differences of times")]
                let share = (at - from) as f64 / (to - from) as f64;
                Some(before.towards(after, share))
            }
            (Some((from, before)), None) if at.saturating_sub(*from) <= tolerance => Some(*before),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_ros_messages::messages::{Header, Time, Transform};

    fn moved(parent: &str, child: &str, at: i64, [x, y, heading]: [f64; 3]) -> TransformStamped {
        let header = Header { stamp: Time::of_nanoseconds(at), frame_id: parent.into() };
        let transform = Transform {
            translation: geometry::vector(x, y),
            rotation: geometry::quaternion(heading),
        };
        TransformStamped { header, child_frame_id: child.into(), transform }
    }

    fn close(found: [f64; 3], expected: [f64; 3]) -> bool {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn frames_are_chained_and_interpolated() {
        let mut tree = Transforms::default();
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(tree.take(&moved("base_link", "mast", 0, [0.1, 0.0, quarter]), true));
        assert!(tree.take(&moved("/mast", "sonar", 1000, [0.2, 0.0, 0.0]), false));
        assert!(tree.take(&moved("mast", "sonar", 3000, [0.2, 0.0, 0.2]), false));
        let find = |at, tolerance| tree.find("base_link", "sonar", at, tolerance);
        assert!(close(find(2000, 0).unwrap(), [0.1, 0.2, quarter + 0.1]));
        assert_eq!(find(3500, 0), Err(NoTransform::Untimely));
        assert!(close(find(3500, 500).unwrap(), [0.1, 0.2, quarter + 0.2]));
        assert_eq!(find(999, 500), Err(NoTransform::Untimely));
        assert_eq!(tree.find("base_link", "lidar", 2000, 0), Err(NoTransform::Unconnected));
    }

    #[test]
    fn circles_end_and_numbers_that_are_none_are_refused() {
        let mut tree = Transforms::default();
        assert!(tree.take(&moved("a", "b", 0, [0.0; 3]), true));
        assert!(tree.take(&moved("b", "a", 0, [0.0; 3]), true));
        assert_eq!(tree.find("base", "a", 0, 0), Err(NoTransform::Unconnected));
        assert!(!tree.take(&moved("a", "c", 0, [f64::NAN, 0.0, 0.0]), true));
        assert!(!tree.take(&moved("a", "c", 0, [0.0, 0.0, f64::INFINITY]), true));
    }
}
