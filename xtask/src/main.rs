//! The project's checks and chores. `cargo xtask ci` runs every check; each is a command of its own, too.

use std::process::ExitCode;

use anyhow::Context;
use ci::Step;
use clap::{Parser, Subcommand};

mod bags;
mod bench;
mod board_page;
mod budgets;
mod c_library;
mod cargo;
mod checks;
mod chips;
mod ci;
mod circles;
mod compositions;
mod dist;
mod elf;
mod emulator;
mod endurance;
mod features;
mod figures;
mod firmware;
mod flash_page;
mod fuzz;
mod golden;
mod miri;
mod mutants;
mod page;
mod panics;
mod pil;
mod playground;
mod program;
mod publish;
mod python;
mod ros;
mod search_windows;
mod site;
mod symbols;
mod template;
mod thumb;
mod unsafe_code;
mod words;
mod workspace;
mod worst_poll;

#[derive(Debug, Parser)]
#[command(about = "The project's checks and chores")]
struct Xtask {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The checks of CI; a failure does not keep the following ones from running.
    Ci {
        /// Jobs or steps by name; all but the long ones if none is given.
        names: Vec<String>,
    },
    /// One step of CI.
    Step { name: String },
    #[command(flatten)]
    Task(Task),
}

#[derive(Debug, Clone, PartialEq, Eq, Subcommand)]
enum Task {
    /// Formatting of every workspace.
    Format,
    /// Clippy, warnings are errors.
    Lint,
    /// No circle of imports between the modules of a crate.
    Circles,
    /// The tests, as the README runs them.
    TestHost,
    /// The documentation, warnings are errors.
    Docs,
    /// The `no_std` crates for microcontrollers with and without FPU.
    Embedded,
    /// The core with each combination of its features that matters.
    Features,
    /// The firmware: builds it, searches it for panics, and runs it in an emulator.
    TestFirmware,
    /// The firmware of all further boards: lints it, builds it, searches it for panics, prints its flash, RAM and stack, and
    /// compares them with docs/firmware.md.
    Boards(firmware::BoardsArgs),
    /// The firmware of the Raspberry Pi Pico on an emulated RP2040, with a robot in a room; `--long` has many drives and power cuts.
    Chips(chips::Args),
    /// Writes docs/boards.md: what has been shown of each board; `--check` compares it.
    BoardPage(page::Args),
    /// The template of a further board: instantiated, built, and refused without each of its parts.
    Template,
    /// Flash and RAM of the shipped firmware, by crate.
    Size,
    /// The deepest that the stack of the shipped firmware can be, by the calls in it.
    Stack(firmware::StackArgs),
    /// The shipped loop on emulated microcontrollers, bit by bit as on the PC; its cost.
    Pil,
    /// The worst poll of many scenarios on a Cortex-M4F and a Cortex-M0+, against docs/worst-poll.md.
    WorstPoll(worst_poll::Args),
    /// Follows docs/build-a-robot.md in simulation: `sonarfix init`, signs of life in QEMU, a drive on each emulated core.
    Guide,
    /// The golden traces on this computer and every emulated microcontroller.
    Golden,
    /// No panic is linked into a program for a microcontroller.
    Panics,
    /// Instructions, code, stack and memory against `budgets.toml`.
    Budgets,
    /// Flash, memory and instructions of what a robot links: writes docs/compositions.md.
    Compositions(compositions::Args),
    /// The C library: its header, its programs on this computer and on emulated cores, hostile calls, its size.
    C(c_library::Args),
    /// Archives of the command for a PC without Rust, and the packages of the C library for Arduino and other builds.
    Dist(dist::Args),
    /// Programs for emulated boards: formatting, Clippy.
    LintEmulated,
    /// Sonarfix and every peer compute the same.
    Peers,
    /// The published crates compile with the oldest Rust that they declare.
    Msrv,
    /// The packages of the published crates build from their own files.
    Package,
    /// What the site computes in the browser, `target/playground`: simulator, form of a new robot, live page; in Chromium it computes the same bits as here.
    Playground,
    /// The site, `target/site`: the docs as a book, and the pages of `playground`; `--check` opens each page in Chromium.
    Site(site::Args),
    /// The Python package: its wheel in an empty environment, its tests, types, style and notebooks.
    Python(python::Args),
    /// Bags of ROS 2 against rosbags in Python: ours read by it, its own and damaged ones read by ours.
    Bags,
    /// The ROS 2 node: its tests, and a client over Eclipse Cyclone DDS that behaves like nav2.
    Ros(ros::Args),
    /// Licences of all dependencies, and advisories if their database can be reached.
    Deny,
    /// The dependencies of the `no_std` crates with their lines of `unsafe` code, against docs/unsafe-code.md.
    UnsafeCode(page::Args),
    /// Records the golden traces, writes the fuzz inputs of messages, and measures and writes `budgets.toml`.
    Bless(BlessArgs),
    /// Measures Sonarfix and its peers (ten minutes).
    Bench,
    /// The paper's statistics at full length: 5,000 seeds, both policies (minutes).
    Statistics,
    /// Writes the figures that README and pages quote (`docs/figures.toml`); `--check` compares them.
    Figures(figures::Args),
    /// Lines with words that `docs/glossary.md` avoids.
    Words,
    /// Random runs of the filter, 10⁸ steps by default (minutes).
    Endurance(endurance::Args),
    /// Random windows of pings for the search for the pose, 10⁶ by default (minutes).
    SearchWindows(search_windows::Args),
    /// Fuzzing for a bounded time.
    Fuzz(fuzz::Args),
    /// Mutation tests with cargo-mutants: of a change with `--since`, of one file with `--file`, or a part of all.
    Mutants(mutants::Args),
    /// The core under Miri if it is installed (long: it builds a standard library first).
    Miri,
}

