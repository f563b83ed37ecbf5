//! How exactly `calibrate` finds the errors of simulated robots.

use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Radians;
use sonarfix_batch::calibrate::{CalibrateError, Calibration, Nominal, calibrate};
use sonarfix_batch::constants::Name;
use sonarfix_batch::log;
use sonarfix_batch::recording::Recording;
use sonarfix_batch::unknown_start::calibrate_from_search;
use sonarfix_batch::wall::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{CLASSROOM, FileError, Scenario, Upsets};
use sonarfix_replay::find::Find;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::SimulationError;

use crate::rooms::Sensor;
use crate::sweeping_robot::{Drive, drive};

pub mod echoes;
pub mod wheel_noise;

/// The path: figures of eight of 8.8 m, with turns both ways.
const PATH: &str = "start = [1.2, 0.7]
corners = [[2.4, 0.7], [2.4, 1.7], [1.2, 1.7], [1.2, 2.7], [2.4, 2.7], [2.4, 1.7], [1.2, 1.7], [1.2, 0.7]]
";
/// The room: opposite walls are within reach, so that they determine the scale of wheels and ranges.
const WALLS: [(&str, &str); 3] =
    [("[6, 0]", "[4, 0]"), ("[6, 8]", "[4, 3.5]"), ("[0, 8]", "[0, 3.5]")];
/// What is not in the map: a bin in a corner and the leg of a chair.
const OBSTACLES: &str = "obstacle = [
    { centre = [3.6, 3.1], radius = \"15 cm\" },
    { centre = [0.4, 1.9], radius = \"3 cm\" },
";
/// Distance from which on the limit of the wheels is 0.3 % instead of 0.5 %, metres.
const LONG: f64 = 20.0;
/// Length of a figure, metres.
const LAP: f64 = 8.8;

/// Errors of a robot: how much its file differs from the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Of the wheels, right and left.
    pub wheels: [f64; 2],
    /// Of the track width, relative.
    pub track: f64,
    /// Of the mount, metres.
    pub mount: f64,
    /// Of the bearing: heading of mount and servo together, radians.
    pub bearing: f64,
    /// Of the servo's scale.
    pub servo: f64,
    /// Of the ranger.
    pub range: f64,
}

impl Errors {
    /// Wheels 3 % and 2 % wrong, track width 5 %, mount 5° and 10 mm, servo 8 % and 4°, range 1 %.
    pub const BUILDER: Self = Self {
        wheels: [0.03, 0.02],
        track: 0.05,
        mount: 0.01,
        bearing: 9.0 * std::f64::consts::PI / 180.0,
        servo: 0.08,
        range: 0.01,
    };

    /// Wheels 10 % wrong.
    pub const GROSS: Self = Self { wheels: [0.1, 0.1], ..Self::BUILDER };

    /// The same magnitudes with random signs.
    fn drawn(self, rng: &mut impl Rng) -> Self {
        let mut sign = |value: f64| if rng.random::<bool>() { value } else { -value };
        Self {
            wheels: self.wheels.map(&mut sign),
            track: sign(self.track),
            mount: sign(self.mount),
            bearing: sign(self.bearing),
            servo: sign(self.servo),
            range: sign(self.range),
        }
    }
}

/// A quantity that is compared with the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Its name.
    pub name: &'static str,
    /// Estimate minus truth.
    pub error: f64,
    /// The estimate's standard deviation.
    pub deviation: f64,
    /// Limit of the error.
    pub limit: f64,
}

impl Compared {
    /// The error in deviations, without a sign.
    fn deviations(&self) -> f64 {
        (self.error / self.deviation).abs()
    }
}

/// A trial.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Its seed.
    pub seed: u64,
    /// The comparison, or why there is no calibration.
    pub outcome: Result<Vec<Compared>, CalibrateError>,
}

/// Why the study failed.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationStudyError {
    /// The scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// The robot does not start.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Runs trials of robots that drive this far, metres, with errors of these magnitudes; after an interruption those that have
/// begun.
///
/// # Errors
/// [`CalibrationStudyError`].
pub fn trials(
    first: u64,
    count: u32,
    metres: f64,
    errors: Errors,
    from: From,
    progress: &impl Progress,
) -> Result<Vec<Trial>, CalibrationStudyError> {
    each_seed(first, count, progress, |seed| trial(seed, metres, errors, from))
}

/// Runs a trial for each seed in parallel; after an interruption those that have begun.
fn each_seed<T: Send>(
    first: u64,
    count: u32,
    progress: &impl Progress,
    trial: impl Fn(u64) -> Result<T, CalibrationStudyError> + Sync,
) -> Result<Vec<T>, CalibrationStudyError> {
    let seeds: Vec<u64> = (0..u64::from(count)).map(|n| first.wrapping_add(n)).collect();
    let run = |&seed: &u64| {
        let trial = trial(seed);
        progress.finished();
        trial
    };
    seeds.par_iter().filter(|_| !progress.is_interrupted()).map(run).collect()
}

