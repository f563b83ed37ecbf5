//! VL53L0X on I²C: a time-of-flight ranger, one range at a time.
//!
//! By ST's user manual UM2039 and its public driver (STSW-IMG005, BSD-3-Clause), whose names the registers have; some registers have
//! no public name. The driver starts one range per ping with 50 ms of light, and reads its status and the rate of its
//! signal with it. Until a range is due the bus is idle, and then one register is read per poll.
//!
//! The first trigger after a configuration or a failure sets the sensor up: it reads the variable that ends a range and
//! the number of reference detectors, enables these, writes ST's tuning, and lets the sensor calibrate its laser's voltage
//! and phase. No step waits, and none makes more than 27 transfers:
//!
//! ```text
//!   Identify ─▶ Detectors ─▶ Tuning (6 parts) ─▶ Voltage ─▶ Phase ─▶ Ready
//!                │   ▲                            │   ▲      │   ▲
//!                └───┘ not read                   └───┘      └───┘ not calibrated
//! ```
//!
//! Each trigger makes one step and is too soon until the last, so that the loop, which repeats it every millisecond, has a
//! range after some 20 ms. ST's driver also estimates the noise of each range from its signal; this one leaves that to the
//! gate. It has been tested on a simulated bus only. Why not an existing crate: `docs/decisions.md`.

use embedded_hal::i2c::I2c;
use sonarfix::geometry::units::{Duration, Instant, Metres};

use super::driver::{Ranger, TriggerError, UnsupportedKind};
use super::echo::{Echo, NoEcho, Outcome};
use super::settings::{RangerKind, RangerSettings, VL53L0X_ADDRESS};
use super::shot::{Shot, encoded};
use crate::time::{NEVER, after, since};

mod registers;

use registers::{PART, TUNING, register};

/// `IDENTIFICATION__MODEL_ID` of a VL53L0X.
const MODEL: u8 = 0xEE;
/// Time after which a range or a step of the set-up has failed.
const GIVE_UP: Duration = Duration::from_ticks(100_000);
/// All of a range, µs.
const BUDGET: u32 = 50_000;
/// Of it, before and after the light that is measured: ST's overheads of start and end, of twice the selection of detectors, of
/// the coarse and of the fine range, µs.
const OVERHEADS: [u32; 5] = [1_910, 960, 2 * 690, 660, 550];
/// Macro periods of the selection of detectors and of the coarse range, as [`TUNING`] sets them, and of 14 clocks of the laser, ns.
const SELECTION: u32 = 0x25 + 1;
const COARSE: u32 = 0x96 + 1;
const COARSE_PERIOD: u32 = macro_period(14);
/// The macro period of the fine range, of 10 clocks of the laser, ns.
const FINE_PERIOD: u32 = macro_period(10);
/// What remains for the light of the fine range, µs.
const LIGHT: u32 = light();
/// The timeout of the fine range, which includes that of the coarse one, macro periods.
const FINE_TIMEOUT: u16 = encoded((LIGHT * 1_000 + FINE_PERIOD / 2) / FINE_PERIOD + COARSE);
/// From the start to the first and to the last light of the fine range, and to the first poll.
const FIRST_LIGHT: Duration = Duration::from_ticks((BUDGET - OVERHEADS[1] - LIGHT) as u64);
const LAST_LIGHT: Duration = Duration::from_ticks((BUDGET - OVERHEADS[1]) as u64);
const RANGING: Duration = Duration::from_ticks(BUDGET as u64 + 2_000);
/// Least rate of the signal, in 128ths of a million counts a second: 0.25.
const LEAST_SIGNAL: u16 = 32;

/// 2,304 periods of the laser, each of so many clocks of 1.655 ns, in ns.
const fn macro_period(clocks: u32) -> u32 {
    (2_304 * clocks * 1_655 + 500) / 1_000
}

/// The time of the fine range.
const fn light() -> u32 {
    let [start, end, selection, coarse, fine] = OVERHEADS;
    let selecting = 2 * ((SELECTION * COARSE_PERIOD + 500) / 1_000);
    let coarsely = (COARSE * COARSE_PERIOD + 500) / 1_000;
    BUDGET - start - end - selection - coarse - fine - selecting - coarsely
}

/// Why a VL53L0X cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Vl53l0xError<E> {
    /// The bus has failed.
    Bus(E),
    /// Another device responds, with this model.
    Model(u8),
    /// The sensor does not finish its set-up within 0.1 s.
    SetUp,
}

