//! The calibration of a recording whose start is unknown: it begins where the search for the pose has found one.
//!
//! The search has the constants of the robot file, which may be wrong: it finds the right pose among others, and not always as the best
//! one. Each pose that it finds is therefore tried, and the calibration with the highest likelihood counts.

use nalgebra::Vector3;
use sonarfix::config::RangerId;
use sonarfix_replay::find::Find;
use sonarfix_replay::log::Record;

use crate::calibrate::{ASIDE, calibrate, loss};
use crate::calibration::{CalibrateError, Calibration, Nominal};
use crate::odometry::wrap;
use crate::recording::{Recording, StartPose};
use crate::wall::Wall;

/// Times from the beginning of the recording in which the pose is searched, seconds, until one leads to a calibration.
const SEARCHED: [f64; 3] = [20.0, 40.0, 90.0];
/// Bearings of the servo's zero that the search assumes, radians.
const BEARINGS: [f64; 3] = [0.0, ASIDE, -ASIDE];
/// Standard deviations of a pose that was found with wrong constants, at least: metres and radians.
const DEVIATIONS: [f64; 2] = [0.1, 0.1];
/// Differences below which two poses are one: metres and radians.
const SAME: [f64; 2] = [0.3, 0.3];
/// Distance over which the poses are compared, metres.
const COMPARED: f64 = 6.0;
/// How many of the best poses the whole recording is calibrated from.
const TRIED: usize = 2;

/// A pose that the search has found.
#[derive(Debug, Clone, Copy)]
struct Found {
    start: StartPose,
    /// The bearing of the servo's zero with which it was found, radians.
    bearing: f64,
}

/// Estimates the calibration from the poses that the search finds.
///
/// # Errors
/// [`CalibrateError`]: the last one, if no pose leads to a calibration.
pub fn calibrate_from_search(
    recording: &Recording,
    walls: &[Wall],
    nominal: &Nominal,
    find: &Find,
) -> Result<Calibration, CalibrateError> {
    recording.check()?;
    if walls.is_empty() || recording.pings.iter().all(|ping| ping.range.is_none()) {
        return Err(CalibrateError::NothingMeasured);
    }
    let mut error = CalibrateError::NoPose;
    for seconds in SEARCHED {
        for found in compared(recording, walls, nominal, found(recording, find, seconds)) {
            let begun = Recording { start: Some(found.start), ..recording.clone() };
            match calibrate(&begun, walls, nominal) {
                Ok(calibration) => return Ok(calibration),
                Err(failed) => error = failed,
            }
        }
    }
    Err(error)
}

/// The poses that explain the next metres best.
fn compared(
    recording: &Recording,
    walls: &[Wall],
    nominal: &Nominal,
    found: Vec<Found>,
) -> Vec<Found> {
    let loss = |found: &Found| {
        let mut part = recording.after(found.start.time);
        part.cut(COMPARED);
        part.start = Some(found.start);
        loss(&part, walls, nominal, found.bearing).ok()
    };
    let losses = found.into_iter().filter_map(|found| Some((loss(&found)?, found)));
    let mut losses: Vec<(f64, Found)> = losses.collect();
    losses.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    losses.into_iter().take(TRIED).map(|(_, found)| found).collect()
}

/// The poses at the end of a part of the recording that the search finds in it.
fn found(recording: &Recording, find: &Find, seconds: f64) -> Vec<Found> {
    let Some(first) = recording.readings.first() else { return Vec::new() };
    let end = first.time + seconds;
    let last = recording.readings.iter().rev().find(|reading| reading.time <= end);
    let time = last.map_or(first.time, |reading| reading.time);
    let mut poses: Vec<Found> = Vec::new();
    for bearing in BEARINGS {
        let records = records(recording, time, bearing);
        for hypothesis in find.run_records(records.iter()).hypotheses {
            let pose = Vector3::new(hypothesis.pose.x, hypothesis.pose.y, hypothesis.pose.heading);
            let is_known = poses.iter().any(|found| {
                let apart = found.start.pose - pose;
                apart.xy().norm() < SAME[0] && wrap(apart.z).abs() < SAME[1]
            });
            if !is_known {
                let position = hypothesis.position_deviation.max(DEVIATIONS[0]);
                let heading = hypothesis.heading_deviation.max(DEVIATIONS[1]);
                poses.push(Found { start: StartPose { time, pose, position, heading }, bearing });
            }
        }
    }
    poses
}

/// The recording until a time as a log has it, with bearings from another zero.
fn records(recording: &Recording, until: f64, zero: f64) -> Vec<Record> {
    let travel = recording.readings.iter().map(|reading| {
        let [right, left] = reading.travel;
        Record::Wheels { time: reading.time, right, left }
    });
    let pings = recording.pings.iter().map(|ping| Record::Range {
        time: ping.time,
        bearing: ping.bearing + zero,
        range: ping.range,
        wall: None,
        ranger: RangerId::FIRST,
    });
    let mut records: Vec<Record> =
        travel.chain(pings).filter(|record| record.time() <= until).collect();
    // A ping comes before the reading of its time, which ends the step to it.
    records.sort_by(|one, other| {
        let is_travel = |record: &Record| matches!(record, Record::Wheels { .. });
        one.time().total_cmp(&other.time()).then(is_travel(one).cmp(&is_travel(other)))
    });
    records
}
