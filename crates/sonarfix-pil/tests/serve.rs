//! The microcontroller's program, with valid and invalid requests.
#![cfg(test)]
#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some milliseconds")]

use std::collections::VecDeque;
use std::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use sonarfix::config::{Config, ServoTiming};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::RangerKind;
use sonarfix_pil::Unmetered;
use sonarfix_pil::{
    Answer, Begin, Counted, GyroSignal, Line, LineError, Load, Request, RequestError, Sensors,
    SessionKind, line, serve,
};

/// A stream that delivers prepared bytes, then ends.
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
        // One byte at a time, like a UART.
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

fn begin(kind: SessionKind) -> Begin {
    Begin {
        at: Instant::from_ticks(0),
        start: Some(Start {
            pose: Pose::new(1.0, 1.0, Radians(0.0)),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.01),
        }),
        config: config(),
        kind,
        load: Load::Quiet,
    }
}

fn config() -> RobotConfig {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.rangers.first.servo = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    let config = RobotConfig::with_common_parts(localizer);
    RobotConfig { left_wheel: config.left_wheel.mirrored(), ..config }
}

/// Sends the requests and returns the answers.
fn asked(requests: &[Request]) -> Vec<Answer> {
    let mut pc = Line(Wire::default());
    for request in requests {
        let mut space = vec![0; 4_096];
        pc.send_request(line::encode(request, &mut space).unwrap()).unwrap();
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
    while let Ok((answer, 0)) = pc.receive_reply(&mut space) {
        answers.push(line::decode_answer(answer).unwrap());
    }
    answers
}

fn sensors(millis: u64, ticks: i32) -> Sensors {
    let counted =
        |ticks: i32| Counted { ticks: ticks.cast_unsigned(), illegal: 0, has_failed: false };
    Sensors {
        at: Instant::from_ticks(millis * 1_000),
        right: counted(ticks),
        left: counted(-ticks),
        echoes: Default::default(),
        gyro: GyroSignal::default(),
    }
}

#[test]
fn a_localizer_is_driven_by_messages() {
    let map = map();
    let answers = asked(&[
        Request::Begin(begin(SessionKind::Localizer), &map),
        Request::Odometry(Instant::from_ticks(100_000), WheelTravel::new(0.02, 0.02), None),
        Request::Aim,
        Request::Fix(Some(Metres(1.0))),
        Request::SkipPing,
        Request::End,
    ]);
    let [
        Answer::Started(_),
        Answer::Odometry(Ok(()), snapshot),
        Answer::Aim(Ok(_)),
        Answer::Fix(_, after),
        Answer::Skipped(_),
        Answer::Ended(0),
    ] = answers[..]
    else {
        panic!("{answers:?}");
    };
    assert!((snapshot.state.x.0 - 1.02).abs() < 1e-6);
    assert!(
        after.covariance[0] < snapshot.covariance[0]
            || after.covariance[7] < snapshot.covariance[7]
    );
}

/// The loop samples the encoders, aims, triggers a ping, and processes the echo of the given edges.
#[test]
fn a_loop_drives_its_devices() {
    let map = map();
    let mut polls: Vec<_> =
        (0..=1_600).map(|t| sensors(t, i32::try_from(t / 2).unwrap())).collect();
    let fallen = |answers: &[Answer]| {
        answers.iter().position(
            |answer| matches!(answer, Answer::Polled { actuators, .. } if actuators.rangers[0].has_fallen),
        )
    };
    let ask = |polls: &[Sensors]| {
        let mut begin = begin(SessionKind::Loop);
        // Only the wall ahead is in reach of the servo.
        begin.config.localizer.rangers.first.servo =
            (Radians::from_degrees(-45.0), Radians::from_degrees(45.0));
        let begin = Request::Begin(begin, &map);
        let polls = polls.iter().copied().map(Request::Poll);
        asked(&std::iter::once(begin).chain(polls).collect::<Vec<_>>())
    };
    let pinged = fallen(&ask(&polls)).expect("it pings");
    // The wall ahead is 3 m away at the start.
    let sent = polls[pinged].at + Duration::from_ticks(500);
    let rolled = f64::from(polls[pinged].right.ticks) * 0.065 * std::f64::consts::PI / 1_496.6;
    let flight = (2.0 * (3.0 - rolled) / 343.2 * 1e6) as u64;
    polls[pinged + 1].echoes[0].rose = Some(sent);
    polls[pinged + 18].echoes[0].fell = Some(sent + Duration::from_ticks(flight));
    let answers = ask(&polls);
    assert_eq!(answers.len(), polls.len() + 1);
    let snapshots: Vec<_> = answers
        .iter()
        .filter_map(|answer| match answer {
            Answer::Polled { snapshot, .. } => *snapshot,
            _ => None,
        })
        .collect();
    let (first, last) = (snapshots.first().unwrap(), snapshots.last().unwrap());
    assert!(last.state.x > first.state.x + Metres(0.1), "it has rolled: {last:?}");
    let looked = |snapshot: &sonarfix_pil::Snapshot| snapshot.health.accepted_in_a_row > 0;
    assert!(snapshots.iter().any(looked), "a range was taken");
    // The wall is ahead, where the servo also points at the start.
    let duty = |answer: &Answer| match answer {
        Answer::Started(actuators) | Answer::Polled { actuators, .. } => actuators.rangers[0].duty,
        _ => None,
    };
    let half_way = u16::try_from(u32::from(u16::MAX) * 1_500 / 20_000).unwrap();
    let duty = answers.iter().rev().find_map(duty).expect("the servo has a duty");
    assert!(duty.abs_diff(half_way) < 3, "{duty}");
}

#[test]
fn an_unsupported_session_is_refused_and_the_next_begins() {
    let map = map();
    let mut damaged = map.clone();
    damaged[40] ^= 1;
    let mut other = begin(SessionKind::Loop);
    other.config.rangers.first.kind = RangerKind::Custom;
    let answers = asked(&[
        Request::Aim,
        Request::Begin(begin(SessionKind::Localizer), &damaged),
        Request::Begin(other, &map),
        Request::Begin(begin(SessionKind::Localizer), &map),
        Request::Fix(None),
        Request::Poll(sensors(1, 0)),
        Request::End,
        Request::Begin(begin(SessionKind::Loop), &map),
        Request::Aim,
        Request::End,
    ]);
    let refused = |answer: &Answer| match answer {
        Answer::Refused(refusal) => Some(*refusal),
        _ => None,
    };
    let expected = [
        Some(RequestError::OutOfPlace),
        Some(RequestError::Map),
        Some(RequestError::Board),
        None,
        Some(RequestError::OutOfPlace),
        Some(RequestError::OutOfPlace),
        None,
        None,
        Some(RequestError::OutOfPlace),
        None,
    ];
    assert_eq!(answers.iter().map(refused).collect::<Vec<_>>(), expected);
}

/// A closed line, or bytes that are not a message, end the program without an answer.
#[test]
fn a_broken_connection_ends_the_session() {
    let mut pc = Line(Wire::default());
    let mut space = vec![0; 4_096];
    let map = map();
    let request = Request::Begin(begin(SessionKind::Localizer), &map);
    pc.send_request(line::encode(&request, &mut space).unwrap()).unwrap();
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
