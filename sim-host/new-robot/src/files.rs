//! The files of a new robot.

use std::f64::consts::PI;
use std::path::Path;

use anyhow::Context;
use sonarfix_boards::wiring::{self, Rangers};
use sonarfix_boards::{Board, Bus, Uf2};
use sonarfix_map::{MapFile, Mistake, Scenario, plausibility, robot_file, with_comments};

use crate::answers::Answers;
use crate::flash::{self, Part};
use crate::question::Refusal;

const ROBOT: &str = include_str!("../templates/robot.toml");
const MAP: &str = include_str!("../templates/map.toml");
const SCENARIO: &str = include_str!("../templates/scenario.toml");
const README: &str = include_str!("../templates/README.md");

/// The simulated track width and diameters of the right and the left wheel, as multiples of the configured ones.
const TRUE_TRACK_WIDTH: f64 = 1.02;
const TRUE_DIAMETERS: [f64; 2] = [1.01, 0.99];

/// Their texts, which are valid.
#[derive(Debug, Clone)]
pub struct Files {
    robot: String,
    map: String,
    scenario: String,
    readme: String,
    wiring: String,
}

impl Files {
    /// The files of these answers.
    ///
    /// # Errors
    /// If they are no valid robot: a length may have no unit, a path may be too near to the walls.
    pub fn of(answers: &Answers) -> anyhow::Result<Self> {
        let files = filled(answers).context(NO_ROBOT)?;
        Scenario::parse(&files.whole()?, "scenario.toml", Path::new("")).context(NO_ROBOT)?;
        Ok(files)
    }

