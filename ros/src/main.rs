//! `sonarfix-ros`: a ROS 2 node that localizes a robot with encoders and sonar, in the place of AMCL. See `docs/ros.md`.

use std::process::ExitCode;

use sonarfix_ros::arguments::Arguments;
use sonarfix_ros::{parameters, program};

const HELP: &str = "sonarfix-ros: a ROS 2 node that localizes a robot with encoders and sonar

    sonarfix-ros --ros-args -p robot_file:=robot.toml -p map_file:=map.toml [-r __ns:=/robot1] [--params-file FILE]
    sonarfix-ros parameters        the parameters as a table

The node is a managed one: a lifecycle manager configures and activates it, or -p autostart_node:=true.
docs/ros.md has its topics, services and parameters.";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> anyhow::Result<()> {
    let arguments =
        Arguments::parse(std::env::args().skip(1), |file| std::fs::read_to_string(file))?;
    for name in &arguments.skipped {
        eprintln!("a parameter for every node is none of this one and is skipped: {name}");
    }
    match arguments.others.first().map(String::as_str) {
        None => program::run(&arguments),
        Some("parameters") => {
            print!("{}", parameters::markdown());
            Ok(())
        }
        Some("help" | "--help" | "-h") => {
            println!("{HELP}");
            Ok(())
        }
        Some(other) => anyhow::bail!("there is no command {other}\n{HELP}"),
    }
}
