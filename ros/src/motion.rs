//! Odometry messages as travels of two wheels, which is what the localizer takes.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};

use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{JointState, Odometry};

use crate::problem::{Nanoseconds, Problem};

/// A planar pose: metres, metres, radians counter-clockwise from x.
pub type Planar = [f64; 3];

/// Sideways displacement up to which a step counts as one arc: metres, and per metre of the step.
const SIDEWAYS: (f64, f64) = (0.002, 0.02);
/// Distance that a wheel may move beyond its largest speed, metres: what rounding and jitter of stamps add.
const JITTER: f64 = 0.005;
/// Messages in a row with old stamps after which the clock of the odometry has been set back.
const OLD_IN_A_ROW: u32 = 10;
/// The most poses that are kept.
const MOST_POSES: usize = 2000;

/// The robot's wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheels {
    /// Distance between the contact points, metres.
    pub track_width: f64,
    /// Largest speed of a wheel, metres per second.
    pub max_speed: f64,
    /// Radius, metres; for joints.
    pub radius: f64,
}

/// A travel of the wheels at constant speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Its begin.
    pub from: Nanoseconds,
    /// Its end.
    pub to: Nanoseconds,
    /// Travel of the right wheel, metres.
    pub right: f64,
    /// Travel of the left wheel, metres.
    pub left: f64,
    /// The turn that a gyro has measured, radians.
    pub turn: Option<f64>,
    /// Whether the path in between is not known, but only its end.
    pub is_gap: bool,
    /// Whether the wheels were not observed meanwhile: the travel is the least one.
    pub is_unobserved: bool,
}

/// What a message leads to.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The travels since the message before, in their order.
    pub parts: Vec<Part>,
    /// What was wrong; the message may be used nevertheless.
    pub problem: Option<Problem>,
    /// Whether the stamps were set back: what was measured before is of another time.
    pub is_clock_reset: bool,
}

impl Motion {
    fn refused(problem: Problem) -> Self {
        Self { parts: Vec::new(), problem: Some(problem), is_clock_reset: false }
    }
}

/// The odometry so far.
#[derive(Debug, Clone)]
pub struct Odometer {
    wheels: Wheels,
    timeout: Nanoseconds,
    /// Poses in the odometry frame, the last one last.
    poses: VecDeque<(Nanoseconds, Planar)>,
    /// Positions of the right and the left joint, radians.
    joints: Option<[f64; 2]>,
    old_in_a_row: u32,
    /// The stamp of the first of them.
    first_old: Nanoseconds,
}

impl Odometer {
    /// An odometer without a message; `timeout` is the time without one that is a gap.
    #[must_use]
    pub fn new(wheels: Wheels, timeout: Nanoseconds) -> Self {
        Self {
            wheels,
            timeout,
            poses: VecDeque::new(),
            joints: None,
            old_in_a_row: 0,
            first_old: 0,
        }
    }

    /// Time and pose in the odometry frame of the last message.
    #[must_use]
    pub fn last(&self) -> Option<(Nanoseconds, Planar)> {
        self.poses.back().copied()
    }

    /// The pose in the odometry frame at a time; at the ends of what is kept, the nearest one.
    #[must_use]
    pub fn pose_at(&self, at: Nanoseconds) -> Option<Planar> {
        let place = self.poses.partition_point(|(time, _)| *time < at);
        let after = self.poses.get(place).or(self.poses.back())?;
        let before = place.checked_sub(1).and_then(|before| self.poses.get(before));
        let before = before.filter(|before| before.0 < after.0 && at < after.0);
        let Some((from, pose)) = before else { return Some(after.1) };
        #[expect(clippy::cast_precision_loss, reason = "differences of times")]
        let share = (at - from) as f64 / (after.0 - from) as f64;
        let [x, y, turn] = between(*pose, after.1);
        Some(moved(*pose, [share * x, share * y, share * turn]))
    }

    /// Forgets all times, because the clock was set back.
    pub fn forget(&mut self) {
        self.poses.clear();
        self.joints = None;
        self.old_in_a_row = 0;
    }

