//! The answers to all questions.

use std::collections::BTreeMap;

use anyhow::Context;
use sonarfix_boards::Board;
use sonarfix_plan::preset::{ServoPreset, SonarPreset};

use crate::question::{self, Refusal, SERVOS, SONARS};
use crate::room::Room;

/// The answer to each question by its option; an optional one may be missing.
pub type Chosen = BTreeMap<String, String>;

/// The answers.
#[derive(Debug, Clone)]
pub struct Answers {
    /// The board.
    pub board: Board,
    /// The ranger.
    pub sonar: SonarPreset,
    /// The bearing of a second one.
    pub second_at: Option<String>,
    /// The servo, with its name in files.
    pub servo: (&'static str, ServoPreset),
    /// With its unit.
    pub wheel_diameter: String,
    /// With its unit.
    pub track_width: String,
    /// Edges of both channels of an encoder per revolution of the wheel.
    pub ticks_per_revolution: f64,
    /// The room.
    pub room: Room,
}

impl Answers {
    /// The answers, checked one by one and together.
    ///
    /// # Errors
    /// [`Refusal`], or if an answer is missing.
    pub fn new(chosen: &Chosen) -> anyhow::Result<Self> {
        let mut checked = Chosen::new();
        for question in question::all()? {
            let answer = chosen.get(question.option);
            let answer = answer.filter(|answer| !question.is_optional || !answer.trim().is_empty());
            if let Some(answer) = answer {
                checked.insert(question.option.to_owned(), question.check(answer)?);
            }
        }
        let answer = |option: &str| {
            checked.get(option).cloned().with_context(|| format!("--{option} is missing"))
        };
        let board = sonarfix_boards::named(&answer("board")?)?;
        let (sonar, servo) = (answer("sonar")?, answer("servo")?);
        let room = match checked.get("room") {
            Some(room) => Room::rectangle(room)?,
            None if board.kit.is_some() => Room::arena(),
            None => Room::example(),
        };
        let answers = Self {
            board,
            sonar: SONARS
                .into_iter()
                .find(|known| known.file_name() == sonar)
                .context("no such sonar")?,
            second_at: checked.get("second-at").cloned(),
            servo: SERVOS.into_iter().find(|(name, _)| *name == servo).context("no such servo")?,
            wheel_diameter: answer("wheel-diameter")?,
            track_width: answer("track-width")?,
            ticks_per_revolution: positive(&answer("ticks-per-revolution")?)?,
            room,
        };
        answers.check()?;
        Ok(answers)
    }

    /// Whether the board has what the rangers need.
    fn check(&self) -> Result<(), Refusal> {
        let Self { board, sonar, .. } = self;
        let refusal = |option, reason| Err(Refusal { option, reason });
        if sonar.is_light() && board.bus.is_none() {
            let reason = format!(
                "the firmware of the {} has no I2C bus for a {}; the boards with one are listed in docs/firmware.md",
                board.title,
                sonar.name()
            );
            return refusal("sonar", reason);
        }
        if self.second_at.is_some() && board.second.is_none() {
            let reason = format!(
                "the firmware of the {} has one ranger; the boards with two are listed in docs/firmware.md",
                board.title
            );
            return refusal("second-at", reason);
        }
        Ok(())
    }
}

fn positive(edges: &str) -> Result<f64, Refusal> {
    let number = edges.parse().ok().filter(|number| *number > 0.0 && f64::is_finite(*number));
    number.ok_or_else(|| Refusal {
        option: "ticks-per-revolution",
        reason: format!("\"{edges}\" is not a positive number"),
    })
}
