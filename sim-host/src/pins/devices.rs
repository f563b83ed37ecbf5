//! The drivers and the loop of `sonarfix-hal`, set up for a scenario as its builder would.

use sonarfix::config::Config;
use sonarfix::units::{Duration, Metres};
use sonarfix_hal::encoder::{GeometryError, TickCount, WheelGeometry, Wheels};
use sonarfix_hal::ranger::{Air, Captured, Celsius, PulseRanger, PulseTiming, TemperatureError};
use sonarfix_hal::robot::{Devices, Settings, SettingsError, Stamp};
use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo, SettingError};
use sonarfix_map::{Robot, Scenario, ServoName, SonarName};

use super::wires::{FULL_DUTY, ServoChannel, TriggerPin, Wires};
use crate::plant::servo::ServoModel;
use crate::world::air;

/// The devices of a simulated robot.
pub type PinDevices<'w> = Devices<
    &'w TickCount,
    &'w TickCount,
    ServoChannel<'w>,
    PulseRanger<TriggerPin<'w>, Captured<'w>>,
>;

/// Why a scenario's hardware cannot be driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SetupError {
    /// An encoder.
    #[error("encoder: {0}")]
    Wheel(#[from] GeometryError),
    /// The servo.
    #[error("servo: {0}")]
    Servo(#[from] SettingError),
    /// The air.
    #[error("sensor: {0}")]
    Air(#[from] TemperatureError),
    /// The loop.
    #[error("loop: {0}")]
    Loop(#[from] SettingsError),
}

/// Where a robot file does not say how long a tick is: 1 mm, of the 0.05 to 1 mm that encoders of
/// small robots have (`FIELD.md`).
const TICK: f64 = 0.001;

/// Right and left wheel's travel from tick to tick, metres.
#[must_use]
pub fn ticks(robot: &Robot) -> [f64; 2] {
    robot.travel_per_tick.map_or([TICK; 2], |per| [per.right.0.into(), per.left.0.into()])
}

/// Both wheels, as the loop knows them.
///
/// # Errors
/// [`SetupError::Wheel`].
pub fn wheels(robot: &Robot) -> Result<Wheels, SetupError> {
    /// Any number of ticks will do: only their length counts here.
    const PER_TURN: f32 = 1024.0;
    let wheel = |tick: f64| {
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let tick = tick as f32;
        let diameter = Metres(tick.abs() * PER_TURN / std::f32::consts::PI);
        let wheel = WheelGeometry::new(diameter, PER_TURN)?;
        Ok::<_, SetupError>(if tick < 0.0 { wheel.reversed() } else { wheel })
    };
    let [right, left] = ticks(robot);
    Ok(Wheels { right: wheel(right)?, left: wheel(left)? })
}

/// The loop's settings.
#[must_use]
pub fn settings(robot: &Robot, stamp: Stamp) -> Settings {
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

    fn driver<'w>(
        &self,
        wires: &'w Wires,
        config: &Config,
    ) -> Result<Servo<ServoChannel<'w>>, SettingError> {
        let point = |width: u16, bearing| MeasuredPulse {
            width: Duration::from_ticks(width.into()),
            bearing,
        };
        let (rightmost, leftmost) = config.sonar.servo;
        let calibration =
            Calibration::new(point(self.pulses.0, rightmost), point(self.pulses.1, leftmost))?;
        Servo::new(ServoChannel(&wires.duty), calibration, (rightmost, leftmost), self.pace)
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

/// The devices on a robot's wires.
///
/// # Errors
/// [`SetupError`], by the device that cannot be driven.
pub fn connect<'w>(
    wires: &'w Wires,
    scenario: &Scenario,
    servo: &ServoSetup,
) -> Result<PinDevices<'w>, SetupError> {
    #[expect(clippy::cast_possible_truncation, reason = "the driver computes in f32")]
    let air = Air::at(Celsius(scenario.hardware.set_temperature as f32))?;
    let line = Captured::new(&wires.echo);
    Ok(Devices {
        right: &wires.right.count,
        left: &wires.left.count,
        servo: servo.driver(wires, &scenario.robot.config)?,
        ranger: PulseRanger::new(TriggerPin(wires), line, timing(scenario), air),
    })
}
