//! Places and bearings of rangers, by the frames of the bag or as given, and what they measured.

use sonarfix::config::MAX_RANGERS;
use sonarfix_replay::scan::Scan;
use sonarfix_ros_messages::transforms::{Nanoseconds, NoTransform, Placement, Transforms};
use sonarfix_sim::angle;

use super::options::{Rosbag, choose, seconds};
use crate::recording::{Ranger, Recording, Scanner, Swept};

/// How old the last transform of a moving frame may be, nanoseconds.
const OLDEST: Nanoseconds = 200_000_000;
/// Rangers nearer to each other than this are at one place, metres.
const ONE_PLACE: f64 = 0.005;
/// A ranger that moves on the robot by more than this is reported, metres.
const MOVES: f64 = 0.02;
/// A sonar of unknown cone, degrees: half of it.
const CONE: f64 = 15.0;

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement {
    /// A range.
    Range {
        /// When.
        time: Nanoseconds,
        /// The number of the ranger.
        ranger: u8,
        /// Radians from the heading.
        bearing: f64,
        /// Metres; none without an echo.
        range: Option<f32>,
    },
    /// A scan.
    Scan {
        /// When.
        time: Nanoseconds,
        /// The scan, with bearings from the heading.
        scan: Scan,
    },
}

impl Measurement {
    /// When.
    pub fn time(&self) -> Nanoseconds {
        match self {
            Self::Range { time, .. } | Self::Scan { time, .. } => *time,
        }
    }
}

/// A ranger of the robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounted {
    /// Metres ahead and to the left of the midpoint between the wheels.
    pub place: [f64; 2],
    /// The rightmost and the leftmost bearing, radians; of a fixed ranger twice its bearing.
    pub bearings: [f64; 2],
    /// Half of its cone, degrees.
    pub cone: f64,
    /// The shortest and the longest range, metres.
    pub reach: [f64; 2],
    /// Whether it measures with light.
    pub is_light: bool,
}

/// The rangers and what they measured.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sensors {
    /// The rangers in the order of their numbers.
    pub rangers: Vec<Mounted>,
    /// What they measured, in any order.
    pub measurements: Vec<Measurement>,
    /// Messages without a transform at their time.
    pub skipped: u64,
    /// What the user should know.
    pub notes: Vec<String>,
}

impl Sensors {
    /// Those of a recording, on a robot whose frame is `base`.
    ///
    /// # Errors
    /// What is missing, and the option that supplies it.
    pub fn of(options: &Rosbag, recording: &Recording, base: &str) -> Result<Self, String> {
        let frames = Frames { options, transforms: tree(recording), base };
        let mut sensors = Self::default();
        let is_scan = options.scan.is_some() || recording.rangers.is_empty();
        if is_scan {
            let found =
                choose(&recording.scanners, options.scan, "/scan", ("LaserScan", "--scan"))?;
            let (topic, scanner) = found.ok_or("has neither Range nor LaserScan")?;
            sensors.scans(&frames, topic, scanner)?;
            return Ok(sensors);
        }
        for name in options.ranges {
            if !recording.rangers.contains_key(name) {
                let names: Vec<&str> = recording.rangers.keys().map(String::as_str).collect();
                return Err(format!(
                    "has no Range on {name} (--range), but on: {}",
                    names.join(", ")
                ));
            }
        }
        for (topic, ranger) in &recording.rangers {
            if options.ranges.is_empty() || options.ranges.contains(topic) {
                sensors.ranges(&frames, topic, ranger)?;
            }
        }
        Ok(sensors)
    }

