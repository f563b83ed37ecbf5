//! A LEGO NXT robot with a laser scanner in an arena, as C. Brenner's SLAM lectures record it:
//! `*_motors.txt` and `*_scan.txt`, with walls and reference poses fitted to them.
//!
//! - `M t … `: time in ms, counts of the left and right wheel in columns 3 and 7, cumulative.
//! - `S t n r1 … rn`: time in ms, ranges in mm, counter-clockwise.
//! - `derived_walls_mm.csv`: the arena's walls. `derived_reference_laserframe.csv`: the pose of
//!   the axle at each scan, from a batch fit of scans, encoders and camera.
//!
//! The file of the overhead camera is not used: it has no heading, a clock, an origin and a scale
//! (13 % off) of its own, and its marker is not at the axle. The fitted reference already includes
//! its data in the frame of the walls.

use std::fs;
use std::path::{Path, PathBuf};

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use crate::convert::robot_file::{self, Value};
use crate::convert::{
    ConvertError, Converted, Log, ReferenceFile, make_dir, read_walls, write_map,
};
use crate::scan::Scan;

/// Offset from the time stamps of the encoders to those of the scans, seconds. A fit of the encoder
/// travel to the reference has its minimum here (heading within ±0.04 rad over eight scans; 0.14 rad
/// without an offset, 0.24 rad with the opposite sign).
pub const ENCODER_LAG: f64 = 0.415;

/// The bearing of beam i is (i − 330) of these steps plus the offset.
const STEP: f64 = 0.006_135_923_151_543;
const OFFSET: f64 = -0.069_813_17;
const MIDDLE: f64 = 330.0;

/// A range below this is an error code of the scanner, mm.
const BAD: f64 = 20.0;

/// Deviations of the initial estimate, metres and radians: the residuals of the reference are
/// 8–11 mm, and a robot can be placed within a degree.
const START_SIGMA: [f64; 2] = [0.01, 0.02];

/// Nominal wheel parameters that a builder might use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nominal {
    /// Fitted to the recording: 0.3255 mm per tick left, 0.3289 right, 170.2 mm.
    Fitted,
    /// Measured with a ruler: 0.327 mm per tick, 170 mm.
    Rounded,
    /// The values of the lectures: 0.349 mm per tick, 150 mm.
    Course,
}

impl Nominal {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Fitted, Self::Rounded, Self::Course];

    fn name(self) -> &'static str {
        match self {
            Self::Fitted => "fitted",
            Self::Rounded => "rounded",
            Self::Course => "course",
        }
    }

    /// Travel per tick of the right and left wheel, and track width, in mm.
    fn millimetres(self) -> [&'static str; 3] {
        match self {
            Self::Fitted => ["0.3289 mm", "0.3255 mm", "170.2 mm"],
            Self::Rounded => ["0.327 mm", "0.327 mm", "170 mm"],
            Self::Course => ["0.349 mm", "0.349 mm", "150 mm"],
        }
    }
}

/// A conversion.
#[derive(Debug, Clone)]
pub struct Lego<'a> {
    /// The folder of the recording.
    pub from: &'a Path,
    /// The folder to write.
    pub to: &'a Path,
    /// The wheel parameters for `robot.toml`.
    pub nominal: Nominal,
    /// See [`ENCODER_LAG`], seconds.
    pub encoder_lag: f64,
}

struct Motors {
    time: f64,
    ticks: [i64; 2],
}

struct TimedScan {
    time: f64,
    scan: Scan,
}

