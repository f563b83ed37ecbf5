//! How well a robot, a map and a start explain the ranges of a log.

use std::io::Empty;

use sonarfix::health::Verdict;
use sonarfix::map::Wall;
use sonarfix_hal::config::{RobotConfig, StartPose};
use sonarfix_sim::trace::{FixRecord, Pose, Recorder, Tick};

use crate::fault::Fault;
use crate::log::Record;
use crate::session::{Session, Trouble};

/// The share of echoes that come from what is not in the map, in a usual room.
const FOREIGN: f64 = 0.1;
/// The least variance of an innovation, m²: 2 cm. A wall of a map is not known better, and a narrower density would reward
/// a sure filter, not a right one.
const LEAST_VARIANCE: f64 = 4e-4;
/// Deviations of the innovations, compared with those that the localizer expects. The most probable one is taken.
const ACCURACIES: [f64; 9] = [1.25, 1.0, 0.82, 0.67, 0.55, 0.45, 0.37, 0.3, 0.25];
/// An echo that is e times as probable as by chance is explained.
const EXPLAINED: f64 = 1.0;

/// The fewest echoes that say something of a share.
const LEAST_COMPARED: usize = 12;
/// The fewest echoes before a stretch that is not explained, and in it.
const LEAST_BEFORE: usize = 20;
const LEAST_WITHIN: usize = 8;
/// The share that is explained before it, in a room with furniture.
const MOSTLY: f64 = 0.7;

/// A stretch whose echoes are not explained, seconds since the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Broken {
    pub from: f64,
    /// `None` if it ends with the log.
    pub until: Option<f64>,
    /// The estimate when it begins.
    pub pose: Option<Pose>,
    /// Whether nearly all echoes before it are explained.
    pub is_sharp: bool,
}

/// One echo: its time, and the logarithm of its likelihood against that of an echo from anywhere in range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Seconds since the start.
    pub time: f64,
    pub weight: f64,
    /// The same of the range in the log, at each of the [`ACCURACIES`].
    weights: [f64; ACCURACIES.len()],
    /// Whether a wall was expected, so that the range could be compared.
    pub is_compared: bool,
    /// The last estimate before it; `None` before the first encoder record.
    pub pose: Option<Pose>,
}

/// What a replay says of its ranges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    pub echoes: Vec<Echo>,
    /// Records of echoes, of which a localizer without encoder records takes none.
    recorded: usize,
    /// Encoder records that a wheel cannot roll.
    too_fast: u64,
    /// Encoder records that were replayed.
    ticks: u64,
    /// Of the ranger, metres.
    max_range: f64,
    /// By which the ranges of the log were multiplied.
    range_factor: f64,
    /// The last estimate, and whether its verdict is not `Lost`.
    pose: Option<Pose>,
    is_sure: bool,
    /// Deviations of the prior of the two wheels, the track width and the range scale, and the estimates at the end.
    prior: [f64; 4],
    calibration: [f64; 4],
    /// That of the robot file, metres.
    track_width: f64,
}

/// A calibration so many deviations of its prior away from the robot file is not that of the robot file.
const STRAINED: f64 = 5.0;

impl Evidence {
    /// A localizer that knows less expects any range: such an echo supports nothing.
    fn most_variance(&self) -> f64 {
        (0.06 * self.max_range).max(0.12).powi(2)
    }

    /// Of a robot, a map or a start that the localizer rejects: no echo is explained.
    pub fn none(records: &[Record]) -> Self {
        let echo = |record: &Record| match record {
            Record::Range { time, range: Some(_), .. } => {
                let weight = FOREIGN.ln();
                Some(Echo {
                    time: *time,
                    weight,
                    weights: [weight; ACCURACIES.len()],
                    is_compared: true,
                    pose: None,
                })
            }
            _ => None,
        };
        let echoes: Vec<_> = records.iter().filter_map(echo).collect();
        Self { recorded: echoes.len(), echoes, ..Self::default() }
    }

