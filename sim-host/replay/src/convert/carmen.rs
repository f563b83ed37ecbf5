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
//! track width are those of this virtual robot.
//!
//! **Reference.** In a corrected log the pose of the scanner is the result of SLAM and becomes the
//! reference. In a raw log it is the odometry, displaced to the scanner: if the displacement is
//! constant, it becomes the mount of the scanner, and there is no reference.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use crate::convert::robot_file::{self, Value};
use crate::convert::{
    ConvertError, Converted, Log, ReferenceFile, make_dir, read_walls, write_map,
};
use crate::lines::Lines;
use crate::scan::Scan;

/// Assumed track width, metres: that of a Pioneer, the robot of most of these logs.
pub const TRACK_WIDTH: f64 = 0.38;

/// Deviations of the initial estimate, metres and radians: the accuracy of SLAM in the map frame.
const START_SIGMA: [f64; 2] = [0.05, 0.03];

/// A scanner displaced by less than this is fixed to the robot, metres and radians: numbers in these
/// files have six digits.
const FIXED: f64 = 2e-3;

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

/// A line of the log.
#[derive(Debug, Clone, PartialEq)]
enum Message {
    Odometry { time: f64, robot: Pose },
    Laser { time: f64, robot: Pose, laser: Pose, scan: Scan },
    Other,
}

impl Carmen<'_> {
    /// Converts line by line. Skipped lines are reported to `report`.
    ///
    /// # Errors
    /// [`ConvertError`], if a file is missing, has no scans or cannot be written.
    pub fn convert(&self, report: &mut dyn FnMut(String)) -> Result<Converted, ConvertError> {
        let walls = self.walls.map(|path| read_walls(path, 1.0)).transpose()?;
        let mut lines = Lines::of(open(self.from)?);
        make_dir(self.to)?;
        let mut writer = Writer::create(self.to)?;
        loop {
            let line = lines.next().map_err(ConvertError::read(self.from))?;
            let Some(line) = line else { break };
            let taken = match line {
                Err(malformed) => Err(malformed.to_string()),
                Ok(line) => parse(line).ok_or_else(|| "is no complete message".to_owned()),
            };
            let skipped = match taken {
                Ok(message) => writer.take(&message)?,
                Err(reason) => Some(reason),
            };
            if let Some(reason) = skipped {
                writer.converted.skipped += 1;
                report(format!("{} line {}: {reason}", self.from.display(), lines.number()));
            }
        }
        let field_of_view =
            writer.field_of_view.ok_or_else(|| ConvertError::content(self.from, "has no scans"))?;
        let mount = writer.mount.fixed();
        let converted = writer.close(self.to)?;
        if let Some(walls) = walls {
            write_map(self.to, "Walls as given; furniture is not in them", &walls)?;
        }
        write_robot(self.to, mount.unwrap_or([0.0, 0.0]), field_of_view)?;
        Ok(converted)
    }
}

fn open(path: &Path) -> Result<Box<dyn BufRead>, ConvertError> {
    let file = BufReader::new(File::open(path).map_err(ConvertError::read(path))?);
    let packed = path.extension().is_some_and(|extension| extension == "gz");
    Ok(if packed { Box::new(BufReader::new(MultiGzDecoder::new(file))) } else { Box::new(file) })
}

/// Writes log and reference, message by message.
struct Writer {
    log: Log,
    reference: ReferenceFile,
    converted: Converted,
    /// Time, odometry and wheel travel of the last encoder record.
    last: Option<(f64, Pose)>,
    wheels: [f64; 2],
    started: bool,
    mount: Mount,
    /// Bearings of the first and the last beam.
    field_of_view: Option<[f64; 2]>,
}

impl Writer {
    fn create(dir: &Path) -> Result<Self, ConvertError> {
        let mut log = Log::create(dir)?;
        log.comment("converted from a CARMEN log; wheel travel from odometry poses,")?;
        log.comment(&format!("track width assumed: {TRACK_WIDTH} m"))?;
        Ok(Self {
            log,
            reference: ReferenceFile::create(dir)?,
            converted: Converted::default(),
            last: None,
            wheels: [0.0, 0.0],
            started: false,
            mount: Mount::default(),
            field_of_view: None,
        })
    }

    /// Writes a message; returns the reason if it is skipped.
    fn take(&mut self, message: &Message) -> Result<Option<String>, ConvertError> {
        let (time, robot) = match message {
            Message::Odometry { time, robot } | Message::Laser { time, robot, .. } => {
                (*time, robot)
            }
            Message::Other => return Ok(None),
        };
        if self.last.is_some_and(|(last, _)| time < last) {
            return Ok(Some("goes back in time".to_owned()));
        }
        if let Message::Laser { laser, .. } = message
            && !self.started
        {
            self.started = true;
            self.log.start(time, laser, START_SIGMA)?;
        }
        self.roll(time, robot)?;
        if let Message::Laser { robot, laser, scan, .. } = message {
            self.log.scan(time, scan)?;
            self.reference.row(time, laser)?;
            self.converted.scans += 1;
            self.converted.reference += 1;
            self.mount.see(robot, laser);
            let last = (1..scan.ranges.len()).fold(scan.first, |bearing, _| bearing + scan.step);
            self.field_of_view = Some([scan.first, last]);
        }
        Ok(None)
    }

