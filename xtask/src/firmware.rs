//! Checks of the shipped firmware: it cannot panic through the project's code, it boots and obeys commands in an
//! emulator; how large it is and how deep its stack can be.
//!
//! All figures are read from the linked file that is flashed.
//!
//! | module | |
//! |---|---|
//! | `boards` | the further boards |
//! | `build` | builds the file |
//! | `lines` | the source line that an instruction was compiled from |
//! | `memory` | there is no allocator, and the stack is below all variables |
//! | `panics` | lines that can panic |
//! | `size` | flash and RAM |
//! | `stack` | the deepest stack |

use std::path::Path;

use anyhow::{Context, ensure};
use sonarfix_boards::Board;

use crate::cargo;
use crate::workspace::Workspace;

pub use boards::Args as BoardsArgs;

mod boards;
pub mod build;
mod lines;
mod memory;
mod panics;
mod size;
mod stack;

/// Builds the firmware, checks the linked file, and runs it in an emulator.
pub fn test() -> anyhow::Result<()> {
    for check in ["fmt --all --check", "clippy --release -- -D warnings"] {
        cargo::check(Workspace::Firmware.cargo(check))?;
    }
    let program = build::release()?;
    let bytes = build::read(&program)?;
    memory::check(&bytes)?;
    panics::check(&bytes)?;
    size::check(&bytes)?;
    emulate(&sonarfix_boards::named("stm32f405")?, &program, stack::check(&bytes)?)?;
    let nucleo = sonarfix_boards::named("nucleo_f446re")?;
    let program_of_nucleo = build::of(&nucleo)?;
    let deepest = stack::print(&build::read(&program_of_nucleo)?)?;
    emulate(&nucleo, &program_of_nucleo, deepest)?;
    let page = "test --package sonarfix-cli --test main emulated_firmware -- --ignored --nocapture";
    let mut command = cargo::command(page);
    command.env("SONARFIX_FIRMWARE", &program);
    cargo::check(command)
}

/// Runs the program of a board in an emulator, whose stack has this bound.
fn emulate(board: &Board, program: &Path, deepest: u64) -> anyhow::Result<()> {
    let tests = "test --package sonarfix-app --test emulated -- --ignored --nocapture";
    let mut command = cargo::command(tests);
    command.env("SONARFIX_FIRMWARE", program).env("SONARFIX_STACK", deepest.to_string());
    command.env("SONARFIX_MAP_AT", format!("{:#x}", board.map.address));
    cargo::check(command)
}

/// Follows the guide with this firmware.
pub fn guide() -> anyhow::Result<()> {
    let mut test =
        cargo::command("test --package sonarfix-cli --test main guide:: -- --ignored --nocapture");
    test.env("SONARFIX_FIRMWARE", build::release()?);
    cargo::check(test)
}

/// The firmware of the further boards, and the size of all.
pub fn boards(args: &BoardsArgs) -> anyhow::Result<()> {
    boards::check(&build::read(&build::release()?)?, args)
}

/// Flash and RAM of the linked file, by crate.
pub fn size() -> anyhow::Result<()> {
    size::check(&build::read(&build::release()?)?)
}

/// How the stack is examined.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct StackArgs {
    /// The board, as `sonarfix init` names it: a Cortex-M.
    #[arg(long, default_value = "stm32f405")]
    board: String,
}

/// The deepest that the stack of the linked file can be.
pub fn stack(args: &StackArgs) -> anyhow::Result<()> {
    let board = sonarfix_boards::all()?.into_iter().find(|board| board.name == args.board);
    let board = board.with_context(|| format!("there is no board {}", args.board))?;
    ensure!(board.target.starts_with("thumb"), "only the instructions of a Cortex-M can be read");
    let program = build::read(&build::of(&board)?)?;
    let checked =
        if board.package == build::NAME { stack::check(&program) } else { stack::print(&program) };
    checked.map(drop)
}
