//! What a bag contains that a localizer takes: odometry, wheels, ranges, scans, poses and frames, by topic.

use std::collections::BTreeMap;

use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    Covariance, Header, Quaternion, Time, Transform, TransformStamped,
};
use sonarfix_ros_messages::transforms::Nanoseconds;
use sonarfix_sim::trace::Pose;

use crate::decode::{Undecodable, Value};
use crate::error::Defect;
use crate::message::{Message, Take};

const ODOMETRY: &str = "nav_msgs/msg/Odometry";
const JOINTS: &str = "sensor_msgs/msg/JointState";
const RANGE: &str = "sensor_msgs/msg/Range";
const SCAN: &str = "sensor_msgs/msg/LaserScan";
const POSE: &str = "geometry_msgs/msg/PoseStamped";
const POSE_WITH_COVARIANCE: &str = "geometry_msgs/msg/PoseWithCovarianceStamped";
const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

/// The most numbers that are kept, of which all are in memory: 256 MiB of them.
const MOST_NUMBERS: usize = 32 << 20;
/// Numbers of a pose, a range and a transform, with times and names.
const OF_POSE: usize = 6;
const OF_RANGE: usize = 2;
const OF_TRANSFORM: usize = 24;
/// How much earlier than the message before it a message of a topic may be: more is a clock that was set back.
const BACK: Nanoseconds = 1_000_000_000;

/// The names of the joints of the right and the left wheel.
pub type Joints = [String; 2];

/// Poses by their time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// The frame in which they are.
    pub frame: String,
    /// The frame whose poses they are; empty if the messages do not tell.
    pub child: String,
    /// Their times, and deviations of the position (metres) and the heading (radians) where the messages have them.
    pub poses: Vec<(Nanoseconds, Pose, Option<[f64; 2]>)>,
}

/// The ranges of a topic.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranger {
    /// Its frame, whose x axis is the beam.
    pub frame: String,
    /// Whether it measures with light.
    pub is_light: bool,
    /// The whole angle of its cone, radians.
    pub field_of_view: f64,
    /// The shortest and the longest range that it reports, metres.
    pub reach: [f64; 2],
    /// Times and ranges, metres; none without an echo.
    pub ranges: Vec<(Nanoseconds, Option<f32>)>,
}

/// A scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// The time of its first beam.
    pub time: Nanoseconds,
    /// The bearing of its first beam in its frame and the angle between beams, radians.
    pub angles: [f64; 2],
    /// Time between beams, seconds.
    pub between: f64,
    /// Ranges, metres; 0 without a return.
    pub ranges: Vec<f32>,
}

/// The scans of a topic.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scanner {
    /// Its frame.
    pub frame: String,
    /// The shortest and the longest range that it reports, metres.
    pub reach: [f64; 2],
    /// The scans.
    pub scans: Vec<Swept>,
}

/// What a bag contains.
#[derive(Default)]
pub struct Recording<'r> {
    /// `Odometry` by topic.
    pub odometry: BTreeMap<String, Track>,
    /// Positions of the right and the left wheel by topic, radians.
    pub joints: BTreeMap<String, Vec<(Nanoseconds, [f64; 2])>>,
    /// Names of joints that are in the bag.
    pub joint_names: Vec<String>,
    /// `Range` by topic.
    pub rangers: BTreeMap<String, Ranger>,
    /// `LaserScan` by topic.
    pub scanners: BTreeMap<String, Scanner>,
    /// `PoseStamped` and `PoseWithCovarianceStamped` by topic.
    pub poses: BTreeMap<String, Track>,
    /// Transforms, and whether each holds at all times.
    pub transforms: Vec<(bool, TransformStamped)>,
    /// Messages left out.
    pub skipped: u64,
    wheels: Option<Joints>,
    numbers: usize,
    latest: BTreeMap<String, Nanoseconds>,
    report: Option<&'r mut dyn FnMut(String)>,
}

impl<'r> Recording<'r> {
    /// An empty one. `wheels` are the joints of the wheels, else those whose names have `right` or `left` and `wheel` in them.
    /// What is left out is reported.
    pub fn new(wheels: Option<Joints>, report: &'r mut dyn FnMut(String)) -> Self {
        Self { wheels, report: Some(report), ..Self::default() }
    }

