//! Rangers on two pins.

use std::io::ErrorKind;

use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::State::{High, Low};
use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};
use proptest::prelude::*;
use sonarfix_hal::ranger::{
    Air, Captured, Celsius, EchoCapture, NoEcho, Outcome, Polled, PulseError, PulseRanger,
    PulseTiming, Ranger, RangerKind, RangerSettings, TriggerError, UnsupportedKind,
};

use super::{at, span};

type OnPins = PulseRanger<Mock, Polled<Mock>>;

/// A trigger pin that pulses `pings` times.
fn pulses(pings: usize) -> Mock {
    let once = [Transaction::set(High), Transaction::set(Low)];
    Mock::new(&vec![once; pings].concat())
}

/// An echo pin that is read at these levels.
fn levels(levels: &[State]) -> Mock {
    let reads: Vec<_> = levels.iter().map(|&level| Transaction::get(level)).collect();
    Mock::new(&reads)
}

fn hc_sr04(trigger: &Mock, echo: &Mock) -> OnPins {
    let line = Polled::new(echo.clone());
    PulseRanger::new(trigger.clone(), line)
}

/// Triggers at `start` and polls 10 µs later and at each of these times, until there is an
/// outcome.
fn ping(ranger: &mut OnPins, start: u64, polls: &[u64]) -> Option<Outcome> {
    ranger.trigger(at(start)).unwrap();
    let times = [start + 10].into_iter().chain(polls.iter().copied());
    times.into_iter().find_map(|time| ranger.poll(at(time)).unwrap())
}

#[test]
fn an_echo_by_polling() {
    let mut trigger = pulses(1);
    // Read at the trigger, at arming, and at four polls.
    let mut echo = levels(&[Low, Low, Low, High, High, Low]);
    let mut ranger = hc_sr04(&trigger, &echo);
    ranger.trigger(at(0)).unwrap();
    // The trigger pulse is 10 µs at least.
    assert_eq!(ranger.poll(at(9)), Ok(None));
    for time in [10, 100, 500, 3_000] {
        assert_eq!(ranger.poll(at(time)), Ok(None));
    }
    let heard = ranger.poll(at(6_500)).unwrap().unwrap().unwrap();
    assert_eq!((heard.sent, heard.heard), (at(500), at(6_500)));
    assert_eq!(heard.reflected(), at(3_500));
    assert!((heard.range.0 - 1.030).abs() < 0.001);
    // The ping is over: there is no further outcome, and no pin is accessed.
    assert_eq!(ranger.poll(at(7_000)), Ok(None));
    trigger.done();
    echo.done();
}

/// A clock that is set back does not make the ranger wait for the old time.
#[test]
fn a_ranger_pings_a_cycle_after_the_clock_was_set_back() {
    let mut trigger = pulses(2);
    let mut echo = levels(&[Low, Low, High, Low, Low, Low]);
    let mut ranger = hc_sr04(&trigger, &echo);
    let hour = 3_600_000_000;
    assert!(ping(&mut ranger, hour, &[hour + 500, hour + 1_500]).is_some());
    ranger.set_clock(at(1_000));
    assert_eq!(ranger.ready_at(), at(61_000));
    assert_eq!(ranger.trigger(at(60_999)), Err(TriggerError::TooSoon));
    ranger.trigger(at(61_000)).unwrap();
    assert_eq!(ranger.poll(at(61_010)), Ok(None));
    trigger.done();
    echo.done();
}

#[test]
fn bleed_through_is_ignored() {
    let mut trigger = pulses(1);
    let mut echo = levels(&[Low, Low, High, Low, High, Low]);
    let mut ranger = hc_sr04(&trigger, &echo);
    let heard = ping(&mut ranger, 0, &[20, 119, 500, 1_500]);
    assert_eq!(heard.unwrap().unwrap().sent, at(500));
    trigger.done();
    echo.done();
}

#[test]
fn pulses_too_long_for_a_range() {
    for (width, reason) in [
        (23_501, NoEcho::OutOfRange),
        (29_999, NoEcho::OutOfRange),
        (30_000, NoEcho::Nothing),
        (70_000, NoEcho::Nothing),
    ] {
        let mut trigger = pulses(1);
        let mut echo = levels(&[Low, Low, High, Low]);
        let mut ranger = hc_sr04(&trigger, &echo);
        let outcome = ping(&mut ranger, 0, &[500, 500 + width]);
        assert_eq!(outcome, Some(Err(reason)), "{width}");
        trigger.done();
        echo.done();
    }
}

#[test]
fn a_missing_board() {
    let mut trigger = pulses(1);
    let mut echo = levels(&[Low, Low, Low, Low, Low]);
    let mut ranger = hc_sr04(&trigger, &echo);
    let outcome = ping(&mut ranger, 0, &[32_009, 32_010]);
    assert_eq!(outcome, Some(Err(NoEcho::NoResponse)));
    trigger.done();
    echo.done();
}

