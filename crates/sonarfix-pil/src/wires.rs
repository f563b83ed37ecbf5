//! The simulated pins of a robot's devices.

mod bus;
mod light;

use core::cell::Cell;
use core::convert::Infallible;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::i2c::{self, ErrorKind, I2c, Operation};
use embedded_hal::pwm::{self, SetDutyCycle};
use serde::{Deserialize, Serialize};
use sonarfix::config::MAX_RANGERS;
use sonarfix::geometry::units::Instant;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::EchoCapture;

use self::bus::transact;

/// The sensors' signals up to a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensors {
    /// The time of the poll.
    pub at: Instant,
    /// The right wheel's encoder.
    pub right: Counted,
    /// The left wheel's encoder.
    pub left: Counted,
    /// The echoes of the rangers.
    pub echoes: [EchoSignals; MAX_RANGERS],
    /// The gyro.
    pub gyro: GyroSignal,
}

/// The edges of an echo line since the last poll, or the bus of a ranger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct EchoSignals {
    /// When it went high, if it did.
    pub rose: Option<Instant>,
    /// When it went low after that, if it did.
    pub fell: Option<Instant>,
    /// What its bus reads, if it is a time-of-flight ranger.
    pub light: LightSignal,
}

/// What the gyro senses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct GyroSignal {
    /// The yaw rate, millionths of a radian per second.
    pub micros: i32,
    /// Whether it does not respond on its bus.
    pub has_failed: bool,
}

pub use light::{LightSignal, Vl53l0xWire, Vl53l1xWire};

/// The counter of an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counted {
    /// Ticks; wraps around.
    pub ticks: u32,
    /// Illegal quadrature transitions; wraps around.
    pub illegal: u32,
    /// Whether a reading of the counter fails.
    pub has_failed: bool,
}

/// The actuators' signals of a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Actuators {
    /// Of each ranger.
    pub rangers: [RangerActuators; MAX_RANGERS],
}

/// The signals of a ranger and its servo of a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RangerActuators {
    /// The servo's duty, of [`FULL_DUTY`], if it was set.
    pub duty: Option<u16>,
    /// Whether the sonar's trigger is high.
    pub is_raised: bool,
    /// Whether the sonar's trigger has fallen or the time-of-flight ranger was started: a ping begins.
    pub has_fallen: bool,
}

/// All wires of a robot, at the microcontroller.
#[derive(Debug, Default)]
pub struct Wires {
    /// The right encoder's counter.
    pub right: CounterWire,
    /// The left encoder's counter.
    pub left: CounterWire,
    /// The wires of the rangers.
    pub rangers: [RangerWires; MAX_RANGERS],
    /// The bus of the gyro.
    pub gyro: GyroWire,
}

/// The wires of a ranger and its servo.
#[derive(Debug, Default)]
pub struct RangerWires {
    /// The servo's PWM channel.
    pub servo: ServoWire,
    /// The sonar's trigger.
    pub trigger: TriggerWire,
    /// The edges of the echo line.
    pub echo: EchoCapture,
    /// The bus of a VL53L1X.
    pub vl53l1x: Vl53l1xWire,
    /// The bus of a VL53L0X.
    pub vl53l0x: Vl53l0xWire,
}

impl Wires {
    /// Applies the sensors' signals to the wires.
    pub fn apply(&self, sensors: &Sensors) {
        self.right.0.set(sensors.right);
        self.left.0.set(sensors.left);
        self.gyro.signal.set(sensors.gyro);
        for (wires, echo) in self.rangers.iter().zip(&sensors.echoes) {
            wires.vl53l1x.apply(echo.light);
            wires.vl53l0x.apply(echo.light);
            if let Some(at) = echo.rose {
                wires.echo.rose(at);
            }
            if let Some(at) = echo.fell {
                wires.echo.fell(at);
            }
        }
    }

