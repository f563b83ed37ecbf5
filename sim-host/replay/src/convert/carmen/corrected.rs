//! Logs whose odometry continues from the corrected pose of each scan, as SLAM programs write them.
//!
//! Each scan replaces the odometry pose by the corrected one. An `ODOM` record after it, the re-anchor, repeats that pose; its
//! stamp means nothing and is often 0. The lines of such a log are a chain:
//! - the step from an `ODOM` record to a scan is the correction and no travel;
//! - the pose from which the next `ODOM` record was reached is that of the scan;
//! - the re-anchor is no record of its own.
//!
//! Some of these logs were written with six digits of the seconds since 1970, or without a clock: their stamps hardly ever advance, and
//! the travel alone tells how time passes.

use super::no_time::NoTime;
use super::odometry::{MAX_SPEED, Record, Sample, Source, Step, Trail};
use super::stamps::{self, JITTER};
use crate::convert::Converted;

/// Sideways displacement from which a step to a scan was not driven by two wheels, metres.
const SIDEWAYS: f64 = 2e-3;
/// Least time between two records, seconds.
const SHORTEST: f64 = 1e-3;
/// Speed of the faster wheel that gives a step its least time, m/s. The robots of the public logs drive at less than 1 m/s; a step is shorter
/// than its travel needs, if stamps that go back are averaged.
const FAST: f64 = 2.5;
/// The same of every step of a log without time, m/s: the mean of the public logs that have one is 0.3 to 0.6 m/s.
const USUAL: f64 = 0.5;
/// A stamp that goes back by more than this is wrong, seconds. Up to 1.9 s were seen in public logs.
const LATE: f64 = 3.0;
/// Difference of two times that is rounding, seconds.
const SAME_TIME: f64 = 1e-9;

/// What shows that a log is of this kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recognised {
    /// Scans with a correction and a re-anchor.
    pub agreeing: usize,
    /// Scans whose pose is not that of the record before.
    pub displaced: usize,
}

impl std::fmt::Display for Recognised {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { agreeing, displaced } = self;
        write!(
            f,
            "recognised: the odometry continues from the corrected pose of each scan ({agreeing} of {displaced} scans): the steps \
             to the scans are corrections, no travel"
        )
    }
}

/// Whether more than half of the scans whose pose is not that of the record before are corrections with a re-anchor. The samples are in
/// the order of the file.
pub fn recognise(samples: &[Sample]) -> Option<Recognised> {
    let mut found = Recognised { agreeing: 0, displaced: 0 };
    for window in samples.windows(3) {
        let [before, scan, after] = window else { continue };
        if scan.source == Source::Scan && scan.pose != before.pose {
            found.displaced += 1;
            found.agreeing += usize::from(is_corrected(before, scan, after));
        }
    }
    (2 * found.agreeing > found.displaced).then_some(found)
}

/// Whether the record after a scan repeats its pose, and the step to the scan is no travel: without time, or sideways. A raw log with the same
/// pose in a scan and the record after it has neither.
fn is_corrected(before: &Sample, scan: &Sample, after: &Sample) -> bool {
    let repeats = after.source == Source::Odometry && after.pose == scan.pose;
    let no_time = scan.time <= before.time || after.time < scan.time;
    repeats && (no_time || Step::between(before, scan).sideways.abs() > SIDEWAYS)
}

/// A message of the chain: a scan, or a record that is no re-anchor.
struct Link {
    sample: Sample,
    /// Its stamp in the log.
    stamp: f64,
}

/// The wheel travel along the chain. Writes the time of each scan into `scans`, which are in the order of the file. A step that needs more
/// time than its stamps have gets it.
///
/// # Errors
/// What is wrong, if most scans have no record of the odometry since the scan before.
pub fn trail<'a>(
    samples: &[Sample],
    mut scans: impl Iterator<Item = &'a mut f64>,
    converted: &mut Converted,
    report: &mut dyn FnMut(u64, &str),
) -> Result<Trail, String> {
    let mut links = links(samples, converted);
    has_odometry(&links)?;
    let missing = NoTime::of(links.iter().map(|link| &link.sample));
    let is_timed = missing.is_none();
    if let Some(missing) = missing {
        let line = links.first().map_or(0, |link| link.sample.line);
        report(
            line,
            &format!("{missing}; its times are those of a drive at {USUAL} metres per second"),
        );
        for link in &mut links {
            link.sample.time = 0.0;
        }
    } else {
        ascend(&mut links, report);
    }
    let mut chain = Chain { is_timed, ..Chain::default() };
    for Link { sample, stamp } in links {
        let time = match sample.source {
            Source::Odometry => chain.record(&sample, converted, report),
            Source::Scan => chain.scan(&sample),
        };
        if sample.source == Source::Scan
            && let Some(of_scan) = scans.next()
        {
            *of_scan = time;
        }
        converted.restamped += u64::from((time - stamp).abs() > SAME_TIME);
    }
    Ok(Trail { records: chain.records, scans_are_corrected: true })
}

