//! `sonarfix replay`: the recording of a robot, through the same localizer.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use sonarfix_map::{Floor, Robot};

use super::overrides::PolicyName;
use super::run::Output;
use super::table;
use crate::replay::fault::Complaint;
use crate::replay::thinned::{CAPACITY, Thinned};
use crate::replay::{Replay, Summary};
use crate::report::{Report, Table};
use crate::trace_csv;

/// Lines that are wrong are told one by one up to this many.
const TOLD: u64 = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (docs/formats.md).
    log: PathBuf,
    /// The map; map.toml beside the log if not given.
    #[arg(long, value_name = "MAP.toml")]
    map: Option<PathBuf>,
    /// The robot; robot.toml beside the log if not given.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Option<PathBuf>,
    /// The true poses; reference.csv beside the log if not given, and none if that is not there.
    #[arg(long, value_name = "REF.csv")]
    reference: Option<PathBuf>,
    /// Which wall the sonar looks at; what the robot file says if not given.
    #[arg(long, value_enum)]
    policy: Option<PolicyName>,
    /// Ends the replay at the first line that is wrong.
    #[arg(long)]
    strict: bool,
    /// Writes the trace here, as CSV (docs/formats.md); a long one thinned to some 10,000 instants.
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let floor = Floor::read(&beside(&args.log, args.map.as_ref(), "map.toml"))?;
    let mut robot = Robot::read(&beside(&args.log, args.config.as_ref(), "robot.toml"))?;
    if let Some(policy) = args.policy {
        robot.config.policy = policy.into();
    }
    let walls = floor.walls();
    let mut trace = Thinned::new(&floor, robot.config.sonar.cone, CAPACITY);
    let summary =
        replay(args, &Replay { robot: &robot, walls: &walls, strict: args.strict }, &mut trace)?;
    if let Some(file) = &args.trace {
        let out = File::create(file).map(BufWriter::new);
        let out = out.with_context(|| format!("cannot write the trace {}", file.display()))?;
        trace_csv::write(trace.trace(), out)?;
    }
    let tables = tables(&summary);
    if args.output.json {
        super::print_json(&summary)?;
    } else {
        let texts: Vec<_> = tables.iter().map(table::text).collect();
        println!("{}", texts.join("\n\n"));
    }
    if let Some(dir) = &args.output.out {
        let report = Report {
            title: format!("Sonarfix: {}", args.log.display()),
            subtitle: subtitle(&summary, trace.every()),
            tables,
            trace: trace.trace(),
        };
        eprintln!("open {}", report.write(dir)?.display());
    }
    Ok(())
}

/// A file that is given, or the one with the usual name beside the log.
fn beside(log: &Path, given: Option<&PathBuf>, name: &str) -> PathBuf {
    given.cloned().unwrap_or_else(|| log.with_file_name(name))
}

fn replay(args: &Args, replay: &Replay, trace: &mut Thinned) -> anyhow::Result<Summary> {
    let open = |path: &Path| File::open(path).with_context(|| path.display().to_string());
    let usual = args.log.with_file_name("reference.csv");
    let reference = match &args.reference {
        Some(given) => Some(open(given)?),
        None if usual.exists() => Some(open(&usual)?),
        None => None,
    };
    let log = open(&args.log)?;
    let progress = progress(log.metadata().map_or(0, |metadata| metadata.len()));
    let mut told = 0_u64;
    let mut tell = |complaint: &Complaint| {
        told += 1;
        if told <= TOLD {
            progress.suspend(|| eprintln!("skipped: {complaint}"));
        }
    };
    let summary = replay.run(
        BufReader::new(progress.wrap_read(log)),
        reference.map(BufReader::new),
        trace,
        &mut tell,
    );
    progress.finish_and_clear();
    if told > TOLD {
        eprintln!("skipped: {} more lines", told - TOLD);
    }
    summary.with_context(|| args.log.display().to_string())
}

