//! What is wrong with a log, or with the robot file, the map and the start that it is replayed with.
//!
//! Some faults are visible in the records: gaps of the clock, counters that overflow, an encoder that stands still. Others are
//! found by trying them: the robot, the map, the start or the log is changed as if the cause were right, and the log is
//! replayed. The cause that makes its ranges most probable is named, if it explains them much better than the files as they
//! are. A log that its files explain is not examined further.

mod causes;
mod change;
mod evidence;
mod finding;
mod recording;
mod report;
mod visible;
mod walls;

use std::io::BufRead;

use serde::Serialize;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_sim::odometry::DeadReckoning;
use sonarfix_sim::trace::Pose;

use crate::fault::ReplayError;
use crate::find::Find;
use crate::log::Record;
use crate::wheels;
use causes::{Candidate, Cause};
use change::Change;
use evidence::{Broken, Evidence};
use recording::{Entry, Recording};
use visible::Visible;

pub use finding::Finding;

/// Fewer echoes say nothing about a cause.
const LEAST_ECHOES: usize = 12;
/// Files that explain so many of the echoes are right.
const RIGHT: f64 = 0.93;
/// Files with another start explain less.
const STARTED_ELSEWHERE: f64 = 0.8;
/// A cause must explain at least this share of the echoes.
const LEAST_EXPLAINED: f64 = 0.6;
const LEAST_EXPLAINED_STANDING: f64 = 0.75;
/// The share of all echoes that a cause may explain less than the files as they are, and that of the echoes that are compared.
const LOST: f64 = 0.03;
const LOST_OF_COMPARED: f64 = 0.1;
/// The logarithm of the likelihood that a cause must gain: in all, and for each echo.
const LEAST_GAIN: f64 = 10.0;
const LEAST_GAIN_PER_ECHO: f64 = 0.08;
/// Records in which causes are tried: five minutes of a robot with 10 encoder records and 2 ranges a second.
const TRIED: usize = 3_600;
/// Records in which candidates are compared first, and how many are examined further.
const SCREENED: usize = 1_200;
const KEPT: usize = 24;
/// Halvings of the step of a varied quantity, and the candidates that are refined.
const REFINEMENTS: i32 = 4;
const REFINED: usize = 6;
/// Prefixes of the log in which the start is searched, seconds, until one explains the log.
const SEARCHED: [f64; 3] = [40.0, 90.0, 200.0];
/// The longest of them in a map of many walls: a search takes as long as seconds times walls.
const MOST_WALL_SECONDS: f64 = 12_000.0;

/// A diagnosis.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Diagnosis {
    /// The share of the echoes that the files explain as they are; `None` with too few of them.
    pub explained: Option<f64>,
    /// What is wrong, the surest first.
    pub findings: Vec<Finding>,
}

/// Looks for what is wrong with a log and its files. Ten minutes of a robot are examined. `start` replaces the start of the log.
/// Without walls the records alone are examined.
///
/// # Errors
/// [`ReplayError`], if the log cannot be read or is of another format.
pub fn diagnose(
    robot: &RobotConfig,
    walls: &[Wall],
    log: impl BufRead,
    start: Option<Pose>,
) -> Result<Diagnosis, ReplayError> {
    let mut visible = Visible::new(robot);
    let mut recording = Recording::read(log, |entry| visible.see(entry))?;
    if let Some(pose) = start {
        recording.start_at(pose);
    }
    let entries = recording::thinned(&recording.entries);
    let whole = Trial { robot, walls, entries: &entries, are_too_fast: visible.are_too_fast() };
    let as_is = whole.as_is();
    // Without a start and a map no echo can be compared with a wall.
    let is_comparable = whole.start().is_some() && !walls.is_empty();
    let is_enough = is_comparable && as_is.count() >= LEAST_ECHOES;
    let explained = is_enough.then(|| as_is.explained());
    let mut findings = visible.findings(&recording);
    // A time in another unit makes each wheel too slow or too fast: nothing else can be tried.
    let is_readable = findings.iter().all(|found| found.cause != "time_unit");
    let is_right = explained.is_none_or(|share| share >= RIGHT)
        && !as_is.is_too_fast()
        && !as_is.is_strained();
    if is_enough && is_readable {
        add_unexplained(&visible, is_right, &mut findings);
        let causes = whole.causes(&as_is);
        let are_none = causes.findings.is_empty();
        // Some cause explains the ranges of a servo that does not turn by chance.
        findings.extend(visible.constant_bearing().filter(|_| !are_none));
        add(causes, &mut findings);
        if are_none && !is_right && !findings.iter().any(|it| it.cause == RANGE_NOISE) {
            findings.extend(visible.unexplained().or_else(|| report::unexplained(&as_is, walls)));
        }
    }
    findings.extend(visible::edited(&recording));
    Ok(Diagnosis { explained, findings })
}