/// Whether most scans follow a record of the odometry.
fn has_odometry(links: &[Link]) -> Result<(), String> {
    let count = |before: Source| {
        let sources = links.iter().map(|link| link.sample.source);
        let pairs = sources.clone().zip(sources.skip(1));
        pairs.filter(|pair| *pair == (before, Source::Scan)).count()
    };
    let [with, without] = [Source::Odometry, Source::Scan].map(count);
    if with >= without {
        return Ok(());
    }
    Err(format!(
        "{without} of its {} scans have no ODOM record since the scan before: the wheel travel cannot be recovered",
        with + without
    ))
}

/// The chain of poses so far.
#[derive(Default)]
struct Chain {
    /// Whether the stamps are times; without, the travel tells the time.
    is_timed: bool,
    records: Vec<Record>,
    /// The pose from which the next record is reached.
    from: Option<Sample>,
    wheels: [f64; 2],
    /// Of the step before, m/s.
    speeds: [f64; 2],
}

impl Chain {
    /// Takes the correction; returns the time of the scan: that of the record before it, since which there is no travel.
    fn scan(&mut self, scan: &Sample) -> f64 {
        let time = self.records.last().map_or(scan.time, |last| last.time);
        if self.records.is_empty() {
            self.records.push(Record { time, wheels: self.wheels });
        }
        self.from = Some(*scan);
        time
    }

    /// Takes the travel to a record; returns the record's time.
    fn record(
        &mut self,
        to: &Sample,
        converted: &mut Converted,
        report: &mut dyn FnMut(u64, &str),
    ) -> f64 {
        let before = (self.from.replace(*to), self.records.last().copied());
        let (Some(from), Some(last)) = before else {
            self.records.push(Record { time: to.time, wheels: self.wheels });
            return to.time;
        };
        let mut step = Step::between(&from, to);
        step.seconds = if self.is_timed { to.time - last.time } else { step.needs(USUAL) };
        let (travel, time) = if step.needs(MAX_SPEED) > step.seconds.max(0.0) + JITTER {
            converted.bridged += 1;
            report(to.line, &step.implausible());
            let seconds = step.seconds.max(SHORTEST);
            (self.speeds.map(|speed| speed * seconds), last.time + seconds)
        } else {
            let seconds = step.seconds.max(step.needs(FAST)).max(SHORTEST);
            self.speeds = step.travel.map(|travel| travel / seconds);
            (step.travel, last.time + seconds)
        };
        for (sum, travel) in self.wheels.iter_mut().zip(travel) {
            *sum += travel;
        }
        self.records.push(Record { time, wheels: self.wheels });
        time
    }
}

/// The chain in the order of the file.
fn links(samples: &[Sample], converted: &mut Converted) -> Vec<Link> {
    let mut links: Vec<Link> = Vec::new();
    let mut anchor = None;
    for &sample in samples {
        let is_anchor = sample.source == Source::Odometry && anchor == Some(sample.pose);
        anchor = (sample.source == Source::Scan).then_some(sample.pose);
        if is_anchor {
            converted.repeated += 1;
            continue;
        }
        links.push(Link { sample, stamp: sample.time });
    }
    links
}

/// Makes the times of the chain ascend: those that go back get the closest ascending sequence.
fn ascend(links: &mut [Link], report: &mut dyn FnMut(u64, &str)) {
    let mut latest = f64::NEG_INFINITY;
    for Link { sample, .. } in links.iter_mut() {
        if sample.time < latest - LATE {
            report(sample.line, "goes back in time: it gets the latest stamp before it");
            sample.time = latest;
        }
        latest = latest.max(sample.time);
    }
    stamps::repair(links.iter_mut().map(|link| &mut link.sample.time));
}
