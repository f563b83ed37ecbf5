//! What the command line may change of a scenario.

use clap::ValueEnum;
use sonarfix::aim::Policy;
use sonarfix::config::{Pace, Rhythm};
use sonarfix::units::Duration;
use sonarfix_map::{Fidelity, Scenario, ServoName};

/// Changes; what is not given stays as the scenario has it.
#[derive(Debug, clap::Args)]
pub struct Overrides {
    /// Which wall the sonar looks at.
    #[arg(long, value_enum)]
    policy: Option<PolicyName>,
    /// What is simulated between world and localizer.
    #[arg(long, value_enum)]
    fidelity: Option<FidelityName>,
    /// Seconds from one range to the next, or "as-fast-as-possible".
    #[arg(long, value_name = "SECONDS", value_parser = rhythm)]
    fix_period: Option<Rhythm>,
    /// Which servo turns the sonar, and the schedule reckons with.
    #[arg(long, value_enum)]
    servo: Option<ServoChoice>,
    /// Lets the ranges be too long by this fraction, of which the filter only knows that it may be
    /// so much (one standard deviation): 0.01.
    #[arg(long, value_name = "FRACTION")]
    range_error: Option<f32>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PolicyName {
    /// The nearest, as in the paper.
    Nearest,
    /// The one that lowers the variance of the position most for the time it takes.
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
    /// Nothing: travels and ranges are told at once.
    Ideal,
    /// Pins, drivers and the robot's own loop.
    Pins,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ServoChoice {
    /// At once where it is told to be.
    Ideal,
    /// A small hobby servo.
    Sg90,
    /// A large one.
    Mg996r,
}

fn rhythm(text: &str) -> Result<Rhythm, String> {
    if text == "as-fast-as-possible" {
        return Ok(Rhythm::AsFastAsPossible);
    }
    let seconds: f64 = text.parse().map_err(|_| "write 0.5, or as-fast-as-possible".to_owned())?;
    if !(1e-6..=3600.0).contains(&seconds) {
        return Err("must be from 1e-6 to 3600".to_owned());
    }
    Ok(Rhythm::Every(Duration::from_ticks(crate::simulate::micros(seconds))))
}

impl Overrides {
    /// Changes the scenario.
    pub fn apply(&self, scenario: &mut Scenario) -> anyhow::Result<()> {
        let config = &mut scenario.robot.config;
        config.policy = self.policy.map_or(config.policy, Policy::from);
        match self.fidelity {
            Some(FidelityName::Ideal) => scenario.fidelity = Fidelity::Ideal,
            Some(FidelityName::Pins) => scenario.fidelity = Fidelity::Pins,
            None => {}
        }
        if let Some(rhythm) = self.fix_period {
            config.sonar.timing.rhythm = rhythm;
        }
        if let Some(servo) = self.servo {
            let (name, pace) = match servo {
                ServoChoice::Ideal => (ServoName::Ideal, Pace::INSTANT),
                ServoChoice::Sg90 => (ServoName::Sg90, Pace::SG90),
                ServoChoice::Mg996r => (ServoName::Mg996r, Pace::MG996R),
            };
            scenario.hardware.servo = name;
            config.sonar.timing.servo = pace;
        }
        if let Some(error) = self.range_error {
            let sensible = error.abs() < 0.5;
            anyhow::ensure!(sensible, "--range-error must be a fraction below 0.5, like 0.01");
            config.prior.range_scale = error.abs();
            scenario.truth.range_scale = error.into();
        }
        Ok(())
    }
}
