//! `sonarfix plan`: forecast of the localization accuracy along a path.

use std::path::{Path as FilePath, PathBuf};

use sonarfix_map::{MapFile, Scenario, SonarModel, robot_file};
use sonarfix_plan::overrides::has_servo;
use sonarfix_plan::preset::{ServoPreset, SonarPreset};
use sonarfix_plan::starts::{LegShare, Share, Starts};
use sonarfix_plan::{BLIND_AFTER, Forecast, HeadingAid, Spread, bare, route};
use sonarfix_report::Table;
use sonarfix_report::heat_map::{Heat, HeatMap};

use crate::warnings::{self, Warning};
use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A map or a scenario (.toml), segments (.csv), or a baked map (docs/formats.md).
    map: PathBuf,
    /// The unit of a CSV whose header names none: m, cm or mm.
    #[arg(long)]
    unit: Option<String>,
    /// The path, for a map or instead of the scenario's: "x,y x,y …" in metres, the start first,
    /// or a file of x,y lines.
    #[arg(long, value_name = "FILE|X,Y …")]
    path: Option<String>,
    /// The sonar by its name in files, like `hc_sr04`, or a robot file; by default the scenario's.
    #[arg(long, value_name = "NAME|ROBOT.toml")]
    sensor: Option<String>,
    /// The servo of the sonar; by default the scenario's.
    #[arg(long, value_enum)]
    servo: Option<ServoPreset>,
    /// Compares all sonars, each alone, with a gyro, and with a compass.
    #[arg(long, conflicts_with = "sensor")]
    compare: bool,
    /// The required position accuracy, one standard deviation, millimetres: marks the sonars that
    /// meet it along the whole path from a start that is known to 1 mm and 0.1°.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    need: Option<f64>,
    /// Starts the robot without a pose at so many places along the path, and reports from where it finds its pose, and after
    /// how many metres.
    #[arg(long, value_name = "N", conflicts_with = "compare")]
    starts: Option<u32>,
    /// Number of runs: detection is random.
    #[arg(long, default_value_t = 10)]
    runs: u32,
    /// Prints JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Writes a drawing of the bound along the path; with --compare, for the best sonar.
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
}

/// The forecast for one sonar.
#[derive(Debug, serde::Serialize)]
struct Candidate {
    sensor: String,
    /// With `--compare`, what measures the heading beside wheels and sonar.
    #[serde(skip_serializing_if = "Option::is_none")]
    heading_aid: Option<HeadingAid>,
    #[serde(flatten)]
    forecast: Forecast,
    /// With `--need`, the bound on the position from a known start, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_known_start: Option<Spread>,
    /// With `--starts`, what starts without a pose lead to.
    #[serde(skip_serializing_if = "Option::is_none")]
    starts: Option<Starts>,
    /// Improbable values of the files.
    warnings: Vec<Warning>,
}

/// A robot to be compared.
struct Fitted {
    sensor: String,
    heading_aid: Option<HeadingAid>,
    scenario: Scenario,
}

impl Candidate {
    /// Its sonar, and what measures the heading beside it.
    fn name(&self) -> String {
        match self.heading_aid {
            None | Some(HeadingAid::None) => self.sensor.clone(),
            Some(aid) => format!("{} and {}", self.sensor, aid.name()),
        }
    }

    /// Whether the bound from a known start stays within this accuracy, millimetres.
    fn suffices(&self, need: f64) -> bool {
        self.from_known_start.is_some_and(|spread| 1e3 * spread.worst <= need)
    }
}

/// Longest time in which a robot without a pose drives on, seconds.
const SEARCHED_FOR: f64 = 120.0;
/// The deviations of a known start, metres and radians.
const KNOWN_POSITION: f64 = 1e-3;
const KNOWN_HEADING: f64 = 0.1 * std::f64::consts::PI / 180.0;

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    anyhow::ensure!(args.starts != Some(0), "--starts must be at least 1");
    let is_sensible = args.need.is_none_or(|need| need > 0.0 && need.is_finite());
    anyhow::ensure!(is_sensible, "--need must be a number of millimetres above zero");
    if let Some(file) = &args.out {
        check_file("--out", file)?;
    }
    let scenario = scenario(args)?;
    let robot = args.sensor.as_deref().map(FilePath::new).filter(|file| file.exists());
    let files: Vec<_> = std::iter::once(args.map.as_path()).chain(robot).collect();
    let warnings = warnings::show(&files);
    let fitted = fitted(args, &scenario)?;
    let forecasts = fitted.len() * if args.need.is_some() { 2 } else { 1 };
    let count = u32::try_from(forecasts).unwrap_or(u32::MAX);
    let starts = args.starts.unwrap_or(0);
    let runs = Runs::new(args.runs.saturating_mul(count).saturating_add(starts));
    let mut candidates = Vec::new();
    for Fitted { sensor, heading_aid, mut scenario } in fitted {
        let Some(forecast) = Forecast::new(&scenario, args.runs, &runs)? else { continue };
        let searched =
            args.starts.map(|starts| Starts::new(&scenario, starts, SEARCHED_FOR, &runs));
        let starts = searched.transpose()?.flatten();
        scenario.start.position = KNOWN_POSITION;
        scenario.start.heading = KNOWN_HEADING;
        let known = args.need.map(|_| Forecast::new(&scenario, args.runs, &runs)).transpose()?;
        let from_known_start = known.flatten().map(|forecast| forecast.position);
        let warnings = warnings.clone();
        candidates.push(Candidate {
            sensor,
            heading_aid,
            forecast,
            from_known_start,
            starts,
            warnings,
        });
    }
    runs.end()?;
    candidates.sort_by(|a, b| a.forecast.position.rms.total_cmp(&b.forecast.position.rms));
    if args.json {
        sonarfix_terminal::json::print(&candidates)?;
    } else if args.compare {
        println!("{}", comparison(&candidates, args.need).text());
    } else {
        for candidate in &candidates {
            println!("{}", legs(candidate, args.need).text());
            if let Some(starts) = &candidate.starts {
                println!("{}", starts_table(starts).text());
            }
        }
    }
    if let (Some(file), Some(best)) = (&args.out, candidates.first()) {
        write(file, &picture(&scenario, best).svg())?;
    }
    Ok(())
}

