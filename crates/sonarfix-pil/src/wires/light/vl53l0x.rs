//! A VL53L0X on a bus of its own: its identity, its calibrations, which end at once, and the result of its last range.

use core::cell::Cell;

use embedded_hal::i2c::{self, ErrorKind, I2c, Operation};

use super::{LightSignal, Shot};
use crate::wires::bus::transact;

/// The wire.
#[derive(Debug, Default)]
pub struct Vl53l0xWire {
    shot: Shot,
    /// The register that is read next, and its page.
    register: Cell<u8>,
    page: Cell<u8>,
    /// The steps of what is started.
    sequence: Cell<u8>,
    is_calibrating: Cell<bool>,
}

const START: u8 = 0x00;
const SEQUENCE: u8 = 0x01;
const INTERRUPT_STATUS: u8 = 0x13;
const STATUS: u8 = 0x14;
const SIGNAL: u8 = 0x1A;
const MILLIMETRES: u8 = 0x1E;
const STROBE: u8 = 0x83;
const MODEL_ID: u8 = 0xC0;
const PAGE: u8 = 0xFF;
const MODEL: u8 = 0xEE;
/// The highest byte of a strong signal.
const STRONG: u8 = 0x10;
/// The calibrations of voltage and phase, which have no range.
const CALIBRATIONS: [u8; 2] = [0x01, 0x02];

impl Vl53l0xWire {
    /// Applies the signal. A range that was started since is not yet in it.
    pub(crate) fn apply(&self, signal: LightSignal) {
        self.shot.signal.set(signal);
    }

    /// Whether a range was started since the last call.
    pub(crate) fn take_start(&self) -> bool {
        self.shot.has_started.take()
    }

    fn byte(&self, register: u8) -> u8 {
        let LightSignal { status, millimetres, .. } = self.shot.signal.get();
        let [high, low] = millimetres.to_be_bytes();
        match register {
            INTERRUPT_STATUS if status != 0 || self.is_calibrating.get() => 4,
            STATUS => status,
            SIGNAL => STRONG,
            MILLIMETRES => high,
            0x1F => low,
            // What it reads of its own memory is there at once.
            STROBE => 1,
            MODEL_ID => MODEL,
            _ => 0,
        }
    }

    fn take(&self, bytes: &[u8]) {
        let [register, values @ ..] = bytes else { return };
        self.register.set(*register);
        let Some(&value) = values.first() else { return };
        match (*register, self.page.get()) {
            (PAGE, _) => self.page.set(value),
            (SEQUENCE, 0) => self.sequence.set(value),
            (START, 0) => self.start(value & 1 != 0),
            _ => {}
        }
    }

    fn start(&self, is_start: bool) {
        let is_calibration = CALIBRATIONS.contains(&self.sequence.get());
        self.is_calibrating.set(is_start && is_calibration);
        if is_start && !is_calibration {
            self.shot.start();
        }
    }

    /// The byte of the register that is read next.
    fn next(&self) -> u8 {
        let register = self.register.get();
        self.register.set(register.wrapping_add(1));
        self.byte(register)
    }
}

impl i2c::ErrorType for &Vl53l0xWire {
    type Error = ErrorKind;
}

impl I2c for &Vl53l0xWire {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let has_failed = self.shot.signal.get().has_failed;
        transact(has_failed, operations, |bytes| self.take(bytes), || self.next())
    }
}