impl<E: core::fmt::Debug> core::fmt::Display for Vl53l0xError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "the bus of the VL53L0X: {error:?}"),
            Self::Model(found) => write!(f, "{found:#04x} responds instead of a VL53L0X"),
            Self::SetUp => f.write_str("the VL53L0X does not finish its calibration"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for Vl53l0xError<E> {}

/// The next step of the set-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Identify,
    Detectors,
    /// The next part of the tuning.
    Tuning(usize),
    Voltage,
    Phase,
    Ready,
}

/// The driver.
///
/// ```
/// use embedded_hal::i2c::ErrorKind;
/// use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
/// use sonarfix::geometry::units::Instant;
/// use sonarfix_hal::ranger::{Ranger, TriggerError, Vl53l0x, Vl53l0xError};
///
/// // Another device has the address.
/// let mut bus = Mock::new(&[I2c::write_read(0x29, vec![0xc0], vec![0xea])]);
/// let mut ranger = Vl53l0x::new(bus.clone());
/// let error = ranger.trigger(Instant::from_ticks(0)).unwrap_err();
/// assert_eq!(error, TriggerError::Device(Vl53l0xError::<ErrorKind>::Model(0xea)));
/// bus.done();
/// ```
#[derive(Debug)]
pub struct Vl53l0x<I> {
    bus: I,
    address: u8,
    shot: Shot,
    step: Step,
    /// When the set-up began, and its last step.
    began: Instant,
    stepped: Instant,
    /// What ends a range, which the sensor knows of itself.
    stop: u8,
}

type Failure<I> = Vl53l0xError<<I as embedded_hal::i2c::ErrorType>::Error>;

impl<I: I2c> Vl53l0x<I> {
    /// A driver for the sensor at the address that it has after a reset.
    #[must_use]
    pub fn new(bus: I) -> Self {
        Self {
            bus,
            address: VL53L0X_ADDRESS,
            shot: Shot::new(RangerSettings::VL53L0X.cycle),
            step: Step::Identify,
            began: Instant::from_ticks(0),
            stepped: Instant::from_ticks(0),
            stop: 0,
        }
    }

    /// Releases the bus.
    pub fn release(self) -> I {
        self.bus
    }

    fn read<const N: usize>(&mut self, register: u8) -> Result<[u8; N], Failure<I>> {
        let mut bytes = [0; N];
        let read = self.bus.write_read(self.address, &[register], &mut bytes);
        read.map_err(Vl53l0xError::Bus)?;
        Ok(bytes)
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), Failure<I>> {
        self.bus.write(self.address, &[register, value]).map_err(Vl53l0xError::Bus)
    }

    fn write_all(&mut self, values: &[(u8, u8)]) -> Result<(), Failure<I>> {
        values.iter().try_for_each(|&(register, value)| self.write(register, value))
    }

    /// Changes some bits of a register: those of `clear` to 0, then those of `set` to 1.
    fn change(&mut self, register: u8, clear: u8, set: u8) -> Result<(), Failure<I>> {
        let [value] = self.read(register)?;
        self.write(register, value & !clear | set)
    }

    /// Makes the next step of the set-up; returns whether it was the last.
    fn set_up(&mut self, now: Instant) -> Result<bool, Failure<I>> {
        // What was begun long ago may not be as it was left.
        if since(now, self.stepped) >= GIVE_UP {
            self.step = Step::Identify;
        }
        self.stepped = now;
        let next = match self.step {
            Step::Identify => {
                self.began = now;
                self.identify()?;
                Some(Step::Detectors)
            }
            Step::Detectors => self.enable_detectors()?.then_some(Step::Tuning(0)),
            Step::Tuning(part) => Some(self.tune(part)?),
            Step::Voltage => {
                let is_calibrated = self.ends_calibration()?;
                if is_calibrated {
                    self.start_calibration(register::PHASE_ONLY, register::SINGLE_SHOT)?;
                }
                is_calibrated.then_some(Step::Phase)
            }
            Step::Phase => {
                let is_calibrated = self.ends_calibration()?;
                if is_calibrated {
                    self.write(register::SEQUENCE, register::RANGE_STEPS)?;
                }
                is_calibrated.then_some(Step::Ready)
            }
            Step::Ready => Some(Step::Ready),
        };
        if let Some(next) = next {
            self.step = next;
        } else if since(now, self.began) >= GIVE_UP {
            return Err(Vl53l0xError::SetUp);
        }
        Ok(self.step == Step::Ready)
    }

