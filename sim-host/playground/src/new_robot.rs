//! The form of a new robot: the questions and the files of `sonarfix init`.

use serde::Serialize;
use sonarfix_boards::Board;
use sonarfix_new_robot::answers::Chosen;
use sonarfix_new_robot::{Answers, Files, Refusal, question};

use crate::archive;
use crate::warning::Warning;

/// What the page shows for its answers.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Shown {
    Robot {
        files: Vec<(&'static str, String)>,
        warnings: Vec<Warning>,
        /// The package of the board's program.
        package: String,
        /// The board's USB drive, if it takes UF2 files.
        drive: Option<String>,
        /// Whether the archive has a UF2.
        uf2: bool,
    },
    Error {
        error: String,
        option: Option<&'static str>,
    },
}

/// The files of a robot, and its UF2 if there are a program and a board that takes one.
struct Made {
    board: Board,
    files: Files,
    uf2: Option<Vec<u8>>,
}

impl Made {
    /// `request` has the answers in JSON, by their options. An empty `program` means that no program was chosen.
    fn of(request: &str, program: &[u8]) -> anyhow::Result<Self> {
        let chosen: Chosen = serde_json::from_str(request)?;
        let answers = Answers::new(&chosen)?;
        let (files, board) = (Files::of(&answers)?, answers.board);
        let usb = board.uf2.as_ref().filter(|_| !program.is_empty());
        let uf2 = usb.map(|usb| files.uf2(&board, usb, program)).transpose()?;
        Ok(Self { board, files, uf2 })
    }

    fn shown(self) -> anyhow::Result<Shown> {
        let Self { board, files, uf2 } = self;
        let warnings = files.warnings()?;
        Ok(Shown::Robot {
            warnings: warnings.iter().map(Warning::from).collect(),
            files: files.all().map(|(name, text)| (name, text.to_owned())).to_vec(),
            package: board.package,
            drive: board.uf2.map(|usb| usb.drive),
            uf2: uf2.is_some(),
        })
    }
}

/// The questions in JSON.
#[must_use]
pub fn questions() -> String {
    let questions = question::all().map(Vec::from).unwrap_or_default();
    serde_json::to_string(&questions).unwrap_or_default()
}

/// Answers the answers in JSON with JSON: `{"files": …, "warnings": …, "package": …, "drive": …, "uf2": …}` or
/// `{"error": …, "option": …}`.
#[must_use]
pub fn answer(request: &str, program: &[u8]) -> String {
    let shown = Made::of(request, program).and_then(Made::shown);
    let shown = shown.unwrap_or_else(|error| match error.downcast_ref::<Refusal>() {
        Some(Refusal { option, reason }) => {
            Shown::Error { error: reason.clone(), option: Some(option) }
        }
        None => Shown::Error { error: format!("{error:#}"), option: None },
    });
    serde_json::to_string(&shown).unwrap_or_default()
}

