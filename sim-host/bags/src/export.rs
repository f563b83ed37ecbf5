//! A log and its replay as a bag: the messages that ROS has for them, with the names and frames that its programs expect.

use std::collections::BTreeMap;
use std::io::{BufRead, Seek, Write};

use anyhow::{Context, ensure};
use sonarfix::config::RangerId;
use sonarfix::geometry::units::Metres;
use sonarfix::sensor::ranger::{RangerParameters, Ranging};
use sonarfix_exchange::row::{Row, Sink};
use sonarfix_hal::config::RobotConfig;
use sonarfix_replay::convert::arc::Arc;
use sonarfix_replay::log::Record;
use sonarfix_replay::scan::Scan;
use sonarfix_replay::{Lines, log};
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    ColorRGBA, Header, LaserScan, Marker, MarkerArray, Odometry, PoseStamped,
    PoseWithCovarianceStamped, Range, TFMessage, Time, Transform, TransformStamped,
};
use sonarfix_ros_messages::transforms::Nanoseconds;
use sonarfix_sim::angle;
use sonarfix_sim::trace::{Pose, Wall};

use crate::writer::{Durability, Writer};

/// Frames: the map, the origin of the odometry, the robot (between the wheels, x ahead) and a scanner.
const MAP: &str = "map";
const ODOM: &str = "odom";
const BASE: &str = "base_link";
const LASER: &str = "laser";
/// Thickness of a drawn wall, metres.
const WALL: f64 = 0.03;
/// Numbers of ROS: a marker of lines that is added, ranges of sound and of light.
const LINE_LIST: i32 = 5;
const ULTRASOUND: u8 = 0;
const INFRARED: u8 = 1;

/// A bag that is being written from a log.
pub struct Export<'r, W: Write + Seek> {
    out: Writer<W>,
    robot: &'r RobotConfig,
    track_width: f64,
    /// Time of the replay's start on the clock of the log, seconds.
    epoch: f64,
    /// The pose of the odometry by time.
    driven: BTreeMap<Nanoseconds, Pose>,
    last: Option<(Nanoseconds, [f64; 2])>,
    has_laser: bool,
    left_out: u64,
}

