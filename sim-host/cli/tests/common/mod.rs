//! A robot that drives in a box and records the exact truth.

#![allow(dead_code, reason = "the program `memory` does not use all of it")]
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test helper"
)]

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::io::{BufReader, Read};

use sonarfix_map::{Floor, robot_file};
use sonarfix_replay::fault::{Complaint, ReplayError};
use sonarfix_replay::thinned::Thinned;
use sonarfix_replay::{Replay, Summary};

pub const MAP: &str = r#"
format = 1
[map]
unit = "m"
wall = [
    { name = "south", from = [0, 0], to = [4, 0] },
    { name = "east", from = [4, 0], to = [4, 3] },
    { name = "north", from = [4, 3], to = [0, 3] },
    { name = "west", from = [0, 3], to = [0, 0] },
]
"#;

pub const ROBOT: &str = r#"
format = 1
[drive]
track_width = "200 mm"
wheel_noise = "1 mm/sqrt(m)"
scale_walk = "1e-5 /sqrt(m)"
track_width_walk = "1e-5 m/sqrt(m)"
max_wheel_speed = "1 m/s"
encoder_period = "100 ms"
right_wheel = { travel_per_edge = "0.01 mm" }
left_wheel = { travel_per_edge = "0.01 mm" }
[sonar]
mount = ["30 mm", "10 mm"]
servo = ["-180 deg", "180 deg"]
cone = "15 deg"
min_range = "5 cm"
max_range = "5 m"
noise = "2 mm"
noise_per_metre = "0 mm/m"
fix_period = "400 ms"
servo_pulses = [{ width = "100 us", bearing = "-180 deg" }, { width = "900 us", bearing = "180 deg" }]
servo_timing = "instant"
ranger = "hc_sr04"
[prior]
scale_right = "1 %"
scale_left = "1 %"
track_width = "4 mm"
range_scale = "0 %"
[gating]
confidence = 3.0
[echo]
# The recorded ranges are exact.
late = "0 mm"
late_per_radian = "0 mm"
[schedule]
policy = "nearest"
"#;

pub const TRACK_WIDTH: f64 = 0.2;
pub const MOUNT: [f64; 2] = [0.03, 0.01];
const SPEED: f64 = 0.2;
/// Drives 2 m ahead, turns by 180° on the spot, and returns.
const LEG: f64 = 10.0;
const TURN: f64 = 5.0;
/// The true start, and the initial estimate.
pub const BEGIN: [f64; 3] = [1.0, 1.2, 0.1];
pub const BELIEVED: [f64; 3] = [1.015, 1.19, 0.11];

/// The pose at a time, and the travel of the right and left wheel.
pub fn truth(time: f64) -> ([f64; 3], [f64; 2]) {
    let lap = LEG + TURN;
    let laps = (time / lap).floor();
    let within = time - laps * lap;
    let advance = SPEED * within.min(LEG);
    let turn = PI * ((within - LEG).max(0.0) / TURN);
    let back = laps.rem_euclid(2.0) > 0.5;
    let (sin, cos) = BEGIN[2].sin_cos();
    let along = if back { SPEED * LEG - advance } else { advance };
    let heading = BEGIN[2] + if back { PI } else { 0.0 } + turn;
    let rolled = laps * SPEED * LEG + advance;
    let turned = (laps * PI + turn) * TRACK_WIDTH / 2.0;
    let pose = [BEGIN[0] + along * cos, BEGIN[1] + along * sin, heading];
    (pose, [rolled + turned, rolled - turned])
}

/// The range of the sonar at a bearing.
pub fn distance([x, y, heading]: [f64; 3], bearing: f64) -> f64 {
    let (sin, cos) = heading.sin_cos();
    let from = [x + cos * MOUNT[0] - sin * MOUNT[1], y + sin * MOUNT[0] + cos * MOUNT[1]];
    let (sin, cos) = (heading + bearing).sin_cos();
    let to = |from: f64, speed: f64, size: f64| {
        let far = if speed > 0.0 { size - from } else { -from };
        if speed.abs() < 1e-12 { f64::INFINITY } else { far / speed }
    };
    to(from[0], cos, 4.0).min(to(from[1], sin, 3.0))
}

/// The measurements in a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sonar {
    /// None.
    Silent,
    /// Single ranges perpendicular to a wall, at times between the encoder records.
    Ranges,
    /// Scans, at the same times.
    Scans,
}

