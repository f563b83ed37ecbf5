//! The software decoder on mocked pins.

use std::io::ErrorKind;

use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::State::{High, Low};
use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};
use sonarfix_hal::encoder::{Counter, Quadrature, TickCount};

fn levels(levels: &[State]) -> Mock {
    let reads: Vec<_> = levels.iter().map(|&level| Transaction::get(level)).collect();
    Mock::new(&reads)
}

#[test]
fn one_period_forwards_then_a_step_back_then_an_illegal_one() {
    let mut a = levels(&[Low, High, High, Low, Low, Low, High]);
    let mut b = levels(&[Low, Low, High, High, Low, High, Low]);
    let count = TickCount::new();
    let mut decoder = Quadrature::new(a.clone(), b.clone(), &count).unwrap();
    let mut counts = vec![];
    for _ in 0..6 {
        decoder.update().unwrap();
        counts.push(((&count).count().unwrap(), (&count).illegal()));
    }
    assert_eq!(counts, [(1, 0), (2, 0), (3, 0), (4, 0), (3, 0), (3, 1)]);
    a.done();
    b.done();
}

#[test]
fn a_pin_that_fails_loses_no_tick() {
    let error = MockError::Io(ErrorKind::NotConnected);
    let mut a = Mock::new(&[Transaction::get(Low), Transaction::get(High), Transaction::get(High)]);
    let mut b = Mock::new(&[
        Transaction::get(Low),
        Transaction::get(Low).with_error(error.clone()),
        Transaction::get(Low),
    ]);
    let count = TickCount::new();
    let mut decoder = Quadrature::new(a.clone(), b.clone(), &count).unwrap();
    assert_eq!(decoder.update(), Err(error));
    assert_eq!((&count).count(), Ok(0));
    decoder.update().unwrap();
    assert_eq!((&count).count(), Ok(1));
    a.done();
    b.done();
}