    /// The ranges of a topic.
    fn ranges(&mut self, frames: &Frames, topic: &str, ranger: &Ranger) -> Result<(), String> {
        let mut found: Vec<(Nanoseconds, [f64; 3], Option<f32>)> = Vec::new();
        for &(time, range) in &ranger.ranges {
            match frames.placement(topic, &ranger.frame, time)? {
                Some(at) => found.push((time, at.beam, range)),
                None => self.skipped += 1,
            }
        }
        let Some((_, [ahead, left, bearing], _)) = found.first().copied() else {
            self.notes.push(frames.untimely(topic, &ranger.frame));
            return Ok(());
        };
        let moved =
            found.iter().map(|(_, [x, y, _], _)| (x - ahead).hypot(y - left)).fold(0.0, f64::max);
        if moved > MOVES {
            self.notes.push(format!(
                "{topic}: the ranger moves on the robot by {moved:.3} m, and the log has one place for it: its first"
            ));
        }
        let turns = found.iter().map(|(_, [.., at], _)| angle::wrap(at - bearing));
        let (right, left_turn) =
            turns.fold((0.0, 0.0), |(low, high): (f64, f64), turn| (low.min(turn), high.max(turn)));
        let half = 0.5 * ranger.field_of_view.to_degrees();
        let cone = if (0.1..=89.0).contains(&half) { half } else { CONE };
        let mounted = Mounted {
            place: [ahead, left],
            bearings: [bearing + right, bearing + left_turn],
            cone: if ranger.is_light { 60.0 } else { cone },
            reach: ranger.reach,
            is_light: ranger.is_light,
        };
        let number = self.mount(topic, mounted)?;
        let measured = |(time, [.., bearing], range): (_, [f64; 3], _)| Measurement::Range {
            time,
            ranger: number,
            bearing,
            range,
        };
        self.measurements.extend(found.into_iter().map(measured));
        Ok(())
    }

    /// The scans of a topic, whole or as beams.
    fn scans(&mut self, frames: &Frames, topic: &str, scanner: &Scanner) -> Result<(), String> {
        let mut place = None;
        let mut field: Option<[f64; 2]> = None;
        let beams = frames.options.beams;
        for swept in &scanner.scans {
            let Some(at) = frames.placement(topic, &scanner.frame, swept.time)? else {
                self.skipped += 1;
                continue;
            };
            let [ahead, left, bearing] = at.beam;
            place.get_or_insert([ahead, left]);
            let turn = if at.is_upside_down { -1.0 } else { 1.0 };
            let [first, step] = swept.angles.map(|angle| turn * angle);
            let scan = Scan { first: first + bearing, step, ranges: swept.ranges.clone() };
            let own = scan.field_of_view();
            field.get_or_insert([own[0].min(own[1]), own[0].max(own[1])]);
            if beams.is_empty() {
                self.measurements.push(Measurement::Scan { time: swept.time, scan });
            } else {
                self.measurements
                    .extend(beams.iter().filter_map(|bearing| beam(&scan, swept, *bearing)));
            }
        }
        let (Some(place), Some(field)) = (place, field) else {
            self.notes.push(frames.untimely(topic, &scanner.frame));
            return Ok(());
        };
        let of_beams =
            |start: f64, pick: fn(f64, f64) -> f64| beams.iter().copied().fold(start, pick);
        let bearings = if beams.is_empty() {
            field.map(|bearing| bearing.clamp(-std::f64::consts::PI, std::f64::consts::PI))
        } else {
            [of_beams(f64::INFINITY, f64::min), of_beams(f64::NEG_INFINITY, f64::max)]
        };
        let mounted =
            Mounted { place, bearings, cone: CONE, reach: scanner.reach, is_light: false };
        self.mount(topic, mounted).map(|_| ())
    }

    /// The number of a ranger; one at the place of another is that one, at further bearings.
    fn mount(&mut self, topic: &str, new: Mounted) -> Result<u8, String> {
        let is_there = |known: &Mounted| {
            let [dx, dy] = [known.place[0] - new.place[0], known.place[1] - new.place[1]];
            dx.hypot(dy) < ONE_PLACE && known.is_light == new.is_light
        };
        let number = self.rangers.iter().position(is_there).unwrap_or(self.rangers.len());
        if let Some(known) = self.rangers.get_mut(number) {
            let ([right, left], [other_right, other_left]) = (known.bearings, new.bearings);
            known.bearings = [right.min(other_right), left.max(other_left)];
        } else {
            self.rangers.push(new);
        }
        if self.rangers.len() > MAX_RANGERS {
            return Err(format!(
                "has ranges from more than {MAX_RANGERS} places ({topic} is one more): choose topics with --range"
            ));
        }
        u8::try_from(number).map_err(|_| "has too many rangers".to_owned())
    }
}

