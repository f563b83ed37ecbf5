//! A bag as a folder for `sonarfix replay`: `log.csv`, `robot.toml` and, where they are known, `reference.csv` and `map.toml`.
//!
//! | module | what |
//! |---|---|
//! | `options` | what the caller chooses |
//! | `wheels` | odometry and joints as travel of two wheels |
//! | `sensors` | places and bearings of rangers, by frames or as given |
//! | `robot` | the robot file |
//! | this one | which topics are used, and the log |

mod options;
mod robot;
mod sensors;
mod wheels;

use std::path::Path;

use sonarfix_replay::convert::{
    ConvertError, Converted, Log, ReferenceFile, make_dir, read_walls, write_map,
};
use sonarfix_ros_messages::transforms::Nanoseconds;
use sonarfix_sim::trace::Pose;

use crate::bag::Bag;
use crate::error::BagError;
use crate::recording::{Recording, Track};
pub use options::Rosbag;
use options::seconds;
use sensors::{Measurement, Sensors};
use wheels::Wheels;

/// Deviations of a start whose message has none, metres and radians.
const START_SIGMA: [f64; 2] = [0.05, 0.03];
/// The topics from which a start is taken.
const STARTS: [&str; 2] = ["/initialpose", "/amcl_pose"];

/// A record of the log, in the order in which those of the same time are written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event<'s> {
    Start(Pose, [f64; 2]),
    Wheels([f64; 2]),
    Measured(&'s Measurement),
}

impl Event<'_> {
    fn order(&self) -> u8 {
        match self {
            Self::Start(..) => 0,
            Self::Wheels(_) => 1,
            Self::Measured(_) => 2,
        }
    }
}

impl Rosbag<'_> {
    /// Converts the bag `from` into the folder `to`. What is left out is reported to `report`, message by message.
    ///
    /// # Errors
    /// [`ConvertError`], if the bag cannot be read, does not tell what is needed, or the folder cannot be written.
    pub fn convert(
        &self,
        from: &Path,
        to: &Path,
        report: &mut dyn FnMut(String),
    ) -> Result<Converted, ConvertError> {
        let walls = self.walls.map(|path| read_walls(path, 1.0)).transpose()?;
        let mut recording = Recording::new(self.joints.clone(), report);
        Bag::open(from)
            .and_then(|bag| bag.read(&mut recording))
            .map_err(|BagError { path, why }| ConvertError::content(&path, why.to_string()))?;
        let content = |why: String| ConvertError::content(from, why);
        let wheels = Wheels::of(self, &recording).map_err(content)?;
        let sensors = Sensors::of(self, &recording, &wheels.base).map_err(content)?;
        let reference = self.reference(&recording).map_err(content)?;
        let start = self.start(&recording, &wheels);
        let skipped = recording.skipped + sensors.skipped;
        drop(recording);
        wheels.notes.iter().chain(&sensors.notes).for_each(|note| report(note.clone()));
        if start.is_none() {
            report(
                "there is no start (--start, or a message of /initialpose or /amcl_pose): `sonarfix find` searches for the pose"
                    .to_owned(),
            );
        }
        make_dir(to)?;
        let mut converted = write_log(to, &wheels, &sensors, start)?;
        converted.skipped = skipped;
        converted.repeated = wheels.repeated;
        if let Some(track) = reference {
            converted.reference = write_reference(to, &track)?;
        }
        if let Some(walls) = walls {
            write_map(to, "Walls as given; furniture is not in them", &walls)?;
        }
        robot::write(to, &wheels, &sensors)?;
        Ok(converted)
    }

    /// The poses that are taken for true.
    fn reference(&self, recording: &Recording) -> Result<Option<Track>, String> {
        let Some(topic) = self.reference else { return Ok(None) };
        let known = [&recording.odometry, &recording.poses];
        let found = known.iter().find_map(|tracks| tracks.get(topic));
        let topics: Vec<&str> =
            known.iter().flat_map(|tracks| tracks.keys()).map(String::as_str).collect();
        let why =
            || format!("has no poses on {topic} (--reference), but on: {}", topics.join(", "));
        let mut track = found.cloned().ok_or_else(why)?;
        track.poses.sort_by_key(|(time, ..)| *time);
        track.poses.dedup_by_key(|(time, ..)| *time);
        Ok(Some(track))
    }

    /// The pose at the begin, with its deviations: as given, or the first that was published, not before the first odometry.
    fn start(
        &self,
        recording: &Recording,
        wheels: &Wheels,
    ) -> Option<(Nanoseconds, Pose, [f64; 2])> {
        let first = wheels.travels.first()?.0;
        if let Some(pose) = self.start {
            return Some((first, pose, START_SIGMA));
        }
        let published = STARTS.iter().find_map(|topic| recording.poses.get(*topic)?.poses.first());
        let (time, pose, deviations) = published?;
        Some((first.max(*time), *pose, deviations.unwrap_or(START_SIGMA)))
    }
}

fn write_log(
    to: &Path,
    wheels: &Wheels,
    sensors: &Sensors,
    start: Option<(Nanoseconds, Pose, [f64; 2])>,
) -> Result<Converted, ConvertError> {
    let mut events: Vec<(Nanoseconds, Event)> = Vec::new();
    events.extend(start.map(|(time, pose, sigmas)| (time, Event::Start(pose, sigmas))));
    events.extend(wheels.travels.iter().map(|(time, travel)| (*time, Event::Wheels(*travel))));
    let measured = sensors.measurements.iter();
    events.extend(measured.map(|measured| (measured.time(), Event::Measured(measured))));
    events.sort_by_key(|(time, event)| (*time, event.order()));
    let mut converted = Converted::default();
    let mut log = Log::create(to)?;
    log.comment("converted from a bag of ROS 2")?;
    for (time, event) in events {
        let time = seconds(time);
        match event {
            Event::Start(pose, sigmas) => log.start(time, &pose, sigmas)?,
            Event::Wheels(travel) => {
                log.wheels(time, travel)?;
                converted.encoders += 1;
            }
            Event::Measured(Measurement::Range { ranger, bearing, range, .. }) => {
                log.range_of(*ranger, time, *bearing, *range)?;
                converted.ranges += 1;
            }
            Event::Measured(Measurement::Scan { scan, .. }) => {
                log.scan(time, scan)?;
                converted.scans += 1;
            }
        }
    }
    log.close()?;
    Ok(converted)
}

fn write_reference(to: &Path, track: &Track) -> Result<u64, ConvertError> {
    let mut reference = ReferenceFile::create(to)?;
    for (time, pose, _) in &track.poses {
        reference.row(seconds(*time), pose)?;
    }
    reference.close()?;
    Ok(track.poses.len() as u64)
}
