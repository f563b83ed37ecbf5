//! Changes of a scenario by options, of the command and of the Python package.

use clap::{Parser, ValueEnum};
use sonarfix::aim::Policy;
use sonarfix::config::{LightBeam, PingSchedule, Ranging};
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::StartPose;
use sonarfix_map::{
    AbsoluteSensors, Fidelity, HeadingSensor, HeadingSlip, PositionSensor, Sampling, Scenario,
    ServoName, SonarName,
};
use sonarfix_sim::pins::devices;

use crate::preset::SonarPreset;

/// Changes of a scenario; by default it stays as it is.
#[derive(Debug, clap::Args)]
pub struct Overrides {
    /// The policy that chooses the wall to measure.
    #[arg(long, value_enum)]
    policy: Option<PolicyName>,
    /// The level of simulation between world and localizer.
    #[arg(long, value_enum)]
    fidelity: Option<FidelityName>,
    /// Seconds between ranges, or "as-fast-as-possible".
    #[arg(long, value_name = "SECONDS", value_parser = schedule)]
    fix_period: Option<PingSchedule>,
    /// The servo of the sonar, in the simulation and in the ping schedule.
    #[arg(long, value_enum)]
    servo: Option<ServoChoice>,
    /// The ranger in place of the robot's, in the simulation and in the robot; the ping schedule stays.
    #[arg(long, value_name = "NAME", value_parser = sensor)]
    sensor: Option<SonarPreset>,
    /// Measures along a beam of light in place of sound, up to 40 degrees from the perpendicular of a wall, with the noise and
    /// reach of the scenario: the beam of a VL53L1X without its other errors.
    #[arg(long, conflicts_with = "sensor")]
    light: bool,
    /// Scale error of the ranges, as a fraction like 0.01; it is also the prior standard deviation
    /// of the range scale in the filter.
    #[arg(long, value_name = "FRACTION")]
    range_error: Option<f32>,
    /// The gyro of the robot.
    #[arg(long, value_enum)]
    gyro: Option<GyroChoice>,
    /// A sensor that measures heading (2 degrees), position (2 cm) or pose (both) from outside, every 0.73 s and 20 ms late.
    #[arg(long, value_enum)]
    absolute: Option<AbsoluteChoice>,
    /// Mean seconds between two slips of a wheel, each of which turns the odometry by 5 to 15 degrees.
    #[arg(long, value_name = "SECONDS")]
    heading_slips: Option<f64>,
    /// Whether the start pose is given to the robot. Without one it searches for its pose, at the start and whenever it is lost.
    #[arg(long, value_enum)]
    start: Option<StartName>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StartName {
    /// The start pose of the scenario is given, but the robot searches for its pose whenever it is lost.
    Relocalize,
    /// It starts without a pose.
    Unknown,
}

/// The options alone.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Alone {
    #[command(flatten)]
    overrides: Overrides,
}

/// The policy by its name.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PolicyName {
    /// The nearest wall, as in the paper.
    Nearest,
    /// The wall with the largest reduction of the position variance per time.
    Informative,
}

