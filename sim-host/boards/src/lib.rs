//! The boards that have firmware: the table `firmware/boards.toml`, and the files of their programs.
//!
//! | module | what |
//! |---|---|
//! | [`image`] | contents of flash by address: of an ELF, with further parts |
//! | [`uf2`] | the file that a board takes on its USB drive |
//! | [`drive`] | that drive |
//! | [`esp`] | the file that the bootloader of an ESP32-C6 starts |
//! | [`wiring`] | a drawing of the parts beside the board |
//! | [`made`] | made ELF files, for tests |

pub mod drive;
pub mod esp;
pub mod image;
pub mod made;
pub mod uf2;
pub mod wiring;

use anyhow::Context;
use serde::Deserialize;

const TABLE: &str = include_str!("../../../firmware/boards.toml");

/// A board.
#[derive(Debug, Clone, Deserialize)]
pub struct Board {
    /// Its name on the command line.
    pub name: String,
    /// Its full name.
    pub title: String,
    /// The package of its firmware.
    pub package: String,
    /// The target that it is built for.
    pub target: String,
    /// Its chip, as `probe-rs` calls it.
    pub chip: String,
    /// Where the baked configuration lies.
    pub config: Region,
    /// Where the baked map lies.
    pub map: Region,
    /// The linker's memory map, from the top of the repository.
    pub memory: String,
    /// Whether programs and images can be written over USB.
    pub usb: bool,
    /// Its USB drive, if it takes UF2 files.
    pub uf2: Option<Uf2>,
    /// Where the PC meets the link.
    pub port: String,
    /// Where the board takes 5 V.
    pub feed: String,
    /// The resistors between echo and ground, upper and lower; none where the sonar has 3.3 V.
    pub divider: Option<[String; 2]>,
    /// What both inputs of the motor driver for a motor are.
    #[serde(default = "inputs_by_direction")]
    pub inputs: String,
    /// Its pins.
    pub pins: Pins,
    /// The I²C bus of the first ranger and of the gyro, if it has one.
    pub bus: Option<Bus>,
    /// The pins of a second ranger, if it has them.
    pub second: Option<Second>,
    /// The robot that the board is sold with.
    pub kit: Option<Kit>,
}

fn inputs_by_direction() -> String {
    "forwards, backwards".to_owned()
}

impl Board {
    /// The address at which its flash starts: a multiple of 16 MiB, below the configuration.
    #[must_use]
    pub fn start_of_flash(&self) -> u32 {
        self.config.address & 0xFF00_0000
    }
}

/// What a board takes on its USB drive.
#[derive(Debug, Clone, Deserialize)]
pub struct Uf2 {
    /// The family of its chip in a UF2 file.
    pub family: u32,
    /// Its `Board-ID` in the file `INFO_UF2.TXT` of the drive.
    pub drive: String,
}

/// A robot that is sold with its board.
#[derive(Debug, Clone, Deserialize)]
pub struct Kit {
    /// The connector of the right motor and its encoder.
    pub right: String,
    /// That of the left ones.
    pub left: String,
    /// That of the sonar.
    pub sonar: String,
    /// That of the servo.
    pub servo: String,
    /// That of the link.
    pub link: String,
    /// With its unit.
    pub wheel_diameter: String,
    /// With its unit.
    pub track_width: String,
    /// Edges of both channels of an encoder per revolution of the wheel.
    pub edges_per_revolution: String,
    /// With its unit.
    pub max_wheel_speed: String,
    /// The wheel whose encoder counts backwards: `right` or `left`.
    pub mirrored: String,
    /// The gyro on the board, as a robot file names it.
    pub gyro: String,
}

/// The pins of an I²C bus.
#[derive(Debug, Clone, Deserialize)]
pub struct Bus {
    /// The clock.
    pub scl: String,
    /// The data.
    pub sda: String,
}

/// The pins of a second ranger.
#[derive(Debug, Clone, Deserialize)]
pub struct Second {
    /// Trigger of a sonar.
    pub trigger: String,
    /// Echo of a sonar, behind a divider like that of the first.
    pub echo: String,
    /// The pulses of its servo, if it has one.
    pub servo: String,
    /// The bus of a ranger of light.
    pub bus: Bus,
}

/// A region of flash.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Region {
    /// First address.
    pub address: u32,
    /// Size, bytes.
    pub bytes: u32,
}

/// The pin of each signal.
#[derive(Debug, Clone, Deserialize)]
pub struct Pins {
    /// Channel A of the right encoder.
    pub right_a: String,
    /// Channel B of the right encoder.
    pub right_b: String,
    /// Channel A of the left encoder.
    pub left_a: String,
    /// Channel B of the left encoder.
    pub left_b: String,
    /// The servo's pulses.
    pub servo: String,
    /// Trigger of the sonar.
    pub trigger: String,
    /// Echo of the sonar, behind the divider.
    pub echo: String,
    /// Enable of the motor driver, if it has one.
    pub enable: Option<String>,
    /// First input of the motor driver for the right motor.
    pub right_1: String,
    /// Second input of the motor driver for the right motor.
    pub right_2: String,
    /// First input of the motor driver for the left motor.
    pub left_1: String,
    /// Second input of the motor driver for the left motor.
    pub left_2: String,
    /// The link, from the board.
    pub tx: String,
    /// The link, to the board.
    pub rx: String,
}

/// The board of this name.
///
/// # Errors
/// No board has this name; the message lists all names.
pub fn named(name: &str) -> anyhow::Result<Board> {
    let boards = all()?;
    let names: Vec<_> = boards.iter().map(|board| board.name.as_str()).collect();
    let known = format!("--board: there is no `{name}`; there are {}", names.join(", "));
    boards.iter().find(|board| board.name == name).cloned().context(known)
}

/// All boards.
///
/// # Errors
/// If the table is invalid.
pub fn all() -> anyhow::Result<Vec<Board>> {
    #[derive(Deserialize)]
    struct Table {
        board: Vec<Board>,
    }

    let table: Table = toml::from_str(TABLE).context("firmware/boards.toml")?;
    Ok(table.board)
}
