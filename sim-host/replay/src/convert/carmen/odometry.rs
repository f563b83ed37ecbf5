//! Which poses of a log are odometry, and the wheel travel between them.
//!
//! A corrected log can have the corrected pose in the odometry fields of its scans, or also in the `ODOM` records after a scan.
//! Every correction would then become wheel travel. Three properties of odometry detect this:
//! - the pose of a scan lies between those of the `ODOM` records before and after it;
//! - two driven wheels do not move sideways: on a short step the displacement is along the mean heading;
//! - speed and turn rate are limited.

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use super::stamps::JITTER;
use crate::convert::Converted;
use crate::convert::arc::Arc;

/// Assumed track width, metres: that of a Pioneer, the robot of most of these logs.
pub const TRACK_WIDTH: f64 = 0.38;

/// A wheel speed above this is implausible, m/s: the `max_wheel_speed` of the robot file, less a rounding.
pub const MAX_SPEED: f64 = 2.9;
/// A turn rate above this is implausible, rad/s.
const MAX_TURN_RATE: f64 = 4.0;
/// Median distance of the poses of the scans from the `ODOM` records from which they are other poses, metres and
/// radians. Interpolation leaves millimetres.
const OTHER_POSE: [f64; 2] = [0.05, 0.035];
/// RMS sideways displacement of a step from which it is a correction, metres; and as a multiple of that of
/// other steps, or as a share of the step.
const SIDEWAYS: f64 = 0.01;
const SIDEWAYS_RATIO: f64 = 3.0;
const SIDEWAYS_SHARE: f64 = 0.02;
/// Number of steps from which their statistics decide.
pub const ENOUGH: usize = 20;
/// A step shorter than this is not tested for sideways motion, metres.
const STANDING: f64 = 0.01;

/// The message that a pose is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// An `ODOM` or `O` record.
    Odometry,
    /// The odometry fields of a scan.
    Scan,
}

/// An odometry pose of the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub line: u64,
    pub time: f64,
    pub pose: Pose,
    pub source: Source,
}

/// Wheel travel since the beginning, right and left, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    pub time: f64,
    pub wheels: [f64; 2],
}

/// The wheel travel of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trail {
    pub records: Vec<Record>,
    /// Whether the odometry fields of the scans contain the corrected pose.
    pub scans_are_corrected: bool,
}

/// A step between two samples.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub seconds: f64,
    /// Travel of the right and the left wheel, metres.
    pub travel: [f64; 2],
    turn: f64,
    /// Displacement across the mean heading, metres.
    pub sideways: f64,
}

impl Step {
    pub fn between(from: &Sample, to: &Sample) -> Self {
        let Arc { travel, turn, sideways } = Arc::between(&from.pose, &to.pose, TRACK_WIDTH);
        Self { seconds: to.time - from.time, travel, turn, sideways }
    }

    fn is_plausible(&self) -> bool {
        self.farther() <= MAX_SPEED * self.seconds
            && self.turn.abs() <= MAX_TURN_RATE * self.seconds
    }

    fn farther(&self) -> f64 {
        self.travel[0].abs().max(self.travel[1].abs())
    }

    /// The time that the step takes at a speed of its faster wheel, seconds.
    pub fn needs(&self, speed: f64) -> f64 {
        self.farther() / speed
    }

    /// The report that this step was replaced.
    pub fn implausible(&self) -> String {
        format!(
            "the odometry is implausible: {:.2} m and {:.0} deg in {:.2} s; replaced by the speed before",
            0.5 * (self.travel[0] + self.travel[1]),
            self.turn.to_degrees(),
            self.seconds,
        )
    }

    fn speeds(&self) -> [f64; 2] {
        self.travel.map(|travel| if self.seconds > 0.0 { travel / self.seconds } else { 0.0 })
    }
}

impl Trail {
    /// The wheel travel of the poses of a log, which are in the order of time.
    ///
    /// # Errors
    /// What is wrong, if no pose of the log is odometry.
    pub fn of(
        samples: Vec<Sample>,
        converted: &mut Converted,
        report: &mut dyn FnMut(u64, &str),
    ) -> Result<Self, String> {
        let (odometry, scans): (Vec<Sample>, Vec<Sample>) =
            samples.iter().partition(|sample| sample.source == Source::Odometry);
        let apart = median_distance(&odometry, &scans);
        let scans_are_corrected = apart
            .is_some_and(|[metres, radians]| metres > OTHER_POSE[0] || radians > OTHER_POSE[1]);
        let samples = if scans_are_corrected { odometry } else { samples };
        let corrected_steps = corrected_steps(&samples, &scans);
        if let (Some([metres, _]), Some(first)) = (apart, scans.first())
            && scans_are_corrected
        {
            report(
                first.line,
                &format!(
                    "the odometry fields of the scans contain another pose than the ODOM records (in the median {metres:.2} m \
                     away): only the ODOM records are used"
                ),
            );
        }
        match corrected_steps {
            Corrected::None => {}
            Corrected::AtScans(metres) => {
                let line = scans.first().map_or(0, |scan| scan.line);
                report(
                    line,
                    &format!(
                        "the odometry jumps at the scans ({:.0} mm sideways, RMS): those steps are replaced by the speed before them",
                        1e3 * metres
                    ),
                );
            }
            Corrected::Everywhere(metres) => {
                return Err(format!(
                    "its odometry fields contain corrected poses (steps move {:.0} mm sideways, RMS), and it has no ODOM \
                     records between the scans: the wheel travel cannot be recovered",
                    1e3 * metres
                ));
            }
        }
        let at_scans = matches!(corrected_steps, Corrected::AtScans(_));
        let records = records(&samples, &scans, at_scans, converted, report);
        let scans_are_corrected = scans_are_corrected || at_scans;
        Ok(Self { records, scans_are_corrected })
    }
}

