//! The terminal of `sonarfix monitor`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::path::Path;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::Instant;
use sonarfix_link::message::{ImageStatus, Odometry, ResetCause};
use sonarfix_link::{Hello, Reporter, Sender, Telemetry, frame};
use sonarfix_map::{CLASSROOM, Fidelity, Scenario};
use sonarfix_monitor::Monitor;
use sonarfix_monitor::hints::hints;
use sonarfix_monitor::teleoperation::{Direction, Teleoperation};
use sonarfix_monitor::terminal::{History, Screen};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick, Trace};

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
        recording: Some(Path::new("run.csv")),
        notice: "start: done",
        teleoperation,
    };
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| screen.draw(frame)).unwrap();
    terminal.backend().to_string()
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