impl Lego<'_> {
    /// Converts. Skipped lines are reported to `report`.
    ///
    /// # Errors
    /// [`ConvertError`], if a file is missing, holds nothing or cannot be written.
    pub fn convert(&self, report: &mut dyn FnMut(String)) -> Result<Converted, ConvertError> {
        let mut converted = Converted::default();
        let mut skip = |path: &Path, line: usize, why: &str, converted: &mut Converted| {
            report(format!("{} line {line}: {why}", path.display()));
            converted.skipped += 1;
        };
        let path = self.find("_motors.txt")?;
        let mut motors: Vec<Motors> = Vec::new();
        for (number, line) in numbered(&read(&path)?) {
            match self.motors(line) {
                Some(row) => match motors.last() {
                    // The encoders were polled again before a new reading.
                    Some(last) if row.time <= last.time => converted.repeated += 1,
                    _ => motors.push(row),
                },
                None => skip(&path, number, "is no `M` record", &mut converted),
            }
        }
        let path = self.find("_scan.txt")?;
        let mut scans: Vec<TimedScan> = Vec::new();
        for (number, line) in numbered(&read(&path)?) {
            match scan(line) {
                Some(row) if scans.last().is_none_or(|last| row.time >= last.time) => {
                    scans.push(row);
                }
                Some(_) => skip(&path, number, "goes back in time", &mut converted),
                None => skip(&path, number, "is no `S` record", &mut converted),
            }
        }
        let path = self.from.join("derived_reference_laserframe.csv");
        let mut reference = Vec::new();
        for (number, line) in numbered(&read(&path)?).skip(1) {
            match reference_row(line) {
                Some(row) => reference.push(row),
                None => skip(&path, number, "is no row of the reference", &mut converted),
            }
        }
        converted.encoders = motors.len() as u64;
        converted.scans = scans.len() as u64;
        converted.reference = reference.len() as u64;
        self.write(&motors, &scans, &reference)?;
        Ok(converted)
    }

    /// The file whose name has this suffix.
    fn find(&self, suffix: &str) -> Result<PathBuf, ConvertError> {
        let entries = fs::read_dir(self.from).map_err(ConvertError::read(self.from))?;
        let mut found: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.to_string_lossy().ends_with(suffix))
            .collect();
        match (found.pop(), found.pop()) {
            (Some(path), None) => Ok(path),
            (Some(_), Some(_)) => {
                Err(ConvertError::content(self.from, format!("has more than one *{suffix}")))
            }
            (None, _) => Err(ConvertError::content(self.from, format!("has no *{suffix}"))),
        }
    }

    fn motors(&self, line: &str) -> Option<Motors> {
        let fields: Vec<&str> = line.split_ascii_whitespace().collect();
        let field = |index: usize| fields.get(index).filter(|_| fields.first() == Some(&"M"));
        let milliseconds: f64 = field(1)?.parse().ok()?;
        Some(Motors {
            time: milliseconds / 1e3 + self.encoder_lag,
            ticks: [field(6)?.parse().ok()?, field(2)?.parse().ok()?],
        })
    }

    fn write(
        &self,
        motors: &[Motors],
        scans: &[TimedScan],
        reference: &[(f64, Pose)],
    ) -> Result<(), ConvertError> {
        let content = |message: &str| ConvertError::content(self.from, message);
        let first = motors.first().ok_or_else(|| content("has no encoder records"))?;
        // The wheels are unknown before the first encoder record.
        let start = reference.iter().find(|(time, _)| *time >= first.time);
        let (start_time, start) =
            start.ok_or_else(|| content("has no reference after the first encoder record"))?;
        let walls = read_walls(&self.from.join("derived_walls_mm.csv"), 1e-3)?;

        make_dir(self.to)?;
        let mut log = Log::create(self.to)?;
        log.comment("LEGO NXT robot with a laser scanner, C. Brenner's SLAM lectures")?;
        log.comment(&format!(
            "encoder stamps shifted by {} s to those of the scans",
            self.encoder_lag
        ))?;
        log.start(*start_time, start, START_SIGMA)?;
        let mut scans = scans.iter().peekable();
        for row in motors {
            // A scan with the same time may come before or after: its own time decides.
            while let Some(scan) = scans.next_if(|scan| scan.time <= row.time) {
                log.scan(scan.time, &scan.scan)?;
            }
            log.ticks(row.time, row.ticks)?;
        }
        for scan in scans {
            log.scan(scan.time, &scan.scan)?;
        }
        log.0.close()?;
        let mut rows = ReferenceFile::create(self.to)?;
        for (time, pose) in reference {
            rows.row(*time, pose)?;
        }
        rows.0.close()?;
        write_map(
            self.to,
            "The arena's walls, fitted to the scans; its six posts are not in it",
            &walls,
        )?;
        self.write_robot("robot.toml", self.nominal)?;
        for nominal in Nominal::ALL {
            self.write_robot(&format!("robot-{}.toml", nominal.name()), nominal)?;
        }
        Ok(())
    }

    fn write_robot(&self, file: &str, nominal: Nominal) -> Result<(), ConvertError> {
        let [right, left, width] = nominal.millimetres();
        let wheel = |travel: &str| format!("{{ travel_per_edge = \"{travel}\" }}");
        // The lectures' wheels are 7 % off, their track width 12 %.
        let [scale, track] = match nominal {
            Nominal::Fitted | Nominal::Rounded => ["0.5 %", "2 mm"],
            Nominal::Course => ["7 %", "20 mm"],
        };
        // The whole cone must be inside the scan, or objects outside would be missed.
        let cone = 15.0;
        let rightmost = (-MIDDLE * STEP + OFFSET).to_degrees() + cone;
        let leftmost = (MIDDLE * STEP + OFFSET).to_degrees() - cone - STEP.to_degrees();
        let servo = format!("[\"{rightmost:.1} deg\", \"{leftmost:.1} deg\"]");
        let text = Value::text;
        let tables = vec![
            (
                "drive",
                vec![
                    ("track_width", text(width, nominal.name())),
                    (
                        "wheel_noise",
                        text(
                            "6 mm/sqrt(m)",
                            "so the encoders scatter about the reference: 0.03 rad in 0.24 m, 0.07 in 1.8 m",
                        ),
                    ),
                    (
                        "scale_walk",
                        text("0.05 %/sqrt(m)", "wheels drift by 0.1 to 0.5 % within a recording"),
                    ),
                    ("track_width_walk", text("0.1 mm/sqrt(m)", "likewise")),
                    ("max_wheel_speed", text("1 m/s", "above what the motors can do")),
                    ("encoder_period", text("260 ms", "as polled")),
                    ("right_wheel", Value(wheel(right), nominal.name())),
                    ("left_wheel", Value(wheel(left), nominal.name())),
                ],
            ),
            (
                "sonar",
                [vec![
                    (
                        "mount",
                        Value(
                            "[\"32 mm\", \"0 mm\"]".to_owned(),
                            "fitted: the scanner is ahead of the axle",
                        ),
                    ),
                    ("servo", Value(servo, "where the whole cone is inside the scan")),
                    ("cone", text(&format!("{cone} deg"), "half of it: a sonar's")),
                    ("min_range", text("2 cm", "below, the scanner reports errors")),
                    ("max_range", text("4 m", "the scanner's")),
                    (
                        "noise",
                        text(
                            "12 mm",
                            "residuals on the walls are 11 mm; the nearest of a cone scatters less than a beam, but is short",
                        ),
                    ),
                    ("noise_per_metre", text("5 mm/m", "the scanner: 1 % at its worst")),
                    ("fix_period", text("800 ms", "a slow sonar's")),
                ], robot_file::no_servo(rightmost, leftmost).into()].into_iter().flatten().collect(),
            ),
            (
                "prior",
                vec![
                    (
                        "scale_right",
                        text(scale, "real wheels are within 0.5 % of what was measured"),
                    ),
                    ("scale_left", text(scale, "likewise")),
                    ("scale_difference", text("1 %", "wheels of one type")),
                    ("track_width", text(track, "a ruler between tyres 3 cm wide")),
                    ("range_scale", text("1 %", "the nearest of a noisy cone is a little short")),
                ],
            ),
            (
                "gating",
                vec![
                    (
                        "confidence",
                        Value("0.5".to_owned(), "deviations; the arena is small beside the uncertainty"),
                    ),
                ],
            ),
            (
                "echo",
                vec![("free_path", text("3 m", "six posts in an arena of 2 m"))],
            ),
            (
                "schedule",
                vec![("policy", text("nearest", "the wall that a post hides least often"))],
            ),
        ];
        let comment = format!("LEGO NXT robot with a laser scanner; wheels {}", nominal.name());
        robot_file::write(self.to, file, &comment, tables)
    }
}

