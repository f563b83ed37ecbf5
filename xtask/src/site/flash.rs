//! What the page that flashes an ESP32-C6 is given, and what the board must have afterwards.

use std::fs;
use std::path::Path;
use std::process::Command;

use sonarfix_boards::{esp, made};

use crate::{cargo, flash_page};

/// The robot whose files are written: those of the live page.
const ROBOT: &str = "live-robot";

/// Writes into the folder `flash` of a folder that has the program `sonarfix` and a robot: the robot in an archive, a program, and the
/// parts that the page must write besides, as the command and `espflash` make them, and the loader that it sends before.
pub fn prepare(folder: &Path) -> anyhow::Result<()> {
    let (robot, flash) = (folder.join(ROBOT), folder.join("flash"));
    fs::create_dir_all(&flash)?;
    let text: Vec<u8> = (0..40_000_u32).flat_map(|it| (it * it).to_le_bytes()).collect();
    let program = made::elf(0x4080_0000, &[made::segment(0x4200_0020, &text)]);
    fs::write(flash.join("program.bin"), esp::write(&program)?)?;
    fs::write(flash.join("program.elf"), program)?;
    let parts = flash_page::prepare(cargo::root())?;
    for name in [flash_page::BOOTLOADER, flash_page::PARTITIONS] {
        fs::copy(parts.join(name), flash.join(name))?;
    }
    fs::copy(parts.join(flash_page::LOADER), flash.join("loader.json"))?;
    let sonarfix = folder.join("sonarfix");
    for (kind, from, to) in [("config", "robot.toml", "config.bin"), ("map", "map.toml", "map.bin")]
    {
        let mut bake = Command::new(&sonarfix);
        bake.args([kind, "bake"]).arg(robot.join(from)).arg("--out").arg(flash.join(to));
        cargo::check(bake)?;
    }
    let mut pack = Command::new("python3");
    pack.args(["-m", "zipfile", "-c"]).arg(flash.join("robot.zip")).arg(&robot);
    cargo::check(pack)
}
