//! Logs of the Carnegie Mellon Robot Navigation Toolkit, CARMEN, and a shorter form of them.
//!
//! CARMEN (<https://carmen.sourceforge.net/logger_playback.html>) has one message per line, each
//! ending in `ipc_timestamp hostname logger_timestamp`:
//! - `ODOM x y theta tv rv accel`
//! - `FLASER n r1 … rn x y theta odom_x odom_y odom_theta`
//! - `ROBOTLASER1 type start_angle field_of_view resolution max_range accuracy remission_mode
//!   n r1 … rn m e1 … em laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv
//!   forward_safety side_safety turn_axis`
//!
//! The short form: `O t x y theta` is odometry; `S t ox oy otheta x y theta n r1 … rn` a scan with
//! the raw odometry and the corrected pose. Other lines are ignored. A file whose name ends in `.gz`
//! is unpacked.
//!
//! **Wheels.** These logs have odometry poses, no wheel travel. The travel between two poses is
//! computed from the turn, the distance along the mean heading and [`TRACK_WIDTH`]. With any track
//! width the odometry of the localizer reproduces the same poses. The estimated scale errors and
//! track width are those of this virtual robot. `odometry` decides which poses are odometry, and which
//! of their steps are plausible.
//!
//! **Reference.** In a corrected log the pose of the scanner is the result of SLAM and becomes the
//! reference. In a raw log it is the odometry, displaced to the scanner: if the displacement is
//! constant, it becomes the mount of the scanner, and there is no reference.
//!
//! **Stamps.** Messages are put in the order of their stamps. A stamp that is earlier than that of the message before it from the
//! same device, by up to `stamps::JITTER`, is repaired; a message that goes back farther is left out. A log whose odometry continues from
//! the corrected poses of its scans is read in the order of its lines (`corrected`).

mod corrected;
mod message;
mod no_time;
mod odometry;
pub(super) mod robot;
mod stamps;

use std::path::Path;

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use crate::convert::{
    ConvertError, Converted, Log, ReferenceFile, make_dir, open, read_walls, write_map,
};
use crate::lines::Lines;
use crate::log::Malformed;
use crate::scan::Scan;
use message::Message;
use no_time::NoTime;
use odometry::{Sample, Source, Trail};

pub use odometry::TRACK_WIDTH;

/// Deviations of the initial estimate, metres and radians: the accuracy of SLAM in the map frame.
const START_SIGMA: [f64; 2] = [0.05, 0.03];

/// A scanner displaced by less than this is fixed to the robot, metres and radians: numbers in these
/// files have six digits.
const FIXED: f64 = 2e-3;

/// Whether a file is a CARMEN log, by the first thousand lines.
///
/// # Errors
/// [`ConvertError`], if it cannot be read.
pub fn is_log(path: &Path) -> Result<bool, ConvertError> {
    let mut lines = Lines::of(open(path)?);
    while lines.number() < 1_000 {
        match lines.next().map_err(ConvertError::read(path))? {
            None => break,
            Some(Ok(line)) if matches!(message::parse(line), Some(message) if message != Message::Other) =>
            {
                return Ok(true);
            }
            Some(_) => {}
        }
    }
    Ok(false)
}

/// A conversion.
#[derive(Debug, Clone, Copy)]
pub struct Carmen<'a> {
    /// The log.
    pub from: &'a Path,
    /// Walls as CSV, if there are any: x1, y1, x2, y2 in metres.
    pub walls: Option<&'a Path>,
    /// The folder to write.
    pub to: &'a Path,
}

/// Most ranges and poses of a log, which are all in memory: fifty times those of the largest public logs.
const MOST_NUMBERS: usize = 16 << 20;

/// Numbers of a pose with its time and place in the log, and of a complaint.
const POSE: usize = 8;

/// A scan with the pose of its scanner.
struct Scanned {
    line: u64,
    time: f64,
    laser: Pose,
    robot: Pose,
    scan: Scan,
}

