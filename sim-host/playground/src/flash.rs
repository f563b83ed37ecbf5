//! Flashing an ESP32-C6 from a page: what `sonarfix flash` writes to it, of the files of a robot and a program.

use std::path::Path;

use anyhow::{Context, bail};
use md5::{Digest as _, Md5};
use serde::{Deserialize, Serialize};
use sonarfix_boards::{Board, esp};
use sonarfix_map::plausibility::{self, Kind};
use sonarfix_map::{MapFile, robot_file};
use sonarfix_new_robot::Refusal;
use sonarfix_new_robot::flash::{self, Part};

use crate::archive;
use crate::warning::Warning;

/// The board.
const BOARD: &str = "esp32c6";
/// The files of a robot in an archive, as `sonarfix init` and the form name them.
const IN_ARCHIVE: [&str; 2] = ["robot.toml", "map.toml"];

/// What was chosen on the page.
#[derive(Debug, Deserialize)]
struct Request {
    /// A robot file and a map; or neither, and an archive with both.
    files: Vec<File>,
    /// The name of the program's file.
    program: String,
}

#[derive(Debug, Deserialize)]
struct File {
    name: String,
    text: String,
}

/// What is written.
#[derive(Debug, Serialize)]
struct Written {
    what: &'static str,
    address: u32,
    /// Bytes.
    length: usize,
    /// That which the robot reports, in hexadecimal digits.
    checksum: Option<String>,
    #[serde(skip)]
    bytes: Vec<u8>,
}

/// What the page shows.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Shown {
    Parts { parts: Vec<Written>, warnings: Vec<Warning> },
    Error { error: String, option: &'static str },
}

/// Answers a request in JSON with JSON, `{"parts": …, "warnings": …}` or `{"error": …, "option": …}`, and the bytes of each part:
/// configuration, map, and program if one was chosen. An empty `archive` or `program` was not chosen.
#[must_use]
pub fn answer(request: &str, archive: &[u8], program: &[u8]) -> (String, Vec<Vec<u8>>) {
    let shown = parts(request, archive, program).unwrap_or_else(|error| {
        let refusal = error.downcast_ref::<Refusal>();
        let option = refusal.map_or("robot", |it| it.option);
        let error = refusal.map_or_else(|| format!("{error:#}"), |it| it.reason.clone());
        Shown::Error { error, option }
    });
    let json = serde_json::to_string(&shown).unwrap_or_default();
    let parts = if let Shown::Parts { parts, .. } = shown { parts } else { Vec::new() };
    (json, parts.into_iter().map(|part| part.bytes).collect())
}

fn parts(request: &str, archive: &[u8], program: &[u8]) -> anyhow::Result<Shown> {
    let Request { mut files, program: name } = serde_json::from_str(request)?;
    let board = sonarfix_boards::named(BOARD)?;
    if !archive.is_empty() {
        for (name, bytes) in archive::read(archive, &IN_ARCHIVE)? {
            files.push(File { name, text: String::from_utf8(bytes).context("it is no text")? });
        }
    }
    let [robot, map] = [(Kind::Robot, "robot file"), (Kind::Map, "map")]
        .map(|(kind, what)| the_only(&files, kind, what));
    let (robot, map) = (robot?, map?);
    let config = robot_file::parse(&robot.text, &robot.name)?;
    let walls = MapFile::parse(map.text.clone().into_bytes(), Path::new(&map.name), None)?;
    let baked =
        [Part::configuration(&config, &board, &robot.name)?, Part::map(&walls, &board, &map.name)?];
    let mut parts = Vec::from(baked.map(Written::from));
    if !program.is_empty() {
        parts.push(written_program(program, &name, &board)?);
    }
    let warnings = [robot, map].map(|it| plausibility::of_text(&it.text, &it.name, Path::new("")));
    Ok(Shown::Parts { parts, warnings: warnings.iter().flatten().map(Warning::from).collect() })
}

/// The file of this kind, if there is one and no more.
fn the_only<'a>(files: &'a [File], kind: Kind, what: &str) -> anyhow::Result<&'a File> {
    let mut found = files.iter().filter(|file| plausibility::kind(&file.text) == kind);
    match (found.next(), found.next()) {
        (Some(file), None) => Ok(file),
        (None, _) => bail!("there is no {what}: choose robot.zip, or both robot.toml and map.toml"),
        (Some(file), Some(other)) => {
            bail!("{} and {}: which {what}? Choose one", file.name, other.name)
        }
    }
}

fn written_program(file: &[u8], name: &str, board: &Board) -> anyhow::Result<Written> {
    let image = flash::esp_program(file, name, board)
        .map_err(|error| Refusal { option: "program", reason: format!("{error:#}") })?;
    let (what, address, length) = ("the program", esp::PROGRAM, image.len());
    Ok(Written { what, address, length, checksum: None, bytes: image })
}