    /// Writes the wheel travel up to an odometry pose.
    fn roll(&mut self, time: f64, pose: &Pose) -> Result<(), ConvertError> {
        match self.last {
            // A scan has an odometry pose of its own time, often already written.
            Some((last, _)) if time <= last => {
                self.converted.repeated += 1;
                return Ok(());
            }
            Some((_, from)) => {
                let [right, left] = travel(&from, pose);
                self.wheels[0] += right;
                self.wheels[1] += left;
            }
            None => {}
        }
        self.last = Some((time, *pose));
        self.converted.encoders += 1;
        self.log.wheels(time, self.wheels)
    }

    fn close(mut self, dir: &Path) -> Result<Converted, ConvertError> {
        self.log.0.close()?;
        let path = self.reference.0.path.clone();
        self.reference.0.close()?;
        if self.mount.fixed().is_some() {
            std::fs::remove_file(&path).map_err(ConvertError::write(dir))?;
            self.converted.reference = 0;
        }
        Ok(self.converted)
    }
}

/// Travel of the right and the left wheel between two poses.
fn travel(from: &Pose, to: &Pose) -> [f64; 2] {
    let turn = angle::wrap(to.heading - from.heading);
    let (sin, cos) = (from.heading + turn / 2.0).sin_cos();
    let advance = cos * (to.x - from.x) + sin * (to.y - from.y);
    let half = turn * TRACK_WIDTH / 2.0;
    [advance + half, advance - half]
}

/// The mounting position of the scanner, and whether it is constant.
#[derive(Debug, Clone, Copy, Default)]
struct Mount {
    lowest: Option<[f64; 3]>,
    highest: [f64; 3],
}

impl Mount {
    fn see(&mut self, robot: &Pose, laser: &Pose) {
        let (sin, cos) = robot.heading.sin_cos();
        let (dx, dy) = (laser.x - robot.x, laser.y - robot.y);
        let turned = angle::wrap(laser.heading - robot.heading);
        let seen = [cos * dx + sin * dy, cos * dy - sin * dx, turned];
        let Some(lowest) = &mut self.lowest else {
            (self.lowest, self.highest) = (Some(seen), seen);
            return;
        };
        for ((lowest, highest), seen) in lowest.iter_mut().zip(&mut self.highest).zip(seen) {
            *lowest = lowest.min(seen);
            *highest = highest.max(seen);
        }
    }

    /// The mounting position, ahead and left, if it is constant.
    fn fixed(&self) -> Option<[f64; 2]> {
        let lowest = self.lowest?;
        let fixed = lowest.iter().zip(self.highest).all(|(low, high)| high - low < FIXED);
        let middle = |axis: [f64; 2]| f64::midpoint(axis[0], axis[1]);
        fixed.then(|| [middle([lowest[0], self.highest[0]]), middle([lowest[1], self.highest[1]])])
    }
}

/// Reads a line; `None` if it is a relevant message, but incomplete.
fn parse(line: &str) -> Option<Message> {
    let mut words = Words(line.split_ascii_whitespace());
    let message = match words.0.next().unwrap_or("#") {
        "O" => {
            let time = words.number()?;
            Message::Odometry { time, robot: words.pose()? }
        }
        "S" => {
            let time = words.number()?;
            let (robot, laser) = (words.pose()?, words.pose()?);
            let scan = half_turn(words.ranges()?);
            Message::Laser { time, robot, laser, scan }
        }
        "ODOM" => {
            let robot = words.pose()?;
            words.skip(3)?;
            Message::Odometry { time: words.timestamp()?, robot }
        }
        "FLASER" => {
            let scan = half_turn(words.ranges()?);
            let (laser, robot) = (words.pose()?, words.pose()?);
            Message::Laser { time: words.timestamp()?, robot, laser, scan }
        }
        "ROBOTLASER1" => {
            words.skip(1)?;
            let first = words.number()?;
            words.skip(1)?;
            let step = words.number()?;
            words.skip(3)?;
            let ranges = words.ranges()?;
            let remissions = words.count()?;
            words.skip(remissions)?;
            let (laser, robot) = (words.pose()?, words.pose()?);
            words.skip(5)?;
            let scan = Scan { first, step, ranges };
            Message::Laser { time: words.timestamp()?, robot, laser, scan }
        }
        _ => return Some(Message::Other),
    };
    words.0.next().is_none().then_some(message)
}

