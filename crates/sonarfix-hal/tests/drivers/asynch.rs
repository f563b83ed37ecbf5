//! The asynchronous waits: the same drivers, woken instead of polled.

use core::cell::Cell;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use std::io::ErrorKind;

use embedded_hal_async::delay::DelayNs;
use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::State::{High, Low};
use embedded_hal_mock::eh1::digital::{Edge, Mock, Transaction};
use embedded_hal_mock::eh1::i2c::{Mock as Bus, Transaction as OnBus};
use sonarfix::geometry::units::Instant;
use sonarfix_hal::asynch::{count, measure, ping};
use sonarfix_hal::encoder::{Counter, Quadrature, TickCount};
use sonarfix_hal::ranger::{Air, NoEcho, Polled, PulseRanger, Srf};

use super::{at, span};

/// A clock that a delay advances. The mocked pins are always ready.
struct Timer<'a>(&'a Cell<u64>);

impl DelayNs for Timer<'_> {
    async fn delay_ns(&mut self, nanos: u32) {
        self.0.set(self.0.get() + u64::from(nanos / 1_000));
    }
}

/// Polls a future that is never pending with these mocks.
fn now<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    match future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("nothing here waits"),
    }
}

#[test]
fn a_ping_sleeps_until_an_edge() {
    let mut trigger = Mock::new(&[Transaction::set(High), Transaction::set(Low)]);
    let mut line = Mock::new(&[
        Transaction::get(Low),
        Transaction::get(Low),
        Transaction::wait_for_state(High),
        Transaction::get(High),
        Transaction::wait_for_state(Low),
        Transaction::get(Low),
    ]);
    let echo = Polled::new(line.clone());
    let mut ranger = PulseRanger::new(trigger.clone(), echo);
    let time = Cell::new(0);
    // Every reading of the clock is 700 µs after the previous one.
    let clock = || -> Instant { at(time.replace(time.get() + 700)) };
    let outcome = now(ping(&mut ranger, &clock, &mut Timer(&time)));
    let echo = outcome.unwrap().unwrap();
    assert_eq!(echo.heard - echo.sent, span(700));
    trigger.done();
    line.done();
}

#[test]
fn a_failed_wait_for_a_pin_is_reported() {
    let broken = MockError::Io(ErrorKind::NotConnected);
    let mut trigger = Mock::new(&[Transaction::set(High), Transaction::set(Low)]);
    let mut line = Mock::new(&[
        Transaction::get(Low),
        Transaction::get(Low),
        Transaction::wait_for_state(High).with_error(broken),
    ]);
    let echo = Polled::new(line.clone());
    let mut ranger = PulseRanger::new(trigger.clone(), echo);
    let time = Cell::new(0);
    assert!(now(ping(&mut ranger, &|| at(time.get()), &mut Timer(&time))).is_err());
    trigger.done();
    line.done();
}

#[test]
fn a_ranger_on_a_bus_is_polled_step_by_step() {
    let mut bus = Bus::new(&[
        OnBus::write(0x70, vec![0x00, 0x52]),
        OnBus::write_read(0x70, vec![0x00], vec![6]),
        OnBus::write_read(0x70, vec![0x02], vec![0, 0]),
    ]);
    let mut ranger = Srf::new(bus.clone(), Srf::DEFAULT_ADDRESS, Air::ROOM);
    let time = Cell::new(0);
    let clock = || at(time.get());
    let outcome = now(measure(&mut ranger, &clock, &mut Timer(&time), span(5_000)));
    assert_eq!(outcome, Ok(Err(NoEcho::Nothing)));
    assert_eq!(time.get(), 65_000);
    bus.done();
}

#[test]
fn an_encoder_is_counted_by_its_edges() {
    let broken = MockError::Io(ErrorKind::NotConnected);
    let mut a = Mock::new(&[
        Transaction::get(Low),
        Transaction::wait_for_edge(Edge::Any),
        Transaction::get(High),
        Transaction::wait_for_edge(Edge::Any).with_error(broken.clone()),
    ]);
    let mut b = Mock::new(&[Transaction::get(Low), Transaction::get(Low)]);
    let ticks = TickCount::new();
    let mut decoder = Quadrature::new(a.clone(), b.clone(), &ticks).unwrap();
    assert_eq!(now(count(&mut decoder)).err(), Some(broken));
    assert_eq!((&ticks).count(), Ok(1));
    a.done();
    b.done();
}
