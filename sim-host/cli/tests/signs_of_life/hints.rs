//! The hints of each device.

use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_hal::ranger::{Echo, NoEcho, Outcome};
use sonarfix_link::message::{ImageStatus, ResetCause, ServoReading};
use sonarfix_link::{Hello, ReceiverCounters};
use sonarfix_monitor::signs::hints::{
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

fn says(hint: Hint, state: State, part: &str) {
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
        says(of(&[0, 0]), State::Try, "roll the robot forwards by hand");
        says(of(&[40, 10]), State::Try, "further forwards");
        says(of(&[60, 60]), State::Try, "now roll it backwards");
        says(of(&[60, 60, -120]), State::Good, "both directions");
        // Swapped channels, which rolling to and fro does not hide.
        says(of(&[-60, -60]), State::Wrong, "swap A and B");
        says(of(&[-120, 240]), State::Wrong, "swap A and B");
    }
}

#[test]
fn an_encoder_with_a_defect_is_wrong() {
    let to_and_fro = counted(2e-4, &[1, -1, 1, -1, 1, -1]);
    says(of_encoder(&to_and_fro), State::Wrong, "only one of A and B");
    let noisy = Counted { illegal: 20, ..counted(2e-4, &[120, -120]) };
    says(of_encoder(&noisy), State::Wrong, "pull-ups");
    let dead = Counted { is_readable: false, ..counted(2e-4, &[120, -120]) };
    says(of_encoder(&dead), State::Wrong, "does not run");
    // Without a configuration any 50 edges are a step.
    says(of_encoder(&counted(0.0, &[49])), State::Try, "further");
    says(of_encoder(&counted(0.0, &[50, -50])), State::Good, "both directions");
}

#[test]
fn a_sonar_is_judged_by_its_last_ping_and_by_whether_it_ever_had_an_echo() {
    let at = Instant::from_ticks;
    let echo = Ok(Echo { sent: at(1_000), heard: at(6_000), range: Metres(0.858) });
    let after = |pings: &[Outcome]| {
        pings.iter().fold(Heard::default(), |heard, &ping| heard.then(Some(ping)))
    };
    says(of_sonar(&Heard::default()), State::Try, "wait");
    says(of_sonar(&after(&[echo])), State::Good, "tape");
    assert_eq!(after(&[echo]).to_string(), "echo after 5000 µs: 0.858 m");
    let stuck = Err(NoEcho::StuckHigh);
    says(of_sonar(&after(&[echo, stuck])), State::Wrong, "no divider?");
    let mute = Err(NoEcho::NoResponse);
    says(of_sonar(&after(&[mute])), State::Wrong, "5 V and ground");
    says(of_sonar(&after(&[echo, mute])), State::Wrong, "loose wire");
    let nothing = Err(NoEcho::Nothing);
    says(of_sonar(&after(&[nothing])), State::Try, "book");
    says(of_sonar(&after(&[nothing; 50])), State::Wrong, "no echo ever");
    says(of_sonar(&after(&[echo, nothing])), State::Good, "no wall");
    says(of_sonar(&after(&[Err(NoEcho::Failed)])), State::Wrong, "driver");
}

#[test]
fn a_servo_must_be_looked_at() {
    let pulses = |degrees| {
        let reading = ServoReading { bearing: Radians::from_degrees(degrees), micros: 1_500.0 };
        Servo::Commanded(reading)
    };
    says(of_servo(Servo::Unread, None), State::Try, "wait");
    says(of_servo(pulses(0.0), None), State::Try, "ahead");
    says(of_servo(pulses(-90.0), None), State::Try, "to the right");
    says(of_servo(pulses(90.0), None), State::Try, "to the left");
    says(of_servo(Servo::Failing, Some(ImageStatus::Valid(1))), State::Wrong, "PWM");
    says(of_servo(Servo::Failing, Some(ImageStatus::Missing)), State::Wrong, "configuration");
}

#[test]
fn a_restart_shows_the_supply() {
    let of = |reset, restarts| of_supply(Supply { reset, restarts });
    says(of(None, 0), State::Try, "wait");
    says(of(Some(ResetCause::PowerOn), 0), State::Good, "no restart");
    says(of(Some(ResetCause::PowerOn), 1), State::Wrong, "470 µF");
    says(of(Some(ResetCause::BrownOut), 0), State::Wrong, "470 µF");
    says(of(Some(ResetCause::Watchdog), 0), State::Wrong, "own code");
    says(of(Some(ResetCause::Pin), 2), State::Wrong, "reset pin");
}

#[test]
fn a_board_is_judged_by_its_frames_and_images() {
    let valid = ImageStatus::Valid(1);
    let hello = |map, configuration| {
        let hello = Hello { firmware: [0; 3], map, configuration, reset: ResetCause::PowerOn };
        of_board(&Board { hello: Some(hello), counters: ReceiverCounters::default() })
    };
    says(hello(valid, valid), State::Good, "runs");
    says(hello(ImageStatus::Corrupt, valid), State::Wrong, "map.bin");
    says(hello(valid, ImageStatus::Missing), State::Wrong, "config.bin");
    let without = |counters| of_board(&Board { hello: None, counters });
    let none = ReceiverCounters::default();
    says(without(none), State::Wrong, "swap TX and RX");
    says(without(ReceiverCounters { frames: 1, ..none }), State::Try, "10 s");
    says(without(ReceiverCounters { foreign: 1, ..none }), State::Wrong, "version");
    says(without(ReceiverCounters { corrupt: 9, ..none }), State::Wrong, "baud");
}
