//! VL53L1X on I²C: a time-of-flight ranger, one range at a time.
//!
//! By ST's user manual UM2356 and its public driver; the register names are theirs. The driver sets the long mode with
//! 50 ms of light. A trigger starts one range; until it is due the bus is idle, and then one register is read per poll.
//! The first trigger after a configuration or a failure of the bus writes all settings, about 50 transfers (6 ms at
//! 400 kHz), so that a sensor that has lost its supply is used again. It has been tested on a simulated bus only. Why not
//! an existing crate: `docs/decisions.md`.

use embedded_hal::i2c::I2c;
use sonarfix::geometry::units::{Duration, Instant, Metres};

use super::driver::{Ranger, TriggerError, UnsupportedKind};
use super::echo::{Echo, NoEcho, Outcome};
use super::settings::{RangerKind, RangerSettings, VL53L1X_ADDRESS};
use super::shot::{Shot, encoded};
use crate::time::{NEVER, after, since};

mod registers;

use registers::{SETTINGS, register};

/// `IDENTIFICATION__MODEL_ID` of a VL53L1X.
const MODEL: u16 = 0xEACC;
/// Duration of a range: the light, and the calibration before it.
const RANGING: Duration = Duration::from_ticks(54_000);
/// Time after which a range has failed.
const GIVE_UP: Duration = Duration::from_ticks(100_000);
/// Time to collect light, and what of it the sensor needs itself, µs.
const BUDGET: u32 = 50_000;
const GUARD: u32 = 4_528;
/// Periods of the laser of the two ranges that are compared, as register values.
const LASER_PERIODS: [u8; 2] = [0x0F, 0x0D];
/// The correction gain of a range, 2011/2048.
const GAIN: u32 = 2_011;
/// Light per detector and second that the sensor aims at, in its own unit.
const TARGET_RATE: u32 = 0x0A00;

/// Why a VL53L1X cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Vl53l1xError<E> {
    /// The bus has failed.
    Bus(E),
    /// Another device responds, with this model.
    Model(u16),
}

