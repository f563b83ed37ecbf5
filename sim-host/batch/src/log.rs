//! Reads a log and a reference (`docs/formats.md`), and the nominal robot from its file.

use std::io::BufRead;

use nalgebra::Vector3;
use sonarfix::geometry::pose::Point;
use sonarfix_hal::config::RobotConfig;
use sonarfix_replay::REFERENCE_HEADER;
use sonarfix_replay::lines::Lines;
use sonarfix_replay::log::{self, HEADER, Record};
use sonarfix_replay::scan::{Cone, Scan};

use sonarfix::config::{PingSchedule, RangerId};
use sonarfix::geometry::units::Radians;

use crate::calibration::Nominal;
use crate::odometry::WheelNoise;
use crate::problem::Noise;
use crate::recording::{Ping, Reading, Recording, ReferencePose, StartPose};

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// Not readable.
    #[error("the file cannot be read: {0}")]
    Read(#[from] std::io::Error),
    /// Another format.
    #[error("the file must start with the line `{0}`")]
    Header(&'static str),
    /// A row of the reference.
    #[error("line {0} of the reference is not time, x, y, heading")]
    Row(usize),
}

/// A log, and what of it was not used.
#[derive(Debug, Clone, Default)]
pub struct Read {
    /// The recording.
    pub recording: Recording,
    /// Lines that were skipped: number and reason.
    pub skipped: Vec<(u64, String)>,
    /// Whether the ranges are cut from scans.
    pub has_scans: bool,
}

/// Standard deviations of a reference pose at first; they are estimated.
const REFERENCE: [f64; 2] = [0.005, 0.01];

/// The robot of a file as the estimator takes it.
#[must_use]
pub fn nominal(robot: &RobotConfig, has_servo: bool) -> Nominal {
    let (drive, sonar) = (&robot.localizer.drive, &robot.localizer.rangers.first);
    let Point { x, y } = sonar.mount;
    let [position, heading] = REFERENCE;
    Nominal {
        track_width: drive.track_width.0.into(),
        mount: [x.0.into(), y.0.into()],
        reach: [sonar.min_range.0.into(), sonar.max_range.0.into()],
        sure_within: robot.localizer.echo.sure_within.0.into(),
        noise: Noise {
            wheel: WheelNoise::independent(f64::from(drive.wheel_noise.0.0).max(1e-4)),
            range: f64::from(sonar.noise.floor.0).max(1e-4),
            range_per_metre: sonar.noise.per_metre.into(),
            position,
            heading,
        },
        has_servo,
    }
}

/// Reads a log.
///
/// # Errors
/// [`ReadError`]; malformed lines are skipped and reported.
pub fn read(reader: impl BufRead, robot: &RobotConfig) -> Result<Read, ReadError> {
    let mut reading =
        LogReader { robot, read: Read::default(), suspect: None, next_scan: 0.0, shift: [0.0; 2] };
    let mut lines = Lines::of(reader);
    if !matches!(lines.next()?, Some(Ok(first)) if first.trim() == HEADER) {
        return Err(ReadError::Header(HEADER));
    }
    while let Some(line) = lines.next()? {
        let taken = line.and_then(log::parse).map_err(|malformed| malformed.to_string());
        if let Err(reason) = taken.and_then(|record| record.map_or(Ok(()), |r| reading.take(r))) {
            reading.read.skipped.push((lines.number(), reason));
        }
    }
    Ok(reading.read)
}

/// Reads the rows of a reference.
///
/// # Errors
/// [`ReadError`], with the number of the line.
pub fn read_reference(reader: impl BufRead) -> Result<Vec<ReferencePose>, ReadError> {
    let mut rows: Vec<ReferencePose> = Vec::new();
    for (number, line) in (1..).zip(reader.lines()) {
        let line = line?;
        if number == 1 {
            if line.trim() != REFERENCE_HEADER {
                return Err(ReadError::Header(REFERENCE_HEADER));
            }
            continue;
        }
        if line.trim().is_empty() {
            continue;
        }
        let fields: Result<Vec<f64>, _> =
            line.split(',').map(|field| field.trim().parse()).collect();
        let fields = fields.map_err(|_| ReadError::Row(number))?;
        let &[time, x, y, heading] = fields.as_slice() else { return Err(ReadError::Row(number)) };
        let is_later = rows.last().is_none_or(|last| time > last.time);
        if is_later && [time, x, y, heading].iter().all(|value| value.is_finite()) {
            rows.push(ReferencePose { time, pose: Vector3::new(x, y, heading) });
        }
    }
    Ok(rows)
}

struct LogReader<'a> {
    robot: &'a RobotConfig,
    read: Read,
    /// An encoder record that is implausibly far from the one before it.
    suspect: Option<Reading>,
    /// Time from which the next scan is used, seconds.
    next_scan: f64,
    /// Correction of the counts after a jump, metres.
    shift: [f64; 2],
}

