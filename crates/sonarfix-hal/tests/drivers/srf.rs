//! SRF02 and SRF08 on a mocked bus.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use sonarfix_hal::ranger::{Air, NoEcho, Outcome, Ranger, Srf, TriggerError};

use super::at;

const ADDRESS: u8 = 0x71;

fn trigger() -> Transaction {
    Transaction::write(ADDRESS, vec![0x00, 0x52])
}

fn revision(byte: u8) -> Transaction {
    Transaction::write_read(ADDRESS, vec![0x00], vec![byte])
}

fn result(micros: u16) -> Transaction {
    Transaction::write_read(ADDRESS, vec![0x02], micros.to_be_bytes().to_vec())
}

/// One ping over a bus that expects this, polled at these times until there is an outcome.
fn ping(expected: &[Transaction], polls: &[u64]) -> Option<Outcome> {
    let mut bus = Mock::new(expected);
    let mut ranger = Srf::new(bus.clone(), ADDRESS, Air::ROOM);
    ranger.trigger(at(0)).unwrap();
    let outcome = polls.iter().find_map(|&time| ranger.poll(at(time)).unwrap());
    bus.done();
    outcome
}

#[test]
fn a_ranging_sensor_is_not_addressed() {
    let source = NoAcknowledgeSource::Address;
    let expected = [
        trigger(),
        revision(0).with_error(ErrorKind::NoAcknowledge(source)),
        revision(0xFF),
        revision(6),
        result(11_662),
    ];
    let polls = [1_000, 64_999, 65_000, 66_000, 67_000];
    let echo = ping(&expected, &polls).unwrap().unwrap();
    assert_eq!(echo.reflected(), at(5_831));
    assert!((echo.range.0 - 2.0025).abs() < 0.001);
}

#[test]
fn results_that_are_no_range() {
    for (micros, reason) in [(0, NoEcho::Nothing), (37_001, NoEcho::OutOfRange)] {
        let expected = [trigger(), revision(6), result(micros)];
        assert_eq!(ping(&expected, &[66_000]), Some(Err(reason)));
    }
}

#[test]
fn a_ranger_without_an_answer_times_out() {
    let expected = [trigger(), revision(0xFF), revision(0xFF)];
    let outcome = ping(&expected, &[99_999, 100_000]);
    assert_eq!(outcome, Some(Err(NoEcho::NoResponse)));
}

#[test]
fn a_bus_that_fails_ends_the_ping_and_the_next_works() {
    let mut bus = Mock::new(&[
        trigger().with_error(ErrorKind::Bus),
        trigger(),
        revision(6),
        result(1_000).with_error(ErrorKind::ArbitrationLoss),
        trigger(),
        revision(6),
        result(1_000),
    ]);
    let mut ranger = Srf::new(bus.clone(), ADDRESS, Air::ROOM);
    let failed = ranger.trigger(at(0));
    assert_eq!(failed, Err(TriggerError::Device(ErrorKind::Bus)));
    ranger.trigger(at(1)).unwrap();
    assert_eq!(ranger.poll(at(66_000)), Err(ErrorKind::ArbitrationLoss));
    assert_eq!(ranger.poll(at(66_001)), Ok(None));
    assert_eq!(ranger.trigger(at(70_000)), Err(TriggerError::TooSoon));
    ranger.trigger(at(70_001)).unwrap();
    assert_eq!(ranger.trigger(at(141_000)), Err(TriggerError::TooSoon));
    assert!(matches!(ranger.poll(at(141_000)), Ok(Some(Ok(_)))));
    bus.done();
}
