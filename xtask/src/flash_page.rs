//! What the page that flashes an ESP32-C6 gets from other projects: the bootloader and the table of partitions, from `espflash`, and
//! esptool-js, from npm.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, anyhow, ensure};
use espflash::flasher::{FlashData, FlashSettings, FlashSize};
use espflash::image_format::idf::IdfBootloaderFormat;
use espflash::target::{Chip, XtalFrequency};
use serde::Deserialize;
use sonarfix_boards::{esp, made};

use crate::cargo;
use crate::workspace::Workspace;

/// The files in the folder of [`prepare`], which `sonarfix-playground pages` reads.
pub const BOOTLOADER: &str = "bootloader.bin";
pub const PARTITIONS: &str = "partitions.bin";
const LIBRARY: &str = "esptool.js";
/// The loader that esptool-js sends to the chip.
pub const LOADER: &str = "node_modules/esptool-js/lib/targets/stub_flasher/esp32c6.json";
/// The packages of npm, the first of which has the others in its file; their folder below that of [`prepare`].
const PACKAGES: [&str; 3] = ["esptool-js", "pako", "atob-lite"];
const MODULES: &str = "node_modules";

/// Writes these files, for the sources in `root`; returns their folder.
pub fn prepare(root: &Path) -> anyhow::Result<PathBuf> {
    let folder = cargo::target_folder().join("flash-page");
    fs::create_dir_all(&folder)?;
    let partitions = root.join("firmware/esp32c6/partitions.csv");
    let [bootloader, table] = of_espflash(&partitions).context(partitions.display().to_string())?;
    fs::write(folder.join(BOOTLOADER), bootloader)?;
    fs::write(folder.join(PARTITIONS), table)?;
    for file in ["package.json", "package-lock.json"] {
        fs::copy(root.join("sim-host/playground").join(file), folder.join(file)).context(file)?;
    }
    let mut install = Command::new("npm");
    install.args(["ci", "--no-audit", "--no-fund", "--ignore-scripts", "--silent"]);
    install.current_dir(&folder);
    cargo::check(install).context("cannot install esptool-js, which takes npm")?;
    let library = folder.join(MODULES).join(PACKAGES[0]).join("bundle.js");
    fs::copy(&library, folder.join(LIBRARY)).with_context(|| library.display().to_string())?;
    Ok(folder)
}

/// Bootloader and table of partitions as `espflash flash` writes them: they do not depend on the program.
fn of_espflash(partitions: &Path) -> anyhow::Result<[Vec<u8>; 2]> {
    let chip = Chip::Esp32c6;
    // The least that a module of this chip has; a larger one is used as one of this size.
    let settings = FlashSettings::new(None, Some(FlashSize::_4Mb), None);
    let flash = FlashData::new(settings, 0, None, chip, XtalFrequency::_40Mhz);
    let program = made::elf(0, &[]);
    let image = IdfBootloaderFormat::new(&program, &flash, Some(partitions), None, None, None)
        .map_err(|error| anyhow!("{error}"))?;
    let mut segments = image.flash_segments();
    let mut next = |address| {
        let segment = segments.next().context("espflash makes no such part")?;
        ensure!(segment.addr == address, "espflash writes it to {:#x}", segment.addr);
        Ok(segment.data().to_vec())
    };
    let parts = [next(esp::BOOTLOADER)?, next(esp::PARTITIONS)?];
    next(esp::PROGRAM).context("the program")?;
    Ok(parts)
}

/// The licences of what the page has in the folder of [`prepare`]: a list, and the texts.
pub fn licences(folder: &Path) -> anyhow::Result<String> {
    let metadata = Workspace::Main.cargo("metadata --format-version 1 --locked");
    let packages = cargo::dependencies(metadata)?;
    let espflash = packages.iter().find(|it| it.name == "espflash").context("no espflash")?;
    let mut list = format!(
        "The page that flashes an ESP32-C6 contains these parts of other projects.\n\n\
         Bootloader of ESP-IDF, https://github.com/espressif/esp-idf, as espflash {} packs it: Apache-2.0\n",
        espflash.version
    );
    let mut texts = String::new();
    for name in PACKAGES {
        let package = folder.join(MODULES).join(name);
        let Package { version, license } =
            serde_json::from_str(&fs::read_to_string(package.join("package.json"))?)?;
        // That of the others in the file may be an older one.
        let version = if name == PACKAGES[0] { version } else { format!("in {}", PACKAGES[0]) };
        writeln!(list, "{name} {version}: {license}")?;
        let text = fs::read_to_string(package.join("LICENSE"))
            .or_else(|_| fs::read_to_string(package.join("LICENSE.md")))
            .with_context(|| format!("the licence of {name}"))?;
        write!(texts, "\n{}\n{name}\n\n{}\n", "-".repeat(78), text.trim())?;
    }
    list.push_str(
        "The loader in esptool-js, of https://github.com/espressif/esp-flasher-stub: MIT OR Apache-2.0\n",
    );
    Ok(list + &texts)
}

/// Of a package of npm.
#[derive(Debug, Deserialize)]
struct Package {
    version: String,
    license: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bootloader is one for this chip, and the table has the regions of `firmware/boards.toml`. The format of the table:
    /// ESP-IDF, `components/partition_table/gen_esp32part.py`.
    #[test]
    fn espflash_makes_a_bootloader_and_the_table_of_the_board() {
        let csv = Workspace::Firmware.folder().join("esp32c6/partitions.csv");
        let [bootloader, table] = of_espflash(&csv).unwrap();
        let image = esp::read(&bootloader).unwrap();
        assert_eq!((image[2], image[3] >> 4), (2, 2), "two lines, 4 MiB");
        let board = sonarfix_boards::named("esp32c6").unwrap();
        let word =
            |entry: &[u8], at: usize| u32::from_le_bytes(entry[at..at + 4].try_into().unwrap());
        let entries = table.chunks(32).take_while(|entry| entry[..2] == [0xAA, 0x50]);
        let regions: Vec<_> = entries.map(|it| (it[2], word(it, 4), word(it, 8))).collect();
        let room = board.config.address - esp::PROGRAM;
        for region in [
            (0, esp::PROGRAM, room),
            (1, board.config.address, board.config.bytes),
            (1, board.map.address, board.map.bytes),
        ] {
            assert!(regions.contains(&region), "{regions:x?}");
        }
        assert!(esp::PARTITIONS as usize + table.len() <= esp::PROGRAM as usize);
    }
}