/// The steps that run if none is named: half an hour on a fresh machine with two cores. The others run by their names or those of their
/// jobs, as on GitHub.
const SHORT: [&str; 8] =
    ["format", "circles", "lint", "docs", "unsafe-code", "test-host", "embedded", "lint-emulated"];

/// The steps of CI. Those of the main workspace come first and those of other workspaces last: two run beside each other, one from each
/// end ([`ci::run`]), and cargo locks the target folder of a workspace.
fn steps() -> [Step<Task>; 37] {
    [
        ("lint", "format", Task::Format),
        ("lint", "circles", Task::Circles),
        ("lint", "lint", Task::Lint),
        ("lint", "docs", Task::Docs),
        ("lint", "deny", Task::Deny),
        ("lint", "unsafe-code", Task::UnsafeCode(page::Args::CHECK)),
        ("test", "test-host", Task::TestHost),
        ("random", "endurance", Task::Endurance(endurance::Args::SHORT)),
        ("random", "search-windows", Task::SearchWindows(search_windows::Args::SHORT)),
        ("python", "bags", Task::Bags),
        ("crates", "embedded", Task::Embedded),
        ("crates", "features", Task::Features),
        ("crates", "msrv", Task::Msrv),
        ("crates", "package", Task::Package),
        ("budgets", "figures", Task::Figures(figures::Args::CHECK)),
        ("budgets", "compositions", Task::Compositions(compositions::Args { check: true })),
        ("budgets", "budgets", Task::Budgets),
        ("budgets", "panics", Task::Panics),
        ("emulated", "golden", Task::Golden),
        ("emulated", "pil", Task::Pil),
        ("emulated", "worst-poll", Task::WorstPoll(worst_poll::Args::CHECK)),
        ("emulated", "guide", Task::Guide),
        ("budgets", "peers", Task::Peers),
        ("budgets", "playground", Task::Playground),
        ("budgets", "site", Task::Site(site::Args::CHECK)),
        ("random", "fuzz", Task::Fuzz(fuzz::Args::short())),
        ("random", "mutants", Task::Mutants(mutants::Args::short())),
        ("c", "dist", Task::Dist(dist::Args::check())),
        ("emulated", "chips", Task::Chips(chips::Args::CHECK)),
        ("firmware", "board-page", Task::BoardPage(page::Args::CHECK)),
        ("firmware", "template", Task::Template),
        ("firmware", "boards", Task::Boards(firmware::BoardsArgs::COMPARE)),
        ("firmware", "test-firmware", Task::TestFirmware),
        ("lint", "lint-emulated", Task::LintEmulated),
        ("c", "c", Task::C(c_library::Args::CHECK)),
        ("ros", "ros", Task::Ros(ros::Args::CHECK)),
        ("python", "python", Task::Python(python::Args::CHECK)),
    ]
    .map(|(job, name, task)| Step { job, name, is_short: SHORT.contains(&name), task })
}

