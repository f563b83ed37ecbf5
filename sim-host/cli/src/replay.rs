//! `sonarfix replay`: replays the recording of a robot through the localizer.

use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use sonarfix_exchange::trace_csv;
use sonarfix_map::{MapFile, robot_file};
use sonarfix_plan::overrides::PolicyName;
use sonarfix_replay::diagnosis::Diagnosis;
use sonarfix_replay::fault::Complaint;
use sonarfix_replay::scan::MOST_PINGS_PER_SCAN;
use sonarfix_replay::thinned::{CAPACITY, Thinned};
use sonarfix_replay::{ByVerdict, Figures, Replay, Summary};
use sonarfix_report::{Report, Table};
use sonarfix_sim::trace::Recorder;

use crate::diagnosis;
use crate::provenance;
use crate::recorded::Sources;
use crate::run::Output;
use crate::serve::{self, PacedArgs};
use crate::warnings::{self, Warned};
use sonarfix_terminal::output::{check_file, check_folder, open};
use sonarfix_terminal::progress::bar;

/// Maximum number of skipped lines that are printed.
const SHOWN: u64 = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (docs/formats.md).
    log: PathBuf,
    /// The map; by default map.toml beside the log.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// The robot; by default robot.toml beside the log.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Option<PathBuf>,
    /// The true poses; by default reference.csv beside the log, if it exists.
    #[arg(long, value_name = "REF.csv")]
    reference: Option<PathBuf>,
    /// The policy that chooses the wall to measure; by default that of the robot file.
    #[arg(long, value_enum)]
    policy: Option<PolicyName>,
    /// Takes up to N ranges of a scan while the pose is known, each at another wall, as a sonar that sweeps has time for.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PINGS_PER_SCAN)))]
    pings_per_scan: u32,
    /// Ends the replay at the first malformed line.
    #[arg(long)]
    strict: bool,
    /// Writes the trace as CSV (docs/formats.md); a long one is thinned to about 10,000 instants.
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    paced: PacedArgs,
    #[command(flatten)]
    output: Output,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(dir) = &args.output.out {
        check_folder("--out", dir)?;
    }
    if let Some(file) = &args.trace {
        check_file("--trace", file)?;
    }
    let map = beside(&args.log, args.map.as_ref(), "map.toml");
    let config = beside(&args.log, args.config.as_ref(), "robot.toml");
    let floor = MapFile::read(&map, None)?.floor;
    let mut robot = robot_file::read(&config)?;
    let warnings = warnings::show(&[&map, &config]);
    if let Some(policy) = args.policy {
        robot.localizer.policy = policy.into();
    }
    let walls = floor.walls();
    let pings_per_scan = args.pings_per_scan;
    let with = Replay { robot: &robot, walls: &walls, strict: args.strict, pings_per_scan };
    let title = format!("Sonarfix: {}", args.log.display());
    let scene = serve::scene(title, "recording", &floor, &robot);
    if let Some(mut paced) =
        args.paced.start(&scene, Sources { map: Some(&map), robot: Some(&config) })?
    {
        replay(args, &with, &mut paced)?;
        paced.end();
    }
    let mut trace = Thinned::new(&floor, robot.localizer.rangers.first.cone, CAPACITY);
    let diagnose = || diagnosis::diagnose(&args.log, with.robot, with.walls, None);
    let summary = replay(args, &with, &mut trace).inspect_err(|_| {
        // Without a start nothing is replayed: the records say why.
        eprint!("{}", diagnose().map(|it| diagnosis::paragraphs(&it)).unwrap_or_default());
    })?;
    if let Some(file) = &args.trace {
        sonarfix_files::write_with(file, |out| trace_csv::write(trace.trace(), out))?;
    }
    let diagnosis = diagnose()?;
    let tables = tables(&summary);
    if args.output.json {
        let result = Diagnosed { summary: &summary, diagnosis: &diagnosis };
        sonarfix_terminal::json::print(&Warned { result: &result, warnings: &warnings })?;
    } else {
        let texts: Vec<_> = tables.iter().map(Table::text).collect();
        println!("{}", texts.join("\n\n"));
        print!("{}", diagnosis::paragraphs(&diagnosis));
    }
    if let Some(dir) = &args.output.out {
        let report = Report {
            title: format!("Sonarfix: {}", args.log.display()),
            subtitle: subtitle(&summary, trace.every()),
            tables,
            trace: trace.trace(),
            spread: None,
            provenance: provenance(args),
            of_paper: false,
        };
        eprintln!("open {}", report.write(dir)?.display());
    }
    Ok(())
}

/// A replay with its diagnosis.
#[derive(Debug, Serialize)]
struct Diagnosed<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    diagnosis: &'a Diagnosis,
}

/// The log, and what is read with it.
fn provenance(args: &Args) -> sonarfix_report::Table {
    let map = beside(&args.log, args.map.as_ref(), "map.toml");
    let robot = beside(&args.log, args.config.as_ref(), "robot.toml");
    let reference = beside(&args.log, args.reference.as_ref(), "reference.csv");
    provenance::table(&[&args.log, &map, &robot, &reference])
}

/// A given file, or the one with the default name beside the log.
fn beside(log: &Path, given: Option<&PathBuf>, name: &str) -> PathBuf {
    given.cloned().unwrap_or_else(|| log.with_file_name(name))
}

