//! The command `sonarfix`.

#[macro_use]
mod output;

mod bound;
mod calibrate;
mod calibration;
mod cli;
mod command;
mod config;
mod convert;
mod export;
mod faults;
mod find;
mod floor_plans;
mod health;
mod init;
mod json;
mod map;
mod map_exchange;
mod measure;
mod merge;
mod monitor;
mod overrides;
mod paper;
mod pil;
mod plan;
mod progress;
mod provenance;
mod reality;
mod relocalize;
mod replay;
mod robot_edit;
mod rooms;
mod rows;
mod run;
mod serve;
mod signs_of_life;
mod sonar_model;
mod survey;
mod surveys;
mod sweep;
mod sweep_values;
mod table;

use std::process::ExitCode;

use clap::Parser;
use cli::Cli;

fn main() -> ExitCode {
    match Cli::parse().execute() {
        Ok(()) => progress::exit_code(),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
