//! VL53L0X: every transfer of the set-up and of a range, and a simulated sensor for what goes wrong.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use sonarfix_hal::ranger::{
    NoEcho, Ranger, RangerKind, RangerSettings, TriggerError, Vl53l0x, Vl53l0xError,
};

use super::{at, span};

const ADDRESS: u8 = 0x29;
/// A range takes 50 ms, and is polled 2 ms later.
const DUE: u64 = 52_000;
/// Steps of the set-up, each one trigger: identity, detectors, six parts of the tuning, times, and two calibrations.
const STEPS: u64 = 11;

/// `DefaultTuningSettings` of ST's driver, version of 2015-11-02: register and value.
const TUNING: &str = "\
    FF01 0000 FF00 0900 1000 1100 2401 25FF 7500 FF01 4E2C 4800 3020 FF00 3009 5400 3104 3203 4083 4625 \
    6000 2700 5006 5100 5296 5608 5730 6100 6200 6400 6500 66A0 FF01 2232 4714 49FF 4A00 FF00 7A0A 7B00 \
    7821 FF01 2334 4200 44FF 4526 4605 4040 0E06 201A 4340 FF00 3403 3544 FF01 3104 4B09 4C05 4D04 FF00 \
    4400 4520 4708 4828 6700 7004 7101 72FE 7600 7700 FF01 0D01 FF00 8001 01F8 FF01 8E01 0001 FF00 8000";

fn tuning() -> Vec<(u8, u8)> {
    let byte = |text: &str| u8::from_str_radix(text, 16).unwrap();
    TUNING.split(' ').map(|word| (byte(&word[..2]), byte(&word[2..]))).collect()
}

fn write(register: u8, value: u8) -> Transaction {
    Transaction::write(ADDRESS, vec![register, value])
}

fn writes(values: &[(u8, u8)]) -> Vec<Transaction> {
    values.iter().map(|&(register, value)| write(register, value)).collect()
}

fn read(register: u8, bytes: &[u8]) -> Transaction {
    Transaction::write_read(ADDRESS, vec![register], bytes.to_vec())
}

/// `VL53L0X_DataInit`, and the first half of `VL53L0X_get_info_from_device`. 0x3C ends a range.
fn identify() -> Vec<Transaction> {
    let mut all = vec![read(0xC0, &[0xEE]), read(0x89, &[0x10]), write(0x89, 0x11)];
    all.extend(writes(&[(0x88, 0x00), (0x80, 0x01), (0xFF, 0x01), (0x00, 0x00)]));
    all.push(read(0x91, &[0x3C]));
    all.extend(writes(&[(0x00, 0x01), (0xFF, 0x00), (0x80, 0x00)]));
    all.extend([read(0x60, &[0x01]), write(0x60, 0x13)]);
    all.extend(writes(&[(0x44, 0x00), (0x45, 0x20), (0x01, 0xFF)]));
    all.extend(writes(&[(0x80, 0x01), (0xFF, 0x01), (0x00, 0x00), (0xFF, 0x06)]));
    all.extend([read(0x83, &[0x40]), write(0x83, 0x44)]);
    all.extend(writes(&[(0xFF, 0x07), (0x81, 0x01), (0x80, 0x01), (0x94, 0x6B), (0x83, 0x00)]));
    all
}

/// The second half, with these reference detectors, and `VL53L0X_set_reference_spads`.
fn detectors(number: u8, good: [u8; 6], enabled: [u8; 6]) -> Vec<Transaction> {
    let mut all = vec![read(0x83, &[0x10]), write(0x83, 0x01), read(0x92, &[number])];
    all.extend(writes(&[(0x81, 0x00), (0xFF, 0x06)]));
    all.extend([read(0x83, &[0x45]), write(0x83, 0x41)]);
    all.extend(writes(&[(0xFF, 0x01), (0x00, 0x01), (0xFF, 0x00), (0x80, 0x00)]));
    all.push(read(0xB0, &good));
    all.extend(writes(&[(0xFF, 0x01), (0x4F, 0x00), (0x4E, 0x2C), (0xFF, 0x00), (0xB6, 0xB4)]));
    all.push(Transaction::write(ADDRESS, [&[0xB0], &enabled[..]].concat()));
    all
}

