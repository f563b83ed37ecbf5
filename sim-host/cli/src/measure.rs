//! `sonarfix measure`: encoders and servo of a robot, step by step.

pub mod corner;
mod robot;
pub mod wheel;

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::Serialize;
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
    /// Prints the results as JSON, and what to do on standard error.
    #[arg(long)]
    json: bool,
}

/// The results as JSON.
#[derive(Debug, Serialize)]
struct Json<'a> {
    right_wheel: Wheel,
    left_wheel: Wheel,
    servo: Option<Servo>,
    /// The robot file that was written.
    out: Option<&'a Path>,
}

#[derive(Debug, Serialize)]
struct Wheel {
    edges_per_revolution: f64,
    mirrored: bool,
}

impl From<Turned> for Wheel {
    fn from(turned: Turned) -> Self {
        Self { edges_per_revolution: turned.edges_per_revolution(), mirrored: turned.is_mirrored() }
    }
}

/// The line from commanded to true bearings.
#[derive(Debug, Serialize)]
struct Servo {
    offset: f64,
    offset_deviation: f64,
    scale: f64,
    scale_deviation: f64,
}

impl From<&Bearings> for Servo {
    fn from(found: &Bearings) -> Self {
        let Bearings { offset, offset_deviation, scale, scale_deviation, .. } = *found;
        Self { offset, offset_deviation, scale, scale_deviation }
    }
}

/// Where the steps and their results are written.
#[derive(Debug, Clone, Copy)]
struct Dialogue {
    json: bool,
}

impl Dialogue {
    /// Says what to do.
    fn ask(self, text: &str) {
        if self.json {
            // Also of a quiet command, which would wait without a word.
            sonarfix_terminal::output::report_error(format_args!("{text}"));
        } else {
            println!("{text}");
        }
    }

    /// Prints a result, which JSON has as a whole.
    fn show(self, text: &str) {
        if !self.json {
            println!("{text}");
        }
    }
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
    let dialogue = Dialogue { json: args.json };
    dialogue.ask("Switch the supply of the motors off and lift the robot.");
    let right = wheel(&mut robot, dialogue, "right", args.revolutions)?;
    let left = wheel(&mut robot, dialogue, "left", args.revolutions)?;
    let has_servo = config.localizer.rangers.first.fixed_bearing().is_none();
    let servo = has_servo.then(|| servo(&mut robot, dialogue, &config, args.passes)).transpose()?;
    if let Some(out) = &args.out {
        let text = robot_edit::measured(&text, &config, &[right, left], servo.as_ref())?;
        robot_file::parse(&text, &out.display().to_string())?;
        sonarfix_files::write(out, text)?;
        let (port, out) = (args.port.name(), out.display());
        dialogue.show(&format!(
            "Written to {out}. Into the robot: sonarfix command --port {port} set-configuration {out}"
        ));
    }
    if args.json {
        sonarfix_terminal::json::print(&Json {
            right_wheel: right.into(),
            left_wheel: left.into(),
            servo: servo.as_ref().map(Servo::from),
            out: args.out.as_deref(),
        })?;
    }
    Ok(())
}

fn wheel(
    robot: &mut Robot,
    dialogue: Dialogue,
    name: &str,
    revolutions: u32,
) -> anyhow::Result<Turned> {
    dialogue.ask(&format!(
        "Turn the {name} wheel forwards by {revolutions} revolutions, and press Enter."
    ));
    let [right, left] = robot.edges()?;
    let (edges, other) = if name == "right" { (right, left) } else { (left, right) };
    let turned =
        Turned::new(edges, other, revolutions.into()).with_context(|| format!("{name} wheel"))?;
    dialogue.show(&format!(
        "  {name} wheel: {:.0} edges per revolution, {}",
        turned.edges_per_revolution(),
        if turned.is_mirrored() { "mirrored" } else { "not mirrored" }
    ));
    Ok(turned)
}

fn servo(
    robot: &mut Robot,
    dialogue: Dialogue,
    config: &RobotConfig,
    passes: u32,
) -> anyhow::Result<Bearings> {
    dialogue.ask(
        "Put the robot on the floor in a corner of a room, 30 cm to 80 cm from a wall ahead and from a wall at its left,\n\
         its front square to the wall ahead and nothing else near it, and press Enter. Then do not touch it."
    );
    let (rightmost, leftmost) = config.localizer.rangers.first.servo;
    let swept = robot.sweep([rightmost.0.into(), leftmost.0.into()], passes)?;
    let found = corner::bearings(&swept)?;
    dialogue.show(&format!(
        "  servo: a bearing of 0° points to {:+.1}° ± {:.1}°, and each further degree is {:.3}° ± {:.3}°",
        found.offset.to_degrees(),
        found.offset_deviation.to_degrees(),
        found.scale,
        found.scale_deviation
    ));
    Ok(found)
}