/// One trial.
///
/// # Errors
/// [`CalibrationStudyError`].
pub fn trial(
    seed: u64,
    metres: f64,
    errors: Errors,
    from: From,
) -> Result<Trial, CalibrationStudyError> {
    let robot = Simulated::new(seed, metres, errors, Variant::default())?;
    Ok(Trial { seed, outcome: robot.calibrated(from).map(|found| robot.compare(&found)) })
}

/// What a calibration begins from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum From {
    /// The start pose.
    Start,
    /// The poses that the search finds.
    Search,
}

/// How a robot differs from that of the classroom, apart from its errors.
#[derive(Debug, Clone, Copy, Default)]
struct Variant {
    /// Noise of the wheels, m/√m, which then have no other random error.
    wheel_noise: Option<f64>,
    /// Its sensor.
    sensor: Option<Sensor>,
}

/// A simulated robot after its drive.
struct Simulated {
    recording: Recording,
    walls: Vec<Wall>,
    /// The map as the robot has it.
    map: Vec<sonarfix::map::Wall>,
    robot: RobotConfig,
    /// Its file.
    nominal: Nominal,
    /// How much the file differs from the truth.
    errors: Errors,
    range_scale: f64,
    track_width: f64,
    metres: f64,
}

impl Simulated {
    /// Simulates a drive.
    fn new(
        seed: u64,
        metres: f64,
        errors: Errors,
        Variant { wheel_noise, sensor }: Variant,
    ) -> Result<Self, CalibrationStudyError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xCA11_B8A7);
        let errors = errors.drawn(&mut rng);
        let mut scenario = Scenario::parse(&text(metres, sensor), "classroom.toml", Path::new(""))?;
        let robot = scenario.robot;
        let truth = &mut scenario.truth;
        [truth.scale_right, truth.scale_left] = errors.wheels;
        truth.track_width = f64::from(robot.localizer.drive.track_width.0) * (1.0 + errors.track);
        truth.range_scale = errors.range;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let [mount, offset, scale] =
            [errors.mount, errors.bearing, 1.0 + errors.servo].map(|value| value as f32);
        let true_robot = &mut scenario.robot;
        let at = true_robot.localizer.rangers.first.mount;
        true_robot.localizer.rangers.first.mount = Point::new(at.x.0 + mount, at.y.0 - mount);
        for pulse in &mut true_robot.rangers.first.servo_pulses {
            pulse.bearing = Radians(offset + scale * pulse.bearing.0);
        }
        if let Some(noise) = wheel_noise {
            scenario.truth.wheel_noise = noise;
            scenario.upsets = Upsets::default();
        }
        let track_width = scenario.truth.track_width;
        let (Drive { mut recording, .. }, simulation) = drive(scenario, robot, seed)?;
        recording.cut(metres);
        let floor = simulation.scenario.floor.named_walls();
        let walls: Vec<Wall> =
            floor.iter().filter_map(|wall| Wall::new(wall.from(), wall.to())).collect();
        let map = simulation.scenario.floor.walls();
        let nominal = log::nominal(&robot, true);
        let range_scale = simulation.range_scale();
        Ok(Self { recording, walls, map, robot, nominal, errors, range_scale, track_width, metres })
    }

    /// The calibration from the start pose, or from those that the search finds.
    fn calibrated(&self, from: From) -> Result<Calibration, CalibrateError> {
        let Self { recording, walls, nominal, robot, map, .. } = self;
        match from {
            From::Start => calibrate(recording, walls, nominal),
            From::Search => {
                calibrate_from_search(recording, walls, nominal, &Find { robot, walls: map })
            }
        }
    }

    /// Compares a calibration with the truth.
    fn compare(&self, found: &Calibration) -> Vec<Compared> {
        let (errors, nominal) = (&self.errors, &self.nominal);
        let [ahead, left] = nominal.mount;
        let wheel = if self.metres < LONG { 0.005 } else { 0.003 };
        let truths = [
            (Name::Right, "right wheel", errors.wheels[0], wheel),
            (Name::Left, "left wheel", errors.wheels[1], wheel),
            (Name::Track, "track width", self.track_width / nominal.track_width - 1.0, 0.01),
            (Name::RangeScale, "range", self.range_scale, 0.002),
            (Name::MountAhead, "mount ahead", ahead + errors.mount, 0.003),
            (Name::MountLeft, "mount left", left - errors.mount, 0.003),
        ];
        let mut compared: Vec<Compared> = Vec::new();
        for (name, label, truth, limit) in truths {
            if let Some(estimate) = found.estimates.iter().find(|estimate| estimate.name == name) {
                let (error, deviation) = (estimate.value - truth, estimate.deviation);
                compared.push(Compared { name: label, error, deviation, limit });
            }
        }
        if let Some(bearings) = &found.bearings {
            let limit = 0.5_f64.to_radians();
            let (error, deviation) = (bearings.offset - errors.bearing, bearings.offset_deviation);
            compared.push(Compared { name: "bearing", error, deviation, limit });
            // Half a degree at 90°.
            let (error, deviation) =
                (bearings.scale - 1.0 - errors.servo, bearings.scale_deviation);
            let limit = limit / std::f64::consts::FRAC_PI_2;
            compared.push(Compared { name: "servo scale", error, deviation, limit });
        }
        compared
    }
}