/// Why a line is left out.
#[derive(Debug, thiserror::Error)]
enum Complaint {
    #[error(transparent)]
    Malformed(#[from] Malformed),
    #[error("{0}")]
    Message(&'static str),
}

/// What the log contains.
#[derive(Default)]
struct Content {
    samples: Vec<Sample>,
    scans: Vec<Scanned>,
    /// What is left out: lines with the reasons.
    complaints: Vec<(u64, Complaint)>,
    /// Those of ranges and poses.
    numbers: usize,
}

impl Carmen<'_> {
    /// Converts. What is left out or implausible is reported to `report`, line by line, and what was recognised.
    ///
    /// # Errors
    /// [`ConvertError`], if a file is missing, has no scans or no odometry, or cannot be written.
    pub fn convert(&self, report: &mut dyn FnMut(String)) -> Result<Converted, ConvertError> {
        let walls = self.walls.map(|path| read_walls(path, 1.0)).transpose()?;
        let mut converted = Converted::default();
        let name = self.from.display();
        let mut report = |line: u64, what: &str| report(format!("{name} line {line}: {what}"));
        let mut content = self.read()?;
        let trail = self.trail(&mut content, &mut converted, &mut report)?;
        let field_of_view = field_of_view(&content)
            .ok_or_else(|| ConvertError::content(self.from, "has no scans"))?;
        // Scans that contain another pose than the odometry contain the corrected one.
        let mount = if trail.scans_are_corrected { None } else { mount(&content.scans) };
        make_dir(self.to)?;
        write_log(self.to, &trail, &content.scans, &mut converted)?;
        if mount.is_none() {
            converted.reference = write_reference(self.to, &content.scans)?;
        }
        if let Some(walls) = walls {
            write_map(self.to, "Walls as given; furniture is not in them", &walls)?;
        }
        robot::write(self.to, mount.unwrap_or([0.0, 0.0]), field_of_view)?;
        Ok(converted)
    }

    /// The wheel travel; makes the stamps of the scans ascend.
    fn trail(
        &self,
        content: &mut Content,
        converted: &mut Converted,
        report: &mut dyn FnMut(u64, &str),
    ) -> Result<Trail, ConvertError> {
        let recognised = corrected::recognise(&content.samples);
        if recognised.is_none() {
            content.leave_out_late();
        }
        content.complaints.sort_by_key(|(line, _)| *line);
        for (line, complaint) in &content.complaints {
            converted.skipped += 1;
            report(*line, &complaint.to_string());
        }
        if let Some(recognised) = recognised {
            let line = content.scans.first().map_or(0, |scan| scan.line);
            report(line, &recognised.to_string());
            let scans = content.scans.iter_mut().map(|scan| &mut scan.time);
            return corrected::trail(&content.samples, scans, converted, report)
                .map_err(|why| ConvertError::content(self.from, why));
        }
        if let Some(missing) = NoTime::of(content.samples.iter()) {
            return Err(ConvertError::content(self.from, missing.to_string()));
        }
        content.in_order_of_time(converted);
        let samples = std::mem::take(&mut content.samples);
        Trail::of(samples, converted, report).map_err(|why| ConvertError::content(self.from, why))
    }

    /// Reads all messages, in the order of the file.
    fn read(&self) -> Result<Content, ConvertError> {
        let mut lines = Lines::of(open(self.from)?);
        let mut content = Content::default();
        while let Some(line) = lines.next().map_err(ConvertError::read(self.from))? {
            let message = match line {
                Err(malformed) => Err(malformed.into()),
                Ok(line) => {
                    message::parse(line).ok_or(Complaint::Message("is no complete message"))
                }
            };
            match message {
                Ok(message) => content.take(lines.number(), message),
                Err(complaint) => {
                    content.numbers += POSE;
                    content.complaints.push((lines.number(), complaint));
                }
            }
            if content.numbers > MOST_NUMBERS {
                let why = format!("has more than {MOST_NUMBERS} ranges: split it");
                return Err(ConvertError::content(self.from, why));
            }
        }
        Ok(content)
    }
}

impl Content {
    fn take(&mut self, line: u64, message: Message) {
        match message {
            Message::Other => {}
            Message::Odometry { time, robot } => {
                self.numbers += POSE;
                self.samples.push(Sample { line, time, pose: robot, source: Source::Odometry });
            }
            Message::Laser { time, robot, laser, scan } => {
                self.numbers += POSE + scan.ranges.len();
                self.samples.push(Sample { line, time, pose: robot, source: Source::Scan });
                self.scans.push(Scanned { line, time, laser, robot, scan });
            }
        }
    }