    /// Takes a pose in the odometry frame.
    pub fn take(&mut self, message: &Odometry) -> Motion {
        let Some(pose) = geometry::planar(&message.pose.pose) else {
            return Motion::refused(Problem::OdometryNotFinite);
        };
        let at = message.header.stamp.nanoseconds();
        self.step(at, |last, wheels| {
            let parts = last.map_or_else(Vec::new, |last| parts_of(between(last, pose), wheels));
            Some((pose, parts))
        })
    }

    /// Takes the positions of the wheels' joints by these names.
    pub fn take_joints(&mut self, message: &JointState, names: &[String]) -> Motion {
        let position = |name: Option<&String>| {
            let place = message.name.iter().position(|own| Some(own) == name)?;
            message.position.get(place).copied()
        };
        let [Some(right), Some(left)] = [position(names.first()), position(names.get(1))] else {
            return Motion::refused(Problem::JointMissing);
        };
        if !right.is_finite() || !left.is_finite() {
            return Motion::refused(Problem::OdometryNotFinite);
        }
        let before = self.joints;
        let at = message.header.stamp.nanoseconds();
        let motion = self.step(at, |last, wheels| {
            let [old_right, old_left] = before.unwrap_or([right, left]);
            let (right, left) =
                (wheels.radius * (right - old_right), wheels.radius * (left - old_left));
            let turn = (right - left) / wheels.track_width;
            let ahead = 0.5 * (right + left);
            let step = [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn];
            Some((moved(last.unwrap_or_default(), step), vec![[right, left]]))
        });
        if self.last().is_some_and(|(time, _)| time == at) {
            self.joints = Some([right, left]);
        }
        motion
    }

    fn step(
        &mut self,
        at: Nanoseconds,
        travel: impl FnOnce(Option<Planar>, &Wheels) -> Option<(Planar, Vec<[f64; 2]>)>,
    ) -> Motion {
        let last = self.last();
        let since = match last {
            Some((before, _)) if at <= before => match self.old(at, before) {
                Ok(since) => Some(since),
                Err(problem) => return Motion::refused(problem),
            },
            _ => None,
        };
        self.old_in_a_row = 0;
        let Some((pose, travels)) = travel(last.map(|(_, pose)| pose), &self.wheels) else {
            return Motion::refused(Problem::OdometryNotFinite);
        };
        if since.is_some() {
            self.poses.clear();
        }
        self.keep(at, pose);
        let Some((before, _)) = last else {
            return Motion { parts: Vec::new(), problem: None, is_clock_reset: false };
        };
        let motion = self.motion(since.unwrap_or(before), at, &travels);
        let problem =
            if since.is_some() { Some(Problem::OdometryClockReset) } else { motion.problem };
        Motion { is_clock_reset: since.is_some(), problem, ..motion }
    }

    /// A message that is not newer than the one before. After several in a row the clock of the odometry was set back; returns the
    /// time of the last message before, by the new clock.
    fn old(&mut self, at: Nanoseconds, before: Nanoseconds) -> Result<Nanoseconds, Problem> {
        if self.old_in_a_row == 0 {
            self.first_old = at;
        }
        self.old_in_a_row += 1;
        if self.old_in_a_row < OLD_IN_A_ROW || at <= self.first_old {
            return Err(if at == before {
                Problem::OdometryRepeated
            } else {
                Problem::OdometryReordered
            });
        }
        let period = (at - self.first_old) / Nanoseconds::from(self.old_in_a_row - 1);
        Ok(self.first_old - period)
    }

    fn keep(&mut self, at: Nanoseconds, pose: Planar) {
        self.poses.push_back((at, pose));
        if self.poses.len() > MOST_POSES {
            self.poses.pop_front();
        }
    }