impl<'r, W: Write + Seek> Export<'r, W> {
    /// Begins a bag with its walls. `epoch` is the time of the replay's start on the clock of the log, seconds.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(out: W, robot: &'r RobotConfig, epoch: f64, walls: &[Wall]) -> anyhow::Result<Self> {
        let mut out = Writer::new(out)?;
        let start = stamp(epoch)?;
        out.write("/map/walls", Durability::Latched, start, &drawn(start, walls))?;
        let track_width = f64::from(robot.localizer.drive.track_width.0);
        let driven = BTreeMap::new();
        Ok(Self {
            out,
            robot,
            track_width,
            epoch,
            driven,
            last: None,
            has_laser: false,
            left_out: 0,
        })
    }

    /// Writes the records of a log; malformed lines are left out. Returns how many records were left out, for which there is no
    /// message. The replay's rows follow ([`Sink`]).
    ///
    /// # Errors
    /// If the log cannot be read, or the file cannot be written.
    pub fn take_log(&mut self, log: impl BufRead) -> anyhow::Result<u64> {
        let mut lines = Lines::of(log);
        while let Some(line) = lines.next()? {
            let Ok(Some(record)) = line.and_then(log::parse) else { continue };
            let number = lines.number();
            self.record(&record).with_context(|| format!("line {number} of the log"))?;
        }
        Ok(self.left_out)
    }

    fn record(&mut self, record: &Record) -> anyhow::Result<()> {
        match record {
            Record::Ticks { time, right, left } => {
                let wheels = [(right, &self.robot.right_wheel), (left, &self.robot.left_wheel)];
                #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
                let travel =
                    wheels.map(|(count, wheel)| *count as f64 * f64::from(wheel.signed_travel().0));
                self.wheels(*time, travel)
            }
            Record::Wheels { time, right, left } => self.wheels(*time, [*right, *left]),
            Record::Range { time, bearing, range, ranger, .. } => {
                self.range(*time, *bearing, *range, *ranger)
            }
            Record::Scan { time, scan } => self.scan(*time, scan),
            Record::Start { time, pose, position_deviation, heading_deviation }
            | Record::Pose { time, pose, position_deviation, heading_deviation } => {
                let [position, heading] =
                    [position_deviation, heading_deviation].map(|deviation| deviation.powi(2));
                let covariance = [[position, 0.0, 0.0], [0.0, position, 0.0], [0.0, 0.0, heading]];
                self.pose("/initialpose", *time, pose, covariance)
            }
            Record::Resume { time, state: [x, y, heading, ..], deviation: [dx, dy, turn, ..] } => {
                let pose = Pose { x: *x, y: *y, heading: *heading };
                let covariance =
                    [[dx * dx, 0.0, 0.0], [0.0, dy * dy, 0.0], [0.0, 0.0, turn * turn]];
                self.pose("/initialpose", *time, &pose, covariance)
            }
            Record::Turn { .. }
            | Record::Absolute { .. }
            | Record::Skip { .. }
            | Record::Mode { .. } => {
                self.left_out += 1;
                Ok(())
            }
        }
    }

    /// The odometry, from zero at the first record.
    fn wheels(&mut self, seconds: f64, travel: [f64; 2]) -> anyhow::Result<()> {
        let time = stamp(seconds)?;
        let (before, old) = self.last.unwrap_or((time, travel));
        if time < before {
            self.left_out += 1;
            return Ok(());
        }
        let step = [travel[0] - old[0], travel[1] - old[1]];
        let from = self.driven.get(&before).copied().unwrap_or_default();
        let pose = Arc::end(&from, step, self.track_width);
        #[expect(clippy::cast_precision_loss, reason = "differences of times")]
        let period = (time - before) as f64 * 1e-9;
        let rate = |change: f64| if period > 0.0 { change / period } else { 0.0 };
        let mut message = Odometry {
            header: header(time, ODOM),
            child_frame_id: BASE.to_owned(),
            ..Odometry::default()
        };
        message.pose.pose = geometry::pose([pose.x, pose.y, pose.heading]);
        message.twist.twist.linear.x = rate(f64::midpoint(step[0], step[1]));
        message.twist.twist.angular.z = rate((step[0] - step[1]) / self.track_width);
        self.out.write("/odom", Durability::Volatile, time, &message)?;
        self.place(time, ODOM, BASE, [pose.x, pose.y, pose.heading])?;
        self.driven.insert(time, pose);
        self.last = Some((time, travel));
        Ok(())
    }

    fn range(
        &mut self,
        seconds: f64,
        bearing: f64,
        range: Option<f64>,
        ranger: RangerId,
    ) -> anyhow::Result<()> {
        let time = stamp(seconds)?;
        let rangers = &self.robot.localizer.rangers;
        let own: RangerParameters =
            *rangers.get(ranger).context("the robot file has no such ranger")?;
        let frame = format!("sonar_{}", ranger.0);
        let [ahead, left] = [own.mount.x, own.mount.y].map(|at| f64::from(at.0));
        self.place(time, BASE, &frame, [ahead, left, bearing])?;
        let is_light = matches!(own.ranging, Ranging::Light(_));
        #[expect(clippy::cast_possible_truncation, reason = "a message has 32 bits")]
        let range = range.map_or(f32::INFINITY, |range| range as f32);
        let message = Range {
            header: header(time, &frame),
            radiation_type: if is_light { INFRARED } else { ULTRASOUND },
            field_of_view: 2.0 * own.cone.0,
            min_range: own.min_range.0,
            max_range: own.max_range.0,
            range,
            variance: if range.is_finite() { own.noise.variance(Metres(range)).0 } else { 0.0 },
        };
        self.out.write(&format!("/{frame}/range"), Durability::Volatile, time, &message)
    }

    #[expect(clippy::cast_possible_truncation, reason = "a message has 32 bits")]
    fn scan(&mut self, seconds: f64, scan: &Scan) -> anyhow::Result<()> {
        let time = stamp(seconds)?;
        let own = self.robot.localizer.rangers.first;
        if !self.has_laser {
            self.has_laser = true;
            let [ahead, left] = [own.mount.x, own.mount.y].map(|at| f64::from(at.0));
            let mounted = transform(time, BASE, LASER, [ahead, left, 0.0]);
            let mounted = TFMessage { transforms: vec![mounted] };
            self.out.write("/tf_static", Durability::Latched, time, &mounted)?;
        }
        let [first, last] = scan.field_of_view();
        let message = LaserScan {
            header: header(time, LASER),
            angle_min: first as f32,
            angle_max: last as f32,
            angle_increment: scan.step as f32,
            range_min: 0.0,
            // A scanner reaches farther than a sonar: what the log has, is in reach.
            range_max: scan.ranges.iter().copied().fold(own.max_range.0, f32::max),
            ranges: scan
                .ranges
                .iter()
                .map(|range| if *range > 0.0 { *range } else { f32::INFINITY })
                .collect(),
            ..LaserScan::default()
        };
        self.out.write("/scan", Durability::Volatile, time, &message)
    }

    /// A pose on the map with the covariance of x, y and heading.
    fn pose(
        &mut self,
        topic: &str,
        seconds: f64,
        pose: &Pose,
        covariance: [[f64; 3]; 3],
    ) -> anyhow::Result<()> {
        let time = stamp(seconds)?;
        let mut message =
            PoseWithCovarianceStamped { header: header(time, MAP), ..Default::default() };
        message.pose.pose = geometry::pose([pose.x, pose.y, pose.heading]);
        message.pose.covariance = geometry::covariance(covariance);
        self.out.write(topic, Durability::Volatile, time, &message)
    }

    /// Where a frame is in another.
    fn place(
        &mut self,
        time: Nanoseconds,
        parent: &str,
        child: &str,
        at: [f64; 3],
    ) -> anyhow::Result<()> {
        let message = TFMessage { transforms: vec![transform(time, parent, child, at)] };
        self.out.write("/tf", Durability::Volatile, time, &message)
    }

    /// The pose of the odometry at a time, interpolated.
    fn driven_at(&self, time: Nanoseconds) -> Pose {
        let before = self.driven.range(..=time).next_back();
        let after = self.driven.range(time..).next();
        match (before, after) {
            (Some((from, one)), Some((to, other))) if from < to => {
                #[expect(clippy::cast_precision_loss, reason = "differences of times")]
                let share = (time - from) as f64 / (to - from) as f64;
                let arc = Arc::between(one, other, self.track_width);
                Arc::end(one, arc.travel.map(|travel| share * travel), self.track_width)
            }
            (before, after) => before.or(after).map(|(_, pose)| *pose).unwrap_or_default(),
        }
    }

    /// Ends the bag, and returns the file and the text of its `metadata.yaml`. `name` is the name of the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(self, name: &str) -> anyhow::Result<(W, String)> {
        self.out.end(name)
    }
}