const RANGE_NOISE: &str = "range_noise";

/// Adds what the records show of ranges that the files do not explain.
fn add_unexplained(visible: &Visible, is_right: bool, findings: &mut Vec<Finding>) {
    if is_right {
        return;
    }
    if let Some(clipped) = visible.clipped() {
        findings.retain(|it| it.cause != "range_stuck");
        findings.push(clipped);
    }
    let is_placed =
        findings.iter().any(|it| ["range_placeholder", "range_stuck"].contains(&it.cause));
    findings.extend(visible.repeated().filter(|_| !is_placed));
    findings.extend(visible.certain_noise());
}

/// Adds the causes that were found by trying, and removes findings in the records that are effects of them.
fn add(causes: Named, findings: &mut Vec<Finding>) {
    // No cause makes random numbers probable, but wheels that count backwards make ranges look random.
    if causes.total > 0.0 {
        findings.retain(|it| it.cause != RANGE_NOISE);
    }
    let causes = causes.findings;
    if causes.iter().any(|it| it.cause == "range_unit") {
        findings.retain(|it| it.cause != "range_placeholder");
    }
    // A jump of a counter may be the effect of a wrong unit.
    let jumps: Vec<_> = findings.extract_if(.., |it| it.cause == "counter_jump").collect();
    findings.extend(causes);
    findings.extend(jumps);
}

/// The files and the log on which causes are tried.
struct Trial<'a> {
    robot: &'a RobotConfig,
    walls: &'a [Wall],
    entries: &'a [Entry],
    /// Whether both wheels are often faster than they can be.
    are_too_fast: bool,
}

/// The causes that explain a log, best first, and by how much the first one is more probable: the logarithm of the likelihood ratio.
#[derive(Default)]
struct Named {
    findings: Vec<Finding>,
    value: f64,
    /// The logarithm of the likelihood with the first one against that of random ranges.
    total: f64,
}

/// A cause that was tried.
struct Tried {
    candidate: Candidate,
    evidence: Evidence,
    /// The logarithm of its likelihood against that of the files as they are.
    gain: f64,
}

impl<'a> Trial<'a> {
    fn of(&self, change: &Change) -> Option<Evidence> {
        let walls = change.walls(self.walls);
        let records = change.records(self.entries, self.robot);
        Evidence::of(&change.robot(self.robot), &walls, records.into_iter(), change.range)
    }

    fn try_one(&self, candidate: &Candidate, as_is: &Evidence) -> Option<Tried> {
        let evidence = self.of(&candidate.change)?;
        let gain = evidence.gain(as_is);
        Some(Tried { candidate: *candidate, evidence, gain })
    }

    /// The files and the log as they are.
    fn as_is(&self) -> Evidence {
        let none = Change::default();
        self.of(&none).unwrap_or_else(|| Evidence::none(&none.records(self.entries, self.robot)))
    }