/// A scan over the half turn ahead, counter-clockwise: 180 or 360 beams leave out the last one,
/// 181 or 361 have both ends.
fn half_turn(ranges: Vec<f32>) -> Scan {
    #[expect(clippy::cast_precision_loss, reason = "a scan has thousands of beams, not 2^53")]
    let steps = (ranges.len() - ranges.len() % 2) as f64;
    Scan { first: -FRAC_PI_2, step: PI / steps.max(1.0), ranges }
}

struct Words<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Words<'_> {
    fn number(&mut self) -> Option<f64> {
        self.0.next()?.parse().ok().filter(|number: &f64| number.is_finite())
    }

    fn count(&mut self) -> Option<usize> {
        self.0.next()?.parse().ok()
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        (0..count).try_for_each(|_| self.0.next().map(|_| ()))
    }

    fn pose(&mut self) -> Option<Pose> {
        let (x, y, heading) = (self.number()?, self.number()?, self.number()?);
        Some(Pose { x, y, heading: angle::wrap(heading) })
    }

    fn ranges(&mut self) -> Option<Vec<f32>> {
        let count = self.count()?;
        let mut ranges = Vec::new();
        for _ in 0..count {
            let range = self.number()?;
            #[expect(clippy::cast_possible_truncation, reason = "a scanner's millimetres")]
            ranges.push(range.max(0.0) as f32);
        }
        (!ranges.is_empty()).then_some(ranges)
    }

    /// The end of every CARMEN message: time sent, host, time logged.
    fn timestamp(&mut self) -> Option<f64> {
        let sent = self.number()?;
        self.skip(1)?;
        self.number()?;
        Some(sent)
    }
}

fn write_robot(dir: &Path, mount: [f64; 2], field: [f64; 2]) -> Result<(), ConvertError> {
    let [rightmost, leftmost] = field.map(f64::to_degrees);
    let cone = 15.0;
    let servo = format!("[\"{rightmost:.1} deg\", \"{leftmost:.1} deg\"]");
    let mount = format!("[\"{:.3} m\", \"{:.3} m\"]", mount[0], mount[1]);
    let wheel = "{ travel_per_edge = \"1 mm\" }";
    let text = Value::text;
    let tables = vec![
        (
            "drive",
            vec![
                (
                    "track_width",
                    text(
                        &format!("{TRACK_WIDTH} m"),
                        "assumed; the wheels were made from poses with it",
                    ),
                ),
                (
                    "wheel_noise",
                    text("8 mm/sqrt(m)", "hard floors, thresholds and turns in place: 0.5 to 20"),
                ),
                (
                    "scale_walk",
                    text("0.02 %/sqrt(m)", "wheels drift by 0.1 to 0.5 % within a recording"),
                ),
                ("track_width_walk", text("0.1 mm/sqrt(m)", "likewise")),
                ("max_wheel_speed", text("3 m/s", "above what such robots do")),
                ("encoder_period", text("250 ms", "about what such logs have")),
                ("right_wheel", Value(wheel.to_owned(), "made up: the log has no counts")),
                ("left_wheel", Value(wheel.to_owned(), "likewise")),
            ],
        ),
        (
            "sonar",
            [vec![
                ("mount", Value(mount, "where the log has the scanner; 0 in a corrected log")),
                (
                    "servo",
                    Value(
                        servo,
                        "the whole scan: half a cone at its ends, or the walls of a corridor would go unheard",
                    ),
                ),
                ("cone", text(&format!("{cone} deg"), "half of it: a sonar's")),
                ("min_range", text("10 cm", "the scanner's")),
                ("max_range", text("8 m", "a sonar's at its best")),
                ("noise", text("15 mm", "the scanner 10 mm, and its centimetres")),
                ("noise_per_metre", text("5 mm/m", "walls are straight to a few mm a metre")),
                ("fix_period", text("800 ms", "a slow sonar's")),
            ], robot_file::no_servo(rightmost, leftmost).into()].into_iter().flatten().collect(),
        ),
        (
            "prior",
            vec![
                ("scale_right", text("5 %", "odometry of unknown calibration: real ones are wrong by 3 to 5 %")),
                ("scale_left", text("5 %", "likewise")),
                ("track_width", text("20 mm", "likewise")),
                ("range_scale", Value("0.0".to_owned(), "map and scanner share their metre")),
            ],
        ),
        (
            "gating",
            vec![
                (
                    "confidence",
                    Value(
                        "0.5".to_owned(),
                        "deviations; with more, few walls are left in a building",
                    ),
                ),
            ],
        ),
        (
            "echo",
            vec![
                ("free_path", text("7 m", "furniture and people that the map does not have")),
                ("map_accuracy", text("40 mm", "walls fitted to SLAM: a few cm")),
            ],
        ),
        ("schedule", vec![("policy", text("informative", "the default"))]),
    ];
    robot_file::write(dir, "robot.toml", "A robot from a CARMEN log", tables)
}
