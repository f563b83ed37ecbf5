//! Which poses a search confuses: by the symmetries of the map, and by motions that furniture, or a difference out of reach, does not
//! show.

use serde::Serialize;
use sonarfix_map::{Symmetry, SymmetryMotion};
use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use super::start::{Outcome, Start};

/// A pose is the image of another one within these errors, metres and radians: the hypotheses of a search without a unique answer are
/// inexact.
const ALIKE: (f64, f64) = (0.8, 0.26);

/// Poses that are confused, with the motion that moves one onto the other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confusion {
    /// The motion.
    #[serde(serialize_with = "as_text")]
    pub motion: SymmetryMotion,
    /// For each start without a right answer at whose end both poses were hypotheses, the true one and the other one: metres, radians.
    pub pairs: Vec<[[f64; 3]; 2]>,
}

fn as_text<S: serde::Serializer>(motion: &SymmetryMotion, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(motion)
}

/// What the starts without a right answer confused at last, the most frequent first.
pub(super) fn all(starts: &[Start], symmetries: &[Symmetry]) -> Vec<Confusion> {
    let group = |motion| Confusion { motion, pairs: Vec::new() };
    let mut found: Vec<Confusion> = symmetries.iter().map(|it| group(it.motion)).collect();
    let of_symmetries = found.len();
    for start in starts.iter().filter(|start| start.outcome != Outcome::Right) {
        let Some(last) = start.ambiguities.last() else { continue };
        let truth = numbers(&last.truth);
        for other in last.wrong.iter().map(numbers) {
            let is_image = |it: &&mut Confusion| {
                it.motion.images(truth).iter().any(|image| are_alike(image, &other))
            };
            if let Some(confusion) = found.iter_mut().find(is_image) {
                confusion.add(truth, other);
            } else {
                let mut confusion = group(motion([truth, other]));
                confusion.add(truth, other);
                found.push(confusion);
            }
        }
    }
    for confusion in found.iter_mut().skip(of_symmetries) {
        confusion.motion = typical(&confusion.pairs).unwrap_or(confusion.motion);
    }
    found.retain(|confusion| !confusion.pairs.is_empty());
    found.sort_by_key(|confusion| std::cmp::Reverse(confusion.pairs.len()));
    found
}

impl Confusion {
    /// Adds the poses of a start, once: a search may have two hypotheses near each other.
    fn add(&mut self, truth: [f64; 3], other: [f64; 3]) {
        let bits = |pose: &[f64; 3]| pose.map(f64::to_bits);
        if self.pairs.last().is_none_or(|[of, _]| bits(of) != bits(&truth)) {
            self.pairs.push([truth, other]);
        }
    }
}

/// The motion between two poses; a shift, if their headings differ by less than the errors.
fn motion([truth, [x, y, heading]]: [[f64; 3]; 2]) -> SymmetryMotion {
    let is_parallel = angle::wrap(heading - truth[2]).abs() < ALIKE.1;
    SymmetryMotion::between(truth, [x, y, if is_parallel { truth[2] } else { heading }])
}

/// The median of the motions between poses, number by number.
fn typical(pairs: &[[[f64; 3]; 2]]) -> Option<SymmetryMotion> {
    let motions: Vec<SymmetryMotion> = pairs.iter().map(|pair| motion(*pair)).collect();
    let median = |of: &dyn Fn(&SymmetryMotion) -> Option<f64>| {
        let mut values: Vec<f64> = motions.iter().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some(match motions.first()? {
        SymmetryMotion::Turn { .. } => {
            let turn = |of: fn(f64, [f64; 2]) -> f64| {
                median(&|motion| match motion {
                    SymmetryMotion::Turn { by, about } => Some(of(*by, *about)),
                    SymmetryMotion::Shift(_) => None,
                })
            };
            let about = [turn(|_, about| about[0])?, turn(|_, about| about[1])?];
            SymmetryMotion::Turn { by: turn(|by, _| by)?, about }
        }
        SymmetryMotion::Shift(_) => {
            let shift = |of: fn([f64; 2]) -> f64| {
                median(&|motion| match motion {
                    SymmetryMotion::Shift(by) => Some(of(*by)),
                    SymmetryMotion::Turn { .. } => None,
                })
            };
            SymmetryMotion::Shift([shift(|[x, _]| x)?, shift(|[_, y]| y)?])
        }
    })
}

fn numbers(pose: &Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.heading]
}

fn are_alike(one: &[f64; 3], other: &[f64; 3]) -> bool {
    let position = (one[0] - other[0]).hypot(one[1] - other[1]);
    position < ALIKE.0 && angle::wrap(one[2] - other[2]).abs() < ALIKE.1
}
