//! What is asked.

use std::collections::BTreeMap;

use serde::Serialize;
use sonarfix_boards::{Board, Kit};
use sonarfix_plan::preset::{ServoPreset, SonarPreset};
use thiserror::Error;

/// A question. Its answer is one line of text.
#[derive(Debug, Clone, Serialize)]
pub struct Question {
    /// The option of `sonarfix init`, without hyphens in front.
    pub option: &'static str,
    /// What is asked.
    pub what: &'static str,
    /// The possible answers; any other if there are none.
    pub known: Vec<String>,
    /// The usual answer, or an example of an optional one.
    pub default: &'static str,
    /// The usual answer of each board that is sold with a robot.
    pub of_kits: BTreeMap<String, String>,
    /// Whether a robot may have no answer.
    pub is_optional: bool,
}

/// An answer that is not possible.
#[derive(Debug, Clone, PartialEq, Eq, Error, Serialize)]
#[error("--{option}: {reason}")]
pub struct Refusal {
    /// The option of `sonarfix init`.
    pub option: &'static str,
    /// Why.
    pub reason: String,
}

/// The rangers that the boards can drive.
pub(crate) const SONARS: [SonarPreset; 4] =
    [SonarPreset::HcSr04, SonarPreset::LvMaxsonar, SonarPreset::Vl53l1x, SonarPreset::Vl53l0x];
/// The servos.
pub(crate) const SERVOS: [(&str, ServoPreset); 2] =
    [("sg90", ServoPreset::Sg90), ("mg996r", ServoPreset::Mg996r)];

/// All questions, in their order.
///
/// # Errors
/// If the table of the boards is invalid.
pub fn all() -> anyhow::Result<[Question; 8]> {
    let boards = sonarfix_boards::all()?;
    let of_kits = |answer: fn(&Kit) -> &String| {
        let of = |board: &Board| Some((board.name.clone(), answer(board.kit.as_ref()?).clone()));
        boards.iter().filter_map(of).collect()
    };
    let names = boards.iter().map(|board| board.name.clone()).collect();
    let sonars = SONARS.map(|sonar| sonar.file_name().to_owned()).to_vec();
    let servos = SERVOS.map(|(name, _)| name.to_owned()).to_vec();
    let choice = |option, what, known, default| Question {
        option,
        what,
        known,
        default,
        of_kits: BTreeMap::new(),
        is_optional: false,
    };
    let text = |option, what, default| choice(option, what, Vec::new(), default);
    let optional =
        |option, what, default| Question { is_optional: true, ..text(option, what, default) };
    Ok([
        choice("board", "board", names, "pico2"),
        choice("sonar", "sonar", sonars, "hc_sr04"),
        optional("second-at", "bearing of a second, fixed sonar", "90 deg"),
        choice("servo", "servo of the sonar", servos, "sg90"),
        Question {
            of_kits: of_kits(|kit| &kit.edges_per_revolution),
            ..text(
                "ticks-per-revolution",
                "encoder edges of both channels per revolution of the wheel",
                "1496.6",
            )
        },
        Question {
            of_kits: of_kits(|kit| &kit.wheel_diameter),
            ..text("wheel-diameter", "diameter of the wheels", "65 mm")
        },
        Question {
            of_kits: of_kits(|kit| &kit.track_width),
            ..text("track-width", "distance between the wheels' points of contact", "121 mm")
        },
        optional("room", "length and width of a rectangular room, metres", "4 x 3"),
    ])
}

impl Question {
    /// The usual answer for a board, if it is known.
    #[must_use]
    pub fn usual(&self, board: Option<&str>) -> &str {
        let of_kit = board.and_then(|board| self.of_kits.get(board));
        of_kit.map_or(self.default, String::as_str)
    }

    /// An answer without the space around it.
    ///
    /// # Errors
    /// If it is not among the known ones or has a character that no value has.
    pub fn check(&self, answer: &str) -> Result<String, Refusal> {
        let answer = answer.trim();
        let is_known = self.known.is_empty() || self.known.iter().any(|known| known == answer);
        if !is_known {
            let list = self.known.join(", ");
            return Err(self.refuse(format!("\"{answer}\" is not one of {list}")));
        }
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || " ._-".contains(letter);
        if answer.is_empty() || !answer.chars().all(is_plain) {
            let reason = format!("\"{answer}\" is no value; write, for example, {}", self.default);
            return Err(self.refuse(reason));
        }
        Ok(answer.to_owned())
    }

    fn refuse(&self, reason: String) -> Refusal {
        Refusal { option: self.option, reason }
    }
}
