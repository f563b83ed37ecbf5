//! The programs of the boards: ELF, BIN and, for a board with a USB drive, UF2.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use sonarfix_boards::image::Image;
use sonarfix_boards::{Board, Uf2, esp, uf2};

use crate::workspace::Workspace;
use crate::{cargo, symbols};

/// Its folder in a release and in each archive.
pub const FOLDER: &str = "firmware";

/// Builds the program of each board and writes its files; returns them.
pub fn programs(out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let folder = out.join(FOLDER);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let mut written = Vec::new();
    for board in &sonarfix_boards::all()? {
        let elf = fs::read(build(board, cargo::root())?)?;
        for (ending, bytes) in files(board, &elf)? {
            let file = folder.join(board.package.clone() + ending);
            fs::write(&file, bytes).with_context(|| file.display().to_string())?;
            written.push(file);
        }
    }
    for (name, text) in [
        (
            "partitions.csv",
            fs::read_to_string(Workspace::Firmware.folder().join("esp32c6/partitions.csv"))?,
        ),
        ("LICENSES.txt", super::licences::of(Workspace::Firmware, "--workspace --target all")?),
    ] {
        fs::write(folder.join(name), text)?;
        written.push(folder.join(name));
    }
    Ok(written)
}

/// Builds the programs of the boards that the pages of the site write or combine, from the sources in `root`, and writes their files
/// into a folder: UF2 for those with a USB drive, the application image for the ESP32-C6.
pub fn for_pages(root: &Path, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder)?;
    let boards = sonarfix_boards::all()?;
    for board in boards.iter().filter(|board| board.uf2.is_some() || is_esp(board)) {
        let elf = fs::read(build(board, root)?)?;
        for (ending, bytes) in files(board, &elf)? {
            fs::write(folder.join(board.package.clone() + ending), bytes)?;
        }
    }
    Ok(())
}

fn is_esp(board: &Board) -> bool {
    board.target.starts_with("riscv")
}

/// Builds the program of a board from the sources in `root`; returns the linked file.
fn build(board: &Board, root: &Path) -> anyhow::Result<PathBuf> {
    let mut rustup = std::process::Command::new("rustup");
    rustup.args(["target", "add", &board.target]);
    cargo::check(rustup)?;
    let Board { package, target, .. } = board;
    let build = format!("build --locked --package {package} --profile dist --target {target}");
    let mut command = Workspace::Firmware.cargo(&build);
    command.current_dir(root.join("firmware"));
    cargo::reproducible(&mut command, root, &[])?;
    symbols::same_in_every_folder(&mut command, root)?;
    cargo::check(command)?;
    Ok(Workspace::Firmware.target_folder().join(target).join("dist").join(package))
}

/// The files of a program, each with the ending of its name.
fn files(board: &Board, elf: &[u8]) -> anyhow::Result<Vec<(&'static str, Vec<u8>)>> {
    let image = Image::of_elf(elf).context(board.package.clone())?;
    let bin = if is_esp(board) { esp::write(elf)? } else { image.flat() };
    let mut files = vec![(".elf", elf.to_vec()), (".bin", bin)];
    if let Some(Uf2 { family, .. }) = board.uf2 {
        files.push((".uf2", uf2::write(&image, family)?));
    }
    Ok(files)
}

/// Checks the written programs: a UF2 has what its ELF loads, and a build of the same sources in another folder has the
/// same bytes.
pub fn check(out: &Path, copy: &Path) -> anyhow::Result<()> {
    for board in &sonarfix_boards::all()? {
        let file = |ending| out.join(FOLDER).join(board.package.clone() + ending);
        let elf = fs::read(file(".elf"))?;
        if let Some(Uf2 { family, .. }) = board.uf2 {
            check_uf2(&fs::read(file(".uf2"))?, &elf, family).context(board.package.clone())?;
        }
        let second = fs::read(build(board, copy)?)?;
        ensure!(elf == second, "{} of another folder has other bytes", board.package);
    }
    Ok(())
}

/// Checks that a UF2 has the bytes of each segment of an ELF at its address, for chips of a family.
fn check_uf2(file: &[u8], elf: &[u8], family: u32) -> anyhow::Result<()> {
    let (written, named) = uf2::read(file)?;
    ensure!(named == family, "the family is {named:#010x} instead of {family:#010x}");
    for (address, bytes) in Image::of_elf(elf)?.parts() {
        ensure!(
            written.at(address, bytes.len()).as_deref() == Some(bytes),
            "the segment at {address:#010x} differs"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    /// The families of <https://github.com/microsoft/uf2/blob/master/utils/uf2families.json>.
    #[test]
    fn the_boards_with_a_usb_drive_have_the_families_of_their_chips() {
        let boards = sonarfix_boards::all().unwrap();
        let families: Vec<_> = boards
            .iter()
            .filter_map(|board| Some((board.name.as_str(), board.uf2.as_ref()?.family)))
            .collect();
        let expected = [
            ("pico2", 0xe48b_ff59),
            ("pico", 0xe48b_ff56),
            ("xrp", 0xe48b_ff56),
            ("xrp-rp2350", 0xe48b_ff59),
        ];
        assert_eq!(families, expected);
        assert!(boards.iter().all(|board| board.usb == board.uf2.is_some()));
    }
}
