//! What CI runs, by the same names: `cargo xtask ci` is every check, and each has a name of its
//! own, so that whoever broke one can run just that.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod bench;
mod budgets;
mod cargo;
mod checks;
mod elf;
mod emulator;
mod endurance;
mod firmware;
mod fuzz;
mod golden;
mod miri;
mod panics;
mod pico;
mod pil;
mod program;
mod thumb;

#[derive(Debug, Parser)]
#[command(about = "The project's checks and chores")]
struct Xtask {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Clone, PartialEq, Eq, Subcommand)]
enum Task {
    /// Every check below, in order.
    Ci,
    /// Formatting.
    Format,
    /// Clippy, warnings are errors.
    Lint,
    /// The tests, as the README runs them.
    TestHost,
    /// The documentation, warnings are errors.
    Docs,
    /// The `no_std` crates for microcontrollers with and without FPU.
    Embedded,
    /// The firmware: builds it, looks for panics in it, and runs it in an emulator.
    TestFirmware,
    /// Flash and RAM of the shipped firmware, by crate.
    Size,
    /// The deepest that the stack of the shipped firmware can be, by the calls in it.
    Stack(firmware::StackArgs),
    /// The shipped loop on emulated microcontrollers, against the PC bit by bit; what it costs them.
    Pil,
    /// The golden traces on this computer and every emulated microcontroller.
    Golden,
    /// No panic is linked into a program for a microcontroller.
    Panics,
    /// Instructions, code, stack and memory against `budgets.toml`.
    Budgets,
    /// The programs in `bench` that link nothing of the peers: format, Clippy.
    LintBench,
    /// Ours and every peer do the same work.
    Peers,
    /// Licences of all dependencies, and advisories if their database can be reached.
    Deny,
    /// Measures again what `budgets` checks and writes it to `budgets.toml`; makes the golden traces
    /// anew.
    Bless,
    /// Ours and its peers at the same work, to `docs/benchmarks.md` (ten minutes).
    Bench,
    /// The paper's statistics at full length: 5,000 seeds, both policies (minutes).
    Statistics,
    /// Random lives of the filter, 10⁸ steps unless told otherwise (minutes).
    Endurance(endurance::Args),
    /// The fuzz targets, for a bounded time.
    Fuzz(fuzz::Args),
    /// The core under Miri, if there is one (long: it builds a standard library first).
    Miri,
}

/// What `ci` runs.
fn all() -> [Task; 15] {
    [
        Task::Format,
        Task::Lint,
        Task::TestHost,
        Task::Docs,
        Task::Embedded,
        Task::TestFirmware,
        Task::Golden,
        Task::Pil,
        Task::Panics,
        Task::Budgets,
        Task::LintBench,
        Task::Peers,
        Task::Deny,
        Task::Endurance(endurance::Args::SHORT),
        Task::Fuzz(fuzz::Args::short()),
    ]
}

fn main() -> ExitCode {
    match run(Xtask::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> anyhow::Result<()> {
    match task {
        Task::Ci => all().into_iter().try_for_each(run),
        Task::Format => cargo::run("fmt --all --check"),
        Task::Lint => cargo::run("clippy --workspace --all-targets --all-features -- -D warnings"),
        Task::TestHost => cargo::run("test"),
        Task::Docs => checks::docs(),
        Task::Embedded => checks::embedded(),
        Task::TestFirmware => firmware::test(),
        Task::Size => firmware::size(),
        Task::Stack(args) => firmware::stack(&args),
        Task::Pil => pil::check(),
        Task::Golden => golden::check(),
        Task::Panics => panics::check(),
        Task::Budgets => budgets::check(),
        Task::LintBench => checks::lint_bench(),
        Task::Peers => checks::peers(),
        Task::Deny => checks::deny(),
        Task::Bless => golden::bless().and_then(|()| budgets::bless()),
        Task::Bench => bench::run(),
        Task::Statistics => checks::statistics(),
        Task::Endurance(args) => endurance::run(args),
        Task::Fuzz(args) => fuzz::run(&args),
        Task::Miri => miri::run(),
    }
}