    /// As much of the log as is enough to try causes.
    fn beginning(&self) -> Trial<'a> {
        let entries = self.entries.get(..TRIED).unwrap_or(self.entries);
        Trial { entries, ..*self }
    }

    /// The causes that explain the log, best first. If much of the log is right before the rest, the robot was probably moved.
    fn causes(&self, as_is: &Evidence) -> Named {
        let lasting = self.beginning().lasting();
        let Some(broken) = as_is.broken() else { return lasting };
        let mut moves = self.moves(broken, as_is);
        keep_best(&mut moves, 0);
        let moved = self.named(&moves, as_is);
        let best = if moved.value > lasting.value { moved } else { lasting };
        if best.findings.is_empty() && broken.is_sharp {
            let findings = vec![report::broken(broken, self.begin(), self.entries)];
            Named { findings, ..Named::default() }
        } else {
            best
        }
    }

    /// The causes that explain the log from its start on.
    fn lasting(&self) -> Named {
        let as_is = &self.as_is();
        let start = self.start();
        let mut candidates = causes::all();
        // A robot that hardly moves, by its log, can follow any ranges.
        candidates.retain(|it| !it.is_of_slow_wheels() || self.are_too_fast);
        candidates.extend(causes::of_walls(self.walls));
        candidates.extend(start.into_iter().flat_map(causes::starts_around));
        candidates.extend(start.and_then(causes::start_unit));
        candidates.extend(start.into_iter().flat_map(causes::start_positions));
        let mut tried: Vec<_> = self
            .screened(candidates)
            .into_iter()
            .filter_map(|it| self.try_one(&it, as_is))
            .collect();
        keep_best(&mut tried, 0);
        // The search takes seconds, and a wrong start explains little.
        if as_is.explained() < STARTED_ELSEWHERE
            && tried.iter().all(|it| it.evidence.explained() < RIGHT || !it.is_enough(as_is))
        {
            tried.extend(self.starts(as_is));
            keep_best(&mut tried, 0);
        }
        for best in tried.iter_mut().take(REFINED) {
            self.refine(best, as_is);
        }
        keep_best(&mut tried, 0);
        self.named(&tried, as_is)
    }

    /// The best of what was tried, and one that is nearly as good.
    fn named(&self, tried: &[Tried], as_is: &Evidence) -> Named {
        // A start near that of the log gains only by its larger deviation.
        let start = self.start();
        let of_heading = self.heading_deviation();
        let is_enough = |it: &&Tried| {
            let is_unusual = !it.candidate.is_usual(self.robot, of_heading);
            is_unusual && it.candidate.is_elsewhere(start) && it.is_enough(as_is)
        };
        let named: Vec<_> = tried.iter().filter(is_enough).collect();
        let Some(first) = named.first() else { return Named::default() };
        let near: Vec<_> =
            named.iter().filter(|it| it.value() > 0.95 * first.value() - 4.0).collect();
        // Several varied quantities that all fit a little are signs of something else.
        let kind = first.candidate.kind();
        let are_alike = kind.is_some() && near.iter().all(|it| it.candidate.kind() == kind);
        let are_vague =
            near.len() > 1 && !are_alike && near.iter().all(|it| it.candidate.is_varied());
        if are_vague && first.is_little() && first.evidence.explained() < RIGHT {
            return Named::default();
        }
        let shown = if are_alike { 3 } else { 2 };
        let finding = |it: &Tried| {
            report::finding(&it.candidate, &it.evidence, self.robot, self.walls, self.entries)
        };
        Named {
            value: first.value(),
            total: first.evidence.total() - first.candidate.cost(),
            findings: near.into_iter().copied().take(shown).map(finding).collect(),
        }
    }

    /// Varies the value of a candidate in steps that become finer.
    fn refine(&self, best: &mut Tried, as_is: &Evidence) {
        for fineness in 0..REFINEMENTS {
            for candidate in causes::finer(&best.candidate, fineness) {
                if let Some(tried) = self.try_one(&candidate, as_is)
                    && tried.gain > best.gain
                {
                    *best = tried;
                }
            }
        }
    }

    /// The time of the first record.
    fn begin(&self) -> f64 {
        self.entries.first().map_or(0.0, |entry| entry.record.time())
    }

    /// The pose of the start record.
    fn start(&self) -> Option<Pose> {
        self.entries.iter().find_map(|entry| match entry.record {
            Record::Start { pose, .. } => Some(pose),
            Record::Resume { state: [x, y, heading, ..], .. } => Some(Pose { x, y, heading }),
            _ => None,
        })
    }

    /// The standard deviation of the heading in the start record, radians.
    fn heading_deviation(&self) -> Option<f64> {
        self.entries.iter().find_map(|entry| match entry.record {
            Record::Start { heading_deviation, .. } => Some(heading_deviation),
            Record::Resume { deviation: [_, _, heading, ..], .. } => Some(heading),
            _ => None,
        })
    }

    /// The candidates that explain the first part of the log best, and the best one of each cause.
    fn screened(&self, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let entries = self.entries.get(..SCREENED).unwrap_or(self.entries);
        let first = Trial { entries, ..*self };
        let as_is = first.as_is();
        let tried = candidates.into_iter().filter_map(|it| first.try_one(&it, &as_is));
        let mut tried = tried.collect();
        keep_best(&mut tried, KEPT);
        tried.into_iter().map(|it| it.candidate).collect()
    }

    /// Starts that the search finds in the first part of the log.
    fn starts(&self, as_is: &Evidence) -> Vec<Tried> {
        self.searched(self.begin(), as_is, causes::start_at)
    }

    /// Other poses from the moment on at which the ranges no longer fit.
    fn moves(&self, broken: Broken, as_is: &Evidence) -> Vec<Tried> {
        let time = self.begin() + broken.from;
        let mut tried = self.searched(time, as_is, |pose| causes::moved_to(time, pose));
        let around = broken.pose.into_iter().flat_map(|pose| causes::moves_around(time, pose));
        tried.extend(around.filter_map(|it| self.try_one(&it, as_is)));
        keep_best(&mut tried, REFINED);
        for best in &mut tried {
            self.refine(best, as_is);
        }
        tried
    }

    /// The candidates of the poses that the search finds from a time on.
    fn searched(
        &self,
        from: f64,
        as_is: &Evidence,
        candidate: impl Fn(Pose) -> Candidate,
    ) -> Vec<Tried> {
        #[expect(clippy::cast_precision_loss, reason = "a number of walls")]
        let longest = MOST_WALL_SECONDS / self.walls.len() as f64;
        let mut tried = Vec::new();
        for seconds in SEARCHED.into_iter().filter(|it| *it <= longest) {
            let poses = self.found(from, seconds).into_iter();
            tried.extend(poses.filter_map(|pose| self.try_one(&candidate(pose), as_is)));
            if tried.iter().any(|it| it.is_enough(as_is) && it.evidence.explained() >= RIGHT) {
                break;
            }
        }
        tried
    }

    /// The poses at a time that the search finds in the seconds after it.
    fn found(&self, from: f64, seconds: f64) -> Vec<Pose> {
        let within = || {
            let records = self.entries.iter().map(|entry| &entry.record);
            records.filter(move |record| (from..=from + seconds).contains(&record.time()))
        };
        let found = Find { robot: self.robot, walls: self.walls }.run_records(within());
        let moved = moved(within(), self.robot);
        found.hypotheses.iter().take(4).map(|it| before(it.pose, moved)).collect()
    }
}