fn write(file: &FilePath, svg: &str) -> anyhow::Result<()> {
    sonarfix_files::write(file, svg)?;
    eprintln!("open {}", file.display());
    Ok(())
}

/// The scenario; a map gets the robot of the floor plans.
fn scenario(args: &Args) -> anyhow::Result<Scenario> {
    let corners = args.path.as_deref().map(route::corners).transpose()?;
    let map = MapFile::read(&args.map, args.unit.as_deref())?;
    let mut scenario = if let Some(scenario) = map.scenario {
        *scenario
    } else {
        let missing = "a map has no path: give one with --path \"x,y x,y …\"";
        anyhow::ensure!(corners.is_some(), "{}: {missing}", args.map.display());
        let name = args.map.display().to_string();
        bare::scenario(map.floor, name)?
    };
    if let Some(corners) = corners {
        scenario.path = route::path(&corners, &scenario.floor, &scenario.robot)?;
    }
    Ok(scenario)
}

/// The scenario with each requested sonar.
fn fitted(args: &Args, scenario: &Scenario) -> anyhow::Result<Vec<Fitted>> {
    let mut scenario = scenario.clone();
    if let Some(servo) = args.servo {
        has_servo(&scenario)?;
        servo.fit(&mut scenario);
    }
    if args.compare {
        let aided = |preset| HeadingAid::ALL.map(|aid| with(preset, &scenario).aided(aid));
        return Ok(SonarPreset::ALL.into_iter().flat_map(aided).collect());
    }
    let Some(sensor) = &args.sensor else {
        let sensor = "its own sonar".to_owned();
        return Ok(vec![Fitted { sensor, heading_aid: None, scenario }]);
    };
    if let Some(preset) = SonarPreset::named(sensor) {
        return Ok(vec![with(preset, &scenario)]);
    }
    let file = FilePath::new(sensor);
    let known = SonarPreset::ALL.map(SonarPreset::file_name).join(", ");
    anyhow::ensure!(
        SonarModel::named(sensor).is_none() || file.exists(),
        "--sensor: no noise and cone are known for \"{sensor}\": give one of {known}, or a robot file"
    );
    anyhow::ensure!(file.exists(), "--sensor: \"{sensor}\" is neither a file nor one of {known}");
    scenario.robot = robot_file::read(file)?;
    Ok(vec![Fitted { sensor: sensor.clone(), heading_aid: None, scenario }])
}

fn with(preset: SonarPreset, scenario: &Scenario) -> Fitted {
    let mut scenario = scenario.clone();
    preset.fit(&mut scenario);
    Fitted { sensor: preset.name().to_owned(), heading_aid: None, scenario }
}

impl Fitted {
    fn aided(mut self, aid: HeadingAid) -> Self {
        aid.fit(&mut self.scenario);
        Self { heading_aid: Some(aid), ..self }
    }
}

fn millimetres(spread: Spread) -> String {
    format!("{:.1} / {:.1}", 1e3 * spread.rms, 1e3 * spread.worst)
}

fn degrees(spread: Spread) -> String {
    format!("{:.2} / {:.2}", spread.rms.to_degrees(), spread.worst.to_degrees())
}

fn point([x, y]: [f64; 2]) -> String {
    format!("({x:.2}, {y:.2})")
}

fn blind_note(forecast: &Forecast) -> String {
    match forecast.blind.first() {
        None => format!("Never blind for more than {BLIND_AFTER:.0} s."),
        Some(longest) => format!(
            "Blind in {:.0} % of the time; the longest: {:.0} s from {} to {} m.",
            100.0 * forecast.blind_share,
            longest.seconds,
            point(longest.from),
            point(longest.to),
        ),
    }
}

