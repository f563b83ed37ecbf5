//! The terminal of `sonarfix monitor`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::path::Path;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use sonarfix_link::{Reporter, Sender, Telemetry, frame};
use sonarfix_map::{CLASSROOM, Fidelity, Scenario};
use sonarfix_monitor::Monitor;
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
        reporter.report(report, localizer, |telemetry| self.send(telemetry));
        self.reporter = Some(reporter);
    }
}

/// What a terminal of this size shows of a run of `classroom`, or before anything was received.
fn shown(received: &Received, trace: &Trace, width: u16, height: u16) -> String {
    let names: Vec<_> = trace.walls.iter().map(|wall| wall.name.clone()).collect();
    let screen = Screen {
        monitor: &received.monitor,
        history: &received.history,
        walls: &trace.walls,
        names: &names,
        recording: Some(Path::new("run.csv")),
        notice: "start: done",
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

/// No size makes it panic.
#[test]
fn a_terminal_may_be_tiny() {
    let (received, trace) = (Received::default(), Trace::default());
    for (width, height) in [(1, 1), (3, 2), (20, 3), (121, 4), (200, 8)] {
        let screen = shown(&received, &trace, width, height);
        assert_eq!(screen.lines().count(), usize::from(height), "{width}×{height}");
    }
}
