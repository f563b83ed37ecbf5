//! The hints of each device.

use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix_hal::ranger::{Echo, NoEcho, Outcome};
use sonarfix_link::message::{ImageStatus, ResetCause, ServoReading};
use sonarfix_link::{Hello, ReceiverCounters};
use sonarfix_telemetry::signs::hints::{
    Board, Counted, Heard, Hint, Servo, State, Supply, of_board, of_encoder, of_servo, of_sonar,
    of_supply,
};

/// Readings of a wheel of 0.2 mm per edge, by the edges between them.
fn counted(metres_per_edge: f32, moves: &[i64]) -> Counted {
    let first = Counted { is_readable: true, metres_per_edge, ..Counted::default() };
    let (mut position, mut lowest, mut highest) = (0, 0, 0);
    moves.iter().fold(first, |counted, &moved| {
        position += moved;
        (lowest, highest) = (position.min(lowest), position.max(highest));
        counted.then(moved, highest - lowest)
    })
}

fn assert_hint(hint: Hint, state: State, part: &str) {
    assert!(hint.state == state && hint.text.contains(part), "{part}: {hint:?}");
}

#[test]
fn an_encoder_is_good_when_it_has_counted_both_ways() {
    for sign in [1, -1] {
        let wheel = 2e-4 * if sign > 0 { 1.0 } else { -1.0 };
        let of = |moves: &[i64]| {
            let moves: Vec<i64> = moves.iter().map(|moved| sign * moved).collect();
            of_encoder(&counted(wheel, &moves))
        };
        assert_hint(of(&[0, 0]), State::Try, "roll the robot forwards by hand");
        assert_hint(of(&[40, 10]), State::Try, "further forwards");
        assert_hint(of(&[60, 60]), State::Try, "now roll it backwards");
        assert_hint(of(&[60, 60, -120]), State::Good, "both directions");
        // Swapped channels, which rolling to and fro does not hide.
        assert_hint(of(&[-60, -60]), State::Wrong, "swap A and B");
        assert_hint(of(&[-120, 240]), State::Wrong, "swap A and B");
    }
}

#[test]
fn an_encoder_with_a_defect_is_wrong() {
    let to_and_fro = counted(2e-4, &[1, -1, 1, -1, 1, -1]);
    assert_hint(of_encoder(&to_and_fro), State::Wrong, "only one of A and B");
    let noisy = Counted { illegal: 20, ..counted(2e-4, &[120, -120]) };
    assert_hint(of_encoder(&noisy), State::Wrong, "pull-ups");
    let dead = Counted { is_readable: false, ..counted(2e-4, &[120, -120]) };
    assert_hint(of_encoder(&dead), State::Wrong, "does not run");
    // Without a configuration any 50 edges are a step.
    assert_hint(of_encoder(&counted(0.0, &[49])), State::Try, "further");
    assert_hint(of_encoder(&counted(0.0, &[50, -50])), State::Good, "both directions");
}

#[test]
fn a_sonar_is_judged_by_its_last_ping_and_by_whether_it_ever_had_an_echo() {
    let at = Instant::from_ticks;
    let echo = Ok(Echo { sent: at(1_000), heard: at(6_000), range: Metres(0.858) });
    let after = |pings: &[Outcome]| {
        pings.iter().fold(Heard::default(), |heard, &ping| heard.then(Some(ping)))
    };
    assert_hint(of_sonar(&Heard::default()), State::Try, "wait");
    assert_hint(of_sonar(&after(&[echo])), State::Good, "tape");
    assert_eq!(after(&[echo]).to_string(), "echo after 5000 µs: 0.858 m");
    let stuck = Err(NoEcho::StuckHigh);
    assert_hint(of_sonar(&after(&[echo, stuck])), State::Wrong, "no divider?");
    let mute = Err(NoEcho::NoResponse);
    assert_hint(of_sonar(&after(&[mute])), State::Wrong, "5 V and ground");
    assert_hint(of_sonar(&after(&[echo, mute])), State::Wrong, "loose wire");
    let nothing = Err(NoEcho::Nothing);
    assert_hint(of_sonar(&after(&[nothing])), State::Try, "book");
    assert_hint(of_sonar(&after(&[nothing; 50])), State::Wrong, "no echo ever");
    assert_hint(of_sonar(&after(&[echo, nothing])), State::Good, "no wall");
    assert_hint(of_sonar(&after(&[Err(NoEcho::Failed)])), State::Wrong, "driver");
}

#[test]
fn a_servo_must_be_looked_at() {
    let pulses = |degrees| {
        let reading = ServoReading { bearing: Radians::from_degrees(degrees), micros: 1_500.0 };
        Servo::Commanded(reading)
    };
    assert_hint(of_servo(Servo::Unread, None), State::Try, "wait");
    assert_hint(of_servo(pulses(0.0), None), State::Try, "ahead");
    assert_hint(of_servo(pulses(-90.0), None), State::Try, "to the right");
    assert_hint(of_servo(pulses(90.0), None), State::Try, "to the left");
    assert_hint(of_servo(Servo::Failing, Some(ImageStatus::Valid(1))), State::Wrong, "PWM");
    assert_hint(
        of_servo(Servo::Failing, Some(ImageStatus::Missing)),
        State::Wrong,
        "configuration",
    );
}

#[test]
fn a_restart_shows_the_supply() {
    let of = |reset, restarts| of_supply(Supply { reset, restarts });
    assert_hint(of(None, 0), State::Try, "wait");
    assert_hint(of(Some(ResetCause::PowerOn), 0), State::Good, "no restart");
    assert_hint(of(Some(ResetCause::PowerOn), 1), State::Wrong, "470 µF");
    assert_hint(of(Some(ResetCause::BrownOut), 0), State::Wrong, "470 µF");
    assert_hint(of(Some(ResetCause::Watchdog), 0), State::Wrong, "own code");
    assert_hint(of(Some(ResetCause::Pin), 2), State::Wrong, "reset pin");
}

#[test]
fn a_board_is_judged_by_its_frames_and_images() {
    let valid = ImageStatus::Valid(1);
    let hello = |map, configuration| {
        let hello = Hello { firmware: [0; 3], map, configuration, reset: ResetCause::PowerOn };
        of_board(&Board { hello: Some(hello), counters: ReceiverCounters::default() })
    };
    assert_hint(hello(valid, valid), State::Good, "runs");
    assert_hint(hello(ImageStatus::Corrupt, valid), State::Wrong, "map.bin");
    assert_hint(hello(valid, ImageStatus::Missing), State::Wrong, "config.bin");
    let without = |counters| of_board(&Board { hello: None, counters });
    let none = ReceiverCounters::default();
    assert_hint(without(none), State::Wrong, "swap TX and RX");
    assert_hint(without(ReceiverCounters { frames: 1, ..none }), State::Try, "10 s");
    assert_hint(without(ReceiverCounters { foreign: 1, ..none }), State::Wrong, "version");
    assert_hint(without(ReceiverCounters { corrupt: 9, ..none }), State::Wrong, "baud");
}
