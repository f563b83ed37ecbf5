//! What a microcontroller's program answers to a PC, whole and broken.
#![cfg(test)]
#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some milliseconds")]

use std::collections::VecDeque;
use std::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use sonarfix::config::Config;
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix::motion::WheelTravel;
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Duration, Instant, Metres, Radians};
use sonarfix_hal::ranger::{Celsius, PulseTiming};
use sonarfix_hal::robot::Settings;
use sonarfix_hal::servo::{MeasuredPulse, Pace};
use sonarfix_pil::board::{ServoBuild, Wheel};
use sonarfix_pil::serve::Unmetered;
use sonarfix_pil::{
    Answer, Begin, Board, Counted, Line, LineError, Refusal, Request, Sensors, line, serve,
};

/// A wire that brings what was written beforehand, and ends.
#[derive(Default)]
struct Wire {
    to: VecDeque<u8>,
    from: Vec<u8>,
}

impl ErrorType for Wire {
    type Error = Infallible;
}

impl Read for Wire {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        // One at a time, as a UART does.
        let (Some(space), Some(byte)) = (bytes.first_mut(), self.to.pop_front()) else {
            return Ok(0);
        };
        *space = byte;
        Ok(1)
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.from.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

fn map() -> Vec<u8> {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
    let point = |(x, y): (f32, f32)| Point::new(x, y);
    let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
    sonarfix_map::bake(&corners.windows(2).map(wall).collect::<Vec<_>>()).unwrap()
}

fn begin(board: Option<Board>) -> Begin {
    Begin {
        at: Instant::from_ticks(0),
        start: Start {
            pose: Pose::new(1.0, 1.0, Radians(0.0)),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.01),
        },
        config: Config::for_track_width(Metres(0.16)),
        board,
    }
}

fn board() -> Board {
    let wheel =
        Wheel { diameter: Metres(0.065), ticks_per_revolution: 1_496.6, is_reversed: false };
    let tried = |width, degrees| MeasuredPulse {
        width: Duration::from_ticks(width),
        bearing: Radians::from_degrees(degrees),
    };
    Board {
        right: wheel,
        left: Wheel { is_reversed: true, ..wheel },
        servo: ServoBuild {
            tried: (tried(1_000, -45.0), tried(2_000, 45.0)),
            limits: (Radians::from_degrees(-90.0), Radians::from_degrees(90.0)),
            pace: Pace::SG90,
        },
        sonar: PulseTiming::HC_SR04,
        air: Celsius(20.0),
        settings: Settings::default(),
    }
}

/// Asks all this and takes the answers.
fn asked(requests: &[Request]) -> Vec<Answer> {
    let mut pc = Line(Wire::default());
    for request in requests {
        let mut space = vec![0; 4_096];
        pc.ask(line::bytes(request, &mut space).unwrap()).unwrap();
    }
    answered(pc.0.from)
}

fn answered(bytes: Vec<u8>) -> Vec<Answer> {
    let mut robot = Line(Wire { to: bytes.into(), from: Vec::new() });
    let mut memory = vec![0; 4_096];
    let end = serve(&mut robot, &mut Unmetered, &mut memory);
    assert!(matches!(end, Err(LineError::Closed | LineError::TooLong | LineError::Unreadable)));
    let mut pc = Line(Wire { to: robot.0.from.into(), from: Vec::new() });
    let mut answers = Vec::new();
    let mut space = [0; line::ANSWER_MAX];
    while let Ok((answer, 0)) = pc.replied(&mut space) {
        answers.push(line::answer(answer).unwrap());
    }
    answers
}

fn sensors(millis: u64, ticks: i32) -> Sensors {
    let counted = |ticks: i32| Counted { ticks: ticks.cast_unsigned(), illegal: 0 };
    Sensors {
        at: Instant::from_ticks(millis * 1_000),
        right: counted(ticks),
        left: counted(-ticks),
        rose: None,
        fell: None,
    }
}

#[test]
fn a_localizer_is_asked_step_by_step() {
    let map = map();
    let answers = asked(&[
        Request::Begin(begin(None), &map),
        Request::Odometry(Instant::from_ticks(100_000), WheelTravel::new(0.02, 0.02)),
        Request::Aim,
        Request::Fix(Some(Metres(1.0))),
        Request::Skip,
        Request::End,
    ]);
    let [
        Answer::Began(_),
        Answer::Rolled(Ok(()), belief),
        Answer::Aimed(Ok(_)),
        Answer::Fixed(_, after),
        Answer::Skipped(_),
        Answer::Ended(0),
    ] = answers[..]
    else {
        panic!("{answers:?}");
    };
    assert!((belief.state.x - 1.02).abs() < 1e-6);
    assert!(
        after.covariance[0] < belief.covariance[0] || after.covariance[7] < belief.covariance[7]
    );
}

