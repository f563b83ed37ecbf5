//! The studies: runs that are pages of the documentation.

#[macro_use]
extern crate sonarfix_terminal;

mod calibration;
mod faults;
mod find;
mod find_forecast;
mod find_standing;
mod floor_plans;
mod health;
mod output;
mod peers;
mod reality;
mod recordings;
mod relocalize;
mod rooms;
mod search_motion;
mod sonar_model;
mod surveys;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Runs the studies of the Sonarfix localizer, and prints their pages.
#[derive(Debug, Parser)]
#[command(name = "sonarfix-studies", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measures the accuracy of `sonarfix calibrate` on simulated robots; prints markdown.
    Calibration(calibration::Args),
    /// Measures the effects of hardware faults; prints markdown.
    Faults(faults::Args),
    /// Measures how simulated robots without a start pose find it.
    Find(find::Args),
    /// Compares the forecast of `sonarfix map check --starts` with simulated searches in floor plans.
    FindForecast(find_forecast::Args),
    /// Measures how simulated robots that stand and sweep find their pose, beside what their pings allow.
    FindStanding(find_standing::Args),
    /// Compares two measurement policies on random floor plans; prints markdown.
    FloorPlans(floor_plans::Args),
    /// Measures the reliability of the health verdict; prints markdown.
    Health(health::Args),
    /// Compares the localizer and the search with a particle filter on the same pings; prints markdown.
    Peers(peers::Args),
    /// Replays all recordings of a folder; prints markdown.
    Reality(reality::Args),
    /// Replays the recordings of a folder with the robot files beside them; prints markdown.
    Recordings(recordings::Args),
    /// Measures how robots that lose their pose, or start without one, find it in random floor plans.
    Relocalize(relocalize::Args),
    /// Measures consistency and verdicts in generated rooms; prints markdown.
    Rooms(rooms::Args),
    /// Measures how robots find their pose that move by themselves while they search for it.
    SearchMotion(search_motion::Args),
    /// Compares the simulated NXT sonar with recorded sweeps; prints markdown.
    SonarModel(sonar_model::Args),
    /// Measures the accuracy of `sonarfix survey` on simulated robots; prints markdown.
    Surveys(surveys::Args),
}

fn main() -> ExitCode {
    match execute(Cli::parse().command) {
        Ok(()) => sonarfix_terminal::progress::exit_code(),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn execute(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Calibration(args) => calibration::execute(&args),
        Command::Faults(args) => faults::execute(&args),
        Command::Find(args) => find::execute(&args),
        Command::FindForecast(args) => find_forecast::execute(&args),
        Command::FindStanding(args) => find_standing::execute(&args),
        Command::FloorPlans(args) => floor_plans::execute(&args),
        Command::Health(args) => health::execute(&args),
        Command::Peers(args) => peers::execute(&args),
        Command::Reality(args) => reality::execute(&args),
        Command::Recordings(args) => recordings::execute(&args),
        Command::Relocalize(args) => relocalize::execute(&args),
        Command::Rooms(args) => rooms::execute(&args),
        Command::SearchMotion(args) => search_motion::execute(&args),
        Command::SonarModel(args) => sonar_model::execute(&args),
        Command::Surveys(args) => surveys::execute(&args),
    }
}
