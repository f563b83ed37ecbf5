//! `sonarfix command`: sends a command to a robot.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::localizer::Start;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix_link::{Command, CommandResult, Motion};
use sonarfix_map::robot_file;
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_telemetry::view;
use sonarfix_terminal::progress::{catch_interrupt, is_interrupted};

use crate::monitor::PortArgs;
use crate::{goto, patrol, self_test};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    #[command(flatten)]
    Single(Single),
    /// Drive to a point, or along several, by the estimates of the robot. It stands while it is lost, while its pose is too
    /// uncertain, and in front of objects that are not on the map (docs/driving.md).
    #[command(allow_negative_numbers = true)]
    Goto(goto::Args),
    /// Drive from point to point of a list, again and again: an example of a program that drives a robot by trips as those of `goto`.
    #[command(allow_negative_numbers = true)]
    Patrol(patrol::Args),
    /// Test the board of a robot that waits with its wheels at rest: link, clock, encoders, pulses of the servo, capture, flash. Prints a
    /// report that can be sent in.
    SelfTest(self_test::Args),
}

// A command of the link. Without a comment of documentation, which would become the help of `command`.
#[derive(Debug, clap::Subcommand)]
enum Single {
    /// Restart the localizer from this pose.
    #[command(allow_negative_numbers = true)]
    SetPose(PoseArgs),
    /// Pass a heading from outside to the running localizer, beside its own estimate.
    #[command(allow_negative_numbers = true)]
    Heading {
        /// Degrees, counter-clockwise from the map's x axis.
        heading: f32,
        /// Standard deviation, degrees.
        #[arg(long, default_value_t = 3.0)]
        deviation: f32,
        #[command(flatten)]
        age: Age,
    },
    /// Pass a position from outside to the running localizer.
    #[command(allow_negative_numbers = true)]
    Position {
        /// Metres along the map's x axis.
        x: f32,
        /// Metres along the map's y axis.
        y: f32,
        /// Standard deviation of x and of y, metres.
        #[arg(long, default_value_t = 0.05)]
        deviation: f32,
        #[command(flatten)]
        age: Age,
    },
    /// Pass a pose from outside to the running localizer.
    #[command(allow_negative_numbers = true)]
    Pose {
        #[command(flatten)]
        pose: PoseArgs,
        #[command(flatten)]
        age: Age,
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
    /// Turn the servo of a robot that waits to this bearing for a minute, for example to fit the horn.
    #[command(allow_negative_numbers = true)]
    Point {
        /// Degrees, counter-clockwise from the robot's heading.
        bearing: f32,
    },
    /// Drive; at the end, and after Ctrl-C, the robot stands. The command is renewed meanwhile: without it the robot stops by
    /// itself after 0.3 s.
    #[command(allow_negative_numbers = true)]
    Drive {
        /// Forward speed, metres per second; negative: backwards.
        #[arg(long, default_value_t = 0.0)]
        speed: f32,
        /// Turn rate, degrees per second, counter-clockwise.
        #[arg(long, default_value_t = 0.0)]
        turn: f32,
        /// For how long; by default until Ctrl-C.
        #[arg(long)]
        seconds: Option<f64>,
    },
}

/// A pose with its deviations.
#[derive(Debug, Clone, Copy, clap::Args)]
struct PoseArgs {
    /// Metres along the map's x axis.
    x: f32,
    /// Metres along the map's y axis.
    y: f32,
    /// Degrees, counter-clockwise from the map's x axis.
    heading: f32,
    /// Standard deviation of x and of y, metres.
    #[arg(long, default_value_t = 0.05)]
    position_deviation: f32,
    /// Standard deviation of the heading, degrees.
    #[arg(long, default_value_t = 3.0)]
    heading_deviation: f32,
}

impl PoseArgs {
    fn start(&self) -> Start {
        Start {
            pose: Pose::new(self.x, self.y, Radians::from_degrees(self.heading)),
            position_deviation: Metres(self.position_deviation),
            heading_deviation: Radians::from_degrees(self.heading_deviation),
        }
    }
}

/// How old a measurement is.
#[derive(Debug, Clone, Copy, clap::Args)]
struct Age {
    /// How long ago it was measured, milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 0)]
    age: u32,
}

impl Age {
    fn command(self, measurement: AbsoluteMeasurement) -> Command {
        Command::Absolute { age: Duration::from_ticks(1_000 * u64::from(self.age)), measurement }
    }
}

impl Single {
    fn command(&self) -> anyhow::Result<Command> {
        Ok(match self {
            Self::SetPose(pose) => Command::SetPose(pose.start()),
            Self::Heading { heading, deviation, age } => {
                let degrees = Radians::from_degrees;
                age.command(AbsoluteMeasurement::Heading {
                    angle: degrees(*heading),
                    deviation: degrees(*deviation),
                })
            }
            Self::Position { x, y, deviation, age } => {
                let noise = PositionNoise::circular(Metres(*deviation));
                age.command(AbsoluteMeasurement::Position { point: Point::new(*x, *y), noise })
            }
            Self::Pose { pose, age } => {
                let Start { pose, position_deviation, heading_deviation } = pose.start();
                let noise = PoseNoise::independent(position_deviation, heading_deviation);
                age.command(AbsoluteMeasurement::Pose { pose, noise })
            }
            Self::SetConfiguration { robot } => Command::SetConfiguration(robot_file::read(robot)?),
            Self::Start => Command::Start,
            Self::Stop => Command::Stop,
            Self::ResetCalibration => Command::ResetCalibration,
            Self::Search => Command::Search,
            Self::MapChecksum => Command::MapChecksum,
            Self::Point { bearing } => Command::Point(Radians::from_degrees(*bearing)),
            Self::Drive { speed, turn, .. } => Command::Drive(Motion {
                speed: MetresPerSecond(*speed),
                turn: RadiansPerSecond(turn.to_radians()),
            }),
        })
    }
}

/// Drives until Ctrl-C or the end of the given time.
fn drive(port: &mut Port, motion: Motion, what: &Single) -> anyhow::Result<CommandResult> {
    let limit = match what {
        Single::Drive { seconds, .. } => *seconds,
        _ => None,
    };
    let limit = limit.map(std::time::Duration::try_from_secs_f64).transpose();
    let limit = limit.context("--seconds: not a duration")?;
    catch_interrupt();
    let began = Instant::now();
    request::drive(port, motion, || {
        is_interrupted() || limit.is_some_and(|limit| began.elapsed() >= limit)
    })
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let what = match &args.what {
        What::Single(what) => what,
        What::Goto(route) => return goto::execute(route, &mut args.port.open()?),
        What::SelfTest(test) => return self_test::execute(test, &mut args.port.open()?),
        What::Patrol(points) => return patrol::execute(points, &mut args.port.open()?),
    };
    let command = what.command()?;
    let mut port = args.port.open()?;
    let (result, response) = match command {
        Command::Absolute { .. } => request::ask_absolute(&mut port, &command)?,
        Command::Drive(motion) => (drive(&mut port, motion, what)?, None),
        _ => (request::ask(&mut port, &command)?, None),
    };
    match result {
        CommandResult::Done => {
            println!("{}", response.as_ref().map_or_else(|| "done".to_owned(), view::absolute));
        }
        CommandResult::Session(number) => println!("session {number}"),
        CommandResult::Map(map) => println!("map {}", view::flashed(map)),
        CommandResult::Refused(reason) => anyhow::bail!("the robot refuses: {reason}"),
    }
    Ok(())
}
