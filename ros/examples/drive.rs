//! Writes a simulated drive as messages, one a line, with the robot file and the map beside it, and the file of a robot that turns while
//! it searches: `drive FOLDER SECONDS`.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context;
use serde_json::json;
use sonarfix_hal::config::{RobotConfig, SearchMotion, SearchMotionKind, StartPose};
use sonarfix_map::robot_file;
use sonarfix_ros::drive::Drive;
use sonarfix_ros::node::Input;
use sonarfix_ros::parameters::Parameters;
use sonarfix_ros::view::Frames;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().context("drive FOLDER SECONDS")?);
    let seconds: f64 = arguments.next().context("drive FOLDER SECONDS")?.parse()?;
    let drive = Drive::classroom(seconds, 0, &Frames::of(&Parameters::default()))?;
    let mut lines = String::new();
    for (at, input) in &drive.messages {
        let (topic, kind, message) = match input {
            Input::Odometry(message) => ("odom", "nav_msgs/msg/Odometry", json!(message)),
            Input::Range(_, message) => ("range", "sensor_msgs/msg/Range", json!(message)),
            Input::Transforms(message) => ("tf", "tf2_msgs/msg/TFMessage", json!(message)),
            _ => continue,
        };
        writeln!(
            lines,
            "{}",
            json!({ "at": at, "topic": topic, "type": kind, "message": message })
        )?;
    }
    for truth in &drive.truth {
        writeln!(lines, "{}", json!({ "at": truth.at, "topic": "truth", "pose": truth.pose }))?;
    }
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("drive.jsonl"), lines)?;
    std::fs::write(folder.join("start.json"), json!(drive.start).to_string())?;
    let robot = drive.scenario.robot;
    let motion = SearchMotion { kind: SearchMotionKind::Spin, bumper: SearchMotion::BUMPER };
    let start = StartPose::Exploring { region: None, motion };
    std::fs::write(folder.join("robot.toml"), robot_file::text(&robot))?;
    std::fs::write(folder.join("turning.toml"), robot_file::text(&RobotConfig { start, ..robot }))?;
    std::fs::write(folder.join("map.toml"), drive.scenario.floor.to_toml())?;
    Ok(())
}