    /// The travels of a step, each for its share of the time.
    fn motion(&self, from: Nanoseconds, to: Nanoseconds, travels: &[[f64; 2]]) -> Motion {
        let largest = |[right, left]: [f64; 2]| right.abs().max(left.abs());
        let total: f64 = travels.iter().map(|&travel| largest(travel)).sum();
        let elapsed = seconds(to - from);
        if total > self.wheels.max_speed * elapsed + JITTER {
            let rest = Part {
                from,
                to,
                right: 0.0,
                left: 0.0,
                turn: None,
                is_gap: true,
                is_unobserved: true,
            };
            return Motion {
                parts: vec![rest],
                problem: Some(Problem::OdometryReset),
                is_clock_reset: false,
            };
        }
        let is_gap = to - from > self.timeout;
        let (mut parts, mut begin, mut done) = (Vec::new(), from, 0.0);
        for &[right, left] in travels {
            done += largest([right, left]);
            let share = if total > 0.0 { done / total } else { 1.0 };
            #[expect(clippy::cast_possible_truncation, reason = "a share of the step")]
            let end = from + (share * elapsed * 1e9).round() as Nanoseconds;
            let end = if begin == from && travels.len() == 1 { to } else { end.clamp(begin, to) };
            // The wheels do not tell the path of a gap, while a pose does.
            let is_unobserved = is_gap && self.joints.is_some();
            parts.push(Part {
                from: begin,
                to: end,
                right,
                left,
                turn: None,
                is_gap,
                is_unobserved,
            });
            begin = end;
        }
        if let Some(last) = parts.last_mut() {
            last.to = to;
        }
        let problem = is_gap.then_some(Problem::OdometryGap);
        Motion { parts, problem, is_clock_reset: false }
    }
}

/// A duration in seconds.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "differences of times")]
pub fn seconds(duration: Nanoseconds) -> f64 {
    duration as f64 * 1e-9
}

/// An angle in [−π, π].
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    let turned = (angle + PI).rem_euclid(2.0 * PI) - PI;
    if turned < -PI { PI } else { turned }
}

/// A pose as seen from another one.
#[must_use]
pub fn between([x0, y0, heading0]: Planar, [x1, y1, heading1]: Planar) -> Planar {
    let (dx, dy) = (x1 - x0, y1 - y0);
    let (sin, cos) = heading0.sin_cos();
    [cos * dx + sin * dy, cos * dy - sin * dx, wrapped(heading1 - heading0)]
}

/// A pose that lies at `step` as seen from `pose`.
#[must_use]
pub fn moved([x, y, heading]: Planar, [dx, dy, turn]: Planar) -> Planar {
    let (sin, cos) = heading.sin_cos();
    [x + cos * dx - sin * dy, y + sin * dx + cos * dy, wrapped(heading + turn)]
}

