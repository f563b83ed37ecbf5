//! The terminal of `sonarfix monitor`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::path::Path;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use sonarfix::aim::{Aim, Reason};
use sonarfix::config::{Config, RangerId};
use sonarfix::filter::ekf::{EkfError, StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians, SquareMetres};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Refusal};
use sonarfix::map::WallId;
use sonarfix_hal::ranger::NoEcho;
use sonarfix_hal::robot::{EncoderFaults, Faults};
use sonarfix_link::message::{
    FlashStatus, ImageStatus, LoopStatus, Odometry, RankedHypothesis, ResetCause, SearchAnswer,
    SearchStatus,
};
use sonarfix_link::{Hello, Ping, ReceiverCounters, Reporter, Sender, Telemetry, frame};
use sonarfix_map::{CLASSROOM, Fidelity, Scenario};
use sonarfix_monitor::teleoperation::{Direction, Teleoperation};
use sonarfix_monitor::terminal::{History, Screen};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick, Trace};
use sonarfix_telemetry::Monitor;
use sonarfix_telemetry::hints::hints;
use sonarfix_telemetry::view;

/// The telemetry of a simulated robot, received.
#[derive(Default)]
struct Received {
    reporter: Option<Reporter>,
    sender: Sender<Telemetry>,
    monitor: Monitor,
    history: History,
}

impl Received {
    fn send(&mut self, telemetry: &Telemetry) {
        let mut buffer = frame::EMPTY;
        for &byte in self.sender.frame(telemetry, &mut buffer) {
            if let Some(received) = self.monitor.push(byte) {
                self.history.take(&received);
            }
        }
    }
}

impl Recorder for Received {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}
    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn began(&mut self, localizer: &sonarfix::localizer::Localizer) {
        let (reporter, began) = Reporter::begin(localizer);
        self.reporter = Some(reporter);
        self.send(&began);
    }

    fn polled(
        &mut self,
        report: &sonarfix_hal::robot::Report,
        localizer: &sonarfix::localizer::Localizer,
    ) {
        let mut reporter = self.reporter.unwrap();
        reporter.report(report, localizer, &mut |telemetry: &Telemetry| self.send(telemetry));
        self.reporter = Some(reporter);
    }
}

/// What a terminal of this size shows of a run of `classroom`, or before anything was received.
fn shown(received: &Received, trace: &Trace, width: u16, height: u16) -> String {
    shown_with(received, trace, None, (width, height))
}

fn shown_with(
    received: &Received,
    trace: &Trace,
    teleoperation: Option<&Teleoperation>,
    (width, height): (u16, u16),
) -> String {
    let names: Vec<_> = trace.walls.iter().map(|wall| wall.name.clone()).collect();
    let screen = Screen {
        monitor: &received.monitor,
        history: &received.history,
        walls: &trace.walls,
        names: &names,
        recording: Some("run.csv"),
        notice: "start: done",
        teleoperation,
    };
    // Made for another size, and resized.
    let mut terminal = Terminal::new(TestBackend::new(width + 7, height + 3)).unwrap();
    terminal.draw(|frame| screen.draw(frame)).unwrap();
    terminal.backend_mut().resize(width, height);
    terminal.draw(|frame| screen.draw(frame)).unwrap();
    terminal.backend().to_string()
}