    /// Takes a message whose fields are known.
    fn add(&mut self, message: &Message, value: &Value) -> Result<Result<(), String>, Undecodable> {
        let topic = message.topic.name.as_str();
        if message.topic.kind == TRANSFORMS {
            return self.transforms(topic, value).map(Ok);
        }
        let stamp = time_of(value)?;
        // A stamp of zero is one that was not set.
        let time = if stamp == 0 { message.time } else { stamp };
        let latest = self.latest.entry(topic.to_owned()).or_insert(time);
        if time < latest.saturating_sub(BACK) {
            return Ok(Err(
                "its stamp is more than a second before that of an earlier one".to_owned()
            ));
        }
        *latest = time.max(*latest);
        match message.topic.kind.as_str() {
            ODOMETRY => {
                let child = value.text("child_frame_id")?;
                self.pose(topic, time, value, "pose.pose", child, true)
            }
            POSE => self.pose(topic, time, value, "pose", "", false),
            POSE_WITH_COVARIANCE => self.pose(topic, time, value, "pose.pose", "", false),
            JOINTS => self.joints(topic, time, value).map(Ok),
            RANGE => self.range(topic, time, value),
            SCAN => self.scan(topic, time, value),
            _ => Ok(Ok(())),
        }
    }

    fn pose(
        &mut self,
        topic: &str,
        time: Nanoseconds,
        value: &Value,
        path: &str,
        child: &str,
        is_odometry: bool,
    ) -> Result<Result<(), String>, Undecodable> {
        let number = |name: &str| value.number(&format!("{path}.{name}"));
        let rotation = Quaternion {
            x: number("orientation.x")?,
            y: number("orientation.y")?,
            z: number("orientation.z")?,
            w: number("orientation.w")?,
        };
        let (x, y) = (number("position.x")?, number("position.y")?);
        let Some(heading) = geometry::heading(&rotation).filter(|_| x.is_finite() && y.is_finite())
        else {
            return Ok(Err("its pose is not finite, or its orientation no rotation".to_owned()));
        };
        let deviations = value.numbers("pose.covariance").ok().and_then(deviations);
        let tracks = if is_odometry { &mut self.odometry } else { &mut self.poses };
        let track = tracks.entry(topic.to_owned()).or_insert_with(|| Track {
            frame: value.text("header.frame_id").unwrap_or_default().to_owned(),
            child: child.to_owned(),
            poses: Vec::new(),
        });
        track.poses.push((time, Pose { x, y, heading }, deviations));
        self.numbers += OF_POSE;
        Ok(Ok(()))
    }

    /// A message that lacks a wheel is of other joints.
    fn joints(&mut self, topic: &str, time: Nanoseconds, value: &Value) -> Result<(), Undecodable> {
        let (names, positions) = (value.list("name")?, value.numbers("position")?);
        let names = names.iter().filter_map(|name| match name {
            Value::Text(name) => Some(name.as_str()),
            _ => None,
        });
        let names: Vec<&str> = names.collect();
        for name in &names {
            if self.joint_names.len() < 100 && !self.joint_names.iter().any(|known| known == name) {
                self.joint_names.push((*name).to_owned());
            }
        }
        let place = |side: usize, word: &str| match &self.wheels {
            Some(wheels) => {
                names.iter().position(|name| wheels.get(side).is_some_and(|own| own == name))
            }
            None => only(&names, |name| {
                let name = name.to_ascii_lowercase();
                name.contains(word) && name.contains("wheel")
            }),
        };
        let position =
            |place: Option<usize>| positions.get(place?).copied().filter(|at| at.is_finite());
        if let (Some(right), Some(left)) = (position(place(0, "right")), position(place(1, "left")))
        {
            self.joints.entry(topic.to_owned()).or_default().push((time, [right, left]));
            self.numbers += OF_RANGE + 1;
        }
        Ok(())
    }

    fn range(
        &mut self,
        topic: &str,
        time: Nanoseconds,
        value: &Value,
    ) -> Result<Result<(), String>, Undecodable> {
        let [nearest, farthest, range] =
            ["min_range", "max_range", "range"].map(|name| value.number(name));
        let reach = [nearest?, farthest?];
        let [nearest, farthest] = reach;
        if nearest.is_nan() || farthest.is_nan() {
            return Ok(Err("its limits are no numbers".to_owned()));
        }
        let field_of_view = value.number("field_of_view")?;
        let is_light = value.number("radiation_type")?.total_cmp(&1.0).is_eq();
        let frame = value.text("header.frame_id")?;
        let ranger = self.rangers.entry(topic.to_owned()).or_insert_with(|| Ranger {
            frame: frame.to_owned(),
            is_light,
            field_of_view,
            reach,
            ranges: Vec::new(),
        });
        if ranger.frame != frame {
            let first = &ranger.frame;
            return Ok(Err(format!(
                "it is of the frame `{frame}`, and the first one of `{first}`"
            )));
        }
        ranger.ranges.push((time, within(range?, reach)));
        self.numbers += OF_RANGE;
        Ok(Ok(()))
    }

