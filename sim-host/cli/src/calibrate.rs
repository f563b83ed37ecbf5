//! `sonarfix calibrate`: the calibration of a robot from a recording.

use std::fmt;
use std::io::{BufReader, Write};
use std::path::PathBuf;

use anyhow::Context;
use nalgebra::Vector3;
use serde::Serialize;
use sonarfix_batch::calibrate::{Calibration, Determined, Estimate, calibrate};
use sonarfix_batch::constants::Name;
use sonarfix_batch::log;
use sonarfix_batch::noise::INLIER;
use sonarfix_batch::recording::StartPose;
use sonarfix_batch::robot_edit;
use sonarfix_batch::unknown_start::calibrate_from_search;
use sonarfix_batch::wall::Wall;
use sonarfix_batch::wheel_noise::{Estimated, Noisy};
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Floor, MapFile, robot_file};
use sonarfix_replay::REFERENCE_HEADER;
use sonarfix_replay::diagnosis::Diagnosis;
use sonarfix_replay::find::Find;
use sonarfix_report::Table;
use sonarfix_report::residuals::{Residual, residuals};
use sonarfix_sim::trace::Pose;

use crate::diagnosis;
use sonarfix_terminal::output::{check_file, open};

mod echoes;

/// Maximum number of skipped lines that are printed.
const SHOWN: usize = 10;
/// Half of a 95 % interval, in standard deviations.
const INTERVAL: f64 = 1.96;
/// A wheel noise so many times the upper limit of its interval is too large.
const AMPLE: f64 = 2.0;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (docs/formats.md).
    log: PathBuf,
    /// The robot as its builder describes it; by default robot.toml beside the log.
    #[arg(long, value_name = "ROBOT.toml")]
    robot: Option<PathBuf>,
    /// The map; by default map.toml beside the log, if it exists.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// True poses over time. Their clock may be late and fast.
    #[arg(long, value_name = "REF.csv")]
    reference: Option<PathBuf>,
    /// The start pose, instead of that of the log: metres and degrees.
    #[arg(long, value_name = "X,Y,HEADING", value_delimiter = ',', allow_hyphen_values = true)]
    start: Option<Vec<f64>>,
    /// Searches for the pose in the first 90 s, instead of taking the start pose of the log; also without this option if it has none.
    #[arg(long, conflicts_with_all = ["start", "reference"])]
    search: bool,
    /// The robot file to write, with the calibration.
    #[arg(long, value_name = "ROBOT.toml")]
    out: Option<PathBuf>,
    /// The smoothed poses to write, as a reference for `replay`.
    #[arg(long, value_name = "REF.csv")]
    trajectory: Option<PathBuf>,
    /// The figure of the residuals to write.
    #[arg(long, value_name = "FILE.svg")]
    residuals: Option<PathBuf>,
    /// Prints one JSON value instead of tables.
    #[arg(long)]
    json: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let outputs = [
        ("--out", &args.out),
        ("--trajectory", &args.trajectory),
        ("--residuals", &args.residuals),
    ];
    for (option, file) in outputs {
        if let Some(file) = file {
            check_file(option, file)?;
        }
    }
    let robot_path = args.robot.clone().unwrap_or_else(|| args.log.with_file_name("robot.toml"));
    let robot = robot_file::read(&robot_path)?;
    crate::warnings::show(&[&robot_path]);
    let text =
        sonarfix_map::read_text(&robot_path).with_context(|| robot_path.display().to_string())?;
    let read = read_log(args, &robot)?;
    let floor = floor(args)?;
    let nominal = log::nominal(&robot, !read.has_scans);
    let fitted = fitted_walls(floor.as_ref());
    let walls = floor.map(|floor| floor.walls()).unwrap_or_default();
    let is_searched = args.search || read.recording.has_no_start();
    let found = if is_searched {
        let find = Find { robot: &robot, walls: &walls };
        calibrate_from_search(&read.recording, &fitted, &nominal, &find)
    } else {
        calibrate(&read.recording, &fitted, &nominal)
    };
    let diagnosis = diagnosis::diagnose(&args.log, &robot, &walls, given_start(args)?)?;
    let found = found.inspect_err(|_| eprint!("{}", diagnosis::paragraphs(&diagnosis)));
    let found = found.with_context(|| args.log.display().to_string())?;
    if let Some(out) = &args.out {
        let text = robot_edit::calibrated(&text, &robot, &found)?;
        robot_file::parse(&text, &out.display().to_string())?;
        sonarfix_files::write(out, text)?;
    }
    if let Some(out) = &args.trajectory {
        sonarfix_files::write_with(out, |out| write_trajectory(out, &found))?;
    }
    if let Some(out) = &args.residuals {
        let shown = found.residuals.iter().map(|residual| Residual {
            time: residual.time,
            value: residual.value,
            is_inlier: residual.normalized.abs() <= INLIER,
        });
        let svg = residuals(&shown.collect::<Vec<_>>())
            .map_err(|error| anyhow::anyhow!("cannot draw the figure: {error}"))?;
        sonarfix_files::write(out, svg)?;
    }
    let begin = Begin::of(&found).filter(|_| is_searched);
    if args.json {
        sonarfix_terminal::json::print(&Json::of(&found, begin, &diagnosis))
    } else {
        println!("{}", estimates(&found, &robot).text());
        println!("\n{}", statement(&found, &robot));
        if let Some(begin) = begin {
            println!("{begin}");
        }
        print!("{}", diagnosis::paragraphs(&diagnosis));
        Ok(())
    }
}