/// The travels of the right and the left wheel that lead from a pose to the next: along the mid-heading, or, if that is not
/// where the robot went, a turn, a straight line and a turn.
fn parts_of([dx, dy, turn]: Planar, wheels: &Wheels) -> Vec<[f64; 2]> {
    let half = 0.5 * wheels.track_width;
    let (sin, cos) = (0.5 * turn).sin_cos();
    let (ahead, sideways) = (dx * cos + dy * sin, dy * cos - dx * sin);
    let distance = dx.hypot(dy);
    let (fixed, per_metre) = SIDEWAYS;
    if sideways.abs() <= fixed + per_metre * distance {
        return vec![[ahead + half * turn, ahead - half * turn]];
    }
    let direction = dy.atan2(dx);
    let is_backwards = direction.abs() > FRAC_PI_2;
    let first = if is_backwards { wrapped(direction + PI) } else { direction };
    let distance = if is_backwards { -distance } else { distance };
    let last = wrapped(turn - first);
    vec![[half * first, -half * first], [distance, distance], [half * last, -half * last]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_ros_messages::messages::{Header, Time};

    const WHEELS: Wheels = Wheels { track_width: 0.2, max_speed: 1.0, radius: 0.05 };

    fn odometer() -> Odometer {
        Odometer::new(WHEELS, 500_000_000)
    }

    fn message(at: Nanoseconds, pose: Planar) -> Odometry {
        let mut odometry = Odometry {
            header: Header { stamp: Time::of_nanoseconds(at), ..Header::default() },
            ..Odometry::default()
        };
        odometry.pose.pose = geometry::pose(pose);
        odometry
    }

    fn end(parts: &[Part]) -> Planar {
        parts.iter().fold([0.0; 3], |pose, part| {
            let turn = (part.right - part.left) / WHEELS.track_width;
            let ahead = 0.5 * (part.right + part.left);
            moved(pose, [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn])
        })
    }

    #[test]
    fn the_travels_of_any_step_lead_to_its_end() {
        let goals = [
            [0.1, 0.0, 0.0],
            [-0.1, 0.02, 0.1],
            [0.2, 0.2, 3.0],
            [-0.2, 0.1, -2.0],
            [0.0, 0.0, 1.0],
        ];
        for goal in goals {
            let mut odometer = odometer();
            odometer.take(&message(0, [0.0; 3]));
            let motion = odometer.take(&message(5_000_000_000, goal));
            assert_eq!(motion.problem, Some(Problem::OdometryGap));
            let found = between(goal, end(&motion.parts));
            assert!(found.iter().all(|error| error.abs() < 0.007), "{goal:?}: {found:?}");
            assert_eq!(motion.parts.first().unwrap().from, 0);
            assert_eq!(motion.parts.last().unwrap().to, 5_000_000_000);
            assert!(motion.parts.windows(2).all(|pair| pair[0].to == pair[1].from));
        }
    }

    #[test]
    fn old_messages_are_named_and_a_clock_that_was_set_back_is_followed() {
        let mut odometer = odometer();
        odometer.take(&message(1_000_000_000, [0.0; 3]));
        odometer.take(&message(1_100_000_000, [0.01, 0.0, 0.0]));
        let problem = |at, odometer: &mut Odometer| odometer.take(&message(at, [0.0; 3])).problem;
        assert_eq!(problem(1_100_000_000, &mut odometer), Some(Problem::OdometryRepeated));
        assert_eq!(problem(1_050_000_000, &mut odometer), Some(Problem::OdometryReordered));
        let motion = odometer.take(&message(1_200_000_000, [0.03, 0.0, 0.0]));
        assert!((motion.parts[0].right - 0.02).abs() < 1e-12);
        for n in 1..OLD_IN_A_ROW {
            let at = Nanoseconds::from(n) * 1_000_000;
            assert_eq!(problem(at, &mut odometer), Some(Problem::OdometryReordered));
        }
        let motion = odometer.take(&message(10_000_000, [0.035, 0.0, 0.0]));
        assert!(motion.is_clock_reset);
        assert_eq!((motion.parts[0].from, motion.parts[0].to), (0, 10_000_000));
        assert!((motion.parts[0].right - 0.005).abs() < 1e-12);
    }

    #[test]
    fn a_jump_is_a_reset_and_no_travel() {
        let mut odometer = odometer();
        odometer.take(&message(0, [5.0, 0.0, 0.0]));
        let motion = odometer.take(&message(100_000_000, [0.0; 3]));
        assert_eq!(motion.problem, Some(Problem::OdometryReset));
        assert!(motion.parts[0].is_unobserved && motion.parts[0].right.abs() < 1e-12);
        let motion = odometer.take(&message(200_000_000, [0.05, 0.0, 0.0]));
        assert_eq!(motion.problem, None);
        assert!((motion.parts[0].right - 0.05).abs() < 1e-12);
    }

    #[test]
    fn joints_are_wheels() {
        let names = ["r".to_owned(), "l".to_owned()];
        let joints = |at, right: f64, left: f64| JointState {
            header: Header { stamp: Time::of_nanoseconds(at), ..Header::default() },
            name: vec!["l".into(), "arm".into(), "r".into()],
            position: vec![left, 0.3, right],
            ..JointState::default()
        };
        let mut odometer = odometer();
        odometer.take_joints(&joints(0, 10.0, 20.0), &names);
        let motion = odometer.take_joints(&joints(100_000_000, 11.0, 20.5), &names);
        assert!((motion.parts[0].right - 0.05).abs() < 1e-12);
        assert!((motion.parts[0].left - 0.025).abs() < 1e-12);
        let mut lacking = joints(200_000_000, 11.0, 20.5);
        lacking.position.pop();
        assert_eq!(odometer.take_joints(&lacking, &names).problem, Some(Problem::JointMissing));
    }

    #[test]
    fn poses_between_messages_are_interpolated() {
        let mut odometer = odometer();
        odometer.take(&message(0, [0.0; 3]));
        odometer.take(&message(100, [0.0, 0.0, 1.0]));
        let [.., heading] = odometer.pose_at(25).unwrap();
        assert!((heading - 0.25).abs() < 1e-12);
        assert_eq!(odometer.pose_at(1000), Some([0.0, 0.0, 1.0]));
    }
}