fn replay(args: &Args, replay: &Replay, trace: &mut impl Recorder) -> anyhow::Result<Summary> {
    let usual = args.log.with_file_name("reference.csv");
    let reference = match &args.reference {
        Some(given) => Some(open(given)?),
        None if usual.exists() => Some(open(&usual)?),
        None => None,
    };
    let log = open(&args.log)?;
    let progress = progress(log.metadata().map_or(0, |metadata| metadata.len()));
    let mut reported = 0_u64;
    let mut report = |complaint: &Complaint| {
        reported += 1;
        if reported <= SHOWN {
            progress.suspend(|| eprintln!("skipped: {complaint}"));
        }
    };
    let summary = replay.run(
        BufReader::new(progress.wrap_read(log)),
        reference.map(BufReader::new),
        trace,
        &mut report,
    );
    progress.finish_and_clear();
    if reported > SHOWN {
        eprintln!("skipped: {} more lines", reported - SHOWN);
    }
    summary.with_context(|| args.log.display().to_string())
}

/// A progress bar of the bytes read; only on a terminal.
fn progress(bytes: u64) -> ProgressBar {
    let style = "{bar:40} {bytes} of {total_bytes}, {eta} left";
    let bar = bar(Some(bytes));
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
    if summary.reference_rows == 0 {
        return vec![course(summary), calibration(summary)];
    }
    vec![errors(summary), verdicts(summary), calibration(summary)]
}

/// What is known without a reference.
fn course(s: &Summary) -> Table {
    let since = |time: Option<f64>, seconds: f64| match time {
        Some(time) => format!("at {time:.1} s, {seconds:.1} s in total"),
        None => "never".to_owned(),
    };
    let (fixes, health) = (s.fixes, &s.health);
    let rows = [
        ("distance (m)", format!("{:.1}", s.distance)),
        ("duration (s)", format!("{:.1}", s.duration)),
        ("ranges accepted", fixes.accepted.to_string()),
        ("ranges gated", fixes.gated.to_string()),
        ("ranges refused", fixes.refused.to_string()),
        ("lines skipped", format!("{} of {}", s.lines_skipped, s.lines)),
        ("verdict degraded", since(health.degraded_at, health.degraded_seconds)),
        ("verdict lost", since(health.lost_at, health.lost_seconds)),
    ];
    Table {
        title: "The replay".to_owned(),
        note: "no reference: the errors are not known".to_owned(),
        columns: ["", "value"].map(str::to_owned).to_vec(),
        rows: rows.map(|(name, value)| vec![name.to_owned(), value]).to_vec(),
    }
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
    let consistency = format!(
        "; half a metre off {}, beyond 3σ {} ({} of the rows)",
        never(s.consistency.diverged_at),
        never(s.consistency.beyond_three_sigma_at),
        cell(s.consistency.beyond_three_sigma, |share| format!("{:.1} %", 100.0 * share)),
    );
    format!(
        "{} rows of the reference; {:.1} m in {:.1} s; ranges accepted {}, gated {}, refused {}; \
         lines skipped {} of {};\n\
         verdict degraded {} ({:.1} s in total), lost {} ({:.1} s in total){consistency}",
        s.reference_rows,
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

fn verdicts(s: &Summary) -> Table {
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    let row = |name: &str, of: ByVerdict| {
        let cells = [of.sum(), of.tracking, of.degraded, of.lost].map(percent);
        [[name.to_owned()].as_slice(), cells.as_slice()].concat()
    };
    let consistency = &s.consistency;
    let errors = consistency.errors;
    let [tracking, degraded, lost] = [errors.tracking, errors.degraded, errors.lost];
    let all = [s.position_rms, s.position_median, s.position_max];
    let errors = |name: &str, all: Option<f64>, of: fn(Figures) -> f64| {
        let by_verdict = [tracking, degraded, lost].map(|figures| figures.map(of));
        let cells = [[all].as_slice(), &by_verdict].concat();
        let cells = cells.into_iter().map(|m| cell(m, |m| format!("{:.0}", 1e3 * m)));
        std::iter::once(name.to_owned()).chain(cells).collect()
    };
    let [all_rms, all_median, all_max] = all;
    let refusals = s.refusals.iter().map(|(reason, count)| format!("{reason} {count}"));
    Table {
        title: "Position error by verdict".to_owned(),
        note: format!(
            "shares are of the time; first lost (half a metre off, or verdict lost) {}\n\
             longest beyond 0.5 m and not reported as lost {}\nrefused: {}",
            consistency.first_loss.map_or_else(
                || "never".to_owned(),
                |loss| format!("after {:.1} m, {:.1} s", loss.distance, loss.time)
            ),
            consistency.longest_wrong.map_or_else(
                || "never".to_owned(),
                |longest| format!(
                    "{:.1} s, {:.1} m, from {:.1} s on",
                    longest.seconds, longest.distance, longest.since
                )
            ),
            refusals.collect::<Vec<_>>().join(", ")
        ),
        columns: ["", "all", "tracking", "degraded", "lost"].map(str::to_owned).to_vec(),
        rows: vec![
            row("within 0.5 m (%)", consistency.within_half_a_metre),
            row("beyond 0.5 m (%)", consistency.beyond_half_a_metre),
            errors("RMS (mm)", all_rms, |figures| figures.position_rms),
            errors("median (mm)", all_median, |figures| figures.position_median),
            errors("worst (mm)", all_max, |figures| figures.position_max),
        ],
    }
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
        note: format!("scale errors are relative to the wheels of the robot file{}", mismatches(s)),
        columns: ["state", "estimate", "deviation"].map(str::to_owned).to_vec(),
        rows: rows.map(row).to_vec(),
    }
}

/// A line for each mismatch of the robot file that was named.
fn mismatches(s: &Summary) -> String {
    let named = s.health.mismatches.all().into_iter().filter(|&(_, seconds)| seconds > 0.0);
    let line =
        |(mismatch, seconds)| format!("\nfor {seconds:.1} s of {:.1} s {mismatch}", s.duration);
    named.map(line).collect()
}

fn cell(value: Option<f64>, show: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), show)
}
