//! `cargo xtask chips`: the firmware of the Raspberry Pi Pico and of the XRP on an emulated RP2040, and of the STM32F405 and the Nucleo-F446RE in QEMU
//! (`firmware/chips`), with a robot in a room.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail, ensure};
use sonarfix_boards::image::Image;
use sonarfix_boards::{Board, uf2};

use crate::elf::Program;
use crate::firmware::build;
use crate::{cargo, ci};

/// The boards with an RP2040, and those in QEMU; the variables of the environment for the tests have their names.
const RP2040: [&str; 2] = ["pico", "xrp"];
const IN_QEMU: [&str; 2] = ["stm32f405", "nucleo_f446re"];
const QEMU: &str = "qemu-system-arm";
/// The page with what the scenarios measure.
const PAGE: &str = "docs/chips.md";
/// The function of the program that is a poll, as the end of its name.
const POLL: &str = "::Board::poll";

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Also twenty drives of 90 s and a hundred power cuts (some 40 minutes).
    #[arg(long)]
    long: bool,
    /// Write docs/chips.md.
    #[arg(long, requires = "long")]
    write: bool,
}

impl Args {
    /// What CI runs.
    pub const CHECK: Self = Self { long: false, write: false };
}

/// The tables of the page: their names in `crates/sonarfix-app/tests/chips/results.rs`, what precedes them, and their heads.
const TABLES: [(&str, &str, &str); 4] = [
    ("Measured", "## Times and errors", "| | |\n|---|---|\n"),
    (
        "Polls",
        "## The longest poll\n\nInstructions of the longest poll of each scenario, interrupts included: application with drivers and link, and\n\
         inputs of the motor code. None with the motors enabled may exceed 130,000, or `cargo xtask chips` fails. The search works between two polls, after the motor code. That of a robot that drives makes a slice of the choice of a wall, or takes a ping; an echo that is not of its wall takes longest, because it is compared with all other reflectors. *Waiting* is without motors: the poll after a reset reads the store, all of it if\n\
         nothing was written, and another one starts the loop. The functions of the boot ROM are not counted: erasures and writes of the\n\
         flash have no instructions.",
        "| scenario | polls | driving | waiting |\n|---|---:|---:|---:|\n",
    ),
    (
        "Drives",
        "## Twenty drives of 90 s\n\nThe largest error of all estimates of a drive, against the robot in the room at the same time. None may exceed 15 mm, and each\n\
         estimate has the bits of the core on the PC with the same wheel travels and pings.",
        "| seed | start | distance | pings | position within | heading within |\n|---:|---|---:|---:|---:|---:|\n",
    ),
    (
        "Cuts",
        "## A hundred power cuts\n\nRobots whose power is cut again and again while they store a pose, at some step of the write or of the erasure. Afterwards a robot\n\
         has the pose before, or the new one; *lost*: neither.",
        "| robot | writes | cuts | has the pose before | has the new one | lost | erasures |\n|---:|---:|---:|---:|---:|---:|---:|\n",
    ),
];