fn read_log(args: &Args, robot: &RobotConfig) -> anyhow::Result<log::Read> {
    let mut read = log::read(BufReader::new(open(&args.log)?), robot)
        .with_context(|| args.log.display().to_string())?;
    for (line, reason) in read.skipped.iter().take(SHOWN) {
        eprintln!("skipped: log line {line}: {reason}");
    }
    if read.skipped.len() > SHOWN {
        eprintln!("skipped: {} more lines", read.skipped.len() - SHOWN);
    }
    if let Some(reference) = &args.reference {
        read.recording.references = log::read_reference(BufReader::new(open(reference)?))
            .with_context(|| reference.display().to_string())?;
    }
    if let Some(Pose { x, y, heading }) = given_start(args)? {
        let time = read.recording.readings.first().map_or(0.0, |reading| reading.time);
        let pose = Vector3::new(x, y, heading);
        read.recording.start = Some(StartPose { time, pose, position: 0.05, heading: 0.05 });
    }
    Ok(read)
}

/// The start pose of the command line.
fn given_start(args: &Args) -> anyhow::Result<Option<Pose>> {
    let Some(start) = &args.start else { return Ok(None) };
    let &[x, y, heading] = start.as_slice() else {
        anyhow::bail!("--start must be x, y and heading, for example 1.5,2,90");
    };
    Ok(Some(Pose { x, y, heading: heading.to_radians() }))
}

/// The map, if there is one.
fn floor(args: &Args) -> anyhow::Result<Option<Floor>> {
    let usual = args.log.with_file_name("map.toml");
    let map = match &args.map {
        Some(map) => map,
        None if usual.exists() => &usual,
        None => return Ok(None),
    };
    Ok(Some(MapFile::read(map, None)?.floor))
}

/// The walls to which the recording is fitted; none without a map.
fn fitted_walls(floor: Option<&Floor>) -> Vec<Wall> {
    let walls = floor.into_iter().flat_map(|floor| floor.named_walls().iter());
    walls.filter_map(|wall| Wall::new(wall.from(), wall.to())).collect()
}

fn write_trajectory(out: &mut impl Write, found: &Calibration) -> anyhow::Result<()> {
    writeln!(out, "{REFERENCE_HEADER}")?;
    for (time, pose, _) in &found.trajectory {
        writeln!(out, "{time:.6},{:.6},{:.6},{:.7}", pose.x, pose.y, pose.z)?;
    }
    Ok(())
}

/// A value for people: relative errors in per cent, lengths in millimetres.
struct Shown {
    label: &'static str,
    value: String,
    interval: String,
}

fn shown(estimate: &Estimate, robot: &RobotConfig) -> Shown {
    let half = INTERVAL * estimate.deviation;
    let scaled = |scale: f64, decimals: usize, unit: &str| {
        let value = format!("{:+.decimals$} {unit}", estimate.value * scale);
        (value, format!("± {:.decimals$} {unit}", half * scale))
    };
    let (value, interval) = match estimate.name {
        Name::Right | Name::Left | Name::RangeScale => scaled(100.0, 3, "%"),
        Name::Track => {
            let width = 1e3 * f64::from(robot.localizer.drive.track_width.0);
            let value = format!("{:.2} mm", width * (1.0 + estimate.value));
            (value, format!("± {:.2} mm", width * half))
        }
        Name::OffAxis => scaled(1e3, 1, "mm/rad"),
        Name::Lag => scaled(1e3, 1, "ms"),
        Name::ClockRate => scaled(1e3, 3, "ms/s"),
        Name::MarkerHeading => scaled(180.0 / std::f64::consts::PI, 3, "deg"),
        Name::MountAhead
        | Name::MountLeft
        | Name::RangeOffset
        | Name::MarkerAhead
        | Name::MarkerLeft => scaled(1e3, 2, "mm"),
    };
    Shown { label: estimate.name.label(), value, interval }
}

