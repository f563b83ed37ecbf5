//! `sonarfix measure`: encoders and servo of a robot, step by step.

pub mod corner;
mod robot;
pub mod wheel;

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_batch::bearings::Bearings;
use sonarfix_batch::robot_edit;
use sonarfix_batch::turned::Turned;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::Command;
use sonarfix_map::robot_file;

use crate::monitor::PortArgs;
use sonarfix_terminal::output::check_file;

use robot::Robot;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// The robot file that is in the robot.
    #[arg(long, value_name = "ROBOT.toml", default_value = "robot.toml")]
    robot: PathBuf,
    /// The robot file to write, with what was measured.
    #[arg(long, value_name = "ROBOT.toml")]
    out: Option<PathBuf>,
    /// Revolutions by which each wheel is turned.
    #[arg(long, default_value_t = 10)]
    revolutions: u32,
    /// Passes of the servo between its limits.
    #[arg(long, default_value_t = 4)]
    passes: u32,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(out) = &args.out {
        check_file("--out", out)?;
    }
    anyhow::ensure!(args.revolutions > 0, "--revolutions must be at least 1");
    anyhow::ensure!(args.passes > 0, "--passes must be at least 1");
    let config = robot_file::read(&args.robot)?;
    let text =
        sonarfix_map::read_text(&args.robot).with_context(|| args.robot.display().to_string())?;
    let mut robot = Robot::new(args.port.open()?);
    robot.command(&Command::Stop)?;
    println!("Switch the supply of the motors off and lift the robot.");
    let right = wheel(&mut robot, "right", args.revolutions)?;
    let left = wheel(&mut robot, "left", args.revolutions)?;
    let has_servo = config.localizer.rangers.first.fixed_bearing().is_none();
    let servo = has_servo.then(|| servo(&mut robot, &config, args.passes)).transpose()?;
    if let Some(out) = &args.out {
        let text = robot_edit::measured(&text, &config, &[right, left], servo.as_ref())?;
        robot_file::parse(&text, &out.display().to_string())?;
        sonarfix_files::write(out, text)?;
        let (port, out) = (args.port.name(), out.display());
        println!(
            "Written to {out}. Into the robot: sonarfix command --port {port} set-configuration {out}"
        );
    }
    Ok(())
}

fn wheel(robot: &mut Robot, name: &str, revolutions: u32) -> anyhow::Result<Turned> {
    println!("Turn the {name} wheel forwards by {revolutions} revolutions, and press Enter.");
    let [right, left] = robot.edges()?;
    let (edges, other) = if name == "right" { (right, left) } else { (left, right) };
    let turned =
        Turned::new(edges, other, revolutions.into()).with_context(|| format!("{name} wheel"))?;
    println!(
        "  {name} wheel: {:.0} edges per revolution, {}",
        turned.edges_per_revolution(),
        if turned.is_mirrored() { "mirrored" } else { "not mirrored" }
    );
    Ok(turned)
}

fn servo(robot: &mut Robot, config: &RobotConfig, passes: u32) -> anyhow::Result<Bearings> {
    println!(
        "Put the robot on the floor in a corner of a room, 30 cm to 80 cm from a wall ahead and from a wall at its left,\n\
         its front square to the wall ahead and nothing else near it, and press Enter. Then do not touch it."
    );
    let (rightmost, leftmost) = config.localizer.rangers.first.servo;
    let swept = robot.sweep([rightmost.0.into(), leftmost.0.into()], passes)?;
    let found = corner::bearings(&swept)?;
    println!(
        "  servo: a bearing of 0° points to {:+.1}° ± {:.1}°, and each further degree is {:.3}° ± {:.3}°",
        found.offset.to_degrees(),
        found.offset_deviation.to_degrees(),
        found.scale,
        found.scale_deviation
    );
    Ok(found)
}
