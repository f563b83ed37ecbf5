//! The command line.

use clap::{CommandFactory, Parser, Subcommand};
use sonarfix_terminal::output::{self, Detail};

use crate::{
    bound, calibrate, check, command, compare, config, convert, doctor, examples, export, find,
    flash, init, map, measure, merge, monitor, paper, pil, plan, replay, run, shell, survey, sweep,
    virtual_robot,
};

/// Simulates, measures, replays and operates the Sonarfix localizer for small wheeled robots.
#[derive(Debug, Parser)]
#[command(name = "sonarfix", version, about)]
pub struct Cli {
    /// Prints results and errors alone: no progress and no remarks.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Also prints what else is done, as the files that are read and written.
    #[arg(short, long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes the files of a new robot into a folder: robot, map, and a scenario that runs at once.
    Init(init::Args),
    /// Checks scenario, robot and map files: errors, and values that are improbable.
    Check(check::Args),
    /// Runs the paper's scenario and prints the results beside the paper's Table 1.
    Paper(paper::Args),
    /// Runs a scenario.
    Run(run::Args),
    /// Runs a scenario with the robot's software on an emulated microcontroller.
    Pil(pil::Args),
    /// Replays the recording of a robot through the localizer.
    Replay(replay::Args),
    /// Compares two runs: logs, traces or scenarios, on a page with both maps at one time, and as a table.
    Compare(compare::Args),
    /// Searches for the pose of a robot without a start pose on a log.
    Find(find::Args),
    /// Estimates the calibration of a robot from a recording, with a known map or true poses.
    Calibrate(calibrate::Args),
    /// Measures encoders and servo of a robot step by step: wheels turned by hand, a sweep in a corner of a room.
    Measure(measure::Args),
    /// Maps the walls around a robot from the recording of a drive with a sweeping sonar.
    Survey(survey::Args),
    /// Converts recordings of other formats for `replay`.
    Convert(convert::Args),
    /// Writes logs, recordings and traces for other programs: MCAP, Parquet and bags of ROS 2.
    Export(export::Args),
    /// Shows the telemetry of a robot and records it for `replay`.
    Monitor(monitor::Args),
    /// Sends a command to a robot.
    #[command(name = "command")]
    Send(command::Args),
    /// Is a simulated robot on a pseudo-terminal, for `monitor`, `command` and `measure`.
    VirtualRobot(virtual_robot::Args),
    /// Joins the rows of `run --shard`.
    Merge(merge::Args),
    /// Bakes a robot file into the configuration image for the robot's flash.
    Config(config::Args),
    /// Writes the program with the map and the configuration of a robot into the flash of its board.
    Flash(flash::Args),
    /// Checks, bakes, draws, simplifies, imports and exports maps.
    Map(map::Args),
    /// Prints the Cramér–Rao bound on each state over time.
    Bound(bound::Args),
    /// Forecasts the localization accuracy along a path, before a robot is built.
    Plan(plan::Args),
    /// Lists the programs and serial ports of this computer that a robot needs, and what to do about the missing ones.
    Doctor(doctor::Args),
    /// Prints the completions of this command for a shell.
    Completions(shell::CompletionsArgs),
    /// Writes the manual pages of this command into a folder.
    Man(shell::ManArgs),
}

impl Cli {
    /// The command line, with examples in its help.
    pub fn with_examples() -> clap::Command {
        examples::added(Self::command())
    }

    /// Executes the command.
    ///
    /// # Errors
    /// Any error, with a message for the user.
    pub fn execute(self) -> anyhow::Result<()> {
        match (self.quiet, self.verbose) {
            (true, _) => output::choose(Detail::Quiet),
            (_, true) => output::choose(Detail::Verbose),
            _ => {}
        }
        sonarfix_map::on_read(|file| detail!("read {}", file.display()));
        sonarfix_files::on_written(|file| detail!("wrote {}", file.display()));
        match self.command {
            Command::Init(args) => init::execute(&args),
            Command::Check(args) => check::execute(&args),
            Command::Paper(args) => paper::execute(&args),
            Command::Run(args) if !args.sweep.is_empty() => sweep::execute(&args),
            Command::Run(args) => run::execute(&args),
            Command::Merge(args) => merge::execute(&args),
            Command::Pil(args) => pil::execute(&args),
            Command::Replay(args) => replay::execute(&args),
            Command::Compare(args) => compare::execute(&args),
            Command::Find(args) => find::execute(&args),
            Command::Calibrate(args) => calibrate::execute(&args),
            Command::Measure(args) => measure::execute(&args),
            Command::Survey(args) => survey::execute(&args),
            Command::Convert(args) => convert::execute(&args),
            Command::Export(args) => export::execute(&args),
            Command::Monitor(args) => monitor::execute(&args),
            Command::Send(args) => command::execute(&args),
            Command::VirtualRobot(args) => virtual_robot::execute(&args),
            Command::Config(args) => config::execute(&args),
            Command::Flash(args) => flash::execute(&args),
            Command::Map(args) => map::execute(&args),
            Command::Bound(args) => bound::execute(&args),
            Command::Plan(args) => plan::execute(&args),
            Command::Doctor(args) => doctor::execute(&args),
            Command::Completions(args) => shell::completions(&args, Self::with_examples()),
            Command::Man(args) => shell::man(&args, Self::with_examples()),
        }
    }
}