/// The classroom's robot in a smaller room, with the path of the study, and another sensor.
fn text(metres: f64, sensor: Option<Sensor>) -> String {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some laps")]
    let laps = (metres / LAP).ceil().max(1.0) as u32;
    let mut text = String::new();
    let mut is_of_sensor = false;
    for line in CLASSROOM.lines() {
        if line.starts_with('[') {
            is_of_sensor = ["[robot.sonar]", "[sensor]"].contains(&line);
        }
        if sensor.is_some() && is_of_sensor {
            continue;
        }
        let key = line.split('=').next().unwrap_or_default().trim();
        match key {
            "start" if line.contains('[') => text.push_str(PATH),
            "corners" | "{ centre" | "{ from" => {}
            "obstacle" => text.push_str(OBSTACLES),
            "laps" => {
                let _ = writeln!(text, "laps = {laps}");
            }
            "follow" => text.push_str("follow = \"truth\"\n"),
            _ => {
                text.push_str(line);
                text.push('\n');
            }
        }
    }
    text.push_str(sensor.map_or("", Sensor::tables));
    WALLS.iter().fold(text, |text, (from, to)| text.replace(from, to))
}

/// The page's table: for each distance and quantity the share of the robots within the limit and inside the interval.
#[must_use]
pub fn page(rows: &[(f64, Vec<Trial>)]) -> String {
    let mut page = String::from(
        "| driven | quantity | limit | within it | inside its 95 % interval | RMS error | estimated |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for (metres, trials) in rows {
        let refused = trials.iter().filter(|trial| trial.outcome.is_err()).count();
        let found: Vec<&Vec<Compared>> =
            trials.iter().filter_map(|trial| trial.outcome.as_ref().ok()).collect();
        let mut names: Vec<&str> = Vec::new();
        for compared in found.iter().copied().flatten() {
            if !names.contains(&compared.name) {
                names.push(compared.name);
            }
        }
        for name in names {
            let all = found.iter().copied().flatten().filter(|compared| compared.name == name);
            page.push_str(&row(*metres, name, &all.copied().collect::<Vec<_>>()));
        }
        let worst = found.iter().copied().flatten().map(Compared::deviations).fold(0.0, f64::max);
        let count = trials.len();
        let _ = writeln!(page, "| {metres:.0} m | refused | | {refused} of {count} | | | |");
        let _ = writeln!(page, "| {metres:.0} m | largest error | | {worst:.1} deviations | | | |");
    }
    page
}

fn row(metres: f64, name: &str, all: &[Compared]) -> String {
    #[expect(clippy::cast_precision_loss, reason = "numbers of robots")]
    let count = all.len().max(1) as f64;
    #[expect(clippy::cast_precision_loss, reason = "numbers of robots")]
    let share = |is: fn(&Compared) -> bool| {
        100.0 * all.iter().filter(|compared| is(compared)).count() as f64 / count
    };
    let within = share(|compared| compared.error.abs() <= compared.limit);
    let inside = share(|compared| compared.error.abs() <= 1.96 * compared.deviation);
    let rms = (all.iter().map(|compared| compared.error.powi(2)).sum::<f64>() / count).sqrt();
    let limit = all.first().map_or(0.0, |compared| compared.limit);
    let unit = |value: f64| match name {
        "mount ahead" | "mount left" => format!("{:.2} mm", 1e3 * value),
        "bearing" => format!("{:.2}°", value.to_degrees()),
        _ => format!("{:.3} %", 100.0 * value),
    };
    format!(
        "| {metres:.0} m | {name} | {} | {within:.1} % | {inside:.1} % | {} | {} |\n",
        unit(limit),
        unit(rms),
        all.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_robots_are_calibrated_within_their_intervals() {
        let trials = trials(70_000, 4, 20.0, Errors::BUILDER, From::Start, &|| ()).unwrap();
        for trial in trials {
            let compared = trial.outcome.unwrap();
            assert!(compared.len() >= 6, "{compared:?}");
            for Compared { name, error, deviation, limit } in compared {
                // Two limits, and 4 deviations: 4 robots with 8 quantities each.
                assert!(
                    error.abs() <= 2.0 * limit.max(2.0 * deviation),
                    "{name}: {error} ± {deviation}"
                );
            }
        }
    }

    /// From the robot file alone the estimate ends in a wrong minimum for each of them.
    #[test]
    fn wheels_that_are_ten_per_cent_wrong_are_found_from_several_starts() {
        for seed in [330_001, 330_017] {
            let compared = trial(seed, 20.0, Errors::GROSS, From::Start).unwrap().outcome.unwrap();
            for Compared { name, error, deviation, limit } in compared {
                assert!(
                    error.abs() <= 2.0 * limit.max(2.0 * deviation),
                    "{name}: {error} ± {deviation}"
                );
            }
        }
    }
}
