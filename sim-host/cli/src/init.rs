//! `sonarfix init`: a folder with the files of a new robot.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, ensure};
use sonarfix_map::{MapFile, Scenario, robot_file};
use sonarfix_plan::preset::{ServoPreset, SonarPreset};

use crate::boards::{self, Board};
use question::Question;

mod question;
mod texts;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder to make: a new or an empty one.
    dir: PathBuf,
    /// The board: its name in firmware/boards.toml.
    #[arg(long)]
    board: Option<String>,
    /// The sonar: `hc_sr04` or `lv_maxsonar`, which the boards can drive.
    #[arg(long)]
    sonar: Option<String>,
    /// The servo of the sonar: sg90 or mg996r.
    #[arg(long)]
    servo: Option<String>,
    /// The diameter of the wheels, with its unit.
    #[arg(long, value_name = "LENGTH")]
    wheel_diameter: Option<String>,
    /// The distance between the points where the wheels touch the floor, with its unit.
    #[arg(long, value_name = "LENGTH")]
    track_width: Option<String>,
    /// Edges of both channels of an encoder per revolution of the wheel: lines x 4 x gear ratio.
    #[arg(long, value_name = "EDGES")]
    ticks_per_revolution: Option<f64>,
}

/// The answers to all questions.
struct Answers {
    board: Board,
    sonar: SonarPreset,
    servo: (&'static str, ServoPreset),
    wheel_diameter: String,
    track_width: String,
    ticks_per_revolution: f64,
}

/// The sonars that the boards can drive.
const SONARS: [SonarPreset; 2] = [SonarPreset::HcSr04, SonarPreset::LvMaxsonar];
const SERVOS: [(&str, ServoPreset); 2] =
    [("sg90", ServoPreset::Sg90), ("mg996r", ServoPreset::Mg996r)];

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let dir = &args.dir;
    let entries = fs::read_dir(dir).map(Iterator::count);
    ensure!(
        entries.as_ref().map_or(true, |count| *count == 0),
        "{} is not empty: name a new folder, so that no file is overwritten",
        dir.display()
    );
    let answers = Answers::collect(args)?;
    let files = texts::all(&answers)?;
    check(&files)?;
    fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
    for (name, text) in &files {
        let file = dir.join(name);
        fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))?;
    }
    println!("wrote {}", files.map(|(name, _)| dir.join(name).display().to_string()).join(", "));
    println!("next: cd {}; sonarfix run scenario.toml --out report", dir.display());
    Ok(())
}

/// Checks the files before the folder is made: a length may have no unit, a path may be too fast for the wheels.
fn check(files: &[(&str, String); 4]) -> anyhow::Result<()> {
    let trial = std::env::temp_dir().join(format!("sonarfix-init-{}", std::process::id()));
    fs::create_dir_all(&trial).with_context(|| format!("cannot make {}", trial.display()))?;
    let read = || -> anyhow::Result<()> {
        for (name, text) in files {
            fs::write(trial.join(name), text)?;
        }
        robot_file::read(&trial.join("robot.toml"))?;
        MapFile::read(&trial.join("map.toml"), None)?;
        Scenario::read(&trial.join("scenario.toml"))?;
        Ok(())
    };
    let result = read();
    // What remains there harms nobody.
    let _ = fs::remove_dir_all(&trial);
    result.context("these answers give no valid robot")
}

impl Answers {
    /// The options; for those that are not given, what the user answers on a terminal, or else the default.
    fn collect(args: &Args) -> anyhow::Result<Self> {
        let boards = boards::all()?;
        let names: Vec<&str> = boards.iter().map(|board| board.name.as_str()).collect();
        let board =
            Question::new("--board", "board", &names, "pico2").ask(args.board.as_deref())?;
        let board =
            boards.iter().find(|known| known.name == board).context("no such board")?.clone();
        let sonars = SONARS.map(SonarPreset::file_name);
        let sonar =
            Question::new("--sonar", "sonar", &sonars, "hc_sr04").ask(args.sonar.as_deref())?;
        let servos = SERVOS.map(|(name, _)| name);
        let servo = Question::new("--servo", "servo of the sonar", &servos, "sg90")
            .ask(args.servo.as_deref())?;
        let length = |option, what, default, given: &Option<String>| {
            Question::new(option, what, &[], default).ask(given.as_deref())
        };
        let edges = args.ticks_per_revolution.map(|edges| edges.to_string());
        let what = "encoder edges of both channels per revolution of the wheel";
        let edges = length("--ticks-per-revolution", what, "1496.6", &edges)?;
        Ok(Self {
            board,
            sonar: SonarPreset::named(&sonar).context("no such sonar")?,
            servo: SERVOS.into_iter().find(|(name, _)| *name == servo).context("no such servo")?,
            wheel_diameter: length(
                "--wheel-diameter",
                "diameter of the wheels",
                "65 mm",
                &args.wheel_diameter,
            )?,
            track_width: length(
                "--track-width",
                "distance between the wheels' points of contact",
                "121 mm",
                &args.track_width,
            )?,
            ticks_per_revolution: positive(&edges)?,
        })
    }
}

fn positive(edges: &str) -> anyhow::Result<f64> {
    let number = edges.parse().ok().filter(|number| *number > 0.0 && f64::is_finite(*number));
    number.with_context(|| format!("--ticks-per-revolution: \"{edges}\" is not a positive number"))
}
