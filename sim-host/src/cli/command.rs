//! `sonarfix command`: tells a robot to do something.

use std::path::PathBuf;

use sonarfix::localizer::Start;
use sonarfix::pose::Pose;
use sonarfix::units::{Metres, Radians};
use sonarfix_link::{Command, Outcome};
use sonarfix_map::Robot;

use super::monitor::PortArgs;
use crate::monitor::{request, view};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Begin anew from this pose.
    #[command(allow_negative_numbers = true)]
    SetPose {
        /// Metres along the map's x axis.
        x: f32,
        /// Metres along the map's y axis.
        y: f32,
        /// Degrees, counter-clockwise from the map's x axis.
        heading: f32,
        /// How sure x and y are: one standard deviation, metres.
        #[arg(long, default_value_t = 0.05)]
        position_deviation: f32,
        /// How sure the heading is: one standard deviation, degrees.
        #[arg(long, default_value_t = 3.0)]
        heading_deviation: f32,
    },
    /// Begin anew with this configuration, and keep it.
    SetConfiguration {
        /// The robot file (docs/formats.md).
        robot: PathBuf,
    },
    /// Run the loop.
    Start,
    /// Stop the loop.
    Stop,
    /// Forget what was learned of wheels and ranger.
    ResetCalibration,
    /// Say which map is in flash.
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
            Self::SetConfiguration { robot } => {
                Command::SetConfiguration(Robot::read(robot)?.config)
            }
            Self::Start => Command::Start,
            Self::Stop => Command::Stop,
            Self::ResetCalibration => Command::ResetCalibration,
            Self::MapChecksum => Command::MapChecksum,
        })
    }
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let command = args.what.command()?;
    match request::ask(&mut args.port.open()?, &command)? {
        Outcome::Done => println!("done"),
        Outcome::Map(map) => println!("map {}", view::flashed(map)),
        Outcome::Refused(reason) => anyhow::bail!("the robot refuses: {reason}"),
    }
    Ok(())
}