/// The loop ticks, aims, sends its trigger up and down, and takes the echo whose edges it is told.
#[test]
fn a_loop_drives_its_devices() {
    let map = map();
    let mut polls: Vec<_> =
        (0..=1_600).map(|t| sensors(t, i32::try_from(t / 2).unwrap())).collect();
    let fallen = |answers: &[Answer]| {
        answers.iter().position(
            |answer| matches!(answer, Answer::Polled { actuators, .. } if actuators.has_fallen),
        )
    };
    let ask = |polls: &[Sensors]| {
        let begin = Request::Begin(begin(Some(board())), &map);
        let polls = polls.iter().copied().map(Request::Poll);
        asked(&std::iter::once(begin).chain(polls).collect::<Vec<_>>())
    };
    let pinged = fallen(&ask(&polls)).expect("it pings");
    // The wall ahead is 3 m away at the start, and the sonar a little in front of the wheels.
    let sent = polls[pinged].at + Duration::from_ticks(500);
    let rolled = f64::from(polls[pinged].right.ticks) * 0.065 * std::f64::consts::PI / 1_496.6;
    let flight = (2.0 * (3.0 - rolled) / 343.2 * 1e6) as u64;
    polls[pinged + 1].rose = Some(sent);
    polls[pinged + 18].fell = Some(sent + Duration::from_ticks(flight));
    let answers = ask(&polls);
    assert_eq!(answers.len(), polls.len() + 1);
    let beliefs: Vec<_> = answers
        .iter()
        .filter_map(|answer| match answer {
            Answer::Polled { belief, .. } => *belief,
            _ => None,
        })
        .collect();
    let (first, last) = (beliefs.first().unwrap(), beliefs.last().unwrap());
    assert!(last.state.x > first.state.x + 0.1, "it has rolled: {last:?}");
    let looked = |belief: &sonarfix_pil::Belief| belief.health.accepted_in_a_row > 0;
    assert!(beliefs.iter().any(looked), "a range was taken");
    // Ahead, where it is sent as the robot is switched on, is also where the wall is.
    let duty = |answer: &Answer| match answer {
        Answer::Began(actuators) | Answer::Polled { actuators, .. } => actuators.duty,
        _ => None,
    };
    let half_way = u16::try_from(u32::from(u16::MAX) * 1_500 / 20_000).unwrap();
    let duty = answers.iter().rev().find_map(duty).expect("the servo is told where to point");
    assert!(duty.abs_diff(half_way) < 3, "{duty}");
}

#[test]
fn what_does_not_fit_is_refused_and_the_next_session_begins() {
    let map = map();
    let mut damaged = map.clone();
    damaged[40] ^= 1;
    let bad = Board { air: Celsius(f32::NAN), ..board() };
    let answers = asked(&[
        Request::Aim,
        Request::Begin(begin(None), &damaged),
        Request::Begin(begin(Some(bad)), &map),
        Request::Begin(begin(None), &map),
        Request::Fix(None),
        Request::Poll(sensors(1, 0)),
        Request::End,
        Request::Begin(begin(Some(board())), &map),
        Request::Aim,
        Request::End,
    ]);
    let refused = |answer: &Answer| match answer {
        Answer::Refused(refusal) => Some(*refusal),
        _ => None,
    };
    let expected = [
        Some(Refusal::OutOfPlace),
        Some(Refusal::Map),
        Some(Refusal::Board),
        None,
        Some(Refusal::OutOfPlace),
        Some(Refusal::OutOfPlace),
        None,
        None,
        Some(Refusal::OutOfPlace),
        None,
    ];
    assert_eq!(answers.iter().map(refused).collect::<Vec<_>>(), expected);
}

/// A line that ends, or brings what is no message, ends the program; nothing is answered to it.
#[test]
fn a_broken_line_ends_it() {
    let mut pc = Line(Wire::default());
    let mut space = vec![0; 4_096];
    let map = map();
    let request = Request::Begin(begin(None), &map);
    pc.ask(line::bytes(&request, &mut space).unwrap()).unwrap();
    let whole = pc.0.from;
    assert_eq!(answered(whole.clone()).len(), 1);
    for length in 0..whole.len() {
        assert!(answered(whole[..length].to_vec()).is_empty(), "cut after {length} bytes");
    }
    let mut long = whole.clone();
    long[3] = 0xFF;
    assert!(answered(long).is_empty());
    let mut garbled = whole;
    garbled[4] = 0x7F;
    assert!(answered(garbled).is_empty());
}