    /// Returns the actuators' signals since the last call.
    pub fn take(&self) -> Actuators {
        let rangers = self.rangers.each_ref().map(|wires| RangerActuators {
            duty: wires.servo.0.take(),
            is_raised: wires.trigger.is_raised.get(),
            has_fallen: wires.trigger.has_fallen.take()
                | wires.vl53l1x.take_start()
                | wires.vl53l0x.take_start(),
        });
        Actuators { rangers }
    }
}

/// A counter with a value that the PC sets.
#[derive(Debug, Default)]
pub struct CounterWire(Cell<Counted>);

/// The reading of a counter has failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadError;

impl Counter for &CounterWire {
    type Error = ReadError;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, ReadError> {
        let Counted { ticks, has_failed, .. } = self.0.get();
        if has_failed { Err(ReadError) } else { Ok(ticks) }
    }

    fn illegal(&mut self) -> u32 {
        self.0.get().illegal
    }
}

/// Timer counts in a period of the servo's PWM: a 16-bit timer.
pub const FULL_DUTY: u16 = u16::MAX;

/// A PWM channel that records its duty.
#[derive(Debug, Default)]
pub struct ServoWire(Cell<Option<u16>>);

impl pwm::ErrorType for &ServoWire {
    type Error = Infallible;
}

impl SetDutyCycle for &ServoWire {
    fn max_duty_cycle(&self) -> u16 {
        FULL_DUTY
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set(Some(duty));
        Ok(())
    }
}

/// A trigger pin that records a falling edge.
#[derive(Debug, Default)]
pub struct TriggerWire {
    is_raised: Cell<bool>,
    has_fallen: Cell<bool>,
}

impl digital::ErrorType for &TriggerWire {
    type Error = Infallible;
}

impl OutputPin for &TriggerWire {
    fn set_low(&mut self) -> Result<(), Infallible> {
        if self.is_raised.replace(false) {
            self.has_fallen.set(true);
        }
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.is_raised.set(true);
        Ok(())
    }
}

/// An MPU-6050 on a bus of its own: its identity, its range, and the rate of its z axis.
#[derive(Debug, Default)]
pub struct GyroWire {
    signal: Cell<GyroSignal>,
    /// The register that is read next.
    register: Cell<u8>,
    /// The range: 0 for 250°/s, and twice as much for each number more.
    range: Cell<u8>,
}

const GYRO_CONFIG: u8 = 0x1B;
const GYRO_Z_HIGH: u8 = 0x47;
const GYRO_Z_LOW: u8 = 0x48;
const WHO_AM_I: u8 = 0x75;
const IDENTITY: u8 = 0x68;
/// Counts of a rate of one radian per second in the range of 250°/s.
const COUNTS: f32 = 131.072 * 180.0 / core::f32::consts::PI;

impl GyroWire {
    fn byte(&self, register: u8) -> u8 {
        let scale = f32::from(1_u8 << (self.range.get() & 3));
        #[expect(clippy::cast_precision_loss, reason = "far more digits than the sensor has")]
        let rate = 1e-6 * self.signal.get().micros as f32;
        let counts = rate * COUNTS / scale;
        #[expect(clippy::cast_possible_truncation, reason = "saturates as the sensor does")]
        let counts = (counts + 0.5_f32.copysign(counts)) as i16;
        let [high, low] = counts.to_be_bytes();
        match register {
            GYRO_Z_HIGH => high,
            GYRO_Z_LOW => low,
            WHO_AM_I => IDENTITY,
            _ => 0,
        }
    }

    fn take(&self, bytes: &[u8]) {
        if let [register, values @ ..] = bytes {
            self.register.set(*register);
            if let (GYRO_CONFIG, [value, ..]) = (*register, values) {
                self.range.set(value >> 3);
            }
        }
    }

    /// The byte of the register that is read next.
    fn next(&self) -> u8 {
        let register = self.register.get();
        self.register.set(register.wrapping_add(1));
        self.byte(register)
    }
}

impl i2c::ErrorType for &GyroWire {
    type Error = ErrorKind;
}

impl I2c for &GyroWire {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let has_failed = self.signal.get().has_failed;
        transact(has_failed, operations, |bytes| self.take(bytes), || self.next())
    }
}
