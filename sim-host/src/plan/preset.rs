//! Sonars and servos that one can buy, as the filter would be told of them.

use clap::ValueEnum;
use sonarfix::config::{Pace, Rhythm};
use sonarfix::range::RangeNoise;
use sonarfix::units::{Duration, Metres, Radians};
use sonarfix_map::{Scenario, ServoName, SonarName};

/// A sonar by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SonarPreset {
    /// HC-SR04: 0.02–3 m, a ping every 60 ms.
    HcSr04,
    /// LV-MaxSonar-EZ: 0.15–6 m in steps of 25 mm, a ping every 50 ms.
    LvMaxsonar,
    /// SRF08: 0.03–5.5 m, a wide cone.
    Srf08,
    /// Polaroid 6500: 0.26–10 m, a narrow cone.
    Polaroid6500,
}

/// What the filter is told of a sonar.
struct Told {
    sonar: SonarName,
    /// Half of the cone, degrees.
    cone: f32,
    /// Ranges that it can be trusted with, metres: most echoes come.
    reach: (f32, f32),
    /// Noise at no range, metres, and per metre. With the jumps of half a wavelength, the steps
    /// of the sensor and the bias off its axis, so more than a datasheet says.
    noise: (f32, f32),
    /// From ping to ping, µs.
    cycle: u64,
}

impl SonarPreset {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::HcSr04, Self::LvMaxsonar, Self::Srf08, Self::Polaroid6500];

    /// What it is sold as.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HcSr04 => "HC-SR04",
            Self::LvMaxsonar => "LV-MaxSonar",
            Self::Srf08 => "SRF08",
            Self::Polaroid6500 => "Polaroid 6500",
        }
    }

    /// Reaches, steps and cycles are those of `FIELD.md`, "Real hardware"; cones and noise chosen
    /// from them, as `world::sensor` says, on the safe side.
    fn told(self) -> Told {
        match self {
            Self::HcSr04 => Told {
                sonar: SonarName::HcSr04,
                cone: 12.0,
                reach: (0.1, 3.5),
                noise: (0.006, 0.002),
                cycle: 60_000,
            },
            Self::LvMaxsonar => Told {
                sonar: SonarName::LvMaxSonar,
                cone: 13.0,
                reach: (0.15, 6.0),
                noise: (0.011, 0.002),
                cycle: 50_000,
            },
            Self::Srf08 => Told {
                sonar: SonarName::Srf08,
                cone: 25.0,
                reach: (0.1, 5.5),
                noise: (0.007, 0.002),
                cycle: 70_000,
            },
            Self::Polaroid6500 => Told {
                sonar: SonarName::Polaroid6500,
                cone: 10.0,
                reach: (0.26, 10.0),
                noise: (0.006, 0.005),
                cycle: 110_000,
            },
        }
    }

    /// Puts it on the robot of a scenario, in place of its own, to look as fast as it can.
    pub fn fit(self, scenario: &mut Scenario) {
        let told = self.told();
        scenario.hardware.sonar = told.sonar;
        let sonar = &mut scenario.robot.config.sonar;
        sonar.cone = Radians::from_degrees(told.cone);
        sonar.min_range = Metres(told.reach.0);
        sonar.max_range = Metres(told.reach.1);
        sonar.noise = RangeNoise { floor: Metres(told.noise.0), per_metre: told.noise.1 };
        sonar.timing.rhythm = Rhythm::AsFastAsPossible;
        sonar.timing.cycle = Duration::from_ticks(told.cycle);
    }
}

/// A servo by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ServoPreset {
    /// At once where it is told to be.
    Ideal,
    /// SG90: 0.12 s/60°.
    Sg90,
    /// MG996R: 0.17 s/60°.
    Mg996r,
}

impl ServoPreset {
    /// Puts it under the sonar of a scenario's robot.
    pub fn fit(self, scenario: &mut Scenario) {
        let (name, pace) = match self {
            Self::Ideal => (ServoName::Ideal, Pace::INSTANT),
            Self::Sg90 => (ServoName::Sg90, Pace::SG90),
            Self::Mg996r => (ServoName::Mg996r, Pace::MG996R),
        };
        scenario.hardware.servo = name;
        scenario.robot.config.sonar.timing.servo = pace;
    }
}