impl<W: Write + Seek> Sink for Export<'_, W> {
    fn take(&mut self, row: &Row) -> anyhow::Result<()> {
        let seconds = self.epoch + row.real("time_s").context("a row without a time")?;
        let reals = |names: [&str; 3]| -> Option<[f64; 3]> {
            let [a, b, c] = names.map(|name| row.real(name));
            Some([a?, b?, c?])
        };
        if let Some([x, y, heading]) = reals(["true_x_m", "true_y_m", "true_heading_rad"]) {
            let time = stamp(seconds)?;
            let pose = geometry::pose([x, y, heading]);
            let message = PoseStamped { header: header(time, MAP), pose };
            self.out.write("/pose/true", Durability::Volatile, time, &message)?;
        }
        let pose = reals(["x_m", "y_m", "heading_rad"]);
        let sigma = reals(["sigma_x_m", "sigma_y_m", "sigma_heading_rad"]);
        let (Some([x, y, heading]), Some([dx, dy, turn])) = (pose, sigma) else { return Ok(()) };
        let xy = row.real("covariance_xy_m2").unwrap_or(0.0);
        let covariance = [[dx * dx, xy, 0.0], [xy, dy * dy, 0.0], [0.0, 0.0, turn * turn]];
        self.pose("/amcl_pose", seconds, &Pose { x, y, heading }, covariance)?;
        let time = stamp(seconds)?;
        // The origin of the odometry on the map, so that the robot is where it is estimated.
        let driven = self.driven_at(time);
        let turned = angle::wrap(heading - driven.heading);
        let (sin, cos) = turned.sin_cos();
        let origin =
            [x - cos * driven.x + sin * driven.y, y - sin * driven.x - cos * driven.y, turned];
        self.place(time, MAP, ODOM, origin)
    }
}

fn header(time: Nanoseconds, frame: &str) -> Header {
    Header { stamp: Time::of_nanoseconds(time), frame_id: frame.to_owned() }
}

fn transform(
    time: Nanoseconds,
    parent: &str,
    child: &str,
    [x, y, heading]: [f64; 3],
) -> TransformStamped {
    let rotation = geometry::quaternion(heading);
    let transform = Transform { translation: geometry::vector(x, y), rotation };
    TransformStamped { header: header(time, parent), child_frame_id: child.to_owned(), transform }
}

/// The walls as lines.
fn drawn(time: Nanoseconds, walls: &[Wall]) -> MarkerArray {
    let mut marker = Marker {
        header: header(time, MAP),
        ns: "walls".to_owned(),
        r#type: LINE_LIST,
        pose: geometry::pose([0.0; 3]),
        color: ColorRGBA { r: 0.4, g: 0.4, b: 0.4, a: 1.0 },
        ..Marker::default()
    };
    marker.scale.x = WALL;
    let ends = walls.iter().flat_map(|wall| [wall.from, wall.to]);
    marker.points = ends.map(|[x, y]| geometry::pose([x, y, 0.0]).position).collect();
    MarkerArray { markers: vec![marker] }
}

/// Seconds as nanoseconds, of which a message has 32 bits of seconds.
#[expect(clippy::cast_possible_truncation, reason = "checked before")]
fn stamp(seconds: f64) -> anyhow::Result<Nanoseconds> {
    ensure!(
        (0.0..=f64::from(i32::MAX)).contains(&seconds),
        "the time {seconds} s: a message of ROS has times from 0 s to the year 2038"
    );
    Ok((seconds * 1e9).round() as Nanoseconds)
}
