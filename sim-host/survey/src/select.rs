//! Which lines are kept, and which are the same.

#![expect(
    clippy::indexing_slicing,
    reason = "lines, matches and spans have the lengths that the track was built with"
)]

use sonarfix_batch::odometry::wrap;

use crate::evidence::{evidence, is_refuted, placed};
use crate::line::Span;
use crate::propose::{Sighting, is_round};
use crate::solve::solve;
use crate::track::Track;

/// Fewest echoes of a line that is no longer in view.
const FEWEST: usize = 6;

impl Track<'_> {
    /// Removes lines that the pings contradict.
    pub(crate) fn remove_refuted(&mut self) {
        let chain = self.problem.chain;
        let here = chain.distances[self.known - 1];
        let placed = placed(&self.problem, &self.state, self.known);
        let evidence = evidence(&self.problem, &self.state, &placed, &self.spans);
        let mut last = vec![0.0_f64; self.state.lines.len()];
        for (k, line) in self.problem.matches.iter().enumerate() {
            if let Some(line) = *line {
                last[line] = chain.distances[chain.pings[k].pose];
            }
        }
        let is_kept = |index: usize| {
            let is_in_view = here - last[index] < 1.5;
            let is_found = evidence[index].all >= FEWEST && !self.is_round(index);
            (is_in_view || is_found) && !is_refuted(&evidence[index])
        };
        let kept: Vec<bool> = (0..self.state.lines.len()).map(is_kept).collect();
        self.keep(&kept);
    }

    fn is_round(&self, index: usize) -> bool {
        let all = self.problem.matches.iter().enumerate();
        let own = all.filter(|(_, line)| **line == Some(index));
        let sightings: Vec<Sighting> = own.filter_map(|(k, _)| self.sighting(k)).collect();
        is_round(&self.state.lines[index], &sightings, self.problem.range_noise)
    }

    fn keep(&mut self, kept: &[bool]) {
        let mut numbers = vec![None; kept.len()];
        let left = numbers.iter_mut().zip(kept).filter(|(_, kept)| **kept);
        for (index, (number, _)) in left.enumerate() {
            *number = Some(index);
        }
        for line in &mut self.problem.matches {
            *line = line.and_then(|line| numbers[line]);
        }
        let mut flags = kept.iter();
        self.state.lines.retain(|_| flags.next().copied().unwrap_or(false));
        let mut flags = kept.iter();
        self.spans.retain(|_| flags.next().copied().unwrap_or(false));
    }

    /// Merges lines of one side of one wall.
    pub(crate) fn merge(&mut self) {
        const TRIALS: usize = 4;
        let mut trials = 0;
        let mut one = 0;
        while one < self.state.lines.len() {
            let mut other = one + 1;
            while other < self.state.lines.len() {
                match self.apart(one, other) {
                    Some(apart) if apart < 0.02 => self.join(one, other),
                    Some(_) if trials < TRIALS => {
                        trials += 1;
                        if !self.try_join(one, other) {
                            other += 1;
                        }
                    }
                    _ => other += 1,
                }
            }
            one += 1;
        }
    }

    /// The distance between two lines that may be the same, where their known parts are nearest.
    fn apart(&self, one: usize, other: usize) -> Option<f64> {
        const DIRECTIONS: f64 = 0.1;
        const FARTHEST: f64 = 0.25;
        let (a, b) = (&self.state.lines[one], &self.state.lines[other]);
        if wrap(a.angle - b.angle).abs() > DIRECTIONS {
            return None;
        }
        let of_a = Span { from: self.spans[one].first()?.from, to: self.spans[one].last()?.to };
        let ends = [self.spans[other].first()?.from, self.spans[other].last()?.to];
        let [from, to] = ends.map(|along| a.along(&b.point(along)));
        let (low, high) = (of_a.from.max(from.min(to)), of_a.to.min(from.max(to)));
        if low - high > 1.0 {
            return None;
        }
        let at = a.point(f64::midpoint(low, high));
        let apart = b.distance(&at).abs();
        (apart < FARTHEST).then_some(apart)
    }

    fn join(&mut self, one: usize, other: usize) {
        for line in self.problem.matches.iter_mut().filter(|line| **line == Some(other)) {
            *line = Some(one);
        }
        let kept: Vec<bool> = (0..self.state.lines.len()).map(|index| index != other).collect();
        self.keep(&kept);
        self.measure_spans();
    }

    /// Joins two lines if nearly all of their echoes still fit after it.
    fn try_join(&mut self, one: usize, other: usize) -> bool {
        let fitting = |track: &Self, of: &[usize]| {
            let problem = &track.problem;
            of.iter()
                .filter(|&&k| {
                    let event = &problem.chain.pings[k];
                    let line = problem.matches[k].zip(problem.recording.pings[event.index].range);
                    line.is_some_and(|(line, range)| {
                        let sonar = problem.sonar(&track.state, event);
                        let line = &track.state.lines[line];
                        let expected = problem.expected(&track.state, &sonar, line);
                        (expected - range).abs() <= 3.0 * problem.range_noise
                    })
                })
                .count()
        };
        let matches = self.problem.matches.iter().enumerate();
        let all: Vec<usize> = matches.filter(|(_, line)| line.is_some()).map(|(k, _)| k).collect();
        let theirs: Vec<usize> = all
            .iter()
            .copied()
            .filter(|&k| [Some(one), Some(other)].contains(&self.problem.matches[k]))
            .collect();
        let mut trial = self.clone();
        trial.join(one, other);
        let window = trial.window(0..trial.known);
        for kernel in [30.0, 10.0, 4.0] {
            trial.problem.kernel = kernel;
            solve(&trial.problem, &mut trial.state, &window, 3);
        }
        let [before, after] = [fitting(self, &theirs), fitting(&trial, &theirs)];
        let [all_before, all_after] = [fitting(self, &all), fitting(&trial, &all)];
        let is_same = 20 * after >= 18 * before
            && 100 * all_after >= 98 * all_before
            && trial.cost() <= self.cost() + 12.0;
        if is_same {
            trial.measure_spans();
            *self = trial;
        }
        is_same
    }
}