    fn scan(
        &mut self,
        topic: &str,
        time: Nanoseconds,
        value: &Value,
    ) -> Result<Result<(), String>, Undecodable> {
        let [first, step, between, nearest, farthest] =
            ["angle_min", "angle_increment", "time_increment", "range_min", "range_max"]
                .map(|name| value.number(name));
        let (angles, between, reach) = ([first?, step?], between?, [nearest?, farthest?]);
        let all = [angles[0], angles[1], between];
        if !all.iter().all(|number| number.is_finite())
            || angles[1].abs() < 1e-6
            || between.abs() > 1.0
        {
            return Ok(Err(
                "its angles or times are not finite, or the angle between beams is zero".to_owned(),
            ));
        }
        let ranges = value.numbers("ranges")?;
        if ranges.is_empty() {
            return Ok(Err("it has no ranges".to_owned()));
        }
        let frame = value.text("header.frame_id")?;
        let new = || Scanner { frame: frame.to_owned(), reach, scans: Vec::new() };
        let scanner = self.scanners.entry(topic.to_owned()).or_insert_with(new);
        let ranges: Vec<f32> =
            ranges.iter().map(|range| within(*range, reach).unwrap_or(0.0)).collect();
        self.numbers += OF_RANGE + ranges.len() / 2;
        scanner.scans.push(Swept { time, angles, between, ranges });
        Ok(Ok(()))
    }

    fn transforms(&mut self, topic: &str, value: &Value) -> Result<(), Undecodable> {
        let is_static = topic.ends_with("tf_static");
        for value in value.list("transforms")? {
            let number = |name: &str| value.number(&format!("transform.{name}"));
            let transform = Transform {
                translation: sonarfix_ros_messages::messages::Vector3 {
                    x: number("translation.x")?,
                    y: number("translation.y")?,
                    z: number("translation.z")?,
                },
                rotation: Quaternion {
                    x: number("rotation.x")?,
                    y: number("rotation.y")?,
                    z: number("rotation.z")?,
                    w: number("rotation.w")?,
                },
            };
            let stamp = Time::of_nanoseconds(time_of(value)?);
            let header = Header { stamp, frame_id: value.text("header.frame_id")?.to_owned() };
            let child_frame_id = value.text("child_frame_id")?.to_owned();
            self.transforms
                .push((is_static, TransformStamped { header, child_frame_id, transform }));
            self.numbers += OF_TRANSFORM;
        }
        Ok(())
    }
}

impl Take for Recording<'_> {
    fn wants(&self, _: &str, kind: &str) -> bool {
        [ODOMETRY, JOINTS, RANGE, SCAN, POSE, POSE_WITH_COVARIANCE, TRANSFORMS].contains(&kind)
    }

    fn take(&mut self, message: &Message) -> Result<(), Defect> {
        let taken = match &message.value {
            Ok(value) => self.add(message, value).map_err(|why| why.to_string()).flatten(),
            Err(why) => Err(why.to_string()),
        };
        if let Err(why) = taken {
            self.skipped += 1;
            let (file, number, topic) =
                (message.file.display(), message.number, &message.topic.name);
            if let Some(report) = &mut self.report {
                report(format!("{file}: message {number}, {topic}: {why}"));
            }
        }
        if self.numbers > MOST_NUMBERS {
            let number = message.number;
            let why = format!(
                "message {number}: there is more than fits (256 MiB of ranges, poses and transforms): take a part with \
                 `ros2 bag convert` or `mcap filter`"
            );
            return Err(Defect::content(why));
        }
        Ok(())
    }
}

/// The stamp of a message, nanoseconds.
#[expect(clippy::cast_possible_truncation, reason = "of 32 bits in the definition; else saturated")]
fn time_of(value: &Value) -> Result<Nanoseconds, Undecodable> {
    let [sec, nanosec] =
        ["header.stamp.sec", "header.stamp.nanosec"].map(|name| value.number(name));
    Ok((sec? as i64).saturating_mul(1_000_000_000).saturating_add(nanosec? as i64))
}

/// A range that is one; NaN, infinities and ranges outside of the limits are no echo.
fn within(range: f64, [nearest, farthest]: [f64; 2]) -> Option<f32> {
    let is_range = range.is_finite() && range > 0.0 && range >= nearest && range <= farthest;
    #[expect(clippy::cast_possible_truncation, reason = "of 32 bits in the messages")]
    is_range.then_some(range as f32)
}

/// The deviations in a covariance of 36 numbers, if it is one with a value above zero.
fn deviations(numbers: &[f64]) -> Option<[f64; 2]> {
    let mut covariance = Covariance::default();
    let places = covariance.0.iter_mut().flatten();
    (numbers.len() == 36).then_some(())?;
    places.zip(numbers).for_each(|(place, number)| *place = *number);
    geometry::deviations(&covariance)
        .filter(|[position, heading]| *position > 0.0 && *heading > 0.0)
}

/// The place of the only name that fits.
fn only(names: &[&str], fits: impl Fn(&str) -> bool) -> Option<usize> {
    let mut found = names.iter().enumerate().filter(|(_, name)| fits(name)).map(|(place, _)| place);
    let first = found.next();
    if found.next().is_some() { None } else { first }
}
