//! The simulated parts of the robot. Each does what its fault says, and counts the failures that its driver reports.

use std::cell::Cell;
use std::rc::Rc;

use embedded_hal::pwm;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::geometry::units::{Duration, Instant, Metres, RadiansPerSecond};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::gyro::{Unreadable, YawRate};
use sonarfix_hal::ranger::{
    Echo, NoEcho, Outcome, Ranger, RangerKind, RangerSettings, TriggerError, UnsupportedKind,
};

use super::case::Fault;

/// Travel of a wheel from edge to edge, metres: 65 mm with 1,024 edges.
pub const EDGE: f64 = std::f64::consts::PI * 0.065 / 1_024.0;
/// Time from ping to ping of a ranger, µs.
const CYCLE: u64 = 60_000;
/// Time that a ranger listens, µs.
const LISTENS: u64 = 32_000;
/// At 20 °C, m/s.
const SPEED_OF_SOUND: f64 = 343.2;

/// A part does not respond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Missing;

impl pwm::Error for Missing {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

/// The encoder of a wheel.
#[derive(Debug, Default)]
pub struct Encoder {
    pub fault: Fault,
    edges: f64,
    pub failures: u32,
}

impl Encoder {
    /// The wheel rolls.
    pub fn roll(&mut self, metres: f64) {
        self.edges += match self.fault {
            Fault::None | Fault::Dead => metres / EDGE,
            Fault::Lying => -metres / EDGE,
            Fault::Silent | Fault::Stuck | Fault::Frozen | Fault::Hanging => 0.0,
        };
    }
}

impl Counter for Encoder {
    type Error = Missing;
    const BITS: u32 = 16;

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wraps around")]
    fn count(&mut self) -> Result<u32, Missing> {
        if self.fault == Fault::Dead {
            self.failures += 1;
            return Err(Missing);
        }
        Ok(self.edges.floor() as i64 as u32 & 0xFFFF)
    }
}

/// The channel of a servo, whose driver owns it.
#[derive(Debug, Clone, Default)]
pub struct Channel {
    pub fault: Rc<Cell<Fault>>,
    pub failures: Rc<Cell<u32>>,
}

impl pwm::ErrorType for Channel {
    type Error = Missing;
}

impl pwm::SetDutyCycle for Channel {
    fn max_duty_cycle(&self) -> u16 {
        40_000
    }

    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Missing> {
        if self.fault.get() != Fault::Dead {
            return Ok(());
        }
        self.failures.set(self.failures.get() + 1);
        Err(Missing)
    }
}

/// A ranger.
#[derive(Debug)]
pub struct SimRanger {
    pub fault: Fault,
    /// What it would measure now, metres.
    pub range: Option<f64>,
    last: Option<f64>,
    ping: Option<(Instant, Option<f64>)>,
    ready: Instant,
    pub failures: u32,
    noise: ChaCha8Rng,
}

impl SimRanger {
    /// One whose noise has this seed.
    pub fn new(seed: u64) -> Self {
        Self {
            fault: Fault::None,
            range: None,
            last: None,
            ping: None,
            ready: Instant::from_ticks(0),
            failures: 0,
            noise: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Forgets its times, as a driver that is started.
    pub fn reset(&mut self) {
        (self.ping, self.ready) = (None, Instant::from_ticks(0));
    }

    fn measured(&mut self) -> Option<f64> {
        let noise = self.noise.random_range(-0.003..0.003);
        match self.fault {
            Fault::Lying => Some(self.noise.random_range(0.1..3.5)),
            Fault::Frozen => self.last,
            _ => {
                self.last = self.range.map(|range| range + noise);
                self.last
            }
        }
    }
}

impl Ranger for SimRanger {
    type Error = Missing;

    fn ready_at(&self) -> Instant {
        self.ready
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Missing>> {
        if now < self.ready {
            return Err(TriggerError::TooSoon);
        }
        let range = self.measured();
        self.ping = Some((now, range));
        self.ready = now.checked_add_duration(Duration::from_ticks(CYCLE)).unwrap_or(now);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Missing> {
        let Some((sent, range)) = self.ping else { return Ok(None) };
        let passed = now.ticks().saturating_sub(sent.ticks());
        let silent = match self.fault {
            Fault::Dead => Some(NoEcho::NoResponse),
            Fault::Stuck => Some(NoEcho::StuckHigh),
            Fault::Hanging => return Ok(None),
            Fault::Silent => Some(NoEcho::Nothing),
            Fault::None | Fault::Frozen | Fault::Lying => None,
        };
        let Some(range) = range.filter(|_| silent.is_none()) else {
            if passed < LISTENS {
                return Ok(None);
            }
            self.ping = None;
            let silent = silent.unwrap_or(NoEcho::Nothing);
            self.failures += u32::from(silent.is_fault());
            return Ok(Some(Err(silent)));
        };
        let heard = sent.checked_add_duration(flight(range)).unwrap_or(sent);
        if now < heard {
            return Ok(None);
        }
        self.ping = None;
        #[expect(clippy::cast_possible_truncation, reason = "a few metres")]
        Ok(Some(Ok(Echo { sent, heard, range: Metres(range as f32) })))
    }

    fn set_clock(&mut self, now: Instant) {
        self.ready = self.ready.min(now + Duration::from_ticks(CYCLE));
        self.ping = self.ping.map(|(_, range)| (now, range));
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let is_known = matches!(settings.kind, RangerKind::Pulse(_) | RangerKind::Vl53l1x { .. });
        if is_known { Ok(()) } else { Err(UnsupportedKind) }
    }
}

/// The time of flight of an echo.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some milliseconds")]
fn flight(range: f64) -> Duration {
    Duration::from_ticks((2e6 * range / SPEED_OF_SOUND) as u64)
}

/// The gyro.
#[derive(Debug)]
pub struct Gyro {
    pub fault: Fault,
    /// The true rate, rad/s.
    pub rate: f64,
    last: f64,
    range: f64,
    pub failures: u32,
    noise: ChaCha8Rng,
}

impl Gyro {
    /// One whose noise has this seed.
    pub fn new(seed: u64) -> Self {
        let noise = ChaCha8Rng::seed_from_u64(seed);
        Self { fault: Fault::None, rate: 0.0, last: 0.0, range: 4.0, failures: 0, noise }
    }
}

impl YawRate for Gyro {
    type Error = Missing;

    fn configure(&mut self, parameters: &GyroParameters) -> Result<(), Missing> {
        self.range = parameters.range.0.into();
        if self.fault == Fault::Dead { Err(Missing) } else { Ok(()) }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a few radians a second")]
    fn rate(&mut self) -> Result<RadiansPerSecond, Unreadable> {
        let noise = self.noise.random_range(-0.002..0.002);
        self.last = match self.fault {
            Fault::Dead | Fault::Hanging => {
                self.failures += 1;
                return Err(Unreadable);
            }
            Fault::None => self.rate + noise,
            Fault::Silent => 0.0,
            Fault::Frozen => self.last,
            Fault::Stuck => self.range,
            Fault::Lying => self.noise.random_range(-self.range..self.range),
        };
        Ok(RadiansPerSecond(self.last as f32))
    }
}