    /// Checks the model, reads what ends a range, and asks for the number of reference detectors.
    fn identify(&mut self) -> Result<(), Failure<I>> {
        let [model] = self.read(register::MODEL_ID)?;
        if model != MODEL {
            return Err(Vl53l0xError::Model(model));
        }
        // Pins of 2.8 V, and the standard mode of the bus.
        self.change(register::SUPPLY, 0, 1)?;
        self.write(0x88, 0)?;
        self.write_all(&[(0x80, 1), (register::PAGE, 1), (0x00, 0)])?;
        [self.stop] = self.read(register::STOP)?;
        self.write_all(&[(0x00, 1), (register::PAGE, 0), (0x80, 0)])?;
        // No limits of the signal before the fine range, until the tuning.
        self.change(register::MSRC_CONTROL, 0, 0x12)?;
        self.write_all(&[(register::LIMIT_HIGH, 0), (register::LIMIT_LOW, 0x20)])?;
        self.write(register::SEQUENCE, 0xFF)?;
        self.write_all(&[(0x80, 1), (register::PAGE, 1), (0x00, 0), (register::PAGE, 6)])?;
        self.change(register::STROBE, 0, 4)?;
        self.write_all(&[(register::PAGE, 7), (0x81, 1), (0x80, 1)])?;
        self.write_all(&[(0x94, 0x6B), (register::STROBE, 0)])
    }

    /// Enables the reference detectors; returns whether the sensor has read their number.
    fn enable_detectors(&mut self) -> Result<bool, Failure<I>> {
        if self.read(register::STROBE)? == [0] {
            return Ok(false);
        }
        self.write(register::STROBE, 1)?;
        let [detectors] = self.read(register::DETECTORS)?;
        self.write_all(&[(0x81, 0), (register::PAGE, 6)])?;
        self.change(register::STROBE, 4, 0)?;
        self.write_all(&[(register::PAGE, 1), (0x00, 1), (register::PAGE, 0), (0x80, 0)])?;
        let good: [u8; 6] = self.read(register::DETECTOR_MAP)?;
        self.write_all(&[(register::PAGE, 1), (0x4F, 0), (0x4E, 0x2C)])?;
        self.write_all(&[(register::PAGE, 0), (0xB6, 0xB4)])?;
        let [a, b, c, d, e, f] = enabled(good, detectors & 0x7F, detectors & 0x80 != 0);
        let written = self.bus.write(self.address, &[register::DETECTOR_MAP, a, b, c, d, e, f]);
        written.map_err(Vl53l0xError::Bus)?;
        Ok(true)
    }

    /// Writes a part of the tuning; after the last, the times of a range, and starts the calibration of the voltage.
    fn tune(&mut self, part: usize) -> Result<Step, Failure<I>> {
        if let Some(values) = TUNING.chunks(PART).nth(part) {
            self.write_all(values)?;
            return Ok(Step::Tuning(part.saturating_add(1)));
        }
        // An interrupt at each range, active low.
        self.write(register::INTERRUPT_CONFIG, register::RANGE_READY)?;
        self.change(register::INTERRUPT_LEVEL, 0x10, 0)?;
        self.write(register::INTERRUPT_CLEAR, 1)?;
        self.write(register::SEQUENCE, register::RANGE_STEPS)?;
        let [high, low] = FINE_TIMEOUT.to_be_bytes();
        self.write_all(&[(register::FINE_TIMEOUT, high), (register::FINE_TIMEOUT_LOW, low)])?;
        self.start_calibration(register::VOLTAGE_ONLY, register::CALIBRATE_VOLTAGE)?;
        Ok(Step::Voltage)
    }

    fn start_calibration(&mut self, steps: u8, start: u8) -> Result<(), Failure<I>> {
        self.write_all(&[(register::SEQUENCE, steps), (register::START, start)])
    }

    /// Ends the calibration, if it is done.
    fn ends_calibration(&mut self) -> Result<bool, Failure<I>> {
        if !self.has_result()? {
            return Ok(false);
        }
        self.write_all(&[(register::INTERRUPT_CLEAR, 1), (register::START, 0)])?;
        Ok(true)
    }