/// Bytes of the log that have been read; shown on a terminal only.
fn progress(bytes: u64) -> ProgressBar {
    let style = "{bar:40} {bytes} of {total_bytes}, {eta} left";
    let bar = ProgressBar::new(bytes);
    match ProgressStyle::with_template(style) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn subtitle(summary: &Summary, every: u64) -> String {
    let thinned = match every {
        1 => String::new(),
        _ => format!(" Figures and player show one encoder record in {every}."),
    };
    format!("A recording of {:.0} s and {:.0} m.{thinned}", summary.duration, summary.distance)
}

fn tables(summary: &Summary) -> Vec<Table> {
    vec![errors(summary), calibration(summary)]
}

fn errors(s: &Summary) -> Table {
    let mm = |metres: Option<f64>| cell(metres, |m| format!("{:.1}", m * 1e3));
    let degrees = |radians: Option<f64>| cell(radians, |r| format!("{:.2}", r.to_degrees()));
    let rows = [
        ("position RMS (mm)", mm(s.position_rms), mm(s.odometry_position_rms)),
        ("position median (mm)", mm(s.position_median), mm(s.odometry_position_median)),
        ("position worst (mm)", mm(s.position_max), mm(s.odometry_position_max)),
        ("heading RMS (deg)", degrees(s.heading_rms), degrees(s.odometry_heading_rms)),
        ("heading median (deg)", degrees(s.heading_median), degrees(s.odometry_heading_median)),
        ("heading worst (deg)", degrees(s.heading_max), degrees(s.odometry_heading_max)),
    ];
    Table {
        title: "Errors against the reference".to_owned(),
        note: errors_note(s),
        columns: ["", "localizer", "encoders alone"].map(str::to_owned).to_vec(),
        rows: rows
            .map(|(name, localizer, encoders)| vec![name.to_owned(), localizer, encoders])
            .to_vec(),
    }
}

fn errors_note(s: &Summary) -> String {
    let at = |time: Option<f64>| cell(time, |t| format!("at {t:.1} s"));
    let never = |time: Option<f64>| time.map_or("never".to_owned(), |_| at(time));
    let (reference, honesty) = match s.reference_rows {
        0 => ("no reference".to_owned(), String::new()),
        rows => (
            format!("{rows} rows of the reference"),
            format!(
                "; half a metre off {}, beyond 3σ {} ({} of the rows)",
                never(s.honesty.astray_at),
                never(s.honesty.beyond_three_sigma_at),
                cell(s.honesty.beyond_three_sigma, |share| format!("{:.1} %", 100.0 * share)),
            ),
        ),
    };
    format!(
        "{reference}; {:.1} m in {:.1} s; ranges accepted {}, gated {}, refused {}; \
         lines skipped {} of {};\n\
         the localizer said degraded {} ({:.1} s in all), lost {} ({:.1} s in all){honesty}",
        s.distance,
        s.duration,
        s.fixes.accepted,
        s.fixes.gated,
        s.fixes.refused,
        s.lines_skipped,
        s.lines,
        never(s.health.degraded_at),
        s.health.degraded_seconds,
        never(s.health.lost_at),
        s.health.lost_seconds,
    )
}

fn calibration(s: &Summary) -> Table {
    let (value, deviation) = (&s.calibration, &s.final_deviation);
    let rows = [
        ("S_R (%)", value.scale_right, deviation.scale_right, 100.0),
        ("S_L (%)", value.scale_left, deviation.scale_left, 100.0),
        ("track width (mm)", value.track_width, deviation.track_width, 1e3),
        ("range scale (%)", value.range_scale, deviation.range_scale, 100.0),
    ];
    let row = |(name, value, deviation, unit): (&str, f64, f64, f64)| {
        let cells = [value, deviation].map(|v| format!("{:.3}", v * unit));
        [[name.to_owned()].as_slice(), cells.as_slice()].concat()
    };
    Table {
        title: "Calibration at the end".to_owned(),
        note: "scale errors are relative to the wheels of the robot file".to_owned(),
        columns: ["state", "estimate", "deviation"].map(str::to_owned).to_vec(),
        rows: rows.map(row).to_vec(),
    }
}

fn cell(value: Option<f64>, show: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), show)
}