impl LogReader<'_> {
    fn take(&mut self, record: Record) -> Result<(), String> {
        match record {
            Record::Ticks { time, right, left } => {
                #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
                let [right, left] = [right as f64, left as f64];
                let travel =
                    |wheel: &sonarfix_hal::config::WheelConfig| f64::from(wheel.signed_travel().0);
                let (of_right, of_left) =
                    (travel(&self.robot.right_wheel), travel(&self.robot.left_wheel));
                self.reading(Reading { time, travel: [right * of_right, left * of_left] })
            }
            Record::Wheels { time, right, left } => {
                self.reading(Reading { time, travel: [right, left] })
            }
            Record::Range { time, bearing, range, ranger: RangerId::FIRST, .. } => {
                self.ping(Ping { time, bearing, range });
                Ok(())
            }
            Record::Scan { time, scan } => {
                self.scan(time, &scan);
                Ok(())
            }
            Record::Start { time, pose, position_deviation, heading_deviation } => {
                let (position, heading) = (position_deviation, heading_deviation);
                let pose = Vector3::new(pose.x, pose.y, pose.heading);
                self.start(StartPose { time, pose, position, heading })
            }
            Record::Resume { time, state, deviation } => {
                let [x, y, heading, ..] = state;
                let [dx, dy, spread, ..] = deviation;
                let pose = Vector3::new(x, y, heading);
                self.start(StartPose { time, pose, position: dx.max(dy), heading: spread })
            }
            // Those of further rangers are left out: the constants are those of the first.
            Record::Range { .. }
            | Record::Skip { .. }
            | Record::Turn { .. }
            | Record::Absolute { .. }
            | Record::Pose { .. }
            | Record::Mode { .. } => Ok(()),
        }
    }

    fn start(&mut self, start: StartPose) -> Result<(), String> {
        if self.read.recording.start.is_some() {
            return Err("the log has a start record already".to_owned());
        }
        self.read.recording.start = Some(start);
        Ok(())
    }

    /// An encoder record. As in a replay, one that is too far from the last is skipped, unless the next agrees with it:
    /// then the counters have jumped.
    fn reading(&mut self, mut reading: Reading) -> Result<(), String> {
        let shifted = |travel: [f64; 2], by: [f64; 2]| {
            let ([right, left], [by_right, by_left]) = (travel, by);
            [right + by_right, left + by_left]
        };
        reading.travel = shifted(reading.travel, self.shift);
        let readings = &mut self.read.recording.readings;
        let Some(last) = readings.last().copied() else {
            readings.push(reading);
            return Ok(());
        };
        if reading.time <= last.time {
            return Err("the time is not later than that of the encoder record before".to_owned());
        }
        let fastest = f64::from(self.robot.localizer.max_wheel_speed.0);
        if speed(&last, &reading) <= fastest {
            self.suspect = None;
            readings.push(reading);
            return Ok(());
        }
        let suspect = self.suspect.replace(reading);
        match suspect.filter(|s| s.time < reading.time && speed(s, &reading) <= fastest) {
            None => Err("a wheel rolled faster than max_wheel_speed".to_owned()),
            Some(suspect) => {
                // The travel in the gap is that of constant speeds after it.
                let [right, left] = suspect.travel;
                let [last_right, last_left] = last.travel;
                let share = (suspect.time - last.time) / (reading.time - suspect.time);
                let [now_right, now_left] = reading.travel;
                let by = [
                    last_right - right + (now_right - right) * share,
                    last_left - left + (now_left - left) * share,
                ];
                readings.push(Reading { time: suspect.time, travel: shifted(suspect.travel, by) });
                readings.push(Reading { time: reading.time, travel: shifted(reading.travel, by) });
                self.shift = shifted(self.shift, by);
                self.suspect = None;
                Ok(())
            }
        }
    }

    /// Pings in order of time; encoder records of the same time may come later.
    fn ping(&mut self, ping: Ping) {
        let pings = &mut self.read.recording.pings;
        let at = pings.partition_point(|other| other.time <= ping.time);
        pings.insert(at, ping);
    }

    /// The pings of a sonar that sweeps over the scan, once per fix period.
    fn scan(&mut self, time: f64, scan: &Scan) {
        self.read.has_scans = true;
        if time < self.next_scan {
            return;
        }
        let sonar = &self.robot.localizer.rangers.first;
        let period = match sonar.timing.schedule {
            PingSchedule::Every(period) => period,
            PingSchedule::AsFastAsPossible => sonar.timing.cycle,
        };
        #[expect(clippy::cast_precision_loss, reason = "some seconds in µs")]
        let period = period.to_micros() as f64 * 1e-6;
        self.next_scan = time + period - 1e-6;
        let (rightmost, leftmost) = (sonar.servo.0.0, sonar.servo.1.0);
        let step = 2.0 * sonar.cone.0.max(0.02);
        let mut bearing = rightmost;
        while bearing <= leftmost {
            let range = scan.specular(&Cone::of(sonar, Radians(bearing)));
            self.ping(Ping { time, bearing: bearing.into(), range });
            bearing += step;
        }
    }
}

