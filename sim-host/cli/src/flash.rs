//! `sonarfix flash`: program, configuration and map into the flash of a board.

mod hello;
mod tool;

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, ensure};
use sonarfix_boards::drive::{self, Drive};
use sonarfix_boards::{Board, Uf2, uf2};
use sonarfix_map::{MapFile, robot_file};
use sonarfix_new_robot::flash::{self, Part};

use crate::warnings;
use hello::{Flashed, Link};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "A Pico or Pico 2 takes one file on its USB drive: hold BOOTSEL while you plug it in. For other boards the command of \
                  probe-rs or espflash is printed and run. What the robot has stored, as its calibration, stays. With --port the first \
                  Hello of the robot is compared with what was flashed."
)]
pub struct Args {
    /// The folder with `robot.toml` and `map.toml`, as `sonarfix init` writes it.
    #[arg(value_name = "ROBOT_DIR")]
    robot: PathBuf,
    /// The board.
    #[arg(long, value_name = "NAME")]
    board: String,
    /// The program: UF2 or ELF; by default the released one, in the folder `firmware` beside this command.
    #[arg(long, value_name = "PROGRAM")]
    program: Option<PathBuf>,
    /// The drive of the board; by default it is looked for where Linux and macOS mount drives.
    #[arg(long, value_name = "DRIVE")]
    to: Option<PathBuf>,
    /// Writes the combined file here, and onto the drive only with --to.
    #[arg(long, value_name = "FILE.uf2")]
    out: Option<PathBuf>,
    /// Checks everything, prints what would be done, and writes nothing.
    #[arg(long)]
    dry_run: bool,
    /// The robot's link: a serial port or `tcp:HOST:PORT`, at which its `Hello` is waited for after flashing.
    #[arg(long)]
    port: Option<String>,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200, requires = "port")]
    baud: u32,
    /// How long the robot's `Hello` is waited for.
    #[arg(long, value_name = "SECONDS", default_value_t = 30, requires = "port")]
    wait: u32,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let board = sonarfix_boards::named(&args.board)?;
    if let (Some(out), false) = (&args.out, args.dry_run) {
        sonarfix_terminal::output::check_file("--out", out)?;
    }
    let parts = parts(args, &board)?;
    let program = program(args, &board)?;
    if let Some(usb) = &board.uf2 {
        over_usb(args, &board, usb, &program, &parts)?;
    } else {
        ensure!(
            args.to.is_none() && args.out.is_none(),
            "the {} takes no UF2: leave out --to and --out",
            board.title
        );
        let images = parts.each_ref().map(|part| (part.region.address, part.bytes.as_slice()));
        tool::flash(&args.robot, args.dry_run, &board, &program, images)?;
    }
    if args.dry_run { Ok(()) } else { check(args, &parts) }
}

/// Compares the robot with what was flashed, if its port is named.
fn check(args: &Args, [configuration, map]: &[Part; 2]) -> anyhow::Result<()> {
    let Some(port) = &args.port else {
        if args.out.is_none() || args.to.is_some() {
            println!("the board restarts; next: sonarfix monitor --port PORT --signs-of-life");
        }
        return Ok(());
    };
    let flashed = Flashed { configuration: configuration.checksum, map: map.checksum };
    let link = Link { name: port, baud: args.baud };
    hello::check(link, Duration::from_secs(args.wait.into()), flashed, &args.robot)
}

/// The baked configuration and map of the robot; prints what a robot reports of them.
fn parts(args: &Args, board: &Board) -> anyhow::Result<[Part; 2]> {
    let (robot, map) = (args.robot.join("robot.toml"), args.robot.join("map.toml"));
    ensure!(
        robot.is_file() && map.is_file(),
        "{} has no robot.toml and map.toml: `sonarfix init` writes such a folder",
        args.robot.display()
    );
    let config = robot_file::read(&robot)?;
    warnings::show(&[&robot]);
    let parts = [
        Part::configuration(&config, board, &robot.display().to_string())?,
        Part::map(&MapFile::read(&map, None)?, board, &map.display().to_string())?,
    ];
    for (part, file) in parts.iter().zip([&robot, &map]) {
        println!(
            "{}: {}, {} bytes at {:#010x}, checksum {:08x}",
            file.display(),
            part.what,
            part.bytes.len(),
            part.region.address,
            part.checksum
        );
    }
    Ok(parts)
}

/// The file of the program.
fn program(args: &Args, board: &Board) -> anyhow::Result<PathBuf> {
    if let Some(program) = &args.program {
        return Ok(program.clone());
    }
    let ending = if board.uf2.is_some() { "uf2" } else { "elf" };
    let name = format!("{}.{ending}", board.package);
    // Without /proc the system does not know its file.
    let here = std::env::current_exe().ok();
    let here = here.or_else(|| std::env::args_os().next().map(PathBuf::from));
    let folder = here.as_deref().and_then(Path::parent).map(|folder| folder.join("firmware"));
    let found = folder.map(|folder| folder.join(&name)).filter(|file| file.is_file());
    found.with_context(|| {
        format!(
            "there is no firmware/{name} beside this command: name the program by --program; the archives of a release have \
             it, and `cargo build --release --package {} --target {}` in the folder firmware of the sources builds it",
            board.package, board.target
        )
    })
}

fn over_usb(
    args: &Args,
    board: &Board,
    usb: &Uf2,
    program: &Path,
    parts: &[Part],
) -> anyhow::Result<()> {
    let name = program.display();
    let bytes = std::fs::read(program).with_context(|| name.to_string())?;
    let image = flash::program(&bytes, &name.to_string(), board, usb)?;
    let first = image.parts().next().map_or(0, |(address, _)| address);
    println!("{name}: the program, {} bytes at {first:#010x}", image.flat().len());
    let file = flash::combined(image, parts, usb)?;
    let blocks = file.len() / uf2::BLOCK;
    let does = if args.dry_run { "would write" } else { "wrote" };
    let wrote = |to: &Path| {
        println!("{does} {}: {blocks} blocks for family {:#010x}", to.display(), usb.family);
    };
    if let Some(out) = &args.out {
        if !args.dry_run {
            sonarfix_files::write(out, &file)?;
        }
        wrote(out);
        if args.to.is_none() {
            println!("copy it to the drive {} of the board in its boot mode", usb.drive);
            return Ok(());
        }
    }
    let drive = Drive::find(args.to.as_deref(), board, usb)?;
    let to = drive.file(&board.package);
    if !args.dry_run {
        drive::copy(&file, &to)?;
    }
    wrote(&to);
    Ok(())
}