/// `VL53L0X_SetGpioConfig`, the steps of a range, and its time. The fine range has 50 ms less what ST's driver subtracts, in
/// microseconds: 1,910 + 960, twice 690 and 38 macro periods of 53.383 for the selection of detectors, 660 and 151 of these periods for
/// the coarse range, and 550. That are 32,421, which are 850 macro periods of 38.131; with the 151 they are 1,001 = 250 * 4 + 1.
fn timing() -> Vec<Transaction> {
    let mut all = vec![write(0x0A, 0x04), read(0x84, &[0x11]), write(0x84, 0x01)];
    all.extend(writes(&[(0x0B, 0x01), (0x01, 0xE8), (0x71, 0x02), (0x72, 0xFA)]));
    // `VL53L0X_perform_vhv_calibration`
    all.extend(writes(&[(0x01, 0x01), (0x00, 0x41)]));
    all
}

/// `VL53L0X_perform_phase_calibration`, and the steps of a range again.
fn calibrations() -> [Vec<Transaction>; 2] {
    let voltage = [read(0x13, &[0x04])].into_iter();
    let voltage = voltage.chain(writes(&[(0x0B, 1), (0x00, 0), (0x01, 0x02), (0x00, 0x01)]));
    let phase = [read(0x13, &[0x07])].into_iter();
    [voltage.collect(), phase.chain(writes(&[(0x0B, 1), (0x00, 0), (0x01, 0xE8)])).collect()]
}

fn start() -> Vec<Transaction> {
    writes(&[
        (0x80, 0x01),
        (0xFF, 0x01),
        (0x00, 0x00),
        (0x91, 0x3C),
        (0x00, 0x01),
        (0xFF, 0x00),
        (0x80, 0x00),
        (0x00, 0x01),
    ])
}

#[test]
fn the_sensor_is_set_up_in_steps_and_ranges() {
    // Of 5 apertures: from the twelfth detector on, the first five that are good.
    let good = [0xFF, 0xAF, 0x0B, 0xFF, 0xFF, 0xFF];
    let enabled = [0, 0xA0, 0x0B, 0, 0, 0];
    let mut all = identify();
    all.push(read(0x83, &[0x00]));
    all.extend(detectors(0x85, good, enabled));
    all.extend(writes(&tuning()));
    all.extend(timing());
    let [voltage, phase] = calibrations();
    all.extend([read(0x13, &[0x00])].into_iter().chain(voltage));
    all.extend([read(0x13, &[0x40])].into_iter().chain(phase));
    all.extend(start());
    let mut bus = Mock::new(&all);
    let mut ranger = Vl53l0x::new(bus.clone());
    assert_eq!(ranger.ready_at(), at(0));
    // Three steps are repeated, because the sensor has not finished.
    let steps = 1_000 * (STEPS + 3);
    for now in (0..steps).step_by(1_000) {
        assert_eq!(ranger.trigger(at(now)), Err(TriggerError::TooSoon), "{now}");
    }
    ranger.trigger(at(steps)).unwrap();
    bus.done();
    assert_eq!(ranger.poll_at(), Some(at(steps + DUE)));

    // The bus is idle until the range is due. 4,660 mm, and 0.26 million counts a second.
    let result = [0x58, 0, 0, 0, 0, 0, 0x00, 0x21, 0, 0, 0x12, 0x34];
    bus.update_expectations(&[
        read(0x13, &[0x00]),
        read(0x13, &[0x04]),
        read(0x14, &result),
        write(0x0B, 0x01),
    ]);
    assert_eq!(ranger.poll(at(steps + DUE - 1)), Ok(None));
    assert_eq!(ranger.poll(at(steps + DUE)), Ok(None));
    let echo = ranger.poll(at(steps + DUE + 1_000)).unwrap().unwrap().unwrap();
    assert!((echo.range.0 - 4.660).abs() < 1e-6);
    // The light of the fine range: 32.4 of the 50 ms, which end 0.96 ms after it.
    assert_eq!((echo.sent, echo.heard), (at(steps + 16_619), at(steps + 49_040)));
    bus.done();

    // The second range writes no settings.
    assert_eq!(ranger.ready_at(), at(steps + 60_000));
    assert_eq!(ranger.trigger(at(steps + 59_999)), Err(TriggerError::TooSoon));
    bus.update_expectations(&start());
    ranger.trigger(at(steps + 60_000)).unwrap();
    bus.done();
}

