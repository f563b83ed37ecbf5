//! The command `sonarfix`.

#[macro_use]
extern crate sonarfix_terminal;

mod bound;
mod calibrate;
mod check;
mod cli;
mod command;
mod compare;
mod config;
mod convert;
mod convert_rosbag;
mod diagnosis;
mod doctor;
mod examples;
mod export;
mod find;
mod flash;
mod goto;
mod init;
mod map;
mod map_exchange;
mod map_starts;
mod measure;
mod merge;
mod monitor;
mod paper;
mod patrol;
mod pil;
mod plan;
mod provenance;
mod recorded;
mod replay;
mod rows;
mod run;
mod self_test;
mod serve;
mod shell;
mod signs_of_life;
mod statistics;
mod survey;
mod sweep;
mod sweep_values;
mod table;
mod virtual_robot;
mod warnings;

use std::process::ExitCode;

use clap::FromArgMatches;
use cli::Cli;
use sonarfix_terminal::{output, progress};

fn main() -> ExitCode {
    // Examples are a part of the help, which is printed without a command, too.
    let arguments = Cli::with_examples().get_matches();
    let cli = Cli::from_arg_matches(&arguments).unwrap_or_else(|error| error.exit());
    match cli.execute() {
        Ok(()) => progress::exit_code(),
        Err(error) => {
            output::report_error(format_args!("error: {error:#}"));
            progress::exit_code_of_error()
        }
    }
}