/// Whether one sonar suffices.
fn verdict(candidate: &Candidate, need: f64) -> String {
    let worst = candidate.from_known_start.map_or(f64::NAN, |spread| 1e3 * spread.worst);
    let verdict = if candidate.suffices(need) { "suffices" } else { "does not suffice" };
    format!("From a known start at worst {worst:.1} mm: {verdict} for {need} mm. ")
}

/// Each leg of a path with one sonar.
fn legs(candidate: &Candidate, need: Option<f64>) -> Table {
    let Candidate { sensor, forecast, .. } = candidate;
    let row = |leg: &sonarfix_plan::LegForecast| {
        let length = (leg.to[0] - leg.from[0]).hypot(leg.to[1] - leg.from[1]);
        vec![
            format!("{} to {}", point(leg.from), point(leg.to)),
            format!("{length:.1}"),
            millimetres(leg.x),
            millimetres(leg.y),
            degrees(leg.heading),
            format!("{:.0}", leg.blind),
        ]
    };
    Table {
        title: format!("Forecast with {sensor}: bound on the deviation, RMS / worst"),
        note: format!(
            "Whole path: position {} mm, worst at {}; heading {}°; {:.1} ranges per second. {}{}",
            millimetres(forecast.position),
            point(forecast.worst_at),
            degrees(forecast.heading),
            forecast.ranges_per_second,
            need.map_or_else(String::new, |need| verdict(candidate, need)),
            blind_note(forecast),
        ),
        columns: ["leg (m)", "m", "x (mm)", "y (mm)", "heading (°)", "blind (s)"]
            .map(str::to_owned)
            .to_vec(),
        rows: forecast.legs.iter().map(row).collect(),
    }
}

/// What starts without a pose on each leg lead to.
fn starts_table(starts: &Starts) -> Table {
    let metres = |metres: Option<f64>| metres.map_or("-".to_owned(), |m| format!("{m:.1}"));
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let row = |name: String, share: &Share| {
        vec![
            name,
            share.starts.to_string(),
            percent(share.right),
            percent(share.wrong),
            metres(share.median_metres),
            metres(share.most_metres),
        ]
    };
    let leg = |leg: &LegShare| row(format!("{} to {}", point(leg.from), point(leg.to)), &leg.share);
    let whole = row("all".to_owned(), &starts.all);
    Table {
        title: "Starts without a pose".to_owned(),
        note: format!(
            "Driving on for at most {:.0} s, back and forth on the path. Metres until the pose is unique and right: of half of \
             the starts, and of nine in ten.",
            starts.seconds
        ),
        columns: ["from leg (m)", "starts", "right", "wrong", "half (m)", "9 in 10 (m)"]
            .map(str::to_owned)
            .to_vec(),
        rows: starts.legs.iter().map(leg).chain([whole]).collect(),
    }
}

/// One line per sonar and heading aid.
fn comparison(candidates: &[Candidate], need: Option<f64>) -> Table {
    let mut columns = vec!["sonar", "beside it", "position (mm)", "worst at (m)", "heading (°)"];
    columns.extend(["longest blind (s)", "blind (%)", "ranges/s"]);
    columns.extend(need.into_iter().flat_map(|_| ["from a known start (mm)", "would do"]));
    let row = |candidate: &Candidate| {
        let Candidate { sensor, heading_aid, forecast, from_known_start, .. } = candidate;
        let mut row = vec![
            sensor.clone(),
            heading_aid.map_or("", HeadingAid::name).to_owned(),
            millimetres(forecast.position),
            point(forecast.worst_at),
            degrees(forecast.heading),
            format!("{:.0}", forecast.blind.first().map_or(0.0, |blind| blind.seconds)),
            format!("{:.0}", 100.0 * forecast.blind_share),
            format!("{:.1}", forecast.ranges_per_second),
        ];
        row.extend(from_known_start.map(millimetres));
        let keeps = |need: f64| if candidate.suffices(need) { "yes" } else { "no" };
        row.extend(need.map(|need| keeps(need).to_owned()));
        row
    };
    let note = match need {
        Some(need) => {
            format!(
                "A sonar suffices if, from a start that is known to 1 mm and 0.1°, the bound on the \
                 position stays within {need} mm; the second column includes the uncertainty of the start."
            )
        }
        None => {
            format!("Blind: for more than {BLIND_AFTER:.0} s the worst-known direction unseen.")
        }
    };
    Table {
        title: "Bound along the path, RMS / worst, the best sonar first".to_owned(),
        note,
        columns: columns.into_iter().map(str::to_owned).collect(),
        rows: candidates.iter().map(row).collect(),
    }
}

fn picture(scenario: &Scenario, candidate: &Candidate) -> HeatMap {
    let heat = |sample: &sonarfix_plan::Sample| Heat {
        at: sample.at,
        value: 1e3 * sample.position(),
        marked: sample.blind,
    };
    HeatMap {
        title: format!("{}: {}", scenario.name, candidate.name()),
        label: "bound on the position error (mm)".to_owned(),
        mark: format!("blind for more than {BLIND_AFTER:.0} s"),
        unmapped: Vec::new(),
        path: candidate.forecast.samples.iter().map(heat).collect(),
        ..HeatMap::of(scenario)
    }
}