    fn has_result(&mut self) -> Result<bool, Failure<I>> {
        let [status] = self.read(register::INTERRUPT_STATUS)?;
        Ok(status & 7 != 0)
    }

    fn start(&mut self) -> Result<(), Failure<I>> {
        self.write_all(&[(0x80, 1), (register::PAGE, 1), (0x00, 0), (register::STOP, self.stop)])?;
        self.write_all(&[(0x00, 1), (register::PAGE, 0), (0x80, 0)])?;
        self.write(register::START, register::SINGLE_SHOT)
    }

    fn listen(&mut self, started: Instant, now: Instant) -> Result<Option<Outcome>, Failure<I>> {
        let age = since(now, started);
        if age < RANGING {
            return Ok(None);
        }
        if !self.has_result()? {
            return Ok((age >= GIVE_UP).then_some(Err(NoEcho::NoResponse)));
        }
        let [status, _, _, _, _, _, s0, s1, _, _, r0, r1] = self.read(register::RESULT)?;
        self.write(register::INTERRUPT_CLEAR, 1)?;
        let [signal, millimetres] = [[s0, s1], [r0, r1]].map(u16::from_be_bytes);
        let (sent, heard) = (after(started, FIRST_LIGHT), after(started, LAST_LIGHT));
        let range = range(status, signal, millimetres);
        Ok(Some(range.map(|range| Echo { sent, heard, range })))
    }
}

/// The first `wanted` detectors of those that are good; of the apertures, which begin with the twelfth, or of all.
fn enabled(good: [u8; 6], wanted: u8, are_apertures: bool) -> [u8; 6] {
    let (mut place, mut found) = (0_u8, 0_u8);
    let first = if are_apertures { 12 } else { 0 };
    good.map(|byte| {
        let mut kept = 0;
        for bit in 0..8 {
            let is_kept = place >= first && found < wanted && byte >> bit & 1 == 1;
            kept |= u8::from(is_kept) << bit;
            found += u8::from(is_kept);
            place += 1;
        }
        kept
    })
}

/// The range of a reading, or why it has no range.
fn range(status: u8, signal: u16, millimetres: u16) -> Result<Metres, NoEcho> {
    match status >> 3 & 0xF {
        // Complete; but of too little light it may be of anything.
        11 if signal >= LEAST_SIGNAL => Ok(Metres(f32::from(millimetres) * 0.001)),
        // Too little light; or a range that the sensor does not state to be one.
        11 | 4 | 0 | 5 | 7 | 12..=15 => Err(NoEcho::Nothing),
        // Wrapped around, too near, or clipped to the shortest range.
        6 | 8 | 9 | 10 => Err(NoEcho::OutOfRange),
        // The laser or the sensor has failed.
        _ => Err(NoEcho::NoResponse),
    }
}

impl<I: I2c> Ranger for Vl53l0x<I> {
    type Error = Vl53l0xError<I::Error>;

    fn ready_at(&self) -> Instant {
        self.shot.ready_at()
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>> {
        if !self.shot.may_start(now, GIVE_UP) {
            return Err(TriggerError::TooSoon);
        }
        let started = if self.step == Step::Ready {
            self.start().map(|()| true)
        } else {
            self.set_up(now).map(|_| false)
        };
        match started {
            Ok(true) => {
                self.shot.start(now);
                Ok(())
            }
            Ok(false) => Err(TriggerError::TooSoon),
            Err(error) => {
                self.step = Step::Identify;
                Err(TriggerError::Device(error))
            }
        }
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error> {
        let Some(started) = self.shot.in_flight_since() else {
            return Ok(None);
        };
        let result = self.listen(started, now);
        if !matches!(result, Ok(None)) {
            self.shot.end();
        }
        // What does not respond may have lost its settings.
        if matches!(result, Err(_) | Ok(Some(Err(NoEcho::NoResponse)))) {
            self.step = Step::Identify;
        }
        result
    }

    fn poll_at(&self) -> Option<Instant> {
        Some(self.shot.in_flight_since().map_or(NEVER, |started| after(started, RANGING)))
    }

    fn set_clock(&mut self, now: Instant) {
        self.shot.set_clock(now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let RangerSettings { kind: RangerKind::Vl53l0x { address }, cycle, .. } = *settings else {
            return Err(UnsupportedKind);
        };
        (self.address, self.shot.cycle, self.step) = (address, cycle.max(RANGING), Step::Identify);
        Ok(())
    }
}
