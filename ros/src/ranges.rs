//! Range and scan messages as ranges along bearings; those whose transform has not arrived wait for it.

use std::collections::VecDeque;

use sonarfix::config::RangerId;
use sonarfix_ros_messages::messages::{LaserScan, RangeHeard};

use crate::motion::wrapped;
use crate::problem::{Nanoseconds, Problem};
use crate::timeline::{Beam, Echo};
use sonarfix_ros_messages::transforms::{NoTransform, Transforms};

/// How long a range waits for a transform at its time, and how old that may be then.
const PATIENCE: Nanoseconds = 100_000_000;
const OLDEST: Nanoseconds = 200_000_000;
/// How long it waits for its frame to be connected at all.
const FRAME_PATIENCE: Nanoseconds = 500_000_000;
/// The most messages that wait.
const MOST_WAITING: usize = 256;

/// What a message measures.
#[derive(Debug, Clone, PartialEq)]
enum Content {
    Range(RangerId, Echo),
    Scan(Box<LaserScan>),
}

/// A message whose transform is not known yet.
#[derive(Debug, Clone, PartialEq)]
struct Waiting {
    at: Nanoseconds,
    frame: String,
    since: Nanoseconds,
    content: Content,
}

/// The ranges that wait for transforms.
#[derive(Debug, Clone)]
pub struct Ranges {
    base: String,
    bearings: Vec<f64>,
    scan_bearings: Vec<f64>,
    waiting: VecDeque<Waiting>,
}

/// What has become of the ranges that waited.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Due {
    /// The ranges with their bearings.
    pub beams: Vec<Beam>,
    /// What was wrong with others.
    pub problems: Vec<Problem>,
}

impl Ranges {
    /// Ranges of a robot with this frame; `bearings` of fixed rangers and of the beams of a scan, radians from the heading.
    #[must_use]
    pub fn new(base: &str, bearings: Vec<f64>, scan_bearings: Vec<f64>) -> Self {
        Self { base: base.to_owned(), bearings, scan_bearings, waiting: VecDeque::new() }
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Forgets what waits.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }

    /// Takes a range that arrived at `now`.
    ///
    /// # Errors
    /// [`Problem`], if it is not used, by the reason.
    pub fn range(
        &mut self,
        ranger: RangerId,
        message: &RangeHeard,
        now: Nanoseconds,
    ) -> Result<(), Problem> {
        let RangeHeard { range, min_range, max_range, .. } = *message;
        if range.is_nan() || min_range.is_nan() || max_range.is_nan() {
            return Err(Problem::RangeNotFinite);
        }
        let content = Content::Range(ranger, echo(range, min_range, max_range));
        self.add(&message.header.frame_id, message.header.stamp.nanoseconds(), content, now)
    }

    /// Takes a scan that arrived at `now`.
    ///
    /// # Errors
    /// [`Problem`], if it is not used, by the reason.
    pub fn scan(&mut self, message: LaserScan, now: Nanoseconds) -> Result<(), Problem> {
        let LaserScan { angle_min, angle_increment, time_increment, .. } = message;
        let numbers =
            [angle_min, angle_increment, time_increment, message.range_min, message.range_max];
        let is_finite = numbers.iter().all(|number| number.is_finite());
        if !is_finite || angle_increment.abs() < 1e-6 || time_increment.abs() > 1.0 {
            return Err(Problem::ScanAngles);
        }
        let (frame, at) = (message.header.frame_id.clone(), message.header.stamp.nanoseconds());
        self.add(&frame, at, Content::Scan(Box::new(message)), now)
    }

    fn add(
        &mut self,
        frame: &str,
        at: Nanoseconds,
        content: Content,
        now: Nanoseconds,
    ) -> Result<(), Problem> {
        if self.waiting.len() >= MOST_WAITING {
            return Err(Problem::RangeQueue);
        }
        self.waiting.push_back(Waiting { at, frame: frame.to_owned(), since: now, content });
        Ok(())
    }

    /// The ranges whose bearings are known by now; the others keep waiting, or have waited in vain.
    pub fn due(&mut self, transforms: &Transforms, now: Nanoseconds) -> Due {
        let mut due = Due::default();
        for waiting in std::mem::take(&mut self.waiting) {
            match self.offset(&waiting, transforms, now) {
                Ok(Some(offset)) => self.resolve(&waiting, offset, &mut due),
                Ok(None) => self.waiting.push_back(waiting),
                Err(problem) => due.problems.push(problem),
            }
        }
        due
    }

    /// The direction of a message's frame, radians from the heading; `None` while it is not known.
    fn offset(
        &self,
        waiting: &Waiting,
        transforms: &Transforms,
        now: Nanoseconds,
    ) -> Result<Option<f64>, Problem> {
        if let Content::Range(ranger, _) = waiting.content
            && let Some(&bearing) = self.bearings.get(ranger.index())
        {
            return Ok(Some(bearing));
        }
        let waited = now.saturating_sub(waiting.since);
        let tolerance = if waited < PATIENCE { 0 } else { OLDEST };
        match transforms.find(&self.base, &waiting.frame, waiting.at, tolerance) {
            Ok([.., heading]) => Ok(Some(heading)),
            Err(NoTransform::Untimely) if waited < PATIENCE => Ok(None),
            Err(NoTransform::Untimely) => Err(Problem::RangeTransform),
            Err(NoTransform::Unconnected) if waited < FRAME_PATIENCE => Ok(None),
            Err(NoTransform::Unconnected) => Err(Problem::RangeFrame),
        }
    }

