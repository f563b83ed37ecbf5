//! `sonarfix command`: sends a command to a robot.

use std::path::PathBuf;

use sonarfix::localizer::Start;
use sonarfix::pose::Pose;
use sonarfix::units::{Metres, Radians};
use sonarfix_link::{Command, CommandResult};
use sonarfix_map::robot_file;
use sonarfix_monitor::{request, view};

use crate::monitor::PortArgs;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Restart the localizer from this pose.
    #[command(allow_negative_numbers = true)]
    SetPose {
        /// Metres along the map's x axis.
        x: f32,
        /// Metres along the map's y axis.
        y: f32,
        /// Degrees, counter-clockwise from the map's x axis.
        heading: f32,
        /// Standard deviation of x and y, metres.
        #[arg(long, default_value_t = 0.05)]
        position_deviation: f32,
        /// Standard deviation of the heading, degrees.
        #[arg(long, default_value_t = 3.0)]
        heading_deviation: f32,
    },
    /// Store this configuration and restart the localizer with it.
    SetConfiguration {
        /// The robot file (docs/formats.md).
        robot: PathBuf,
    },
    /// Run the loop.
    Start,
    /// Stop the loop.
    Stop,
    /// Discard the estimated calibration of wheels and ranger.
    ResetCalibration,
    /// Declare the pose unknown and search for it.
    Search,
    /// Print the checksum of the map in flash.
    MapChecksum,
}

impl What {
    fn command(&self) -> anyhow::Result<Command> {
        Ok(match self {
            Self::SetPose { x, y, heading, position_deviation, heading_deviation } => {
                let degrees = Radians::from_degrees;
                Command::SetPose(Start {
                    pose: Pose::new(*x, *y, degrees(*heading)),
                    position_deviation: Metres(*position_deviation),
                    heading_deviation: degrees(*heading_deviation),
                })
            }
            Self::SetConfiguration { robot } => Command::SetConfiguration(robot_file::read(robot)?),
            Self::Start => Command::Start,
            Self::Stop => Command::Stop,
            Self::ResetCalibration => Command::ResetCalibration,
            Self::Search => Command::Search,
            Self::MapChecksum => Command::MapChecksum,
        })
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let command = args.what.command()?;
    match request::ask(&mut args.port.open()?, &command)? {
        CommandResult::Done => println!("done"),
        CommandResult::Session(number) => println!("session {number}"),
        CommandResult::Map(map) => println!("map {}", view::flashed(map)),
        CommandResult::Refused(reason) => anyhow::bail!("the robot refuses: {reason}"),
    }
    Ok(())
}
