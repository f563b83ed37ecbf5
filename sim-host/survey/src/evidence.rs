//! The evidence of the pings for and against a line: echoes from it, echoes from behind it, and echoes that reached it through
//! another wall.

#![expect(clippy::indexing_slicing, reason = "lines and pings have the lengths of the problem")]

use nalgebra::Vector2;
use sonarfix_batch::chain_of_poses::Event;

use crate::line::{Line, Span};
use crate::problem::{Problem, Sonar, State};

/// Largest angle off the axis at which a wall answers nearly always, radians.
const SURE: f64 = 0.2;
/// Distance within which a wall answers nearly always, as a share of the sonar's longest range.
const NEAR: f64 = 0.65;

/// Evidence on one line.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evidence {
    /// Echoes from it.
    pub all: usize,
    /// Those of them near the axis, where it should answer.
    pub echoes: usize,
    /// Echoes from behind it where it should have answered.
    pub passed: usize,
    /// Missing echoes where it should have answered.
    pub missing: usize,
    /// Echoes from it whose path crosses another wall.
    pub blocked: usize,
}

/// A ping with the sonar's estimated place.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// The ping, as an index into the chain.
    pub ping: usize,
    /// The sonar.
    pub sonar: Sonar,
    /// The measured range.
    pub range: Option<f64>,
}

/// All pings of a range of poses at their estimated places.
#[must_use]
pub fn placed(problem: &Problem, state: &State, until: usize) -> Vec<Placed> {
    let pings = problem.chain.pings.iter().enumerate();
    let known = pings.take_while(|(_, event)| event.pose < until);
    let place = |(ping, event): (usize, &Event)| {
        let range = problem.recording.pings.get(event.index)?.range;
        Some(Placed { ping, sonar: problem.sonar(state, event), range })
    };
    known.filter_map(place).collect()
}

/// Whether the straight path from a sonar to a point on another line crosses a wall, more than 12 cm before the point.
#[must_use]
pub fn crosses(from: &Vector2<f64>, to: &Vector2<f64>, line: &Line, spans: &[Span]) -> bool {
    const BEFORE: f64 = 0.12;
    let (start, end) = (line.distance(from), line.distance(to));
    // From the front of the wall only: its back is another line.
    if start <= 0.02 || end >= -BEFORE {
        return false;
    }
    let share = start / (start - end);
    let along = line.along(&(from + (to - from) * share));
    spans.iter().any(|span| span.has(along, -0.05))
}

/// The evidence on every line; `spans` has the supported parts of each.
#[must_use]
pub fn evidence(
    problem: &Problem,
    state: &State,
    placed: &[Placed],
    spans: &[Vec<Span>],
) -> Vec<Evidence> {
    let mut all = vec![Evidence::default(); state.lines.len()];
    let mut support = vec![0_usize; state.lines.len()];
    for line in problem.matches.iter().flatten() {
        support[*line] += 1;
    }
    let tolerance = 0.03 + 4.0 * problem.range_noise;
    for place in placed {
        let Placed { sonar, range, ping } = place;
        for (index, line) in state.lines.iter().enumerate() {
            let evidence = &mut all[index];
            if problem.matches[*ping] == Some(index) {
                evidence.all += 1;
                evidence.echoes += usize::from(line.off_axis(sonar.direction).abs() < SURE);
                let foot = line.point(line.along(&sonar.at));
                let is_blocked = state.lines.iter().enumerate().any(|(other, wall)| {
                    support[other] > support[index]
                        && crosses(&sonar.at, &foot, wall, &spans[other])
                });
                evidence.blocked += usize::from(is_blocked);
                continue;
            }
            let distance = line.distance(&sonar.at);
            let along = line.along(&sonar.at);
            let should_answer = distance > problem.robot.reach[0] + 0.05
                && distance < NEAR * problem.robot.reach[1]
                && line.off_axis(sonar.direction).abs() < SURE
                && spans[index].iter().any(|span| span.has(along, -0.1));
            if !should_answer {
                continue;
            }
            let expected = problem.expected(state, sonar, line);
            match range {
                Some(range) if *range > expected + tolerance => evidence.passed += 1,
                Some(_) => {}
                None => evidence.missing += 1,
            }
        }
    }
    all
}

/// Whether the evidence is against a line.
#[must_use]
pub fn is_refuted(evidence: &Evidence) -> bool {
    let Evidence { all, echoes, passed, missing, blocked } = *evidence;
    3 * passed > echoes.max(6) || passed + missing > echoes.max(2) || 2 * blocked > all
}