fn read(path: &Path) -> Result<String, ConvertError> {
    let bytes = sonarfix_map::read_bytes(path).map_err(ConvertError::read(path))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn numbered(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty())
}

fn scan(line: &str) -> Option<TimedScan> {
    let mut fields = line.split_ascii_whitespace();
    fields.next().filter(|kind| *kind == "S")?;
    let milliseconds: f64 = fields.next()?.parse().ok()?;
    let count: usize = fields.next()?.parse().ok()?;
    let mut ranges = Vec::new();
    for field in fields {
        let millimetres: f64 = field.parse().ok().filter(|r: &f64| r.is_finite())?;
        #[expect(clippy::cast_possible_truncation, reason = "a scanner's millimetres")]
        ranges.push(if millimetres < BAD { 0.0 } else { (millimetres / 1e3) as f32 });
    }
    let scan = Scan { first: -MIDDLE * STEP + OFFSET, step: STEP, ranges };
    (scan.ranges.len() == count).then_some(TimedScan { time: milliseconds / 1e3, scan })
}

/// `scan_index,t_s,x_mm,y_mm,th_rad,…`
fn reference_row(line: &str) -> Option<(f64, Pose)> {
    let fields = line.split(',').skip(1).take(4).map(|field| field.trim().parse().ok());
    let fields: Vec<f64> = fields.collect::<Option<_>>()?;
    let &[time, x, y, heading] = fields.as_slice() else { return None };
    Some((time, Pose { x: x / 1e3, y: y / 1e3, heading: angle::wrap(heading) }))
}