/// A sensor in which every calibration ends at once, and which counts transfers.
#[derive(Debug)]
struct Chip {
    register: u8,
    /// What it says of a calibration or a range, and of its own memory.
    interrupt: u8,
    strobe: u8,
    result: [u8; 12],
    transfers: usize,
    most_transfers: usize,
    is_dead: bool,
}

#[derive(Debug, Clone)]
struct Bus(Rc<RefCell<Chip>>);

impl Bus {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip {
            register: 0,
            interrupt: 4,
            strobe: 1,
            result: [0; 12],
            transfers: 0,
            most_transfers: 0,
            is_dead: false,
        })))
    }

    fn answer(&self, status: u8, signal: u16, millimetres: u16) {
        let ([s0, s1], [r0, r1]) = (signal.to_be_bytes(), millimetres.to_be_bytes());
        self.0.borrow_mut().result = [status << 3, 0, 0, 0, 0, 0, s0, s1, 0, 0, r0, r1];
    }
}

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl I2c for Bus {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let mut chip = self.0.borrow_mut();
        if chip.is_dead {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        chip.transfers += 1;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => chip.register = bytes[0],
                Operation::Read(bytes) => match chip.register {
                    0xC0 => bytes.copy_from_slice(&[0xEE]),
                    0x13 => bytes.copy_from_slice(&[chip.interrupt]),
                    0x83 => bytes.copy_from_slice(&[chip.strobe]),
                    0x14 => bytes.copy_from_slice(&chip.result),
                    _ => bytes.fill(0),
                },
            }
        }
        Ok(())
    }
}

/// Triggers every millisecond until a range starts; returns when.
fn started(ranger: &mut Vl53l0x<Bus>, bus: &Bus, from: u64) -> u64 {
    for now in (from..from + 100_000).step_by(1_000) {
        let before = bus.0.borrow().transfers;
        let triggered = ranger.trigger(at(now));
        let mut chip = bus.0.borrow_mut();
        chip.most_transfers = chip.most_transfers.max(chip.transfers - before);
        match triggered {
            Ok(()) => return now,
            Err(error) => assert_eq!(error, TriggerError::TooSoon),
        }
    }
    panic!("no range is started");
}

#[test]
fn no_step_of_the_set_up_takes_long() {
    let bus = Bus::new();
    let mut ranger = Vl53l0x::new(bus.clone());
    assert_eq!(started(&mut ranger, &bus, 0), 1_000 * STEPS);
    assert!(bus.0.borrow().most_transfers <= 27, "{bus:?}");
}

#[test]
fn a_status_is_the_reason_for_no_range() {
    for (status, signal, outcome) in [
        (11, 31, Err(NoEcho::Nothing)),
        (11, 32, Ok(1_500.0)),
        (4, 500, Err(NoEcho::Nothing)),
        (0, 500, Err(NoEcho::Nothing)),
        (7, 500, Err(NoEcho::Nothing)),
        (6, 500, Err(NoEcho::OutOfRange)),
        (9, 500, Err(NoEcho::OutOfRange)),
        (10, 500, Err(NoEcho::OutOfRange)),
        (1, 500, Err(NoEcho::NoResponse)),
        (3, 500, Err(NoEcho::NoResponse)),
    ] {
        let bus = Bus::new();
        let mut ranger = Vl53l0x::new(bus.clone());
        let sent = started(&mut ranger, &bus, 0);
        bus.answer(status, signal, 1_500);
        let result = ranger.poll(at(sent + DUE)).unwrap().unwrap();
        let millimetres = result.map(|echo| (1e3 * echo.range.0).round());
        assert_eq!(millimetres, outcome, "{status}");
    }
}