/// The files of the answers as a ZIP archive with the folder `robot`; empty if they have none.
#[must_use]
pub fn zip(request: &str, program: &[u8]) -> Vec<u8> {
    let Ok(Made { files, uf2, .. }) = Made::of(request, program) else { return Vec::new() };
    let texts = files.all().map(|(name, text)| (name, text.as_bytes()));
    let uf2 = uf2.as_ref().map(|uf2| ("robot.uf2", uf2.as_slice()));
    let all = texts.into_iter().chain(uf2).map(|(name, bytes)| (format!("robot/{name}"), bytes));
    // Writing to memory does not fail.
    archive::write(&all.collect::<Vec<_>>()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use sonarfix_boards::image::Image;
    use sonarfix_boards::uf2;
    use sonarfix_map::{MapFile, robot_file};
    use sonarfix_new_robot::flash;

    fn usual() -> Value {
        let questions: Vec<Value> = serde_json::from_str(&questions()).unwrap();
        let is_asked = |it: &&Value| !it["is_optional"].as_bool().unwrap();
        let asked = questions.iter().filter(is_asked);
        asked.map(|it| (it["option"].as_str().unwrap().to_owned(), it["default"].clone())).collect()
    }

    fn answered(changes: &[(&str, &str)]) -> Value {
        let mut request = usual();
        for (option, answer) in changes {
            request[option] = json!(answer);
        }
        serde_json::from_str(&answer(&request.to_string(), &[])).unwrap()
    }

    #[test]
    fn the_usual_robot_has_files_and_no_warnings() {
        for room in ["", "4 x 3", "12 x 7.5"] {
            let shown = answered(&[("room", room)]);
            assert_eq!(shown["warnings"], json!([]), "{room}");
            assert_eq!(shown["files"].as_array().unwrap().len(), 5);
        }
    }

    #[test]
    fn improbable_values_are_warned_of_with_the_intention() {
        for (change, key, reason) in [
            (("wheel-diameter", "650 mm"), "wheel", "65 mm"),
            (("track-width", "1.21 m"), "track_width", "usual are 0.15 to 16"),
            (("ticks-per-revolution", "3"), "edges_per_revolution", "implausible"),
        ] {
            let shown = answered(&[change]);
            let warnings = shown["warnings"].as_array().cloned().unwrap_or_default();
            let is_named = |it: &Value| {
                let [key_of, message] = ["key", "message"].map(|part| it[part].as_str().unwrap());
                key_of.contains(key) && message.contains(reason)
            };
            assert!(warnings.iter().any(is_named), "{change:?}: {shown}");
        }
    }

    #[test]
    fn impossible_answers_name_their_question() {
        for (option, answer, reason) in [
            ("board", "arduino", "pico2"),
            ("track-width", "12\" }", "is no value"),
            ("ticks-per-revolution", "0", "positive"),
            ("room", "4 m", "4 x 3"),
            ("room", "4 x 0", "4 x 3"),
        ] {
            let shown = answered(&[(option, answer)]);
            assert_eq!(shown["option"], option, "{shown}");
            assert!(shown["error"].as_str().unwrap().contains(reason), "{shown}");
        }
        let shown = answered(&[("wheel-diameter", "65")]);
        assert!(shown["error"].as_str().unwrap().contains("a unit is missing"), "{shown}");
    }

    /// The parts of the archive, found by its directory.
    #[test]
    fn the_archive_has_the_files() {
        let archive = zip(&usual().to_string(), &[]);
        let number = |at: usize, bytes: usize| {
            archive[at..at + bytes].iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))
        };
        let end = archive.len() - 22;
        assert_eq!(&archive[end..end + 4], b"PK\x05\x06");
        let mut at = number(end + 16, 4);
        assert_eq!(number(end + 12, 4), end - at);
        for file in answered(&[])["files"].as_array().unwrap() {
            let [name, text] = [0, 1].map(|part| file[part].as_str().unwrap());
            let [size, length, from] =
                [(24, 4), (28, 2), (42, 4)].map(|(n, bytes)| number(at + n, bytes));
            let path = format!("robot/{name}");
            assert_eq!(&archive[at + 46..at + 46 + length], path.as_bytes());
            let data = from + 30 + length;
            assert_eq!(&archive[data..data + size], text.as_bytes());
            assert_eq!(&archive[from..from + 4], b"PK\x03\x04");
            at += 46 + length;
        }
        assert_eq!(at, end);
        assert!(zip("{}", &[]).is_empty());
    }

    /// A program of 5,000 bytes for a family.
    fn program(family: u32) -> Vec<u8> {
        let mut image = Image::default();
        image.add("the program", 0x1000_0000, &[0x5A; 5000]).unwrap();
        uf2::write(&image, family).unwrap()
    }

    /// The UF2 has the program, and what `sonarfix flash` adds to it, at the addresses of the board.
    #[test]
    fn a_program_makes_the_uf2_of_the_robot() {
        let request = usual().to_string();
        let board = sonarfix_boards::named("pico2").unwrap();
        let program = program(board.uf2.unwrap().family);
        let shown: Value = serde_json::from_str(&answer(&request, &program)).unwrap();
        assert_eq!((&shown["uf2"], &shown["drive"]), (&json!(true), &json!("RP2350")), "{shown}");
        let archive = zip(&request, &program);
        let at = archive.windows(4).position(|bytes| bytes == b"UF2\n").unwrap();
        let end = archive.windows(4).position(|bytes| bytes == b"PK\x01\x02").unwrap();
        let (image, _) = uf2::read(&archive[at..end]).unwrap();
        assert_eq!(image.at(0x1000_0000, 5000), Some(vec![0x5A; 5000]));
        let text = |name| {
            let files = shown["files"].as_array().unwrap();
            files.iter().find(|file| file[0] == name).unwrap()[1].as_str().unwrap().to_owned()
        };
        let config = robot_file::parse(&text("robot.toml"), "").unwrap();
        let config = flash::configuration(&config).unwrap();
        assert_eq!(image.at(board.config.address, config.len()), Some(config));
        let map = MapFile::parse(text("map.toml").into(), "map.toml".as_ref(), None).unwrap();
        let map = flash::image(&map).unwrap();
        assert_eq!(image.at(board.map.address, map.len()), Some(map));
    }

    #[test]
    fn a_program_of_another_board_is_refused_and_a_board_without_a_drive_needs_none() {
        let program = program(0xe48b_ff56);
        let refused: Value = serde_json::from_str(&answer(&usual().to_string(), &program)).unwrap();
        assert_eq!(refused["option"], "program");
        assert!(
            refused["error"].as_str().unwrap().contains("for a Raspberry Pi Pico "),
            "{refused}"
        );
        assert!(zip(&usual().to_string(), &program).is_empty());
        let mut request = usual();
        request["board"] = json!("stm32f405");
        let shown: Value = serde_json::from_str(&answer(&request.to_string(), &program)).unwrap();
        assert_eq!((&shown["uf2"], &shown["drive"]), (&json!(false), &json!(null)), "{shown}");
    }
}
