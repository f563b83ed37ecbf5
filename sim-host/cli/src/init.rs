//! `sonarfix init`: a folder with the files of a new robot.

use std::fs;
use std::path::PathBuf;

use anyhow::ensure;
use sonarfix_new_robot::answers::Chosen;
use sonarfix_new_robot::{Answers, Files, question};
use sonarfix_terminal::output::check_folder;

use crate::warnings;

mod ask;

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
    /// A rectangular room of this length and width, metres, for example "4 x 3"; without this option a room of 4 m by 3 m with
    /// cupboards in one corner; for an XRP the walls of an arena on a table.
    #[arg(long, value_name = "LENGTH x WIDTH")]
    room: Option<String>,
}

impl Args {
    /// The answer to a question that an option gives.
    fn given(&self, option: &str) -> Option<String> {
        match option {
            "board" => self.board.clone(),
            "sonar" => self.sonar.clone(),
            "second-at" => self.second_at.clone(),
            "servo" => self.servo.clone(),
            "wheel-diameter" => self.wheel_diameter.clone(),
            "track-width" => self.track_width.clone(),
            "ticks-per-revolution" => self.ticks_per_revolution.map(|edges| edges.to_string()),
            "room" => self.room.clone(),
            _ => None,
        }
    }

    /// The options; for those that are not given, what the user answers on a terminal, or else the default.
    fn answers(&self) -> anyhow::Result<Answers> {
        let mut chosen = Chosen::new();
        for question in question::all()? {
            let answer = match self.given(question.option) {
                None if question.is_optional => continue,
                None => ask::ask(&question, chosen.get("board").map(String::as_str))?,
                Some(given) => given,
            };
            chosen.insert(question.option.to_owned(), question.check(&answer)?);
        }
        Answers::new(&chosen)
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let dir = &args.dir;
    let entries = fs::read_dir(dir).map(Iterator::count);
    ensure!(
        entries.as_ref().map_or(true, |count| *count == 0),
        "{} is not empty: name a new folder, so that no file is overwritten",
        dir.display()
    );
    // Before the questions.
    check_folder("the folder", dir)?;
    let written = write(args);
    if written.is_err() && entries.is_err() {
        // Only if it is empty.
        let _ = fs::remove_dir(dir);
    }
    written
}

fn write(args: &Args) -> anyhow::Result<()> {
    let dir = &args.dir;
    let files = Files::of(&args.answers()?)?;
    for (name, text) in files.all() {
        sonarfix_files::write(&dir.join(name), text)?;
    }
    let names = files.all().map(|(name, _)| dir.join(name).display().to_string());
    println!("wrote {}", names.join(", "));
    warnings::show(&[&dir.join("scenario.toml")]);
    println!("next: cd {}; sonarfix run scenario.toml --out report", dir.display());
    Ok(())
}