fn main() -> ExitCode {
    let result = symbols::run_as_rustc().unwrap_or_else(|| match Xtask::parse().command {
        Command::Ci { names } => ci::run(&steps(), &names, ci::run_in_a_process),
        Command::Step { name } => step(&name),
        Command::Task(task) => run(task).map(|()| ExitCode::SUCCESS),
    });
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

fn step(name: &str) -> anyhow::Result<ExitCode> {
    let step = steps().into_iter().find(|step| step.name == name);
    run(step.with_context(|| format!("there is no step {name}"))?.task)?;
    Ok(ExitCode::SUCCESS)
}

/// What is renewed.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
struct BlessArgs {
    /// Only `budgets.toml`.
    #[arg(long)]
    budgets: bool,
}

fn bless(args: &BlessArgs) -> anyhow::Result<()> {
    if !args.budgets {
        golden::bless()?;
        fuzz::bless()?;
    }
    budgets::bless()
}

fn run(task: Task) -> anyhow::Result<()> {
    match task {
        Task::Format => checks::format(),
        Task::Lint => cargo::run("clippy --workspace --all-targets --all-features -- -D warnings"),
        Task::Circles => circles::check(),
        Task::TestHost => cargo::run("test"),
        Task::Docs => checks::docs(),
        Task::Embedded => checks::embedded(),
        Task::Features => features::check(),
        Task::TestFirmware => firmware::test(),
        Task::Boards(args) => firmware::boards(&args),
        Task::BoardPage(args) => board_page::run(args),
        Task::Chips(args) => chips::run(args),
        Task::Template => template::check(),
        Task::Size => firmware::size(),
        Task::Stack(args) => firmware::stack(&args),
        Task::Pil => pil::check(),
        Task::WorstPoll(args) => worst_poll::run(args),
        Task::Guide => firmware::guide(),
        Task::Golden => golden::check(),
        Task::Panics => panics::check(),
        Task::Budgets => budgets::check(),
        Task::Compositions(args) => compositions::run(&args),
        Task::C(args) => c_library::run(&args),
        Task::Dist(args) => dist::run(&args),
        Task::LintEmulated => checks::lint_emulated(),
        Task::Peers => checks::peers(),
        Task::Msrv => publish::msrv(),
        Task::Package => publish::package(),
        Task::Playground => playground::build_and_check(),
        Task::Site(args) => site::run(args),
        Task::Python(args) => python::check(args),
        Task::Bags => bags::check(),
        Task::Ros(args) => ros::run(&args),
        Task::Deny => checks::deny(),
        Task::UnsafeCode(args) => unsafe_code::run(args),
        Task::Bless(args) => bless(&args),
        Task::Bench => bench::run(),
        Task::Statistics => checks::statistics(),
        Task::Figures(args) => figures::run(&args),
        Task::Words => words::print(),
        Task::Endurance(args) => endurance::run(args),
        Task::SearchWindows(args) => search_windows::run(args),
        Task::Fuzz(args) => fuzz::run(&args),
        Task::Mutants(args) => mutants::run(&args),
        Task::Miri => miri::run(),
    }
}