/// The beam of a scan that is nearest to a bearing, if the scan has one within its step.
fn beam(scan: &Scan, swept: &Swept, bearing: f64) -> Option<Measurement> {
    let turn = angle::wrap(bearing - scan.first);
    // A scan that ends behind the robot counts on beyond half a turn.
    let whole = std::f64::consts::TAU.copysign(scan.step);
    let turn = if turn * scan.step < 0.0 && turn.abs() > 0.5 * scan.step.abs() {
        turn + whole
    } else {
        turn
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a place in a list, checked by `get`"
    )]
    let place = (turn / scan.step).round().max(0.0) as usize;
    let range = *scan.ranges.get(place)?;
    #[expect(clippy::cast_precision_loss, reason = "a place in a list")]
    let place = place as f64;
    #[expect(clippy::cast_possible_truncation, reason = "less than a day")]
    let later = (swept.between * place * 1e9) as Nanoseconds;
    let bearing = angle::wrap(scan.first + place * scan.step);
    let range = (range > 0.0).then_some(range);
    Some(Measurement::Range { time: swept.time.saturating_add(later), ranger: 0, bearing, range })
}

/// Where a frame is on the robot.
struct At {
    /// Metres ahead, metres to the left, and the bearing of its x axis, radians.
    beam: [f64; 3],
    is_upside_down: bool,
}

/// The frames of a bag.
struct Frames<'f> {
    options: &'f Rosbag<'f>,
    transforms: Transforms,
    base: &'f str,
}

impl Frames<'_> {
    /// Where the frame of a topic is; none if its transforms do not cover the time.
    fn placement(&self, topic: &str, frame: &str, at: Nanoseconds) -> Result<Option<At>, String> {
        if let Some((_, beam)) = self.options.mounts.iter().find(|(name, _)| name == topic) {
            return Ok(Some(At { beam: *beam, is_upside_down: false }));
        }
        let base = self.base;
        let of = |placement: Placement| {
            let is_upside_down = placement.is_upside_down();
            placement.planar().map(|beam| At { beam, is_upside_down })
        };
        match self.transforms.placement(base, frame, at, OLDEST) {
            Ok(placement) => Ok(of(placement)),
            Err(NoTransform::Untimely) => Ok(None),
            Err(NoTransform::Unconnected) => Err(format!(
                "{topic}: no transform leads from `{base}` to `{frame}`: state its place with --mount {topic}=AHEAD,LEFT,DEGREES, or \
                 the robot's frame with --base"
            )),
        }
    }

    fn untimely(&self, topic: &str, frame: &str) -> String {
        let base = self.base;
        format!(
            "{topic} is left out: there is no transform from `{base}` to `{frame}` at the times of its messages"
        )
    }
}

/// The tree of frames, with all transforms in the order of their times.
fn tree(recording: &Recording) -> Transforms {
    let mut ordered: Vec<_> = recording.transforms.iter().collect();
    ordered.sort_by_key(|(_, transform)| transform.header.stamp.nanoseconds());
    let mut tree = Transforms::keeping(usize::MAX);
    for (is_static, transform) in ordered {
        // One that is no rotation places nothing: its frame is then missing.
        let _ = tree.take(transform, *is_static);
    }
    tree
}

impl Mounted {
    /// Whether it does not turn: by less than a degree.
    pub fn is_fixed(&self) -> bool {
        self.bearings[1] - self.bearings[0] < 0.017
    }
}

/// The usual time between measurements, seconds.
pub fn period(sensors: &Sensors) -> f64 {
    let mut times: Vec<Nanoseconds> = sensors.measurements.iter().map(Measurement::time).collect();
    times.sort_unstable();
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return 0.2 };
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let steps = times.len().max(2) as f64 - 1.0;
    seconds(last - first) / steps
}