fn estimates(found: &Calibration, robot: &RobotConfig) -> Table {
    let row = |estimate: &Estimate| {
        let Shown { label, value, interval } = shown(estimate, robot);
        let determined = match estimate.determined {
            Determined::Yes => "yes",
            Determined::Jointly => "only together with the others of the drive",
            Determined::No => "not by this recording",
        };
        vec![
            label.to_owned(),
            value,
            interval,
            format!("{:.1}", estimate.scatter),
            determined.to_owned(),
        ]
    };
    let mut rows: Vec<Vec<String>> = found.estimates.iter().map(row).collect();
    if let Some(bearings) = &found.bearings {
        let mut push = |label: &str, value: String, deviation: f64| {
            let interval = format!("± {:.2}", INTERVAL * deviation);
            rows.push(vec![label.to_owned(), value, interval, "–".to_owned(), String::new()]);
        };
        let degrees = f64::to_degrees;
        push(
            "bearing offset (deg)",
            format!("{:+.2}", degrees(bearings.offset)),
            degrees(bearings.offset_deviation),
        );
        push(
            "bearing scale (%)",
            format!("{:+.2}", 100.0 * (bearings.scale - 1.0)),
            100.0 * bearings.scale_deviation,
        );
        push(
            "half cone (deg)",
            format!("{:.1}", degrees(bearings.half_cone)),
            degrees(bearings.cone_deviation),
        );
    }
    Table {
        title: "Calibration".to_owned(),
        note: "errors of the wheels are relative to the robot file; intervals of 95 %, widened by the difference of \
               the two halves\n(in its standard deviations)"
            .to_owned(),
        columns: ["", "estimate", "interval", "halves", "determined"].map(str::to_owned).to_vec(),
        rows,
    }
}

/// What was used, and what the recording cannot tell.
fn statement(found: &Calibration, robot: &RobotConfig) -> String {
    let [left, right] = found.turned.map(f64::to_degrees);
    let mut lines = vec![format!(
        "{:.1} m, turns of {left:.0}° to the left and {right:.0}° to the right; {} of {} echoes from walls fit; {} reference poses",
        found.distance, found.inliers, found.expected, found.referenced
    )];
    let noise = &found.noise;
    lines.push(wheel_noise(&found.wheel_noise));
    let file = f64::from(robot.localizer.drive.wheel_noise.0.0);
    lines.extend(judged(&found.wheel_noise.wheel, file));
    if found.expected > 0 {
        let per_metre = 1e3 * noise.range_per_metre;
        lines.push(format!("range noise {:.2} mm and {per_metre:.2} mm/m", 1e3 * noise.range));
    }
    lines.extend(echoes::lines(&found.echoes, &robot.localizer.echo));
    if found.referenced > 0 {
        let (position, heading) = (1e3 * noise.position, noise.heading.to_degrees());
        lines.push(format!("reference noise {position:.2} mm and {heading:.3}°"));
    }
    if found.estimates.iter().any(|estimate| estimate.determined == Determined::Jointly) {
        lines.push(
            "Not determined: the difference of the wheels separately from the track width. The robot turned to one side \
             only; the wheels are assumed to be equal to 0.5 %. Drive figures of eight to separate them."
                .to_owned(),
        );
    }
    let unknown = found.estimates.iter().filter(|estimate| {
        let is_in_file = !matches!(estimate.name, Name::RangeOffset | Name::OffAxis);
        is_in_file && estimate.determined == Determined::No
    });
    let unknown: Vec<&str> = unknown.map(|estimate| estimate.name.label()).collect();
    if !unknown.is_empty() {
        lines.push(format!(
            "Not determined: {}. The robot file keeps its value. Drive figures of eight where opposite walls are within \
             reach: 20 m, for the track width 60 m.",
            unknown.join(", ")
        ));
    }
    if found.expected > 0 && found.bearings.is_none() {
        lines.push(
            "Not determined: the bearings of servo and mount. They follow from the bearings at which a wall answers \
             and no longer answers: record a drive in which the sonar sweeps."
                .to_owned(),
        );
    }
    lines.join("\n")
}

/// The pose that the search has found, in SI units: the calibration begins there.
#[derive(Debug, Clone, Copy, Serialize)]
struct Begin {
    time: f64,
    x: f64,
    y: f64,
    heading: f64,
}

impl Begin {
    fn of(found: &Calibration) -> Option<Self> {
        let (time, pose, _) = found.trajectory.first()?;
        Some(Self { time: *time, x: pose.x, y: pose.y, heading: pose.z })
    }
}

impl fmt::Display for Begin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time, x, y, heading } = self;
        let degrees = heading.to_degrees();
        write!(
            f,
            "it begins at {time:.1} s, where the search finds {x:.2} m, {y:.2} m, {degrees:.0} deg"
        )
    }
}