/// The lines of one second of a log and of its reference.
pub fn second(second: u32, sonar: Sonar) -> (String, String) {
    let (mut log, mut reference) = (String::new(), String::new());
    if second == 0 {
        let [x, y, heading] = BELIEVED;
        log.push_str("sonarfix-log,1\n# a box\n");
        writeln!(log, "start,0,{x},{y},{heading},0.02,0.02").unwrap();
        reference.push_str("time_s,x_m,y_m,heading_rad\n");
    }
    for tenth in 0..10 {
        let time = f64::from(second) + f64::from(tenth) / 10.0;
        let (_, [right, left]) = truth(time);
        let ticks = [right, left].map(|metres| (metres / 1e-5).round());
        writeln!(log, "ticks,{time},{},{}", ticks[0], ticks[1]).unwrap();
        let between = time + 0.063;
        let (pose, _) = truth(between);
        writeln!(reference, "{between},{},{},{}", pose[0], pose[1], pose[2]).unwrap();
        if tenth % 4 == 1 {
            match sonar {
                Sonar::Silent => {}
                Sonar::Ranges => {
                    // Two walls in turn, so that both coordinates are observable.
                    let wall = f64::from(second % 2) * PI / 2.0;
                    let bearing = (wall - pose[2]).rem_euclid(TAU) - PI;
                    let range = distance(pose, bearing);
                    writeln!(log, "range,{between},{bearing},{range}").unwrap();
                }
                Sonar::Scans => {
                    write!(log, "scan,{between},{},{},", -PI, TAU / 360.0).unwrap();
                    for beam in 0..360 {
                        let bearing = -PI + f64::from(beam) * TAU / 360.0;
                        write!(log, "{:.4} ", distance(pose, bearing)).unwrap();
                    }
                    log.push('\n');
                }
            }
        }
    }
    (log, reference)
}

/// A whole log and its reference.
pub fn recording(seconds: u32, sonar: Sonar) -> (String, String) {
    (0..seconds).map(|s| second(s, sonar)).unzip()
}

/// A log that is generated while it is read, never held as a whole.
pub struct Endless {
    next: u32,
    seconds: u32,
    text: Vec<u8>,
    read: usize,
    make: fn(u32) -> String,
}

impl Endless {
    pub fn new(seconds: u32, make: fn(u32) -> String) -> BufReader<Self> {
        BufReader::new(Self { next: 0, seconds, text: Vec::new(), read: 0, make })
    }
}

impl Read for Endless {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.read == self.text.len() && self.next < self.seconds {
            self.text = (self.make)(self.next).into_bytes();
            self.read = 0;
            self.next += 1;
        }
        let count = (self.text.len() - self.read).min(buffer.len());
        buffer[..count].copy_from_slice(&self.text[self.read..self.read + count]);
        self.read += count;
        Ok(count)
    }
}

/// A replay in the box, with its complaints.
pub struct Replayed {
    pub summary: Summary,
    pub trace: Thinned,
    pub complaints: Vec<String>,
}

pub fn try_replay(log: &[u8], reference: &str, strict: bool) -> Result<Replayed, ReplayError> {
    replay_with(log, reference, strict, 1)
}

/// A replay with at most so many ranges of a scan.
pub fn replay_scans(log: &str, reference: &str, pings_per_scan: u32) -> Replayed {
    replay_with(log.as_bytes(), reference, false, pings_per_scan).unwrap()
}

fn replay_with(
    log: &[u8],
    reference: &str,
    strict: bool,
    pings_per_scan: u32,
) -> Result<Replayed, ReplayError> {
    let floor = Floor::parse(MAP, "map.toml").unwrap();
    let robot = robot_file::parse(ROBOT, "robot.toml").unwrap();
    let walls = floor.walls();
    let mut trace = Thinned::new(&floor, robot.localizer.rangers.first.cone, 1000);
    let mut complaints = Vec::new();
    let mut report = |complaint: &Complaint| complaints.push(complaint.to_string());
    let replay = Replay { robot: &robot, walls: &walls, strict, pings_per_scan };
    let reference = (!reference.is_empty()).then_some(reference.as_bytes());
    let summary = replay.run(log, reference, &mut trace, &mut report)?;
    Ok(Replayed { summary, trace, complaints })
}

pub fn replay(log: &str, reference: &str) -> Replayed {
    try_replay(log.as_bytes(), reference, false).unwrap()
}