    /// Leaves out messages that go back in time by more than jitter, of each device.
    fn leave_out_late(&mut self) {
        let Self { samples, scans, complaints, .. } = self;
        let mut clocks = [stamps::Clock::default(); 2];
        samples.retain(|sample| {
            let [odometry, laser] = &mut clocks;
            let clock = if sample.source == Source::Odometry { odometry } else { laser };
            let checked = clock.check(sample.time).map_err(Complaint::Message);
            checked.map_err(|complaint| complaints.push((sample.line, complaint))).is_ok()
        });
        let mut laser = stamps::Clock::default();
        scans.retain(|scan| laser.check(scan.time).is_ok());
    }

    /// Repairs the stamps of each device, and puts everything in their order.
    fn in_order_of_time(&mut self, converted: &mut Converted) {
        let scans = self.scans.iter_mut().map(|scan| &mut scan.time);
        converted.restamped += stamps::repair(scans);
        for source in [Source::Odometry, Source::Scan] {
            let samples = self.samples.iter_mut().filter(|sample| sample.source == source);
            let repaired = stamps::repair(samples.map(|sample| &mut sample.time));
            if source == Source::Odometry {
                converted.restamped += repaired;
            }
        }
        // Stable: of an odometry record and a scan at the same time the earlier line is first.
        self.samples.sort_by(|one, other| one.time.total_cmp(&other.time));
    }
}

/// Bearings of the first and the last beam of the last scan.
fn field_of_view(content: &Content) -> Option<[f64; 2]> {
    Some(content.scans.last()?.scan.field_of_view())
}

fn write_log(
    dir: &Path,
    trail: &Trail,
    scans: &[Scanned],
    converted: &mut Converted,
) -> Result<(), ConvertError> {
    let mut log = Log::create(dir)?;
    log.comment("converted from a CARMEN log; wheel travel from odometry poses,")?;
    log.comment(&format!("track width assumed: {TRACK_WIDTH} m"))?;
    let mut scans = scans.iter().peekable();
    let mut started = false;
    for record in &trail.records {
        // A scan at the time of a record follows it.
        while let Some(scan) = scans.next_if(|scan| scan.time < record.time) {
            write_scan(&mut log, scan, &mut started)?;
            converted.scans += 1;
        }
        if let Some(scan) = scans.peek().filter(|scan| scan.time <= record.time && !started) {
            log.start(scan.time, &scan.laser, START_SIGMA)?;
            started = true;
        }
        log.wheels(record.time, record.wheels)?;
        converted.encoders += 1;
    }
    for scan in scans {
        write_scan(&mut log, scan, &mut started)?;
        converted.scans += 1;
    }
    log.0.close()
}

fn write_scan(log: &mut Log, scan: &Scanned, started: &mut bool) -> Result<(), ConvertError> {
    if !*started {
        log.start(scan.time, &scan.laser, START_SIGMA)?;
        *started = true;
    }
    log.scan(scan.time, &scan.scan)
}

fn write_reference(dir: &Path, scans: &[Scanned]) -> Result<u64, ConvertError> {
    let mut reference = ReferenceFile::create(dir)?;
    for scan in scans {
        reference.row(scan.time, &scan.laser)?;
    }
    reference.0.close()?;
    Ok(scans.len() as u64)
}

/// The mounting position of the scanner, ahead and left, if it is the same in all scans.
fn mount(scans: &[Scanned]) -> Option<[f64; 2]> {
    let seen = |scan: &Scanned| {
        let (sin, cos) = scan.robot.heading.sin_cos();
        let (dx, dy) = (scan.laser.x - scan.robot.x, scan.laser.y - scan.robot.y);
        let turned = angle::wrap(scan.laser.heading - scan.robot.heading);
        [cos * dx + sin * dy, cos * dy - sin * dx, turned]
    };
    let first = scans.first().map(seen)?;
    let (mut lowest, mut highest) = (first, first);
    for seen in scans.iter().map(seen) {
        for ((lowest, highest), seen) in lowest.iter_mut().zip(&mut highest).zip(seen) {
            *lowest = lowest.min(seen);
            *highest = highest.max(seen);
        }
    }
    let fixed = lowest.iter().zip(highest).all(|(low, high)| high - low < FIXED);
    let middle = |low: f64, high: f64| f64::midpoint(low, high);
    let ([ahead, left, _], [ahead_high, left_high, _]) = (lowest, highest);
    fixed.then(|| [middle(ahead, ahead_high), middle(left, left_high)])
}