    fn resolve(&self, waiting: &Waiting, offset: f64, due: &mut Due) {
        let at = waiting.at;
        let scan = match &waiting.content {
            &Content::Range(ranger, echo) => {
                return due.beams.push(Beam { at, ranger, bearing: offset, echo });
            }
            Content::Scan(scan) => scan,
        };
        for &bearing in &self.scan_bearings {
            match beam_of(scan, at, offset, bearing) {
                Ok(beam) => due.beams.push(beam),
                Err(problem) => due.problems.push(problem),
            }
        }
    }
}

/// The echo of a range that is not NaN, by the limits of its message (REP 117: minus infinity is too near, infinity is no echo).
fn echo(range: f32, least: f32, most: f32) -> Echo {
    if range < least {
        Echo::TooNear
    } else if range <= most {
        Echo::At(range.into())
    } else {
        Echo::None
    }
}

/// The beam of a scan that is nearest to a bearing.
fn beam_of(scan: &LaserScan, at: Nanoseconds, offset: f64, bearing: f64) -> Result<Beam, Problem> {
    let (first, step) = (f64::from(scan.angle_min), f64::from(scan.angle_increment));
    let turned = wrapped(bearing - offset - first);
    // From the first beam in the direction of the scan.
    let turned = if turned * step < -0.5 * step * step {
        turned + step.signum() * 2.0 * std::f64::consts::PI
    } else {
        turned
    };
    let number = (turned / step).round();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates; then there is no such beam"
    )]
    let range = scan.ranges.get(number as usize).copied().ok_or(Problem::ScanAngles)?;
    if range.is_nan() {
        return Err(Problem::RangeNotFinite);
    }
    #[expect(clippy::cast_possible_truncation, reason = "a part of the time of a scan")]
    let later = (number * f64::from(scan.time_increment) * 1e9) as Nanoseconds;
    Ok(Beam {
        at: at.saturating_add(later),
        ranger: RangerId::FIRST,
        bearing: wrapped(offset + first + number * step),
        echo: echo(range, scan.range_min, scan.range_max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_ros_messages::messages::{Header, Time, TransformStamped};

    fn heard(at: Nanoseconds, range: f32) -> RangeHeard {
        let header = Header { stamp: Time::of_nanoseconds(at), frame_id: "sonar".into() };
        RangeHeard { header, min_range: 0.1, max_range: 4.0, range, ..RangeHeard::default() }
    }

    #[test]
    fn a_range_waits_for_its_transform() {
        let mut ranges = Ranges::new("base", Vec::new(), Vec::new());
        let mut tree = Transforms::default();
        ranges.range(RangerId::FIRST, &heard(1000, 1.5), 1000).unwrap();
        assert_eq!(ranges.due(&tree, 2000), Due::default());
        let mut transform =
            TransformStamped { child_frame_id: "sonar".into(), ..TransformStamped::default() };
        transform.header.frame_id = "base".into();
        transform.transform.rotation = sonarfix_ros_messages::geometry::quaternion(0.5);
        assert!(tree.take(&transform, true));
        let due = ranges.due(&tree, 3000);
        assert_eq!((due.beams.len(), due.beams[0].echo), (1, Echo::At(1.5)));
        assert!((due.beams[0].bearing - 0.5).abs() < 1e-9);
        ranges.range(RangerId::FIRST, &heard(1000, f32::INFINITY), 1000).unwrap();
        assert_eq!(ranges.due(&tree, 3000).beams[0].echo, Echo::None);
        let limits = [(f32::NEG_INFINITY, Echo::TooNear), (0.09, Echo::TooNear), (4.1, Echo::None)];
        for (range, expected) in limits {
            ranges.range(RangerId::FIRST, &heard(1000, range), 1000).unwrap();
            let due = ranges.due(&tree, 3000);
            assert_eq!(due.beams[0].echo, expected, "{range}");
        }
        let nan = ranges.range(RangerId::FIRST, &heard(1000, f32::NAN), 1000);
        assert_eq!(nan, Err(Problem::RangeNotFinite));
    }

    #[test]
    fn a_range_without_a_frame_is_named() {
        let mut ranges = Ranges::new("base", Vec::new(), Vec::new());
        ranges.range(RangerId::FIRST, &heard(0, 1.5), 0).unwrap();
        let due = ranges.due(&Transforms::default(), FRAME_PATIENCE);
        assert_eq!(due.problems, [Problem::RangeFrame]);
        assert!(ranges.is_empty());
    }

    #[test]
    fn beams_of_a_scan_are_found_by_bearing() {
        let scan = LaserScan {
            angle_min: -1.5,
            angle_increment: 0.1,
            time_increment: 0.001,
            range_min: 0.1,
            range_max: 9.0,
            ranges: (0..31_u8).map(f32::from).collect(),
            ..LaserScan::default()
        };
        let beam = beam_of(&scan, 0, 0.0, 0.0).unwrap();
        assert_eq!((beam.echo, beam.at), (Echo::None, 15_000_000));
        assert_eq!(beam_of(&scan, 0, 0.0, -1.5).unwrap().echo, Echo::TooNear);
        let beam = beam_of(&scan, 0, 1.0, 0.32).unwrap();
        assert_eq!(beam.echo, Echo::At(8.0));
        assert!((beam.bearing - 0.3).abs() < 1e-6);
        assert_eq!(beam_of(&scan, 0, 0.0, 2.0), Err(Problem::ScanAngles));
        assert_eq!(beam_of(&scan, 0, 0.0, -2.0), Err(Problem::ScanAngles));
    }
}