impl<E: core::fmt::Debug> core::fmt::Display for Vl53l1xError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "the bus of the VL53L1X: {error:?}"),
            Self::Model(found) => write!(f, "{found:#06x} responds instead of a VL53L1X"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for Vl53l1xError<E> {}

/// The driver.
///
/// ```
/// use embedded_hal::i2c::ErrorKind;
/// use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
/// use sonarfix::geometry::units::Instant;
/// use sonarfix_hal::ranger::{Ranger, TriggerError, Vl53l1x, Vl53l1xError};
///
/// // Another device has the address.
/// let mut bus = Mock::new(&[I2c::write_read(0x29, vec![0x01, 0x0f], vec![0xee, 0xaa])]);
/// let mut ranger = Vl53l1x::new(bus.clone());
/// let error = ranger.trigger(Instant::from_ticks(0)).unwrap_err();
/// assert_eq!(error, TriggerError::Device(Vl53l1xError::<ErrorKind>::Model(0xeeaa)));
/// bus.done();
/// ```
#[derive(Debug)]
pub struct Vl53l1x<I> {
    bus: I,
    address: u8,
    shot: Shot,
    /// Whether the settings are written.
    is_set: bool,
    /// Whether the first range has calibrated the sensor.
    is_calibrated: bool,
}

/// The registers of a range that are read.
struct Reading {
    status: u8,
    detectors: u16,
    ambient: u16,
    millimetres: u16,
    signal: u16,
}

impl<I: I2c> Vl53l1x<I> {
    /// A driver for the sensor at the address that it has after a reset.
    #[must_use]
    pub fn new(bus: I) -> Self {
        Self {
            bus,
            address: VL53L1X_ADDRESS,
            shot: Shot::new(RangerSettings::VL53L1X.cycle),
            is_set: false,
            is_calibrated: false,
        }
    }

    /// Releases the bus.
    pub fn release(self) -> I {
        self.bus
    }

    fn read<const N: usize>(&mut self, register: u16) -> Result<[u8; N], Vl53l1xError<I::Error>> {
        let mut bytes = [0; N];
        let read = self.bus.write_read(self.address, &register.to_be_bytes(), &mut bytes);
        read.map_err(Vl53l1xError::Bus)?;
        Ok(bytes)
    }

    fn write(&mut self, register: u16, value: u8) -> Result<(), Vl53l1xError<I::Error>> {
        let [high, low] = register.to_be_bytes();
        let written = self.bus.write(self.address, &[high, low, value]);
        written.map_err(Vl53l1xError::Bus)
    }

    fn write_word(&mut self, register: u16, value: u16) -> Result<(), Vl53l1xError<I::Error>> {
        let ([high, low], [first, second]) = (register.to_be_bytes(), value.to_be_bytes());
        let written = self.bus.write(self.address, &[high, low, first, second]);
        written.map_err(Vl53l1xError::Bus)
    }

    /// Writes all settings; returns whether the sensor has booted, which takes 1.2 ms.
    fn set_up(&mut self) -> Result<bool, Vl53l1xError<I::Error>> {
        let model = u16::from_be_bytes(self.read(register::MODEL_ID)?);
        if model != MODEL {
            return Err(Vl53l1xError::Model(model));
        }
        let [status] = self.read(register::FIRMWARE_STATUS)?;
        if status & 1 == 0 {
            return Ok(false);
        }
        for &(register, value) in &SETTINGS {
            self.write(register, value)?;
        }
        self.set_budget()?;
        let offset = u16::from_be_bytes(self.read(register::OUTER_OFFSET)?);
        self.write_word(register::RANGE_OFFSET, offset.wrapping_mul(4))?;
        self.is_calibrated = false;
        Ok(true)
    }

    /// Sets the time to collect light, which is counted in macro periods of the laser.
    fn set_budget(&mut self) -> Result<(), Vl53l1xError<I::Error>> {
        let oscillator = u16::from_be_bytes(self.read(register::OSCILLATOR)?);
        let [first, second] = LASER_PERIODS.map(|period| macro_period(oscillator, period));
        let each = (BUDGET - GUARD) / 2;
        let phase = periods(1_000, first).min(0xFF);
        self.write(register::PHASE_TIMEOUT, phase as u8)?;
        self.write_word(register::MODE_TIMEOUT_A, encoded(periods(1, first)))?;
        self.write_word(register::RANGE_TIMEOUT_A, encoded(periods(each, first)))?;
        self.write_word(register::MODE_TIMEOUT_B, encoded(periods(1, second)))?;
        self.write_word(register::RANGE_TIMEOUT_B, encoded(periods(each, second)))
    }

    fn start(&mut self) -> Result<(), Vl53l1xError<I::Error>> {
        self.write(register::INTERRUPT_CLEAR, 1)?;
        self.write(register::MODE_START, register::SINGLE_SHOT)
    }

    fn listen(
        &mut self,
        sent: Instant,
        now: Instant,
    ) -> Result<Option<Outcome>, Vl53l1xError<I::Error>> {
        let age = since(now, sent);
        if age < RANGING {
            return Ok(None);
        }
        let [status] = self.read(register::INTERRUPT_STATUS)?;
        if status & 1 != 0 {
            return Ok((age >= GIVE_UP).then_some(Err(NoEcho::NoResponse)));
        }
        let reading = self.reading()?;
        if !self.is_calibrated {
            self.keep_calibration()?;
        }
        self.aim_at_rate(&reading)?;
        self.write(register::INTERRUPT_CLEAR, 1)?;
        let range = range(&reading);
        Ok(Some(range.map(|range| Echo { sent, heard: after(sent, RANGING), range })))
    }

    fn reading(&mut self) -> Result<Reading, Vl53l1xError<I::Error>> {
        let [status, _, _, d0, d1, _, _, a0, a1, _, _, _, _, r0, r1, s0, s1] =
            self.read(register::RESULT)?;
        let word = |high, low| u16::from_be_bytes([high, low]);
        Ok(Reading {
            status,
            detectors: word(d0, d1),
            ambient: word(a0, a1),
            millimetres: word(r0, r1),
            signal: word(s0, s1),
        })
    }

    /// Keeps the calibration of the first range for those after it, as ST's driver does.
    fn keep_calibration(&mut self) -> Result<(), Vl53l1xError<I::Error>> {
        let [init] = self.read(register::VHV_INIT)?;
        self.write(register::VHV_INIT, init & 0x7F)?;
        let [bound] = self.read(register::VHV_BOUND)?;
        self.write(register::VHV_BOUND, (bound & 0x03) + (3 << 2))?;
        self.write(register::PHASE_OVERRIDE, 1)?;
        let [phase] = self.read(register::PHASE_RESULT)?;
        self.write(register::PHASE_START, phase)?;
        self.is_calibrated = true;
        Ok(())
    }

    /// Sets the number of detectors of the next range by the light of this one.
    fn aim_at_rate(&mut self, reading: &Reading) -> Result<(), Vl53l1xError<I::Error>> {
        let total = (u32::from(reading.signal) + u32::from(reading.ambient)).min(0xFFFF) << 16;
        let each = total.checked_div(u32::from(reading.detectors)).unwrap_or(0);
        let wanted = (TARGET_RATE << 16).checked_div(each).unwrap_or(0x8000).min(0xFFFF);
        self.write_word(register::DETECTORS, wanted as u16)
    }
}

/// The range of a reading, or why it has no range.
fn range(reading: &Reading) -> Result<Metres, NoEcho> {
    match reading.status & 0x1F {
        // Complete; or clipped to the shortest range.
        9 | 8 => {
            let millimetres = (u32::from(reading.millimetres) * GAIN + 0x400) / 0x800;
            #[expect(clippy::cast_precision_loss, reason = "at most 16 bits")]
            Ok(Metres(millimetres as f32 * 0.001))
        }
        // Too little light, or too noisy.
        4 | 6 => Err(NoEcho::Nothing),
        // Beyond the range, or wrapped around.
        5 | 7 | 12 | 13 => Err(NoEcho::OutOfRange),
        // The laser or the sensor has failed.
        _ => Err(NoEcho::NoResponse),
    }
}

/// Microseconds of a macro period, in 4096ths, by the sensor's oscillator and the period of its laser.
fn macro_period(oscillator: u16, laser: u8) -> u32 {
    let clock = (1_u32 << 30).checked_div(u32::from(oscillator)).unwrap_or(0);
    let clocks = (u32::from(laser) + 1) << 1;
    ((clock.wrapping_mul(2_304) >> 6).wrapping_mul(clocks)) >> 6
}

/// How many macro periods a time is, rounded.
fn periods(micros: u32, period: u32) -> u32 {
    ((micros << 12) + period / 2).checked_div(period).unwrap_or(0)
}

impl<I: I2c> Ranger for Vl53l1x<I> {
    type Error = Vl53l1xError<I::Error>;

    fn ready_at(&self) -> Instant {
        self.shot.ready_at()
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>> {
        if !self.shot.may_start(now, GIVE_UP) {
            return Err(TriggerError::TooSoon);
        }
        if !self.is_set {
            self.is_set = self.set_up().map_err(TriggerError::Device)?;
            if !self.is_set {
                return Err(TriggerError::TooSoon);
            }
        }
        if let Err(error) = self.start() {
            self.is_set = false;
            return Err(TriggerError::Device(error));
        }
        self.shot.start(now);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error> {
        let Some(sent) = self.shot.in_flight_since() else {
            return Ok(None);
        };
        let result = self.listen(sent, now);
        if !matches!(result, Ok(None)) {
            self.shot.end();
        }
        // What does not respond may have lost its settings.
        if matches!(result, Err(_) | Ok(Some(Err(NoEcho::NoResponse)))) {
            self.is_set = false;
        }
        result
    }

    fn poll_at(&self) -> Option<Instant> {
        Some(self.shot.in_flight_since().map_or(NEVER, |sent| after(sent, RANGING)))
    }

    fn set_clock(&mut self, now: Instant) {
        self.shot.set_clock(now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let RangerSettings { kind: RangerKind::Vl53l1x { address }, cycle, .. } = *settings else {
            return Err(UnsupportedKind);
        };
        (self.address, self.shot.cycle, self.is_set) = (address, cycle.max(RANGING), false);
        Ok(())
    }
}