    /// Name and text of each file.
    #[must_use]
    pub fn all(&self) -> [(&'static str, &str); 5] {
        [
            ("robot.toml", &self.robot),
            ("map.toml", &self.map),
            ("scenario.toml", &self.scenario),
            ("README.md", &self.readme),
            ("wiring.svg", &self.wiring),
        ]
    }

    /// The improbable values in them.
    ///
    /// # Errors
    /// None of files that are valid.
    pub fn warnings(&self) -> anyhow::Result<Vec<Mistake>> {
        Ok(plausibility::of_text(&self.whole()?, "scenario.toml", Path::new("")))
    }

    /// The UF2 that a board with a USB drive takes: a program, UF2 or ELF, with the configuration and the map.
    ///
    /// # Errors
    /// [`Refusal`], if the program is not for this board.
    pub fn uf2(&self, board: &Board, usb: &Uf2, program: &[u8]) -> anyhow::Result<Vec<u8>> {
        let image = flash::program(program, "the file", board, usb)
            .map_err(|error| Refusal { option: "program", reason: format!("{error:#}") })?;
        let (robot, map) = ("robot.toml", "map.toml");
        let config = robot_file::parse(&self.robot, robot)?;
        let walls = MapFile::parse(self.map.clone().into_bytes(), Path::new(map), None)?;
        let parts = [Part::configuration(&config, board, robot)?, Part::map(&walls, board, map)?];
        flash::combined(image, &parts, usb)
    }

    /// The scenario with the map and the robot that it names in it.
    fn whole(&self) -> anyhow::Result<String> {
        let table = |text: &str| text.parse::<toml::Table>();
        let mut scenario = table(&self.scenario)?;
        let (mut robot, mut map) = (table(&self.robot)?, table(&self.map)?);
        robot.remove("format");
        let walls = map.remove("map").context("a map has a table `map`")?;
        scenario.insert("robot".to_owned(), robot.into());
        scenario.insert("map".to_owned(), walls);
        Ok(scenario.to_string())
    }
}

const NO_ROBOT: &str = "these answers give no valid robot";

fn filled(answers: &Answers) -> anyhow::Result<Files> {
    let replacements = replacements(answers)?;
    let filled = |template: &str| {
        replacements.iter().fold(template.to_owned(), |text, (key, value)| {
            text.replace(&format!("@{key}@"), value)
        })
    };
    let (robot, map) = (with_comments(&filled(ROBOT)), filled(MAP));
    let configured = robot_file::parse(&robot, "robot.toml")?;
    // The simulated wheels differ from the configured ones.
    let width = TRUE_TRACK_WIDTH * f64::from(configured.localizer.drive.track_width.0);
    let circumference =
        answers.ticks_per_revolution * f64::from(configured.right_wheel.travel_per_edge.0);
    let [right, left] = TRUE_DIAMETERS.map(|factor| factor * circumference / PI);
    let built = [("true_track_width", width), ("true_right", right), ("true_left", left)];
    let scenario = built.into_iter().fold(filled(SCENARIO), |text, (key, metres)| {
        text.replace(&format!("@{key}@"), &format!("{:.2}", 1e3 * metres))
    });
    let rangers = Rangers {
        name: answers.sonar.name(),
        is_light: answers.sonar.is_light(),
        has_second: answers.second_at.is_some(),
    };
    let wiring = wiring::drawing(&answers.board, rangers);
    Ok(Files { robot, map, scenario, readme: filled(README), wiring })
}

/// The text for each key of the templates.
fn replacements(answers: &Answers) -> anyhow::Result<Vec<(&'static str, String)>> {
    let mut fitted = Scenario::paper()?;
    answers.sonar.fit(&mut fitted);
    let sonar = fitted.robot.localizer.rangers.first;
    let (board, pins, room) = (&answers.board, &answers.board.pins, &answers.room);
    let kit = board.kit.as_ref();
    let mirrored = kit.map_or("left", |kit| &kit.mirrored);
    let is_mirrored = |side| if side == mirrored { ", mirrored = true" } else { "" };
    let hexadecimal = |address: u32| format!("{address:#010X}").replace("0X", "0x");
    Ok(vec![
        ("title", board.title.clone()),
        ("board", board.name.clone()),
        ("package", board.package.clone()),
        ("target", board.target.clone()),
        ("chip", board.chip.clone()),
        ("port", board.port.clone()),
        ("usb", usb(answers, &hexadecimal(board.config.address), &hexadecimal(board.map.address))),
        ("config_address", hexadecimal(board.config.address)),
        ("map_address", hexadecimal(board.map.address)),
        ("map_bytes", board.map.bytes.to_string()),
        ("right_a", pins.right_a.clone()),
        ("right_b", pins.right_b.clone()),
        ("left_a", pins.left_a.clone()),
        ("left_b", pins.left_b.clone()),
        ("servo_pin", pins.servo.clone()),
        ("motors", motors(board)),
        ("rangers", wiring(answers)),
        ("table", if answers.second_at.is_some() { "[[sonar]]" } else { "[sonar]" }.to_owned()),
        ("second", second(answers)),
        ("tx", pins.tx.clone()),
        ("rx", pins.rx.clone()),
        ("sonar", answers.sonar.file_name().to_owned()),
        ("servo", answers.servo.0.to_owned()),
        ("max_wheel_speed", kit.map_or("1 m/s", |kit| &kit.max_wheel_speed).to_owned()),
        ("mirrored", mirrored.to_owned()),
        ("right_mirrored", is_mirrored("right").to_owned()),
        ("left_mirrored", is_mirrored("left").to_owned()),
        (
            "gyro",
            kit.map_or_else(String::new, |kit| format!("\n[gyro]\nsensor = \"{}\"\n", kit.gyro)),
        ),
        ("wheel_diameter", answers.wheel_diameter.clone()),
        ("track_width", answers.track_width.clone()),
        ("edges", answers.ticks_per_revolution.to_string()),
        ("cone", sonar.cone.to_degrees().to_string()),
        ("min_range", sonar.min_range.0.to_string()),
        ("max_range", sonar.max_range.0.to_string()),
        ("noise", sonar.noise.floor.0.to_string()),
        ("noise_per_metre", sonar.noise.per_metre.to_string()),
        ("walls", room.walls.clone()),
        ("start", format!("{:?}", room.start)),
        ("corners", room.corners.clone()),
        ("obstacles", room.obstacles.clone()),
        ("pose", format!("{:?} {:?}", room.start[0], room.start[1])),
    ])
}

/// The rows of the motor driver in the table of signals.
fn motors(board: &Board) -> String {
    let (pins, inputs) = (&board.pins, &board.inputs);
    let enable = pins.enable.as_ref().map_or_else(String::new, |pin| {
        format!("| enable of the motor driver, with a pull-down | {pin} |\n")
    });
    let motor = |side, first, second| {
        format!("| inputs of the motor driver: {side} motor {inputs} | {first}, {second} |\n")
    };
    let right = motor("right", &pins.right_1, &pins.right_2);
    enable + &right + &motor("left", &pins.left_1, &pins.left_2)
}

/// The rows of the rangers in the table of signals.
fn wiring(answers: &Answers) -> String {
    let Answers { board, sonar, second_at, .. } = answers;
    let pins = &board.pins;
    let rows = |which: &str, trigger: &str, echo: &str, bus: Option<&Bus>| match bus {
        Some(Bus { scl, sda }) if sonar.is_light() => {
            format!("| {which}, which gets 3.3 V: SCL, SDA | {scl}, {sda} |\n")
        }
        _ => {
            let through = board.divider.as_ref().map_or_else(String::new, |[upper, lower]| {
                format!(", through {upper} with {lower} to ground")
            });
            format!(
                "| trigger of the {which} | {trigger} |\n| echo of the {which}{through} | {echo} |\n"
            )
        }
    };
    let kind = if sonar.is_light() { "ranger" } else { "sonar" };
    let first = rows(kind, &pins.trigger, &pins.echo, board.bus.as_ref());
    let second =
        board.second.as_ref().filter(|_| second_at.is_some()).map_or_else(String::new, |pins| {
            rows(&format!("second {kind}"), &pins.trigger, &pins.echo, Some(&pins.bus))
        });
    first + &second
}

/// The table of a second ranger, which is like the first but does not turn. The keys have the placeholders of the template.
fn second(answers: &Answers) -> String {
    let Some(bearing) = &answers.second_at else { return String::new() };
    format!(
        "\n[[sonar]]\n\
         mount = [\"0 mm\", \"60 mm\"] # measure:\n\
         bearing = \"{bearing}\"\n\
         cone = \"@cone@ deg\"\n\
         min_range = \"@min_range@ m\"\n\
         max_range = \"@max_range@ m\"\n\
         noise = \"@noise@ m\"\n\
         noise_per_metre = \"@noise_per_metre@ m/m\"\n\
         ranger = \"@sonar@\"\n"
    )
}

/// How to write program and images over USB, on a board that can.
fn usb(answers: &Answers, config: &str, map: &str) -> String {
    let board = &answers.board;
    if !board.usb {
        return String::new();
    }
    let program = format!("firmware/target/{}/release/{}", board.target, board.package);
    format!(
        "\nWithout a probe, over USB: build the program in the folder `firmware` of the repository (`rustup` and `flip-link` as above),\n\n\
         ```sh\ncargo build --release --package {} --target {}\n```\n\nhold `BOOTSEL` while plugging the board in, bake the two \
         files as above, and write everything from this folder, with the path of the\nrepository in place of \
         `../sonarfix`:\n\n```sh\npicotool load -t bin -o {config} config.bin\npicotool load -t bin -o {map} map.bin\n\
         picotool load -x -t elf ../sonarfix/{program}\n```\n",
        board.package, board.target
    )
}
