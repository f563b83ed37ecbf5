//! What goes into the flash of a board: program, configuration and map.

use anyhow::{Context, ensure};
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::units::Metres;
use sonarfix_boards::image::Image;
use sonarfix_boards::{Board, Region, Uf2, esp, uf2};
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::RangerKind;
use sonarfix_link::baked;
use sonarfix_map::{MapFile, Severity, bake, flaws};

/// What goes into the flash beside the program.
#[derive(Debug, Clone)]
pub struct Part {
    /// What it is: `the configuration` or `the map`.
    pub what: &'static str,
    /// Where it lies.
    pub region: Region,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// That which a robot reports of it.
    pub checksum: u32,
}

impl Part {
    /// The baked configuration of a robot.
    ///
    /// # Errors
    /// If the firmware of the board cannot drive the robot, or the board has no room for it; the message names `source`.
    pub fn configuration(
        config: &RobotConfig,
        board: &Board,
        source: &str,
    ) -> anyhow::Result<Self> {
        check_board(board, config)?;
        let (bytes, checksum) = (configuration(config)?, baked::checksum(config));
        let part = Self { what: "the configuration", region: board.config, bytes, checksum };
        part.fitting(board, source)
    }

    /// The baked map.
    ///
    /// # Errors
    /// If the map has errors, or the board has no room for it; the message names `source`.
    pub fn map(map: &MapFile, board: &Board, source: &str) -> anyhow::Result<Self> {
        let bytes = image(map)?;
        let checksum = seal(&bytes);
        Self { what: "the map", region: board.map, bytes, checksum }.fitting(board, source)
    }

    fn fitting(self, board: &Board, source: &str) -> anyhow::Result<Self> {
        let (what, length, most) = (self.what, self.bytes.len(), self.region.bytes);
        ensure!(
            length <= most as usize,
            "{source}: {what} has {length} bytes, and the {} has room for {most}",
            board.title
        );
        Ok(self)
    }
}

/// The bytes of a baked configuration.
///
/// # Errors
/// If it has more bytes than any configuration.
pub fn configuration(config: &RobotConfig) -> anyhow::Result<Vec<u8>> {
    let mut buffer = [0; baked::LENGTH_MAX];
    Ok(baked::write(config, &mut buffer)?.to_vec())
}

/// Refuses a robot that the firmware of a board cannot drive.
///
/// # Errors
/// What the board lacks.
pub fn check_board(board: &Board, config: &RobotConfig) -> anyhow::Result<()> {
    let title = &board.title;
    let (rangers, most) = (config.rangers.iter().count(), 1 + usize::from(board.second.is_some()));
    ensure!(
        rangers <= most,
        "the firmware of the {title} drives at most {most} of the {rangers} rangers of the robot"
    );
    let is_on_bus = |kind: RangerKind| !matches!(kind, RangerKind::Pulse(_) | RangerKind::Custom);
    let has_bus = board.bus.is_some();
    let needs_bus = config.rangers.iter().any(|(_, ranger)| is_on_bus(ranger.kind));
    ensure!(has_bus || !needs_bus, "the {title} has no I2C bus for the ranger");
    let has_gyro = config.localizer.gyro.is_some();
    ensure!(has_bus || !has_gyro, "the {title} has no I2C bus for the gyro");
    Ok(())
}

/// The sonar that a map without a robot is checked with.
#[must_use]
pub fn usual_sonar() -> RangerParameters {
    Config::for_track_width(Metres(0.16)).rangers.first
}

/// The image of a map.
///
/// # Errors
/// If the map has errors; they are not listed.
pub fn image(map: &MapFile) -> anyhow::Result<Vec<u8>> {
    let findings = flaws(&map.floor, &map.sonar().unwrap_or_else(usual_sonar))?;
    let errors = findings.iter().filter(|it| it.severity() == Severity::Error).count();
    let name = map.name();
    ensure!(errors == 0, "{name}: {errors} errors; run `sonarfix map check {name}`");
    Ok(bake(&map.floor.walls())?)
}

/// The checksum at the end of an image, which a robot reports.
#[must_use]
pub fn seal(image: &[u8]) -> u32 {
    image.last_chunk().copied().map_or(0, u32::from_le_bytes)
}

/// The contents of a program's file, UF2 or ELF, checked against the board.
///
/// # Errors
/// If it is no such file or for another board; the messages name it `name`.
pub fn program(file: &[u8], name: &str, board: &Board, usb: &Uf2) -> anyhow::Result<Image> {
    let image = if uf2::is_uf2(file) {
        let (image, family) = uf2::read(file).with_context(|| name.to_owned())?;
        check_family(family, name, board, usb)?;
        image
    } else {
        Image::of_elf(file).with_context(|| format!("{name} is neither UF2 nor ELF"))?
    };
    let (first, _) = image.parts().next().context("the program is empty")?;
    let end = image.parts().map(|(address, bytes)| address as usize + bytes.len()).max();
    ensure!(
        first >= board.start_of_flash()
            && end.is_some_and(|end| end <= board.config.address as usize),
        "{name} is no program for the {}: it does not lie between {:#010x} and {:#010x}",
        board.title,
        board.start_of_flash(),
        board.config.address
    );
    Ok(image)
}

/// The application image of a program's file, ELF or image, for the board with a chip of Espressif; it lies at [`esp::PROGRAM`].
///
/// # Errors
/// If it is no such file, for another chip or too large; the messages name it `name`.
pub fn esp_program(file: &[u8], name: &str, board: &Board) -> anyhow::Result<Vec<u8>> {
    let title = &board.title;
    let image = esp::read(file).with_context(|| format!("{name} is no program for the {title}"))?;
    let (length, most) = (image.len(), board.config.address - esp::PROGRAM);
    ensure!(
        length <= most as usize,
        "{name} has {length} bytes, and the {title} has room for {most}"
    );
    Ok(image)
}

fn check_family(family: u32, name: &str, board: &Board, usb: &Uf2) -> anyhow::Result<()> {
    if family == usb.family {
        return Ok(());
    }
    let others = sonarfix_boards::all()?;
    let has_it = |it: &&Board| it.uf2.as_ref().is_some_and(|uf2| uf2.family == family);
    let other = others.iter().find(has_it);
    let other = other.map_or_else(|| "another chip".to_owned(), |it| format!("a {}", it.title));
    anyhow::bail!(
        "{name} is for {other} (family {family:#010x}), not for the {} ({:#010x}): choose its board (--board) or another \
         file (--program)",
        board.title,
        usb.family
    );
}

/// The UF2 with a program and parts beside it.
///
/// # Errors
/// If they overlap.
pub fn combined(mut program: Image, parts: &[Part], usb: &Uf2) -> anyhow::Result<Vec<u8>> {
    for Part { what, region, bytes, .. } in parts {
        program.add(what, region.address, bytes)?;
    }
    uf2::write(&program, usb.family)
}
