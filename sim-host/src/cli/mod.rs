//! The command line: what can be asked, and where the answers go.

mod bound;
mod command;
mod config;
mod convert;
mod faults;
mod floor_plans;
mod health;
mod map;
mod monitor;
mod overrides;
mod paper;
mod pil;
mod plan;
mod replay;
mod run;
mod sonar_model;
mod table;

use clap::{Parser, Subcommand};

/// Tells a small wheeled robot where it is; here, in simulation and from recordings.
#[derive(Debug, Parser)]
#[command(name = "sonarfix", version, about)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs the paper's scenario many times and prints its Table 1 beside ours.
    Paper(paper::Args),
    /// Runs any scenario.
    Run(run::Args),
    /// Runs a scenario with the robot's software on an emulated microcontroller.
    Pil(pil::Args),
    /// Replays the recording of a robot through the localizer.
    Replay(replay::Args),
    /// Converts recordings of other formats for `replay`.
    Convert(convert::Args),
    /// Shows what a robot says, live, and records it for `replay`.
    Monitor(monitor::Args),
    /// Tells a robot to do something.
    #[command(name = "command")]
    Tell(command::Args),
    /// Bakes a robot's configuration into the bytes that it reads from its flash.
    Config(config::Args),
    /// Checks, bakes, draws and simplifies maps.
    Map(map::Args),
    /// Prints how well any estimator could know the robot's state, over time.
    Bound(bound::Args),
    /// Shows how well a robot would know where it is along a path, before it is built.
    Plan(plan::Args),
    /// Prints how the simulated NXT sonar compares with recorded sweeps, as markdown.
    SonarModel(sonar_model::Args),
    /// Prints what every fault of the hardware does to a robot, as markdown.
    Faults(faults::Args),
    /// Prints how often the verdict is wrong, and how long it takes, as markdown.
    Health(health::Args),
    /// Compares two policies of the sonar in floor plans that nobody drew, as markdown.
    FloorPlans(floor_plans::Args),
}

impl Cli {
    /// Does what was asked.
    ///
    /// # Errors
    /// Whatever went wrong, in words for the person who asked.
    pub fn execute(self) -> anyhow::Result<()> {
        match self.command {
            Command::Paper(args) => paper::execute(&args),
            Command::Run(args) => run::execute(&args),
            Command::Pil(args) => pil::execute(&args),
            Command::Replay(args) => replay::execute(&args),
            Command::Convert(args) => convert::execute(&args),
            Command::Monitor(args) => monitor::execute(&args),
            Command::Tell(args) => command::execute(&args),
            Command::Config(args) => config::execute(&args),
            Command::Map(args) => map::execute(&args),
            Command::Bound(args) => bound::execute(&args),
            Command::Plan(args) => plan::execute(&args),
            Command::SonarModel(args) => sonar_model::execute(&args),
            Command::Faults(args) => faults::execute(&args),
            Command::Health(args) => health::execute(&args),
            Command::FloorPlans(args) => floor_plans::execute(&args),
        }
    }
}

/// Prints a value as JSON.
fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}