/// Median distance and turn of the poses of the scans from the interpolated odometry; `None` without odometry around them.
fn median_distance(odometry: &[Sample], scans: &[Sample]) -> Option<[f64; 2]> {
    let mut apart: [Vec<f64>; 2] = Default::default();
    for scan in scans {
        let after = odometry.partition_point(|sample| sample.time < scan.time);
        let (Some(from), Some(to)) =
            (after.checked_sub(1).and_then(|index| odometry.get(index)), odometry.get(after))
        else {
            continue;
        };
        let share = (scan.time - from.time) / (to.time - from.time).max(1e-9);
        let turn = angle::wrap(to.pose.heading - from.pose.heading);
        let x = from.pose.x + share * (to.pose.x - from.pose.x);
        let y = from.pose.y + share * (to.pose.y - from.pose.y);
        let heading = from.pose.heading + share * turn;
        let [metres, radians] = &mut apart;
        metres.push((scan.pose.x - x).hypot(scan.pose.y - y));
        radians.push(angle::wrap(scan.pose.heading - heading).abs());
    }
    let is_enough = apart[0].len() >= ENOUGH.min(scans.len().max(1));
    is_enough.then(|| {
        apart.map(|mut values| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        })
    })
}

/// Where the poses were corrected.
enum Corrected {
    None,
    /// In the steps that contain a scan; their RMS sideways displacement, metres.
    AtScans(f64),
    /// In all steps.
    Everywhere(f64),
}

fn corrected_steps(samples: &[Sample], scans: &[Sample]) -> Corrected {
    let mut across = Sideways::default();
    let mut between = Sideways::default();
    for pair in samples.windows(2) {
        let [from, to] = pair else { continue };
        let step = Step::between(from, to);
        let distance = (to.pose.x - from.pose.x).hypot(to.pose.y - from.pose.y);
        if distance < STANDING || !step.is_plausible() {
            continue;
        }
        if has_scan(scans, from, to) { &mut across } else { &mut between }
            .add(step.sideways, distance);
    }
    let metres = across.rms();
    if across.count < ENOUGH || metres < SIDEWAYS {
        Corrected::None
    } else if between.count >= ENOUGH {
        if metres > SIDEWAYS_RATIO * between.rms() {
            Corrected::AtScans(metres)
        } else {
            Corrected::None
        }
    } else if metres > SIDEWAYS_SHARE * across.rms_distance() {
        Corrected::Everywhere(metres)
    } else {
        Corrected::None
    }
}

/// Whether a scan is within a step, at its end included.
fn has_scan(scans: &[Sample], from: &Sample, to: &Sample) -> bool {
    let after = scans.partition_point(|scan| scan.time <= from.time);
    scans.get(after).is_some_and(|scan| scan.time <= to.time)
}

#[derive(Default)]
struct Sideways {
    squares: f64,
    distance_squares: f64,
    count: usize,
}

impl Sideways {
    fn add(&mut self, sideways: f64, distance: f64) {
        self.squares += sideways * sideways;
        self.distance_squares += distance * distance;
        self.count += 1;
    }

    fn rms(&self) -> f64 {
        root_mean(self.squares, self.count)
    }

    fn rms_distance(&self) -> f64 {
        root_mean(self.distance_squares, self.count)
    }
}

fn root_mean(squares: f64, count: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
    let count = count.max(1) as f64;
    (squares / count).sqrt()
}

/// The wheel travel, step by step. An implausible step is reported and replaced by the speed before it; within [`JITTER`] it
/// is first joined with those after it, in case only its stamp is wrong.
fn records(
    samples: &[Sample],
    scans: &[Sample],
    replace_at_scans: bool,
    converted: &mut Converted,
    report: &mut dyn FnMut(u64, &str),
) -> Vec<Record> {
    let mut records: Vec<Record> = Vec::new();
    let Some(mut from) = samples.first() else { return records };
    records.push(Record { time: from.time, wheels: [0.0, 0.0] });
    let mut wheels = [0.0, 0.0];
    let mut speeds = [0.0, 0.0];
    // The first of the implausible samples that wait for a plausible one.
    let mut waiting: Option<&Sample> = None;
    for to in samples.get(1..).unwrap_or_default() {
        if to.time <= from.time {
            // A scan has an odometry pose of its own time, often already written.
            converted.repeated += 1;
            continue;
        }
        let step = Step::between(from, to);
        let travel = if replace_at_scans && has_scan(scans, from, to) {
            converted.bridged += 1;
            speeds.map(|speed| speed * step.seconds)
        } else if step.is_plausible() {
            if waiting.is_some() {
                converted.restamped += 1;
            }
            speeds = step.speeds();
            step.travel
        } else if step.seconds < JITTER {
            waiting.get_or_insert(to);
            continue;
        } else {
            let at = waiting.unwrap_or(to);
            converted.bridged += 1;
            report(at.line, &step.implausible());
            speeds.map(|speed| speed * step.seconds)
        };
        waiting = None;
        for (sum, travel) in wheels.iter_mut().zip(travel) {
            *sum += travel;
        }
        from = to;
        records.push(Record { time: to.time, wheels });
    }
    records
}
