//! The devices of a scenario: what its robot's drivers must know of them, and what they are.

use sonarfix::config::Config;
use sonarfix::units::{Duration, Metres};
use sonarfix_hal::ranger::{Celsius, PulseTiming};
use sonarfix_hal::robot::{Settings, Stamp};
use sonarfix_hal::servo::{MeasuredPulse, Pace};
use sonarfix_map::{Robot, Scenario, ServoName, SonarName};
use sonarfix_pil::Board;
use sonarfix_pil::board::{ServoBuild, Wheel};
use sonarfix_pil::wires::FULL_DUTY;

use crate::plant::servo::ServoModel;
use crate::world::air;

/// Where a robot file does not say how long a tick is: 1 mm, of the 0.05 to 1 mm that encoders of
/// small robots have (`FIELD.md`).
const TICK: f64 = 0.001;

/// Right and left wheel's travel from tick to tick, metres.
#[must_use]
pub fn ticks(robot: &Robot) -> [f64; 2] {
    robot.travel_per_tick.map_or([TICK; 2], |per| [per.right.0.into(), per.left.0.into()])
}

/// A wheel, as the loop knows it.
fn wheel(tick: f64) -> Wheel {
    /// Any number of ticks will do: only their length counts here.
    const PER_TURN: f32 = 1024.0;
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let tick = tick as f32;
    let diameter = Metres(tick.abs() * PER_TURN / std::f32::consts::PI);
    Wheel { diameter, ticks_per_revolution: PER_TURN, is_reversed: tick < 0.0 }
}

/// The loop's settings.
fn settings(robot: &Robot, stamp: Stamp) -> Settings {
    Settings {
        tick: robot.encoder_period,
        rhythm: robot.config.sonar.timing.rhythm,
        stamp,
        ..Settings::default()
    }
}

/// What belongs to a servo on both sides of its wire.
#[derive(Debug, Clone, Copy)]
pub struct ServoSetup {
    /// How it moves.
    pub model: ServoModel,
    /// How the driver thinks it does.
    pub pace: Pace,
    /// Pulses at its rightmost and its leftmost bearing, µs.
    pulses: (u16, u16),
}

impl ServoSetup {
    /// A servo of this name.
    #[must_use]
    pub fn of(name: ServoName) -> Self {
        match name {
            // Frames of 1 ms, as of a digital servo, and no time to turn.
            ServoName::Ideal => Self {
                model: ServoModel::ideal(),
                pace: Pace {
                    frame: Duration::from_ticks(1_000),
                    sixty_degrees: Duration::from_ticks(0),
                    settle: Duration::from_ticks(0),
                },
                pulses: (100, 900),
            },
            ServoName::Sg90 => {
                Self { model: ServoModel::sg90(), pace: Pace::SG90, pulses: (500, 2_500) }
            }
            ServoName::Mg996r => {
                Self { model: ServoModel::mg996r(), pace: Pace::MG996R, pulses: (500, 2_500) }
            }
        }
    }

    /// Where the servo is sent by a duty, radians.
    #[must_use]
    pub fn bearing(&self, duty: u16, config: &Config) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a frame has some thousand µs")]
        let frame = self.pace.frame.to_micros() as f64;
        let pulse = f64::from(duty) / f64::from(FULL_DUTY) * frame;
        let (shortest, longest) = (f64::from(self.pulses.0), f64::from(self.pulses.1));
        let (rightmost, leftmost) = limits(config);
        rightmost + (leftmost - rightmost) * (pulse - shortest) / (longest - shortest)
    }

    /// What its driver is told of it.
    fn build(&self, config: &Config) -> ServoBuild {
        let tried = |width: u16, bearing| MeasuredPulse {
            width: Duration::from_ticks(width.into()),
            bearing,
        };
        let (rightmost, leftmost) = config.sonar.servo;
        let (shortest, longest) = self.pulses;
        ServoBuild {
            tried: (tried(shortest, rightmost), tried(longest, leftmost)),
            limits: (rightmost, leftmost),
            pace: self.pace,
        }
    }
}

fn limits(config: &Config) -> (f64, f64) {
    let (rightmost, leftmost) = config.sonar.servo;
    (rightmost.0.into(), leftmost.0.into())
}

/// How long the driver of a scenario's sonar waits for what.
#[must_use]
pub fn timing(scenario: &Scenario) -> PulseTiming {
    /// What an HC-SR04 is given after its longest flight, for its silence and its cycle.
    const SHORT: PulseTiming = PulseTiming::HC_SR04;
    match scenario.hardware.sonar {
        SonarName::HcSr04 => return SHORT,
        SonarName::LvMaxSonar => return PulseTiming::LV_MAXSONAR,
        _ => {}
    }
    let reach = f64::from(scenario.robot.config.sonar.max_range.0);
    // A tenth more, for what is beyond the reach only by its noise or by the air.
    let flight = 1.1 * 2.0 * reach / air::speed_of_sound(scenario.hardware.set_temperature);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some ms")]
    let longest = Duration::from_ticks((flight * 1e6) as u64);
    PulseTiming {
        longest,
        silence: longest + (SHORT.silence - SHORT.longest),
        listen: longest + (SHORT.listen - SHORT.longest),
        cycle: longest + (SHORT.cycle - SHORT.longest),
        stuck: longest + (SHORT.stuck - SHORT.longest),
        ..SHORT
    }
}

/// What the drivers of a scenario's robot are told of its devices.
#[must_use]
pub fn board(scenario: &Scenario, stamp: Stamp) -> Board {
    let [right, left] = ticks(&scenario.robot).map(wheel);
    #[expect(clippy::cast_possible_truncation, reason = "the driver computes in f32")]
    let air = Celsius(scenario.hardware.set_temperature as f32);
    Board {
        right,
        left,
        servo: ServoSetup::of(scenario.hardware.servo).build(&scenario.robot.config),
        sonar: timing(scenario),
        air,
        settings: settings(&scenario.robot, stamp),
    }
}