    /// Replays records, whose ranges are those of the log times a factor. `None` if they hold no start, or the localizer rejects it.
    pub fn of(
        robot: &RobotConfig,
        walls: &[Wall],
        records: impl Iterator<Item = Record>,
        range_factor: f64,
    ) -> Option<Self> {
        // A search would find the pose again, and hide what is wrong.
        let robot = RobotConfig { start: StartPose::Known, ..*robot };
        let max_range = f64::from(robot.localizer.rangers.first.max_range.0);
        let prior = &robot.localizer.prior;
        let prior = [prior.scale_right, prior.scale_left, prior.track_width.0, prior.range_scale];
        let prior = prior.map(f64::from);
        let track_width = robot.localizer.drive.track_width.0.into();
        let mut evidence = Self { max_range, range_factor, prior, track_width, ..Self::default() };
        let (mut too_fast, mut recorded) = (0, 0);
        let mut session =
            Session::<std::io::BufReader<Empty>, _>::new(&robot, walls, None, &mut evidence);
        for record in records {
            recorded += usize::from(matches!(record, Record::Range { range: Some(_), .. }));
            match session.take(record, &mut |_, _| Ok(())) {
                Err(Trouble::End(_)) => return None,
                Err(Trouble::Skip(Fault::TooFast)) => too_fast += 1,
                Ok(()) | Err(Trouble::Skip(_)) => {}
            }
        }
        session.end().ok()?;
        (evidence.too_fast, evidence.recorded) = (too_fast, recorded);
        Some(evidence)
    }

    /// All echoes, those that were not taken, too.
    pub fn count(&self) -> usize {
        self.recorded.max(self.echoes.len())
    }

    /// By how many deviations of its prior each quantity differs from the robot file.
    fn strains(&self) -> impl Iterator<Item = f64> {
        let pairs = self.calibration.into_iter().zip(self.prior);
        pairs.filter(|(_, deviation)| *deviation > 0.0).map(|(value, by)| (value / by).abs())
    }

    /// Whether the localizer has estimated a robot that the robot file excludes.
    pub fn is_strained(&self) -> bool {
        self.strains().any(|strain| strain > STRAINED)
    }

    /// The logarithm of the likelihood ratio of all echoes, with the prior of the calibration at the end. An echo that was not taken is foreign.
    pub fn total(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
        let untaken = (self.count() - self.echoes.len()) as f64;
        let total = |accuracy: usize| {
            let weights = self.echoes.iter().filter_map(|echo| echo.weights.get(accuracy));
            weights.sum::<f64>()
        };
        let echoes = (0..ACCURACIES.len()).map(total).fold(f64::NEG_INFINITY, f64::max);
        let prior = -0.5 * self.strains().map(|strain| strain * strain).sum::<f64>();
        echoes + untaken * FOREIGN.ln() + prior
    }

    /// The share of the compared echoes that are explained; of all, if few could be compared.
    pub fn explained(&self) -> f64 {
        let compared: Vec<_> = self.echoes.iter().copied().filter(|it| it.is_compared).collect();
        let are_many = compared.len() >= LEAST_COMPARED && 10 * compared.len() >= self.count();
        if are_many { share(&compared) } else { share_of(&self.echoes, self.count()) }
    }

    /// The share of all echoes that are explained.
    pub fn explained_of_all(&self) -> f64 {
        share_of(&self.echoes, self.count())
    }

    /// Whether a wall was expected by at least half of all echoes.
    pub fn are_mostly_compared(&self) -> bool {
        2 * self.echoes.iter().filter(|it| it.is_compared).count() >= self.count()
    }

    /// The logarithm of the likelihood against that of another replay, for as many echoes as that one has.
    pub fn gain(&self, other: &Self) -> f64 {
        let missing = other.count().saturating_sub(self.count());
        #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
        let [own, missing, all] = [self.count(), missing, other.count()].map(|count| count as f64);
        let total = self.total() + missing * FOREIGN.ln();
        total * all / (own + missing).max(1.0) - other.total()
    }

    /// The stretch in which the echoes are explained least, if they are well explained for long before it.
    pub fn broken(&self) -> Option<Broken> {
        let (mut begin, mut sum) = (0, 0.0);
        let (mut worst, mut stretch) = (0.0, 0..0);
        for (index, echo) in self.echoes.iter().enumerate() {
            sum -= echo.weight;
            if sum <= 0.0 {
                (begin, sum) = (index + 1, 0.0);
            } else if sum > worst {
                (worst, stretch) = (sum, begin..index + 1);
            }
        }
        let before = self.echoes.get(..stretch.start)?;
        let within = self.echoes.get(stretch.clone())?;
        let is_late = before.len() >= LEAST_BEFORE && 5 * before.len() >= 2 * self.echoes.len();
        let is_long = within.len() >= LEAST_WITHIN;
        let is_broken = is_late && is_long && share(before) >= MOSTLY && share(within) < 0.4;
        let to_end = stretch.end + LEAST_WITHIN >= self.echoes.len();
        is_broken.then_some(Broken {
            from: within.first()?.time,
            pose: within.first()?.pose,
            until: (!to_end).then_some(within.last()?.time),
            is_sharp: share(before) >= 0.95,
        })
    }

    /// Whether wheels are often faster than they can be.
    pub fn is_too_fast(&self) -> bool {
        20 * self.too_fast > self.ticks
    }
}