/// The speed of the faster wheel, m/s.
fn speed(one: &Reading, next: &Reading) -> f64 {
    let ([r0, l0], [r1, l1]) = (one.travel, next.travel);
    (r1 - r0).abs().max((l1 - l0).abs()) / (next.time - one.time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_map::Scenario;
    use std::path::Path;

    fn robot() -> RobotConfig {
        Scenario::parse(sonarfix_map::CLASSROOM, "classroom.toml", Path::new("")).unwrap().robot
    }

    #[test]
    fn damaged_lines_are_skipped_and_jumps_of_the_counters_bridged() {
        let log = "sonarfix-log,1\nstart,0,1,2,0.5,0.01,0.02\nticks,0,0,0\nticks,1,100,100\nnonsense\n\
                   ticks,1,100,100\nrange,1.5,0.2,1.25\nticks,2,90000,90000\nticks,3,90100,90100\nticks,4,9";
        let read = read(log.as_bytes(), &robot()).unwrap();
        let skipped: Vec<u64> = read.skipped.iter().map(|(line, _)| *line).collect();
        assert_eq!(skipped, [5, 6, 8, 10]);
        let travel: Vec<f64> =
            read.recording.readings.iter().map(|r| r.travel[0] / 0.4887e-3).collect();
        for (got, counts) in travel.iter().zip([0.0, 100.0, 200.0, 300.0]) {
            assert!((got - counts).abs() < 1e-3, "{travel:?}");
        }
        assert_eq!(read.recording.pings.len(), 1);
        assert!(read.recording.start.is_some());
    }

    #[test]
    fn another_file_is_refused() {
        assert!(matches!(read("x,1\n".as_bytes(), &robot()), Err(ReadError::Header(_))));
        assert!(matches!(read_reference("x\n".as_bytes()), Err(ReadError::Header(_))));
        let rows = format!("{REFERENCE_HEADER}\n1,2,3\n");
        assert!(matches!(read_reference(rows.as_bytes()), Err(ReadError::Row(2))));
    }
}
