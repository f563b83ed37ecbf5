//! The options of `sonarfix init`, and what is asked for those that are not given.

use std::path::PathBuf;

use anyhow::{Context, ensure};
use sonarfix_plan::preset::{ServoPreset, SonarPreset};

use super::question::Question;
use sonarfix_boards::Board;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder to make: a new or an empty one.
    pub dir: PathBuf,
    /// The board: its name in firmware/boards.toml.
    #[arg(long)]
    board: Option<String>,
    /// The ranger: `hc_sr04` or `lv_maxsonar`, or of light `vl53l1x` or `vl53l0x`.
    #[arg(long)]
    sonar: Option<String>,
    /// A second ranger of this kind at a fixed bearing, with its unit, for example "90 deg"; none without this option.
    #[arg(long, value_name = "BEARING", allow_hyphen_values = true)]
    second_at: Option<String>,
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
pub struct Answers {
    pub board: Board,
    pub sonar: SonarPreset,
    /// The bearing of a second one.
    pub second_at: Option<String>,
    pub servo: (&'static str, ServoPreset),
    pub wheel_diameter: String,
    pub track_width: String,
    pub ticks_per_revolution: f64,
}

/// The rangers that the boards can drive.
const SONARS: [SonarPreset; 4] =
    [SonarPreset::HcSr04, SonarPreset::LvMaxsonar, SonarPreset::Vl53l1x, SonarPreset::Vl53l0x];
const SERVOS: [(&str, ServoPreset); 2] =
    [("sg90", ServoPreset::Sg90), ("mg996r", ServoPreset::Mg996r)];

impl Answers {
    /// The options; for those that are not given, what the user answers on a terminal, or else the default.
    pub fn collect(args: &Args) -> anyhow::Result<Self> {
        let boards = sonarfix_boards::all()?;
        let names: Vec<&str> = boards.iter().map(|board| board.name.as_str()).collect();
        let board =
            Question::new("--board", "board", &names, "pico2").ask(args.board.as_deref())?;
        let board =
            boards.iter().find(|known| known.name == board).context("no such board")?.clone();
        let sonars = SONARS.map(SonarPreset::file_name);
        let sonar =
            Question::new("--sonar", "sonar", &sonars, "hc_sr04").ask(args.sonar.as_deref())?;
        let sonar = SonarPreset::named(&sonar).context("no such sonar")?;
        ensure!(
            !sonar.is_light() || board.bus.is_some(),
            "--sonar: the firmware of the {} has no I2C bus for a {}; the boards with one are listed in docs/firmware.md",
            board.title,
            sonar.name()
        );
        let ask =
            |bearing| Question::new("--second-at", "bearing", &[], "90 deg").ask(Some(bearing));
        let second_at = args.second_at.as_deref().map(ask).transpose()?;
        ensure!(
            second_at.is_none() || board.second.is_some(),
            "--second-at: the firmware of the {} has one ranger; the boards with two are listed in docs/firmware.md",
            board.title
        );
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
            sonar,
            second_at,
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
