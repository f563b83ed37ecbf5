//! The command `sonarfix`.

#[macro_use]
extern crate sonarfix_terminal;

mod bound;
mod calibrate;
mod check;
mod cli;
mod command;
mod config;
mod convert;
mod convert_rosbag;
mod doctor;
mod export;
mod find;
mod init;
mod map;
mod map_exchange;
mod measure;
mod merge;
mod monitor;
mod paper;
mod pil;
mod plan;
mod provenance;
mod replay;
mod rows;
mod run;
mod serve;
mod shell;
mod signs_of_life;
mod survey;
mod sweep;
mod sweep_values;
mod table;
mod warnings;

use std::process::ExitCode;

use clap::Parser;
use cli::Cli;
use sonarfix_terminal::progress;

fn main() -> ExitCode {
    match Cli::parse().execute() {
        Ok(()) => progress::exit_code(),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