#[test]
fn a_sensor_that_never_finishes_is_a_fault_and_is_set_up_again() {
    let bus = Bus::new();
    let mut ranger = Vl53l0x::new(bus.clone());
    bus.0.borrow_mut().strobe = 0;
    for now in (0..100_000).step_by(1_000) {
        assert_eq!(ranger.trigger(at(now)), Err(TriggerError::TooSoon));
    }
    let never = Err(TriggerError::Device(Vl53l0xError::SetUp));
    assert_eq!(ranger.trigger(at(100_000)), never);
    bus.0.borrow_mut().strobe = 1;
    let sent = started(&mut ranger, &bus, 101_000);
    // A range without an end.
    bus.0.borrow_mut().interrupt = 0;
    assert_eq!(ranger.poll(at(sent + 99_999)), Ok(None));
    assert_eq!(ranger.poll(at(sent + 100_000)), Ok(Some(Err(NoEcho::NoResponse))));
    assert_eq!(ranger.trigger(at(sent + 100_000)), Err(TriggerError::TooSoon));
    bus.0.borrow_mut().interrupt = 4;
    let again = started(&mut ranger, &bus, sent + 101_000);
    assert_eq!(again, sent + 100_000 + 1_000 * STEPS);
}

#[test]
fn a_sensor_that_is_lost_is_set_up_again() {
    let bus = Bus::new();
    let mut ranger = Vl53l0x::new(bus.clone());
    let sent = started(&mut ranger, &bus, 0);
    bus.0.borrow_mut().is_dead = true;
    assert!(matches!(ranger.poll(at(sent + DUE)), Err(Vl53l0xError::Bus(_))));
    let lost = ranger.trigger(at(sent + 60_000));
    assert!(matches!(lost, Err(TriggerError::Device(Vl53l0xError::Bus(_)))));
    bus.0.borrow_mut().is_dead = false;
    assert_eq!(started(&mut ranger, &bus, sent + 70_000), sent + 70_000 + 1_000 * STEPS);
}

/// A set-up that nobody continues for a while begins again.
#[test]
fn an_interrupted_set_up_begins_again() {
    let bus = Bus::new();
    let mut ranger = Vl53l0x::new(bus.clone());
    for now in [0, 1_000, 2_000] {
        assert_eq!(ranger.trigger(at(now)), Err(TriggerError::TooSoon));
    }
    assert_eq!(started(&mut ranger, &bus, 102_000), 102_000 + 1_000 * STEPS);
}

#[test]
fn its_address_and_cycle_are_configured() {
    let mut bus = Mock::new(&[Transaction::write_read(0x31, vec![0xC0], vec![0xEA])]);
    let mut ranger = Vl53l0x::new(bus.clone());
    let kind = RangerKind::Vl53l0x { address: 0x31 };
    ranger.configure(&RangerSettings { kind, ..RangerSettings::VL53L0X }).unwrap();
    let other = Err(TriggerError::Device(Vl53l0xError::Model(0xEA)));
    assert_eq!(ranger.trigger(at(0)), other);
    bus.done();
    assert!(ranger.configure(&RangerSettings::VL53L1X).is_err());
    let slow = RangerSettings { cycle: span(200_000), ..RangerSettings::VL53L0X };
    let bus = Bus::new();
    let mut ranger = Vl53l0x::new(bus.clone());
    ranger.configure(&slow).unwrap();
    let sent = started(&mut ranger, &bus, 0);
    assert_eq!(ranger.ready_at(), at(sent + 200_000));
}
