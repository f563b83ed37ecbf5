//! `sonarfix convert rosbag`: a bag of ROS 2 as a log.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use sonarfix_bags::convert::Rosbag;
use sonarfix_replay::convert::{ConvertError, Converted};
use sonarfix_sim::trace::Pose;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The bag: a folder with metadata.yaml, or a file .mcap or .db3.
    from: PathBuf,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replaces a log that is in the folder.
    #[arg(long)]
    force: bool,
    /// The topic of the odometry; by default the only one, or /odom.
    #[arg(long, value_name = "TOPIC")]
    odometry: Option<String>,
    /// The radius of the wheels, metres: takes the wheels from a `JointState`, in place of an `Odometry`.
    #[arg(long, value_name = "M", value_parser = length, requires = "track_width")]
    wheel_radius: Option<f64>,
    /// The joints of the wheels; by default those with `right` or `left` and `wheel` in their names.
    #[arg(long, value_name = "RIGHT,LEFT", value_parser = names, requires = "wheel_radius")]
    joints: Option<[String; 2]>,
    /// The distance between the wheels, metres.
    #[arg(long, value_name = "M", value_parser = length)]
    track_width: Option<f64>,
    /// A topic with ranges; may be repeated. By default all.
    #[arg(long, value_name = "TOPIC")]
    range: Vec<String>,
    /// The topic with scans, in place of ranges.
    #[arg(long, value_name = "TOPIC", conflicts_with = "range")]
    scan: Option<String>,
    /// Takes of a scan the beams at these bearings, degrees from the heading, as ranges.
    #[arg(long, value_name = "DEGREES,…", value_delimiter = ',', value_parser = number, allow_hyphen_values = true)]
    beams: Vec<f64>,
    /// The robot's frame; by default that of the odometry.
    #[arg(long, value_name = "FRAME")]
    base: Option<String>,
    /// The place of a ranger or scanner on the robot, metres ahead and to the left, and its bearing, in place of its frame. May be
    /// repeated.
    #[arg(long, value_name = "TOPIC=AHEAD,LEFT,DEGREES", value_parser = mount)]
    mount: Vec<(String, [f64; 3])>,
    /// The pose at the begin, metres and degrees; by default the first message of `/initialpose` or `/amcl_pose`.
    #[arg(long, value_name = "X,Y,DEGREES", value_parser = placed, allow_hyphen_values = true)]
    start: Option<[f64; 3]>,
    /// The topic with the true poses.
    #[arg(long, value_name = "TOPIC")]
    reference: Option<String>,
    /// The walls as CSV: x1, y1, x2, y2 in metres. Without them no map.toml is written.
    #[arg(long, value_name = "WALLS.csv")]
    walls: Option<PathBuf>,
}

impl Args {
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// Refuses to replace a log.
    pub fn check(&self) -> anyhow::Result<()> {
        let log = self.out.join("log.csv");
        ensure!(
            self.force || !log.exists(),
            "--out: {} exists: name another folder, or replace it with --force",
            log.display()
        );
        Ok(())
    }

    pub fn convert(&self, report: &mut dyn FnMut(String)) -> Result<Converted, ConvertError> {
        let beams: Vec<f64> = self.beams.iter().map(|bearing| bearing.to_radians()).collect();
        let rosbag = Rosbag {
            odometry: self.odometry.as_deref(),
            joints: self.joints.clone(),
            radius: self.wheel_radius,
            track_width: self.track_width,
            ranges: &self.range,
            scan: self.scan.as_deref(),
            beams: &beams,
            base: self.base.as_deref(),
            mounts: &self.mount,
            start: self.start.map(|[x, y, heading]| Pose { x, y, heading }),
            reference: self.reference.as_deref(),
            walls: self.walls.as_deref(),
        };
        rosbag.convert(&self.from, &self.out, report)
    }
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a finite number"))
}

fn length(text: &str) -> Result<f64, String> {
    let metres = number(text)?;
    let is_length = metres > 0.0 && metres <= 10.0;
    if is_length { Ok(metres) } else { Err("it is not a length up to 10 m".to_owned()) }
}

fn names(text: &str) -> Result<[String; 2], String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    names.try_into().map_err(|_| "it is not two names with a comma between them".to_owned())
}

/// Two lengths and an angle in degrees, as radians.
fn placed(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let [x, y, degrees] = numbers.try_into().map_err(|_| "it is not three numbers".to_owned())?;
    Ok([x, y, f64::to_radians(degrees)])
}

fn mount(text: &str) -> Result<(String, [f64; 3]), String> {
    let (topic, place) = text.split_once('=').ok_or("there is no `=` behind the topic")?;
    Ok((topic.to_owned(), placed(place)?))
}