impl Tried {
    /// The gain without what a cause of its kind gains by chance. A varied quantity fits a little better than what is right.
    fn value(&self) -> f64 {
        self.gain - self.candidate.cost()
    }

    /// Whether each echo becomes less than e times as probable.
    fn is_little(&self) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "a number of echoes")]
        let echoes = self.evidence.count() as f64;
        self.value() < echoes
    }

    fn is_enough(&self, as_is: &Evidence) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "a number of echoes")]
        let echoes = as_is.count() as f64;
        let gain = self.value();
        // What makes a robot file right that the localizer has to bend need not explain more echoes.
        let is_relaxed = as_is.is_strained() && !self.evidence.is_strained();
        gain >= LEAST_GAIN
            && (is_relaxed || gain >= LEAST_GAIN_PER_ECHO * echoes)
            && self.evidence.explained() >= self.least_explained()
            && self.explains_no_less(as_is)
    }

    /// The least share: ranges fit by chance to a robot that hardly moves by its log.
    fn least_explained(&self) -> f64 {
        if self.candidate.is_standing() { LEAST_EXPLAINED_STANDING } else { LEAST_EXPLAINED }
    }

    /// Whether it explains as many echoes as the files as they are, but for those that are compared with other walls.
    fn explains_no_less(&self, as_is: &Evidence) -> bool {
        let lost = as_is.explained_of_all() - self.evidence.explained_of_all();
        let lost_of_compared = as_is.explained() - self.evidence.explained();
        // A search of the whole map finds a pose at which a part fits, in the map of another room, too.
        if self.candidate.cause == Cause::StartPose
            && self.evidence.explained_of_all() < LEAST_EXPLAINED
        {
            return false;
        }
        let permitted = match self.candidate.cause {
            Cause::Moved => LOST,
            // The share of few compared echoes means little.
            _ if as_is.are_mostly_compared() || self.candidate.is_of_wall() => LOST_OF_COMPARED,
            _ => 1.0,
        };
        lost <= LOST && lost_of_compared <= permitted
    }
}