impl From<Part> for Written {
    fn from(Part { what, region, bytes, checksum }: Part) -> Self {
        let checksum = Some(format!("{checksum:08x}"));
        Self { what, address: region.address, length: bytes.len(), checksum, bytes }
    }
}

/// The MD5 of some bytes in hexadecimal digits, as the boot ROM computes it of a range of flash.
#[must_use]
pub fn md5(bytes: &[u8]) -> String {
    format!("{:032x}", u128::from_be_bytes(Md5::digest(bytes).into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use sonarfix_boards::made::{elf, segment};
    use sonarfix_map::Scenario;

    fn robot() -> [File; 2] {
        let scenario = Scenario::parse(sonarfix_map::CLASSROOM, "", "".as_ref()).unwrap();
        [
            ("my_robot.toml", robot_file::text(&scenario.robot)),
            ("room.toml", scenario.floor.to_toml()),
        ]
        .map(|(name, text)| File { name: name.to_owned(), text })
    }

    fn program() -> Vec<u8> {
        esp::write(&elf(0x4080_0000, &[segment(0x4200_0020, &[0x5A; 5000])])).unwrap()
    }

    fn answered(files: &[&File], archive: &[u8], program: &[u8]) -> (Value, Vec<Vec<u8>>) {
        let files: Vec<_> =
            files.iter().map(|it| json!({ "name": it.name, "text": it.text })).collect();
        let request = json!({ "files": files, "program": "robot.bin" });
        let (shown, bytes) = answer(&request.to_string(), archive, program);
        (serde_json::from_str(&shown).unwrap(), bytes)
    }

    /// The parts are those of `sonarfix flash`, whether the files come alone or in an archive.
    #[test]
    fn the_files_of_a_robot_become_parts_of_its_flash() {
        let [robot, map] = robot();
        let board = sonarfix_boards::named(BOARD).unwrap();
        let config = robot_file::parse(&robot.text, "").unwrap();
        let config = Part::configuration(&config, &board, "").unwrap();
        let walls = MapFile::parse(map.text.clone().into(), "".as_ref(), None).unwrap();
        let walls = Part::map(&walls, &board, "").unwrap();
        let program = program();
        let (shown, bytes) = answered(&[&map, &robot], &[], &program);
        assert_eq!(bytes, [config.bytes, walls.bytes, program.clone()]);
        let part = |what: &str, address: u32, index: usize, checksum: Option<u32>| {
            let checksum = checksum.map(|it| format!("{it:08x}"));
            json!({ "what": what, "address": address, "length": bytes[index].len(), "checksum": checksum })
        };
        let expected = json!([
            part("the configuration", board.config.address, 0, Some(config.checksum)),
            part("the map", board.map.address, 1, Some(walls.checksum)),
            part("the program", esp::PROGRAM, 2, None),
        ]);
        assert_eq!(shown["parts"], expected, "{shown}");
        let names = ["robot/robot.toml", "robot/map.toml"].map(str::to_owned);
        let [first, second] = names;
        let packed =
            archive::write(&[(first, robot.text.as_bytes()), (second, map.text.as_bytes())]);
        let (in_archive, of_archive) = answered(&[], &packed.unwrap(), &[]);
        assert_eq!((of_archive.as_slice(), &in_archive["parts"][0]), (&bytes[..2], &expected[0]));
    }

    #[test]
    fn what_is_wrong_names_the_choice() {
        let [robot, map] = robot();
        let wrong = File { name: "wrong.toml".to_owned(), text: robot.text.replace("mm", "kg") };
        let both = [&robot, &map];
        let of_another = elf(0, &[segment(0x0800_0000, &[1; 64])]);
        let large = elf(0, &[segment(0x4200_0020, &vec![1; 0xF_0000])]);
        let refused = |files: &[&File], archive: &[u8], program: &[u8], option, reason| {
            let (shown, bytes) = answered(files, archive, program);
            assert!(bytes.is_empty() && shown["option"] == option, "{shown}");
            assert!(shown["error"].as_str().unwrap().contains(reason), "{shown}");
        };
        refused(&[&robot], &[], &[], "robot", "there is no map");
        refused(&[&map], &[], &[], "robot", "there is no robot file");
        refused(&[&robot, &map, &robot], &[], &[], "robot", "which robot file?");
        refused(&[&wrong, &map], &[], &[], "robot", "wrong.toml:");
        refused(&[], b"PK", &[], "robot", "no ZIP archive");
        refused(&both, &[], &of_another, "program", "robot.bin is no program for the ESP32-C6");
        refused(&both, &[], &large, "program", "has room for 983040");
    }

    /// The values of RFC 1321, A.5.
    #[test]
    fn md5_is_that_of_the_standard() {
        assert_eq!(md5(b""), "d41d8cd98f00b204e9800998ecf8427e");
        assert_eq!(md5(b"message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
    }
}
