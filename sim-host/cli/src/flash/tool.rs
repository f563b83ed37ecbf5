//! Boards without a USB drive: the programs that write their flash.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, ensure};
use sonarfix_boards::Board;
use sonarfix_boards::image::Image;

/// Writes program, configuration and map by the tool of the board: prints its commands, and runs them if it is installed and this is
/// no dry run. The addresses and contents of configuration and map go through files in the folder of the robot.
pub fn flash(
    robot: &Path,
    is_dry: bool,
    board: &Board,
    program: &Path,
    parts: [(u32, &[u8]); 2],
) -> anyhow::Result<()> {
    check(board, program)?;
    let files = ["config.bin", "map.bin"].map(|name| robot.join(name));
    for (file, (_, bytes)) in files.iter().zip(parts) {
        if !is_dry {
            sonarfix_files::write(file, bytes)?;
        }
        let does = if is_dry { "would write" } else { "wrote" };
        println!("{does} {}", file.display());
    }
    let images = files.iter().zip(parts).map(|(file, (address, _))| (address, file.as_path()));
    let images: Vec<_> = images.collect();
    let commands = if is_esp(board) {
        espflash(program, &images)
    } else {
        probe_rs(&board.chip, program, &images)
    };
    let tool = commands.first().and_then(|command| command.first()).context("no command")?;
    let is_there = Command::new(tool).arg("--version").output().is_ok();
    for command in &commands {
        println!("{}", shown(command));
        if is_there && !is_dry {
            run(command)?;
        }
    }
    if is_dry {
        return Ok(());
    }
    ensure!(
        is_there,
        "{tool} is not installed: run these commands where it is, or install it by `cargo install {} --locked`",
        if tool == "probe-rs" { "probe-rs-tools" } else { tool.as_str() }
    );
    Ok(())
}

fn is_esp(board: &Board) -> bool {
    board.target.starts_with("riscv")
}

/// Whether the program can be one for the board.
fn check(board: &Board, program: &Path) -> anyhow::Result<()> {
    let name = program.display();
    let bytes = std::fs::read(program).with_context(|| name.to_string())?;
    let image = Image::of_elf(&bytes).with_context(|| {
        format!("{name}: the {} takes an ELF, as firmware/{}.elf", board.title, board.package)
    })?;
    // The addresses of an ESP32-C6 are those at which the flash is mapped, not those in flash.
    let start = board.start_of_flash();
    let is_in = image.parts().all(|(address, _)| address & 0xFF00_0000 == start);
    ensure!(
        is_esp(board) || is_in,
        "{name} is no program for the {}: it does not lie in the flash at {start:#010x}",
        board.title
    );
    println!("{name}: the program");
    Ok(())
}

/// The program last: the board starts with it.
fn espflash(program: &Path, images: &[(u32, &Path)]) -> Vec<Vec<String>> {
    let chip = ["--chip", "esp32c6"].map(str::to_owned);
    let image = |(address, file): &(u32, &Path)| {
        let mut command = vec!["espflash".to_owned(), "write-bin".to_owned()];
        command.extend(chip.clone());
        command.extend([format!("{address:#010x}"), file.display().to_string()]);
        command
    };
    let mut commands: Vec<_> = images.iter().map(image).collect();
    let mut command = vec!["espflash".to_owned(), "flash".to_owned()];
    command.extend(chip);
    let partitions = program.with_file_name("partitions.csv");
    if partitions.is_file() {
        command.extend(["--partition-table".to_owned(), partitions.display().to_string()]);
    }
    command.push(program.display().to_string());
    commands.push(command);
    commands
}

fn probe_rs(chip: &str, program: &Path, images: &[(u32, &Path)]) -> Vec<Vec<String>> {
    let command = |verb: &str, rest: &[String]| {
        let mut command = ["probe-rs", verb, "--chip", chip].map(str::to_owned).to_vec();
        command.extend_from_slice(rest);
        command
    };
    let image = |(address, file): &(u32, &Path)| {
        let format = ["--binary-format", "bin", "--base-address"].map(str::to_owned);
        let what = [format!("{address:#010x}"), file.display().to_string()];
        command("download", &[format.as_slice(), &what].concat())
    };
    let mut commands: Vec<_> = images.iter().map(image).collect();
    commands.push(command("download", &[program.display().to_string()]));
    commands.push(command("reset", &[]));
    commands
}

/// A command as a shell takes it.
fn shown(command: &[String]) -> String {
    let quoted = |word: &String| {
        let is_plain = |it: char| it.is_alphanumeric() || "-_./:".contains(it);
        if word.chars().all(is_plain) { word.clone() } else { format!("'{word}'") }
    };
    command.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

fn run(command: &[String]) -> anyhow::Result<()> {
    let (tool, arguments) = command.split_first().context("no command")?;
    let status = Command::new(tool).args(arguments).status().with_context(|| tool.clone())?;
    ensure!(
        status.success(),
        "`{}` failed: is the board connected, and its debug probe or serial port free?",
        shown(command)
    );
    Ok(())
}