/// The noise of the wheels and its parts, with their intervals.
fn wheel_noise(found: &Estimated) -> String {
    let shown = |noise: &Noisy| {
        let [least, most] = noise.interval().map(|limit| 1e3 * limit);
        let unknown = if noise.is_determined() { "" } else { ", not by this recording" };
        format!("{:.2} mm/sqrt(m) ({least:.2} to {most:.2}{unknown})", 1e3 * noise.value)
    };
    format!(
        "wheel noise {}; of the distance alone {}, of the turns alone {}. Intervals of 95 %; `wheel_noise` of the robot file is not \
         changed",
        shown(&found.wheel),
        shown(&found.distance),
        shown(&found.turn)
    )
}

/// Whether the noise of the robot file, m/√m, is below the interval, or far above it: a filter needs some more than the recording shows.
fn judged(found: &Noisy, file: f64) -> Option<String> {
    let [least, most] = found.interval();
    let (size, consequence) = match file {
        file if file < least => {
            ("small", "its filter is too sure of the pose, and refuses right ranges")
        }
        file if file > AMPLE * most => {
            ("large", "its filter follows the ranges more than it needs to")
        }
        _ => return None,
    };
    let stated = format!("wheel_noise = \"{:.1} mm/sqrt(m)\"", 1e3 * file);
    found
        .is_determined()
        .then(|| format!("{stated} in the robot file is too {size}: {consequence}"))
}

/// The result in SI units.
#[derive(Serialize)]
struct Json<'a> {
    begin: Option<Begin>,
    estimates: Vec<JsonEstimate>,
    bearing_offset: Option<[f64; 2]>,
    bearing_scale: Option<[f64; 2]>,
    half_cone: Option<[f64; 2]>,
    echoes: echoes::Json,
    wheel_noise: JsonNoise,
    wheel_noise_of_distance: JsonNoise,
    wheel_noise_of_turns: JsonNoise,
    range_noise: f64,
    range_noise_per_metre: f64,
    inliers: usize,
    expected: usize,
    referenced: usize,
    turned: [f64; 2],
    distance: f64,
    diagnosis: &'a Diagnosis,
}

#[derive(Serialize)]
struct JsonEstimate {
    name: &'static str,
    value: f64,
    deviation: f64,
    halves: f64,
    determined: &'static str,
}

#[derive(Serialize)]
struct JsonNoise {
    value: f64,
    interval: [f64; 2],
    determined: bool,
}

impl JsonNoise {
    fn of(noise: &Noisy) -> Self {
        let (interval, determined) = (noise.interval(), noise.is_determined());
        Self { value: noise.value, interval, determined }
    }
}

impl<'a> Json<'a> {
    fn of(found: &Calibration, begin: Option<Begin>, diagnosis: &'a Diagnosis) -> Self {
        let estimates = found.estimates.iter().map(|estimate| JsonEstimate {
            name: estimate.name.label(),
            value: estimate.value,
            deviation: estimate.deviation,
            halves: estimate.scatter,
            determined: match estimate.determined {
                Determined::Yes => "yes",
                Determined::Jointly => "jointly",
                Determined::No => "no",
            },
        });
        let bearings = found.bearings.as_ref();
        Self {
            begin,
            estimates: estimates.collect(),
            bearing_offset: bearings.map(|b| [b.offset, b.offset_deviation]),
            bearing_scale: bearings.map(|b| [b.scale, b.scale_deviation]),
            half_cone: bearings.map(|b| [b.half_cone, b.cone_deviation]),
            echoes: echoes::Json::of(&found.echoes),
            wheel_noise: JsonNoise::of(&found.wheel_noise.wheel),
            wheel_noise_of_distance: JsonNoise::of(&found.wheel_noise.distance),
            wheel_noise_of_turns: JsonNoise::of(&found.wheel_noise.turn),
            range_noise: found.noise.range,
            range_noise_per_metre: found.noise.range_per_metre,
            inliers: found.inliers,
            expected: found.expected,
            referenced: found.referenced,
            turned: found.turned,
            distance: found.distance,
            diagnosis,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_noise_that_contradicts_the_recording_is_named() {
        // An interval of 1.6 to 2.4 mm/√m.
        let found = Noisy { value: 0.002, deviation: 0.1 };
        let small = judged(&found, 0.001).unwrap();
        assert!(
            small.starts_with("wheel_noise = \"1.0 mm/sqrt(m)\" in the robot file is too small")
        );
        assert!(judged(&found, 0.01).unwrap().contains("too large"));
        assert_eq!(judged(&found, 0.003), None);
        assert_eq!(judged(&Noisy { deviation: 0.6, ..found }, 1e-5), None);
    }
}