/// Sorts what was tried, and keeps the best of each cause, and so many others that are as good.
fn keep_best(tried: &mut Vec<Tried>, others: usize) {
    tried.sort_by(|a, b| b.value().total_cmp(&a.value()));
    let (mut seen, mut kept) = (Vec::new(), 0);
    tried.retain(|it| {
        let is_new = !seen.contains(&it.candidate.cause);
        seen.push(it.candidate.cause);
        let is_kept = is_new || kept < others;
        kept += usize::from(is_kept);
        is_kept
    });
}

/// The pose relative to the start after some records, by the encoders alone.
fn moved<'r>(records: impl Iterator<Item = &'r Record>, robot: &RobotConfig) -> Pose {
    let width = robot.localizer.drive.track_width.0.into();
    let mut odometry = DeadReckoning::new(Pose::default(), width);
    let mut last: Option<[f64; 2]> = None;
    for record in records {
        let wheels = match *record {
            #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
            Record::Ticks { right, left, .. } => {
                wheels::of_counts(robot, [right as f64, left as f64])
            }
            Record::Wheels { right, left, .. } => [right, left],
            _ => continue,
        };
        if let Some(last) = last.replace(wheels) {
            odometry.moved([wheels[0] - last[0], wheels[1] - last[1]]);
        }
    }
    odometry.pose()
}

/// The pose from which a robot has moved to `end`.
fn before(end: Pose, moved: Pose) -> Pose {
    let heading = end.heading - moved.heading;
    let (sin, cos) = heading.sin_cos();
    Pose {
        x: end.x - cos * moved.x + sin * moved.y,
        y: end.y - sin * moved.x - cos * moved.y,
        heading,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of ranges that look random, with a cause that makes them so probable.
    fn left(total: f64) -> Vec<&'static str> {
        let finding = |cause| Finding::new(cause, String::new(), String::new());
        let mut findings = vec![finding(RANGE_NOISE)];
        let causes = Named { findings: vec![finding("encoder_mirrored")], value: 50.0, total };
        add(causes, &mut findings);
        findings.iter().map(|it| it.cause).collect()
    }

    #[test]
    fn ranges_that_a_cause_makes_probable_are_not_random() {
        assert_eq!(left(20.0), ["encoder_mirrored"]);
        assert_eq!(left(-20.0), [RANGE_NOISE, "encoder_mirrored"]);
    }
}
