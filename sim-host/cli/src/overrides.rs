//! Changes of a scenario on the command line.

use clap::ValueEnum;
use sonarfix::aim::Policy;
use sonarfix::config::PingSchedule;
use sonarfix::gyro::GyroParameters;
use sonarfix::units::Duration;
use sonarfix_hal::config::StartPose;
use sonarfix_map::{
    AbsoluteSensors, Fidelity, HeadingSensor, HeadingSlip, PositionSensor, Sampling, Scenario,
    ServoName,
};
use sonarfix_sim::pins::devices;

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
        let sampling = Sampling { period: 730_000, delay: 20_000, outliers: 0.0 };
        let (deviation, turn) = (0.02, 2.0_f64.to_radians());
        let heading = HeadingSensor { sampling, deviation: turn };
        let heading_deviation = (self == Self::Pose).then_some(turn);
        let position = PositionSensor { sampling, deviation, heading_deviation };
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

impl Overrides {
    /// Applies the changes to a scenario.
    pub fn apply(&self, scenario: &mut Scenario) -> anyhow::Result<()> {
        let config = &mut scenario.robot.localizer;
        config.policy = self.policy.map_or(config.policy, Policy::from);
        match self.fidelity {
            Some(FidelityName::Ideal) => scenario.fidelity = Fidelity::Ideal,
            Some(FidelityName::Pins) => scenario.fidelity = Fidelity::Pins,
            None => {}
        }
        if let Some(schedule) = self.fix_period {
            config.sonar.timing.schedule = schedule;
        }
        if let Some(servo) = self.servo {
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