#[test]
fn a_line_stuck_high_recovers_after_a_timeout() {
    let mut trigger = pulses(3);
    let mut echo = levels(&[
        // First ping: rises, and has not fallen at the timeout.
        Low, Low, High, High, // Still high when the next two are requested, at 60 and 100 ms.
        High, High, // Then it counts as stuck, and a ping is triggered nevertheless.
        High, High, High, High, // It falls at last, and the third ping is valid.
        Low, Low, High, Low,
    ]);
    let mut ranger = hc_sr04(&trigger, &echo);
    assert_eq!(ping(&mut ranger, 0, &[500, 32_010]), Some(Err(NoEcho::Nothing)));
    for soon in [60_010, 100_009] {
        assert_eq!(ranger.trigger(at(soon)), Err(TriggerError::TooSoon));
    }
    let stuck = ping(&mut ranger, 100_010, &[132_020]);
    assert_eq!(stuck, Some(Err(NoEcho::StuckHigh)));
    let freed = ping(&mut ranger, 200_000, &[200_500, 203_500]).unwrap();
    assert_eq!(freed.unwrap().reflected(), at(202_000));
    trigger.done();
    echo.done();
}

#[test]
fn pins_that_fail_end_the_ping_and_the_next_works() {
    let broken = MockError::Io(ErrorKind::NotConnected);
    let mut trigger = Mock::new(&[
        Transaction::set(High).with_error(broken.clone()),
        Transaction::set(High),
        Transaction::set(Low).with_error(broken.clone()),
        Transaction::set(High),
        Transaction::set(Low),
    ]);
    let mut echo = Mock::new(&[
        Transaction::get(Low).with_error(broken.clone()),
        Transaction::get(Low),
        Transaction::get(Low),
        Transaction::get(Low), // armed
        Transaction::get(Low),
        Transaction::get(Low), // armed
        Transaction::get(Low).with_error(broken.clone()),
    ]);
    let mut ranger = hc_sr04(&trigger, &echo);
    let on_echo = || PulseError::Echo(broken.clone());
    let on_trigger = || PulseError::Trigger(broken.clone());
    // Reading the line, then raising the trigger: no ping was started, so no cycle to wait for.
    assert_eq!(ranger.trigger(at(0)), Err(TriggerError::Device(on_echo())));
    assert_eq!(ranger.trigger(at(1)), Err(TriggerError::Device(on_trigger())));
    // Lowering it.
    ranger.trigger(at(2)).unwrap();
    assert_eq!(ranger.poll(at(12)), Err(on_trigger()));
    assert_eq!(ranger.poll(at(13)), Ok(None));
    // Listening.
    ranger.trigger(at(60_012)).unwrap();
    assert_eq!(ranger.poll(at(60_022)), Ok(None));
    assert_eq!(ranger.poll(at(60_500)), Err(on_echo()));
    assert_eq!(ranger.poll(at(60_501)), Ok(None));
    trigger.done();
    echo.done();
}

#[test]
fn a_cancelled_ping_does_not_block_the_next() {
    let mut trigger = Mock::new(&[Transaction::set(High), Transaction::set(High)]);
    let capture = EchoCapture::new();
    let line = Captured::new(&capture);
    let mut ranger = PulseRanger::new(trigger.clone(), line);
    ranger.trigger(at(0)).unwrap();
    assert_eq!(ranger.trigger(at(59_999)), Err(TriggerError::TooSoon));
    ranger.trigger(at(60_000)).unwrap();
    trigger.done();
}

#[test]
fn an_lv_maxsonar_by_its_pulse_width() {
    let mut trigger = pulses(1);
    let capture = EchoCapture::new();
    let air = Air::at(Celsius(22.5)).unwrap();
    let line = Captured::new(&capture);
    let mut ranger = PulseRanger::new(trigger.clone(), line);
    ranger.configure(&RangerSettings { air, ..RangerSettings::LV_MAXSONAR }).unwrap();
    ranger.trigger(at(0)).unwrap();
    assert_eq!(ranger.poll(at(19)), Ok(None));
    assert_eq!(ranger.poll(at(20)), Ok(None));
    // 90 inches of 147 µs: the example of the datasheet.
    capture.rose(at(900));
    capture.fell(at(900 + 90 * 147));
    let echo = ranger.poll(at(30_000)).unwrap().unwrap().unwrap();
    assert!((echo.range.0 - 90.0 * 0.0254).abs() < 0.006, "{echo:?}");
    trigger.done();
}