/// The share of some echoes that are explained; 1 without any.
fn share(echoes: &[Echo]) -> f64 {
    share_of(echoes, echoes.len())
}

/// The share of all echoes that are explained, if the others are not; 1 without any.
fn share_of(echoes: &[Echo], all: usize) -> f64 {
    if all == 0 {
        return 1.0;
    }
    let explained = echoes.iter().filter(|echo| echo.weight >= EXPLAINED).count();
    #[expect(clippy::cast_precision_loss, reason = "counts of echoes")]
    let share = explained as f64 / all as f64;
    share
}

impl Recorder for Evidence {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        self.ticks += 1;
        let estimate = make().estimate;
        self.pose = Some(estimate.pose);
        self.is_sure = estimate.verdict != Verdict::Lost;
        let of = estimate.calibration;
        let track_width = of.track_width - self.track_width;
        self.calibration = [of.scale_right, of.scale_left, track_width, of.range_scale];
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        let record = make();
        let Some(range) = record.range else { return };
        let innovation = match (record.innovation, record.innovation_variance) {
            (Some(innovation), Some(variance)) if variance < self.most_variance() => {
                Some((innovation, variance.max(LEAST_VARIANCE)))
            }
            _ => None,
        };
        let weight = |accuracy: f64, width: f64| {
            let density = innovation.map_or(0.0, |(innovation, variance)| {
                density(innovation, accuracy * accuracy * variance)
            });
            let weight = (FOREIGN + (1.0 - FOREIGN) * density * width).ln();
            // A localizer that has lost the pose follows any range.
            if self.is_sure { weight } else { weight.min(0.0) }
        };
        // The likelihood is that of the range in the log, whose errors are those of the changed range divided by the factor; those
        // of the pose and the map, about half of them, are not. Longer ranges are no evidence. A number beyond the longest range
        // is no range in metres, which nothing else explains.
        let is_in_range = range <= self.range_factor * self.max_range;
        let factor = if is_in_range { self.range_factor.sqrt().min(1.0) } else { 1.0 };
        let weights = ACCURACIES.map(|accuracy| weight(accuracy, factor * self.max_range));
        let weight = weight(1.0, self.max_range);
        let is_compared = record.innovation.is_some();
        self.echoes.push(Echo { time: record.time, weight, weights, is_compared, pose: self.pose });
    }
}

/// The density of a normal distribution.
fn density(value: f64, variance: f64) -> f64 {
    (-0.5 * value * value / variance).exp() / (std::f64::consts::TAU * variance).sqrt()
}

#[cfg(test)]
mod tests {
    use sonarfix_sim::trace::Outcome;

    use super::*;

    /// A hundred echoes with innovations of one size, metres, of ranges that were multiplied by a factor.
    fn evidence(innovation: f64, range_factor: f64) -> Evidence {
        let new = Evidence { max_range: 2.5, range_factor, is_sure: true, ..Evidence::default() };
        (0_u8..100).fold(new, |mut evidence, ping| {
            let sign = if ping % 2 == 0 { 1.0 } else { -1.0 };
            evidence.fix(|| FixRecord {
                time: f64::from(ping),
                wall: None,
                ranger: 0,
                sonar: [0.0; 2],
                direction: 0.0,
                bearing: 0.0,
                range: Some(0.8),
                source: None,
                why: None,
                outcome: Outcome::Accepted,
                association: None,
                reason: String::new(),
                innovation: Some(sign * innovation),
                innovation_variance: Some(LEAST_VARIANCE),
            });
            evidence
        })
    }

    #[test]
    fn a_factor_that_shortens_ranges_must_explain_them_better() {
        let (as_is, halved) = (evidence(0.01, 1.0), evidence(0.01, 0.5));
        assert!(halved.gain(&as_is) < -20.0, "{}", halved.gain(&as_is));
        // Twice the length is no evidence, neither for nor against it.
        assert!(evidence(0.01, 2.0).gain(&as_is).abs() < 1e-9);
        assert!((halved.explained() - as_is.explained()).abs() < 1e-9);
    }

    #[test]
    fn numbers_beyond_the_longest_range_are_no_ranges_in_metres() {
        let centimetres = evidence(0.01, 0.01);
        assert!(centimetres.gain(&evidence(0.01, 1.0)).abs() < 1e-9);
    }

    #[test]
    fn accurate_ranges_show_mistakes_that_are_smaller_than_their_noise() {
        // Both are within one deviation of the robot file.
        let gain = evidence(0.005, 1.0).gain(&evidence(0.015, 1.0));
        assert!(gain > 60.0, "{gain}");
    }
}