/// Tests the emulated chip, then runs the scenarios of `crates/sonarfix-app/tests/chips` with the ELF, and one with the UF2 of a release.
pub fn run(args: Args) -> anyhow::Result<()> {
    for tool in ["node", "npm"] {
        if Command::new(tool).arg("--version").output().is_err() {
            ci::skip(&format!("boards on emulated chips: {tool} is not there"));
            return Ok(());
        }
    }
    let folder = cargo::root().join("firmware/chips");
    let mut install = Command::new("npm");
    install.args(["ci", "--no-audit", "--no-fund", "--silent"]).current_dir(&folder);
    cargo::check(install).context("cannot install the emulator")?;
    let mut test = Command::new("node");
    test.arg("--test").current_dir(&folder);
    cargo::check(test)?;

    let rows = empty_file()?;
    // One after another: each takes a processor, and another step of CI the second one.
    let tests =
        "test --package sonarfix-app --test chips -- --ignored --nocapture --test-threads 1";
    let mut command = cargo::command(tests);
    if !args.long {
        command.args(["--skip", "long::"]);
    }
    command.env("SONARFIX_CHIPS_ROWS", &rows);
    for board in RP2040 {
        pass_rp2040(&mut command, &sonarfix_boards::named(board)?)?;
    }
    if Command::new(QEMU).arg("--version").output().is_ok() {
        for board in IN_QEMU {
            pass_program(&mut command, &sonarfix_boards::named(board)?)?;
        }
    } else {
        ci::skip(&format!("STM32F405 and Nucleo-F446RE in a room: {QEMU} is not there"));
        command.args(["--skip", "stm32::"]);
    }
    let result = cargo::check(command);
    // A scenario that exceeds a limit has told what it measured before: that is shown, and the command fails.
    let page = page(&fs::read_to_string(&rows)?, args.long);
    let page = if result.is_ok() { page? } else { page.unwrap_or_default() };
    println!("{page}");
    if args.write && !page.is_empty() {
        fs::write(cargo::root().join(PAGE), page)?;
    }
    result
}

/// The variable of the environment with something of a board.
fn variable(board: &Board, what: &str) -> String {
    format!("SONARFIX_{}_{what}", board.name.to_uppercase())
}

/// Builds the program of a board, and passes it to the tests; returns its path.
fn pass_program(command: &mut Command, board: &Board) -> anyhow::Result<PathBuf> {
    let elf = build::of(board)?;
    command.env(variable(board, "ELF"), &elf);
    Ok(elf)
}

/// The same as UF2, too, and the address of its poll.
fn pass_rp2040(command: &mut Command, board: &Board) -> anyhow::Result<()> {
    let bytes = build::read(&pass_program(command, board)?)?;
    let poll = address_of_poll(&Program::parse(&bytes)?)?;
    let usb = board.uf2.as_ref().context("the board takes no UF2")?;
    let uf2 = cargo::target_folder().join(format!("chips-{}.uf2", board.name));
    let bytes = uf2::write(&Image::of_elf(&bytes)?, usb.family)?;
    ensure!(uf2::is_uf2(&bytes), "what is written is no UF2");
    fs::write(&uf2, bytes)?;
    command.env(variable(board, "UF2"), uf2).env(variable(board, "POLL"), poll.to_string());
    Ok(())
}

/// The file for the rows of the tables, which is empty.
fn empty_file() -> anyhow::Result<PathBuf> {
    let rows = cargo::target_folder().join("chips.rows");
    fs::write(&rows, "")?;
    Ok(rows)
}

/// The address of the function that is counted.
fn address_of_poll(program: &Program) -> anyhow::Result<u64> {
    let is_poll = |name: &String| name.ends_with(POLL);
    let mut found = program.functions().filter(|(_, function)| function.names.iter().any(is_poll));
    match (found.next(), found.next()) {
        (Some((at, _)), None) => Ok(at),
        (None, _) => bail!("the program has no function {POLL}"),
        _ => bail!("the program has several functions {POLL}"),
    }
}

/// The page with these rows, each after the name of its table.
fn page(rows: &str, is_long: bool) -> anyhow::Result<String> {
    let mut page = "\
# Boards on emulated chips
Generated by `cargo xtask chips --long --write`; change the code, not this page.

The program that is flashed, on an emulated RP2040 or in QEMU, with a robot in a room ([boards.md](boards.md) has what is emulated, and what is not).
Times are those of the chip.
"
    .to_owned();
    for (name, text, head) in TABLES {
        let prefix = format!("{name}: ");
        let rows: Vec<&str> = rows.lines().filter_map(|line| line.strip_prefix(&prefix)).collect();
        let is_of_long = ["Drives", "Cuts"].contains(&name);
        ensure!(
            rows.is_empty() == (is_of_long && !is_long),
            "table {name} has {} rows",
            rows.len()
        );
        if !rows.is_empty() {
            writeln!(page, "\n{text}\n\n{head}{}", rows.join("\n"))?;
        }
    }
    Ok(page)
}
