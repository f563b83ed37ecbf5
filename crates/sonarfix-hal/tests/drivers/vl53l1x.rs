//! VL53L1X on a simulated bus: a bank of registers that the driver writes and reads.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use sonarfix_hal::ranger::{
    Air, NoEcho, OneOf, OneOfError, Ranger, RangerKind, RangerSettings, Srf, TriggerError, Vl53l1x,
    Vl53l1xError,
};

use super::{at, span};

/// A range takes 54 ms.
const DUE: u64 = 54_000;

/// A sensor with its registers, and the bytes that were transferred.
#[derive(Debug, Default)]
struct Chip {
    registers: BTreeMap<u16, u8>,
    transfers: usize,
    starts: usize,
    is_dead: bool,
}

#[derive(Debug, Clone)]
struct Bus(Rc<RefCell<Chip>>);

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl I2c for Bus {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        let mut chip = self.0.borrow_mut();
        chip.transfers += 1;
        if chip.is_dead || address != 0x29 {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        let mut register = 0_u16;
        for operation in operations {
            match operation {
                Operation::Write([high, low, values @ ..]) => {
                    register = u16::from_be_bytes([*high, *low]);
                    for (place, value) in (register..).zip(values.iter()) {
                        chip.registers.insert(place, *value);
                    }
                    chip.starts += usize::from(register == 0x0087 && *values == [0x10]);
                }
                Operation::Write(_) => panic!("a register has two bytes"),
                Operation::Read(bytes) => {
                    for (place, byte) in (register..).zip(bytes.iter_mut()) {
                        *byte = chip.registers.get(&place).copied().unwrap_or(0);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Bus {
    /// A sensor that has booted.
    fn booted() -> Self {
        let registers = [
            (0x010F, 0xEA),
            (0x0110, 0xCC),
            (0x00E5, 1),
            (0x0006, 0xBC),
            (0x0007, 0x00),
            (0x0031, 1),
        ];
        let chip = Chip { registers: registers.into_iter().collect(), ..Chip::default() };
        Self(Rc::new(RefCell::new(chip)))
    }

    fn set(&self, register: u16, value: u8) {
        self.0.borrow_mut().registers.insert(register, value);
    }

    fn word(&self, register: u16) -> u16 {
        let chip = self.0.borrow();
        let byte = |place| chip.registers.get(&place).copied().unwrap_or(0);
        u16::from_be_bytes([byte(register), byte(register + 1)])
    }

    /// A result is ready.
    fn answer(&self, status: u8, millimetres: u16) {
        self.set(0x0031, 0);
        self.set(0x0089, status);
        let [high, low] = millimetres.to_be_bytes();
        self.set(0x0096, high);
        self.set(0x0097, low);
    }
}

#[test]
fn a_range_is_started_waited_for_and_read() {
    let bus = Bus::booted();
    let mut ranger = Vl53l1x::new(bus.clone());
    assert_eq!(ranger.ready_at(), at(0));
    ranger.trigger(at(1_000)).unwrap();
    assert_eq!(bus.0.borrow().starts, 1);
    // Half of 50 ms less 4.5 ms, 22.736 ms, in macro periods of 2,304 · 32 clocks of 64 · 11.75 MHz, 98.04 µs: 232,
    // which is stored less one.
    assert_eq!(bus.word(0x005E), 231);
    assert_eq!(ranger.poll_at(), Some(at(1_000 + DUE)));
    let before = bus.0.borrow().transfers;
    assert_eq!(ranger.poll(at(DUE)), Ok(None));
    assert_eq!(bus.0.borrow().transfers, before, "the bus is idle while light is collected");
    bus.set(0x0031, 1);
    assert_eq!(ranger.poll(at(1_000 + DUE)), Ok(None));
    bus.answer(9, 2_048);
    let echo = ranger.poll(at(2_000 + DUE)).unwrap().unwrap().unwrap();
    assert!((echo.range.0 - 2.011).abs() < 1e-6);
    assert_eq!((echo.sent, echo.reflected()), (at(1_000), at(1_000 + DUE / 2)));
    assert_eq!(ranger.poll(at(60_000)), Ok(None));
    assert_eq!(ranger.ready_at(), at(61_000));
    assert_eq!(ranger.trigger(at(60_999)), Err(TriggerError::TooSoon));
    // The second start writes no settings again.
    let before = bus.0.borrow().transfers;
    ranger.trigger(at(61_000)).unwrap();
    assert_eq!(bus.0.borrow().transfers - before, 2);
}

/// The rate of photons that ST's driver aims at is 20 · 128 in units of 1/128 Mcps; numbers of detectors are in 1/256.
#[test]
fn the_next_range_has_detectors_for_the_rate_that_is_aimed_at() {
    let cases = [
        (0x0900, 0x0100, 200, 200.0),
        (0x0600, 0x0E00, 200, 100.0),
        (0x0100, 0x0180, 100, 255.996),
        // Without detectors or without light: half of them.
        (0, 0, 100, 128.0),
        (0x0900, 0x0100, 0, 128.0),
    ];
    for (signal, ambient, detectors, expected) in cases {
        let bus = Bus::booted();
        let mut ranger = Vl53l1x::new(bus.clone());
        ranger.trigger(at(0)).unwrap();
        for (register, word) in [(0x008C, 256 * detectors), (0x0090, ambient), (0x0098, signal)] {
            let [high, low] = u16::to_be_bytes(word);
            bus.set(register, high);
            bus.set(register + 1, low);
        }
        bus.answer(9, 500);
        ranger.poll(at(DUE)).unwrap().unwrap().unwrap();
        let found = f64::from(bus.word(0x0054)) / 256.0;
        assert!((found / expected - 1.0).abs() < 1e-3, "{signal} {ambient}: {found}");
    }
}

#[test]
fn a_status_is_the_reason_for_no_range() {
    for (status, outcome) in [
        (4, NoEcho::Nothing),
        (6, NoEcho::Nothing),
        (5, NoEcho::OutOfRange),
        (7, NoEcho::OutOfRange),
        (1, NoEcho::NoResponse),
        (17, NoEcho::NoResponse),
    ] {
        let bus = Bus::booted();
        let mut ranger = Vl53l1x::new(bus.clone());
        ranger.trigger(at(0)).unwrap();
        bus.answer(status, 500);
        assert_eq!(ranger.poll(at(DUE)), Ok(Some(Err(outcome))));
    }
}

#[test]
fn a_sensor_that_boots_or_is_lost_is_set_up_again() {
    let bus = Bus::booted();
    bus.set(0x00E5, 0);
    let mut ranger = Vl53l1x::new(bus.clone());
    assert_eq!(ranger.trigger(at(0)), Err(TriggerError::TooSoon));
    bus.set(0x00E5, 1);
    ranger.trigger(at(1_000)).unwrap();
    let settings = bus.0.borrow().transfers;
    bus.0.borrow_mut().is_dead = true;
    assert!(ranger.poll(at(1_000 + DUE)).is_err());
    assert!(matches!(ranger.trigger(at(70_000)), Err(TriggerError::Device(Vl53l1xError::Bus(_)))));
    bus.0.borrow_mut().is_dead = false;
    let before = bus.0.borrow().transfers;
    ranger.trigger(at(71_000)).unwrap();
    assert!(bus.0.borrow().transfers - before > 40, "{settings}");
}

#[test]
fn a_sensor_that_never_finishes_does_not_respond() {
    let bus = Bus::booted();
    let mut ranger = Vl53l1x::new(bus.clone());
    ranger.trigger(at(0)).unwrap();
    bus.set(0x0031, 1);
    assert_eq!(ranger.poll(at(99_999)), Ok(None));
    assert_eq!(ranger.poll(at(100_000)), Ok(Some(Err(NoEcho::NoResponse))));
}

#[test]
fn a_board_with_two_drivers_uses_the_configured_one() {
    let bus = Bus::booted();
    let srf = Srf::new(bus.clone(), Srf::DEFAULT_ADDRESS, Air::ROOM);
    let mut ranger = OneOf::new(srf, Vl53l1x::new(bus.clone()));
    let not_there = Err(TriggerError::Device(OneOfError::First(ErrorKind::NoAcknowledge(
        NoAcknowledgeSource::Address,
    ))));
    assert_eq!(ranger.trigger(at(0)), not_there);
    ranger.configure(&RangerSettings::VL53L1X).unwrap();
    ranger.trigger(at(0)).unwrap();
    assert_eq!(ranger.poll_at(), Some(at(DUE)));
    bus.answer(9, 1_000);
    assert!(ranger.poll(at(DUE)).unwrap().is_some());
    assert_eq!(ranger.ready_at(), at(60_000));
    let custom = RangerSettings { kind: RangerKind::Custom, ..RangerSettings::VL53L1X };
    assert!(ranger.configure(&custom).is_err());
    let slow = RangerSettings { cycle: span(200_000), ..RangerSettings::VL53L1X };
    ranger.configure(&slow).unwrap();
    assert_eq!(ranger.ready_at(), at(200_000));
}