proptest! {
    /// Every echo has the timestamp of its reflection, however late the loop polls, and at any state of
    /// the clock.
    #[test]
    fn echoes_are_stamped_to_their_reflection(
        boot in 0_u64..1 << 40,
        latency in 300_u64..5_000,
        flight in 100_u64..=23_500,
        bleed in prop::option::of(0_u64..100),
        polls in prop::collection::vec(10_u64..30_000, 1..40),
    ) {
        let capture = EchoCapture::new();
        let mut trigger = pulses(1);
        let line = Captured::new(&capture);
        let mut ranger = PulseRanger::new(trigger.clone(), line);
        ranger.trigger(at(boot)).unwrap();
        prop_assert_eq!(ranger.poll(at(boot + 10)), Ok(None));
        // The edges, in the order in which they reach the interrupt.
        let sent = boot + 10 + latency;
        let mut edges = vec![(sent, true), (sent + flight, false)];
        if let Some(width) = bleed {
            edges.splice(0..0, [(boot + 11, true), (boot + 11 + width, false)]);
        }
        let mut edges = edges.into_iter().peekable();
        let mut now = boot + 10;
        // The last poll is after all edges, so there must be an echo.
        let polls = polls.into_iter().chain([60_000]);
        let heard = polls.into_iter().find_map(|step| {
            now += step;
            while let Some((time, high)) = edges.next_if(|&(time, _)| time <= now) {
                if high { capture.rose(at(time)) } else { capture.fell(at(time)) }
            }
            ranger.poll(at(now)).unwrap()
        });
        trigger.done();
        let late = latency + flight > PulseTiming::HC_SR04.listen.ticks() - 10;
        prop_assert!(!late, "the case is made so that every echo is in time");
        let echo = heard.unwrap().unwrap();
        prop_assert_eq!(echo.reflected(), at(sent + flight / 2));
        prop_assert!((echo.range.0 - 171.71e-6 * flight as f32).abs() < 1e-5);
    }

    /// Never two pings within the cycle, and never one later than the cycle allows.
    #[test]
    fn pings_keep_their_distance(mut steps in prop::collection::vec(1_u64..25_000, 1..120)) {
        // At the end there is time for three pings.
        steps.extend([20_000; 9]);
        let mut now = 0;
        let mut trigger = Mock::new(&vec![Transaction::set(High); steps.len()]);
        let capture = EchoCapture::new();
        let line = Captured::new(&capture);
        let mut ranger = PulseRanger::new(trigger.clone(), line);
        let (mut last, mut pings) = (None, 0);
        let count = steps.len() as u64;
        for step in steps {
            now += step;
            let is_due = last.is_none_or(|last| now - last >= 60_000);
            prop_assert_eq!(ranger.ready_at() <= at(now), is_due);
            match ranger.trigger(at(now)) {
                Ok(()) => {
                    prop_assert!(is_due, "{last:?} and {now}");
                    (last, pings) = (Some(now), pings + 1);
                }
                Err(error) => {
                    prop_assert_eq!(error, TriggerError::TooSoon);
                    prop_assert!(!is_due);
                }
            }
        }
        // A ping is at most a cycle and a step after the previous one.
        prop_assert!(pings >= 3 && pings >= now / 85_000);
        // The mock has one expectation per step; only one per ping was used.
        prop_assert_eq!(trigger.by_ref().count() as u64 + pings, count);
        trigger.done();
    }
}

#[test]
fn timings_are_consistent() {
    for settings in [RangerSettings::HC_SR04, RangerSettings::LV_MAXSONAR] {
        let RangerKind::Pulse(timing) = settings.kind else { panic!("{settings:?}") };
        assert!(timing.blanking < timing.longest && timing.longest <= timing.silence);
        assert!(timing.silence < timing.listen && timing.listen < settings.cycle);
        assert!(settings.cycle < timing.stuck && timing.trigger > span(0));
    }
}

/// Settings of another kind of ranger are refused; those of this kind change every time.
#[test]
fn a_ranger_takes_the_settings_of_its_kind() {
    let mut trigger = pulses(1);
    let capture = EchoCapture::new();
    let mut ranger = PulseRanger::new(trigger.clone(), Captured::new(&capture));
    for kind in [RangerKind::Srf { address: 0x70 }, RangerKind::Custom] {
        let other = RangerSettings { kind, ..RangerSettings::HC_SR04 };
        assert_eq!(ranger.configure(&other), Err(UnsupportedKind));
    }
    assert_eq!(*ranger.timing(), PulseTiming::HC_SR04);
    let slow = RangerSettings { cycle: span(90_000), ..RangerSettings::LV_MAXSONAR };
    ranger.configure(&slow).unwrap();
    assert_eq!(*ranger.timing(), PulseTiming::LV_MAXSONAR);
    ranger.trigger(at(0)).unwrap();
    let _ = ranger.poll(at(20)).unwrap();
    assert_eq!(ranger.ready_at(), at(90_020));
    trigger.done();
}