/// The words of a screen, without borders and line ends.
fn words(screen: &str) -> String {
    let lines = screen.lines().map(|line| line.trim_matches('"').trim_matches('│'));
    lines.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// A robot that has lost its pose, whose last ping was refused for the longest reason, with these faults.
fn troubled(faults: Faults) -> (Received, Trace) {
    let mut received = Received::default();
    received.send(&Telemetry::Hello(Hello {
        firmware: [10, 20, 30],
        map: ImageStatus::Valid(0x8f3a_5c11),
        configuration: ImageStatus::Version(17),
        reset: ResetCause::Unknown,
    }));
    let at = Instant::from_ticks(123_456_789_000);
    let state = StateEstimate { x: Metres(-1234.567), y: Metres(-234.567), ..Default::default() };
    let (_, began) = Reporter::resume(at, state, StandardDeviations::default());
    let Telemetry::Initialized(mut estimate) = began else { unreachable!("{began:?}") };
    received.send(&began);
    estimate.health.verdict = Verdict::Lost;
    estimate.health.silent_in_a_row = 12_345;
    estimate.health.gated_in_a_row = 12_345;
    received.send(&Telemetry::Estimate(estimate));
    let why = Reason {
        gain: SquareMetres(0.0),
        success: 1.0,
        time: Duration::from_ticks(0),
        candidates: 1,
    };
    let (wall, bearing, range) = (WallId(0), Radians(-2.0), Metres(2.0));
    received.send(&Telemetry::Ping(Ping {
        at,
        aim: Aim { wall, bearing, range, why, ranger: RangerId(0) },
        outcome: Err(NoEcho::Mistimed),
        fix: Fix::Refused(Refusal::Filter(EkfError::JacobianTooLarge)),
    }));
    received.send(&Telemetry::LoopStatus(LoopStatus {
        at,
        running: true,
        faults,
        worst_poll: Duration::from_ticks(123_456),
        commands: ReceiverCounters::default(),
        flash: FlashStatus { writes: 100, failures: 12_345 },
        noise_factor: 1.0,
    }));
    let name = "behind the blackboard, left of the door".to_owned();
    let wall = sonarfix_sim::trace::Wall { name, from: [0.0, 0.0], to: [4.0, 0.0] };
    (received, Trace { walls: vec![wall], ..Trace::default() })
}

fn encoder(errors: u32, illegal: u32) -> EncoderFaults {
    EncoderFaults { errors, illegal }
}

#[test]
fn the_terminal_names_walls_and_draws_map_and_innovations() {
    let mut scenario = Scenario::parse(CLASSROOM, "scenario.toml", Path::new("")).unwrap();
    scenario.fidelity = Fidelity::Pins;
    let simulation = Simulation::new(scenario);
    let trace = simulation.empty_trace();
    let mut received = Received::default();
    let empty = shown(&received, &trace, 140, 40);
    assert!(empty.contains("no estimate yet") && empty.contains("ping    none yet"), "{empty}");
    simulation.run(0, &mut received).unwrap();

    let wide = shown(&received, &trace, 140, 40);
    for text in ["tracking", "run.csv", "start: done", " map ", " innovations (mm) ", "pose    x "]
    {
        assert!(wide.contains(text), "no {text}:\n{wide}");
    }
    let named = trace.walls.iter().any(|wall| wide.contains(&format!("wall {} at", wall.name)));
    assert!(named, "no wall is named:\n{wide}");
    // Braille: the walls, the path and the robot.
    let dots = wide.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
    assert!(dots > 100, "{dots} characters of the map:\n{wide}");
    let narrow = shown(&received, &trace, 80, 40);
    assert!(narrow.contains("tracking") && narrow.contains(" map "), "{narrow}");
}

/// Pose, verdict, the last ping with its reason, faults, and everything to check are whole on the smallest usual terminal.
#[test]
fn a_terminal_of_80_by_24_has_all_reasons() {
    let faults = Faults { travel: 12_345, servo: 12_345, ..Faults::default() };
    let (received, trace) = troubled(faults);
    let screen = shown(&received, &trace, 80, 24);
    let text = words(&screen);
    let found = hints(&received.monitor);
    assert_eq!(found.len(), 5, "{found:?}");
    let refusal = Refusal::Filter(EkfError::JacobianTooLarge).to_string();
    let more = [
        "✖ lost",
        "5 to check",
        "x -1234.567 m",
        "wall behind the blackboard, left of the door at -114.6°",
        &NoEcho::Mistimed.to_string(),
        &format!("refused, {refusal}"),
        "faults: servo 12345, travel 12345",
        "12345 writes failed, what changes is lost at power off",
        "recording run.csv start: done",
    ];
    for part in found.iter().map(String::as_str).chain(more) {
        assert!(text.contains(part), "no {part}:\n{screen}");
    }
}

/// With more to check than there is room, the most important is there, and a line states that there is more.
#[test]
fn what_matters_least_is_left_out_first() {
    let every = Faults {
        right: encoder(1, 2),
        left: encoder(3, 4),
        servo: 5,
        ranger: 6,
        travel: 7,
        deadlines: 8,
        clock: 9,
        gyro: 10,
    };
    let (received, trace) = troubled(every);
    let screen = words(&shown(&received, &trace, 80, 24));
    let first = hints(&received.monitor).first().unwrap().clone();
    for part in ["more lines on a larger terminal", "pose x", "health lost", "ping wall", &first] {
        assert!(screen.contains(part), "no {part}:\n{screen}");
    }
    assert!(!screen.contains("cycles in a row"), "{screen}");
    let large = words(&shown(&received, &trace, 80, 70));
    assert!(large.contains("cycles in a row") && !large.contains("larger terminal"), "{large}");
}

#[test]
fn a_terminal_of_80_by_24_has_the_answers_of_the_search() {
    let (mut received, trace) = troubled(Faults::default());
    let at = Instant::from_ticks(0);
    let answer = SearchAnswer::Along(WallId(0));
    received.send(&Telemetry::Search(SearchStatus {
        at,
        mode: Mode::Searching,
        answer,
        pings: 12_345,
        cycles: 123_456,
    }));
    for rank in 0..8 {
        let pose = Pose::new(-1234.5, -1234.5, Radians(-3.0));
        received.send(&Telemetry::Hypothesis(RankedHypothesis {
            at,
            rank,
            pose,
            position_deviation: Metres(123.4),
            heading_deviation: Radians(1.0),
            fit: -12.34,
            explained: 1.0,
        }));
    }
    let screen = words(&shown(&received, &trace, 80, 24));
    let status = view::search(received.monitor.search().unwrap(), &[trace.walls[0].name.clone()]);
    for part in
        [words(&status), "1 x -1234.50 m".to_owned(), "fit -12.34, 100 % explained".to_owned()]
    {
        assert!(screen.contains(&part), "no {part}:\n{screen}");
    }
}

#[test]
fn no_line_is_cut_at_any_width() {
    let (received, trace) = troubled(Faults { servo: 1, ..Faults::default() });
    let names: Vec<_> = trace.walls.iter().map(|wall| wall.name.clone()).collect();
    // A word that is longer than a line is divided.
    let joined = |text: &str| text.split_whitespace().collect::<String>();
    let whole = joined(&view::page(&received.monitor, &names));
    for width in [20, 33, 78, 118] {
        let lines = view::fitted(&received.monitor, &names, width, 500);
        assert!(lines.iter().all(|line| line.chars().count() <= width), "{width}: {lines:?}");
        assert_eq!(joined(&lines.join("\n")), whole, "{width}");
    }
}

/// A robot that is driven is not overlooked, and neither is the key that stops it.
#[test]
fn the_terminal_says_that_a_robot_is_driven_and_how_to_stop_it() {
    let (received, trace) = (Received::default(), Trace::default());
    let mut keys = Teleoperation::default();
    let shown = |keys: Option<&Teleoperation>| shown_with(&received, &trace, keys, (80, 24));
    assert!(!shown(None).contains("arrows"), "a file cannot be driven");
    assert!(shown(Some(&keys)).contains("arrows drive: 0.10 m/s"));
    keys.press(Direction::Left, std::time::Instant::now());
    let driven = shown(Some(&keys));
    assert!(driven.contains("LEFT 45 deg/s  SPACE STOPS"), "{driven}");
    keys.stop();
    assert!(shown(Some(&keys)).contains("STANDS"));
}

/// No size makes it panic.
#[test]
fn a_terminal_may_be_tiny() {
    let (received, trace) = (Received::default(), Trace::default());
    for (width, height) in [(1, 1), (3, 2), (20, 3), (121, 4), (200, 8)] {
        let screen = shown(&received, &trace, width, height);
        assert_eq!(screen.lines().count(), usize::from(height), "{width}×{height}");
    }
}

/// What the telemetry of a robot suggests to check.
fn hints_after(telemetry: &[Telemetry]) -> String {
    let mut received = Received::default();
    for telemetry in telemetry {
        received.send(telemetry);
    }
    hints(&received.monitor).join("\n")
}

fn wheels(number: u32, right_metres: f64, left_metres: f64) -> Telemetry {
    let at = Instant::from_ticks(u64::from(number) * 100_000);
    Telemetry::Odometry(Odometry { at, right_metres, left_metres })
}

#[test]
fn a_wheel_that_does_not_count_is_found() {
    let rolled = |number: u32| f64::from(number) * 0.05;
    let right_dead: Vec<_> = (0..10).map(|n| wheels(n, 0.0, rolled(n))).collect();
    let found = hints_after(&right_dead);
    assert!(found.contains("the right encoder counts nothing"), "{found}");
    let left_dead: Vec<_> = (0..10).map(|n| wheels(n, -rolled(n), 0.0)).collect();
    let found = hints_after(&left_dead);
    assert!(found.contains("the left encoder counts nothing"), "{found}");
    // Turning about one wheel for a short time, then driving.
    let good: Vec<_> =
        (0..40).map(|n| wheels(n, rolled(n), if n < 5 { 0.0 } else { rolled(n - 5) })).collect();
    assert_eq!(hints_after(&good), "");
}

#[test]
fn a_robot_without_images_and_with_a_silent_sonar_is_found() {
    let hello = Telemetry::Hello(Hello {
        firmware: [1, 2, 3],
        map: ImageStatus::Missing,
        configuration: ImageStatus::Corrupt,
        reset: ResetCause::PowerOn,
    });
    let found = hints_after(&[hello]);
    assert!(found.contains("no map") && found.contains("a damaged configuration"), "{found}");

    let at = Instant::from_ticks(0);
    let (_, began) = Reporter::resume(at, StateEstimate::default(), StandardDeviations::default());
    let Telemetry::Initialized(mut estimate) = began else { unreachable!("{began:?}") };
    assert_eq!(hints_after(&[Telemetry::Estimate(estimate)]), "");
    estimate.health.silent_in_a_row = 10;
    estimate.health.gated_in_a_row = 10;
    let found = hints_after(&[Telemetry::Estimate(estimate)]);
    assert!(found.contains("no usable range for 10 pings"), "{found}");
    assert!(found.contains("10 ranges in a row do not fit the map"), "{found}");
}

/// Without a robot file only the noise is judged, with it the wheels as well.
#[test]
fn a_robot_that_differs_from_its_file_is_found() {
    let at = Instant::from_ticks(0);
    let state = StateEstimate { scale_right: 0.05, scale_left: -0.05, ..Default::default() };
    let (_, began) = Reporter::resume(at, state, StandardDeviations::default());
    let Telemetry::Initialized(mut estimate) = began else { unreachable!("{began:?}") };
    let prior = Config::for_track_width(Metres(0.16)).prior;
    for (nis, without_file, with_file) in
        [(1.0, "", "WheelsOutsidePrior"), (2.5, "NoiseTooSmall", "NoiseTooSmall")]
    {
        estimate.health.nis = nis;
        for (monitor, named) in
            [(Monitor::default(), without_file), (Monitor::of(prior), with_file)]
        {
            let mut received = Received { monitor, ..Received::default() };
            received.send(&Telemetry::Estimate(estimate));
            let found = hints(&received.monitor).join("\n");
            assert_eq!(found.is_empty(), named.is_empty(), "{found}");
            assert!(found.contains(named), "{found}");
        }
    }
}