impl From<PolicyName> for Policy {
    fn from(name: PolicyName) -> Self {
        match name {
            PolicyName::Nearest => Self::Nearest,
            PolicyName::Informative => Self::Informative,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum FidelityName {
    /// None: travel and ranges are passed directly.
    Ideal,
    /// Pins, drivers and the robot's loop.
    Pins,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ServoChoice {
    /// Reaches the commanded bearing at once.
    Ideal,
    /// SG90, a small hobby servo.
    Sg90,
    /// MG996R, a large hobby servo.
    Mg996r,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum GyroChoice {
    /// None.
    None,
    /// MPU-6050.
    Mpu6050,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum AbsoluteChoice {
    /// A compass.
    Heading,
    /// A beacon.
    Position,
    /// A camera.
    Pose,
}

impl AbsoluteChoice {
    fn sensors(self) -> AbsoluteSensors {
        let heading = HeadingSensor::COMPASS;
        let heading_deviation = (self == Self::Pose).then_some(heading.deviation);
        let sampling = Sampling::EXAMPLE;
        let position = PositionSensor { sampling, deviation: 0.02, heading_deviation };
        AbsoluteSensors {
            heading: (self == Self::Heading).then_some(heading),
            position: (self != Self::Heading).then_some(position),
        }
    }
}

fn schedule(text: &str) -> Result<PingSchedule, String> {
    if text == "as-fast-as-possible" {
        return Ok(PingSchedule::AsFastAsPossible);
    }
    let seconds: f64 = text.parse().map_err(|_| "write 0.5, or as-fast-as-possible".to_owned())?;
    if !(1e-6..=3600.0).contains(&seconds) {
        return Err("must be from 1e-6 to 3600".to_owned());
    }
    Ok(PingSchedule::Every(Duration::from_ticks(sonarfix_sim::time::micros(seconds))))
}

fn sensor(name: &str) -> Result<SonarPreset, String> {
    let known = || SonarPreset::ALL.map(SonarPreset::file_name).join(", ");
    SonarPreset::named(name).ok_or_else(|| format!("must be one of {}", known()))
}

/// The largest angle of incidence with the option `--light`, degrees.
const LIGHT_CONE: f32 = 40.0;

/// Whether the sonar of a robot is on a servo, which an option replaces.
///
/// # Errors
/// If it is not.
pub fn has_servo(scenario: &Scenario) -> anyhow::Result<()> {
    let is_fixed = scenario.robot.localizer.rangers.first.fixed_bearing().is_some();
    anyhow::ensure!(!is_fixed, "--servo: the robot's sonar has a fixed bearing and no servo");
    Ok(())
}

impl Overrides {
    /// Reads options, as on the command line.
    ///
    /// # Errors
    /// The error of the command.
    pub fn parse(options: impl IntoIterator<Item = String>) -> Result<Self, clap::Error> {
        Alone::try_parse_from(options).map(|alone| alone.overrides)
    }

    /// Applies the changes to a scenario.
    ///
    /// # Errors
    /// If an option does not fit the scenario, or its value is out of range.
    pub fn apply(&self, scenario: &mut Scenario) -> anyhow::Result<()> {
        if let Some(preset) = self.sensor {
            let schedule = scenario.robot.localizer.rangers.first.timing.schedule;
            preset.fit(scenario);
            scenario.robot.localizer.set_ping_schedule(schedule);
        }
        if self.light {
            let sonar = &mut scenario.robot.localizer.rangers.first;
            sonar.ranging = Ranging::Light(LightBeam::VL53L1X);
            sonar.cone = Radians::from_degrees(LIGHT_CONE);
            scenario.hardware.sonar = SonarName::Ideal;
        }
        let config = &mut scenario.robot.localizer;
        config.policy = self.policy.map_or(config.policy, Policy::from);
        match self.fidelity {
            Some(FidelityName::Ideal) => scenario.fidelity = Fidelity::Ideal,
            Some(FidelityName::Pins) => scenario.fidelity = Fidelity::Pins,
            None => {}
        }
        if let Some(schedule) = self.fix_period {
            config.set_ping_schedule(schedule);
        }
        if let Some(servo) = self.servo {
            has_servo(scenario)?;
            let name = match servo {
                ServoChoice::Ideal => ServoName::Ideal,
                ServoChoice::Sg90 => ServoName::Sg90,
                ServoChoice::Mg996r => ServoName::Mg996r,
            };
            devices::mount_servo(scenario, name);
        }
        if let Some(error) = self.range_error {
            let sensible = error.abs() < 0.5;
            anyhow::ensure!(sensible, "--range-error must be a fraction below 0.5, like 0.01");
            scenario.robot.localizer.prior.range_scale = error.abs();
            scenario.truth.range_scale = error.into();
        }
        match self.gyro {
            Some(GyroChoice::None) => scenario.robot.localizer.gyro = None,
            Some(GyroChoice::Mpu6050) => {
                scenario.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
            }
            None => {}
        }
        if let Some(choice) = self.absolute {
            scenario.absolute = choice.sensors();
        }
        if let Some(every) = self.heading_slips {
            anyhow::ensure!(every > 0.0, "--heading-slips must be a positive number of seconds");
            let [least, most] = [5.0_f64, 15.0].map(f64::to_radians);
            scenario.upsets.heading_slip = HeadingSlip { every, least, most };
        }
        if let Some(start) = self.start {
            scenario.robot.start = StartPose::Unknown { region: None };
            scenario.start.is_unknown |= start == StartName::Unknown;
        }
        Ok(())
    }
}
