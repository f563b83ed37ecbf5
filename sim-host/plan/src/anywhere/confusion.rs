//! Which poses a search confuses: motions of the map that furniture, or a difference out of reach, does not show.

use serde::Serialize;
use sonarfix_map::SymmetryMotion;
use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use super::start::{Outcome, Start};

/// A pose is the image of another one within these errors, metres and radians: a search that is not sure of its pose knows it only
/// roughly.
const ALIKE: (f64, f64) = (0.5, 0.26);

/// Poses that are confused, with the motion that moves one onto the other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confusion {
    /// The motion.
    #[serde(serialize_with = "as_text")]
    pub motion: SymmetryMotion,
    /// In how many starts without a right answer the search had both poses at the end.
    pub starts: usize,
    /// The true pose and the other one of each of these starts: metres, radians.
    pub pairs: Vec<[[f64; 3]; 2]>,
}

fn as_text<S: serde::Serializer>(motion: &SymmetryMotion, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(motion)
}

/// What the starts without a right answer confused at last, the most frequent first.
pub(super) fn all(starts: &[Start]) -> Vec<Confusion> {
    let mut found: Vec<Confusion> = Vec::new();
    for start in starts.iter().filter(|start| start.outcome != Outcome::Right) {
        let Some(last) = start.doubts.last() else { continue };
        let truth = numbers(&last.truth);
        for rival in last.rivals.iter().map(numbers) {
            let is_this = |confusion: &&mut Confusion| {
                confusion.motion.images(truth).iter().any(|image| are_alike(image, &rival))
            };
            if let Some(known) = found.iter_mut().find(is_this) {
                // One start may have two hypotheses near each other.
                if known.pairs.last().is_none_or(|[of, _]| *of != truth) {
                    known.starts += 1;
                    known.pairs.push([truth, rival]);
                }
            } else {
                let motion = SymmetryMotion::between(truth, untwisted(truth, rival));
                found.push(Confusion { motion, starts: 1, pairs: vec![[truth, rival]] });
            }
        }
    }
    found.sort_by_key(|confusion| std::cmp::Reverse(confusion.starts));
    found
}

/// A pose with the heading of another one, if they differ by less than the errors.
fn untwisted(truth: [f64; 3], [x, y, heading]: [f64; 3]) -> [f64; 3] {
    let is_parallel = angle::wrap(heading - truth[2]).abs() < ALIKE.1;
    [x, y, if is_parallel { truth[2] } else { heading }]
}

fn numbers(pose: &Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.heading]
}

fn are_alike(one: &[f64; 3], other: &[f64; 3]) -> bool {
    let position = (one[0] - other[0]).hypot(one[1] - other[1]);
    position < ALIKE.0 && angle::wrap(one[2] - other[2]).abs() < ALIKE.1
}
