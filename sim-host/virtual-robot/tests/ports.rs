//! A virtual robot at its ports, with the code of the programs that are used with a robot.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Instant;

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::localizer::Start;
use sonarfix_link::{Command, CommandResult, Motion, Telemetry};
use sonarfix_map::Scenario;
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_telemetry::Monitor;
use sonarfix_telemetry::conversation::{Conversation, Due, Outcome};
use sonarfix_virtual_robot::ports::Ports;
use sonarfix_virtual_robot::robot::{Parts, VirtualRobot};

/// Runs a robot at the port that `open` opens, while `test` uses it by its name.
fn with_robot(open: impl FnOnce(&mut Ports) -> String + Send + 'static, test: impl FnOnce(&str)) {
    let (sender, names) = channel();
    let is_over = Arc::new(AtomicBool::new(false));
    let has_ended = Arc::clone(&is_over);
    let robot = thread::spawn(move || {
        let scenarios =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/sonarfix-map/scenarios");
        let scenario = Scenario::read(&scenarios.join("classroom.toml")).unwrap();
        let parts = Parts::new(scenario).unwrap();
        let mut robot = VirtualRobot::switched_on(&parts, 1, true).unwrap();
        robot.start(parts.start().as_ref()).unwrap();
        let mut ports = Ports::default();
        sender.send(open(&mut ports)).unwrap();
        let is_over = || has_ended.load(Ordering::Relaxed);
        sonarfix_virtual_robot::run(&mut robot, &mut ports, 1.0, u64::MAX, is_over).unwrap();
    });
    test(&names.recv().unwrap());
    is_over.store(true, Ordering::Relaxed);
    robot.join().unwrap();
}

/// A program at a port of the robot.
struct Client {
    port: Port,
    monitor: Monitor,
    conversation: Conversation,
    began: Instant,
    outcomes: Vec<Outcome>,
}

impl Client {
    fn new(port: &str) -> Self {
        Self {
            port: Port::open(port, 115_200).unwrap(),
            monitor: Monitor::default(),
            conversation: request::conversation(),
            began: Instant::now(),
            outcomes: Vec::new(),
        }
    }

    /// Reads messages and renews the motion until one `is_last`, for at most so many seconds of the robot's time.
    fn watch(&mut self, seconds: u64, mut is_last: impl FnMut(&Self, &Telemetry) -> bool) {
        let began = self.time();
        while self.time() < began + 1_000_000 * seconds {
            if let Due::Send(bytes) = self.conversation.poll(self.began.elapsed()) {
                self.port.send(&bytes).unwrap();
            }
            let mut received = Vec::new();
            let read = |bytes: &[u8]| {
                received.extend_from_slice(bytes);
                Ok(ControlFlow::Break(()))
            };
            self.port.read(read).unwrap().unwrap();
            for byte in received {
                let Some(message) = self.monitor.push(byte) else { continue };
                if let Telemetry::Ack(ack) = &message.telemetry {
                    self.outcomes.extend(self.conversation.take(ack));
                }
                if is_last(self, &message.telemetry) {
                    return;
                }
            }
        }
        panic!("it has not happened in {seconds} s: {:?}", self.outcomes);
    }

    /// The time of the robot's latest estimate, µs.
    fn time(&self) -> u64 {
        self.monitor.estimate().map_or(0, |estimate| estimate.at.ticks())
    }

    /// Distance of the estimated position from a point, metres.
    fn distance(&self, [x, y]: [f32; 2]) -> f32 {
        let state = self.monitor.estimate().unwrap().state;
        (state.x.0 - x).hypot(state.y.0 - y)
    }
}

/// Sets the pose of a robot at this port, drives it, cuts the link, and sees it stop.
fn drive_and_cut(port: &str) {
    let is_estimate = |message: &Telemetry| matches!(message, Telemetry::Estimate(_));
    let mut client = Client::new(port);
    client.watch(30, |client, message| is_estimate(message) && client.monitor.hello().is_some());
    let start = [1.6, 1.5];
    assert!(client.distance(start) > 0.05);
    let set_pose = Command::SetPose(Start {
        pose: Pose::new(1.6, 1.5, Radians(0.0)),
        position_deviation: Metres(0.1),
        heading_deviation: Radians(0.05),
    });
    assert_eq!(request::ask(&mut client.port, &set_pose).unwrap(), CommandResult::Done);
    client.watch(5, |client, message| is_estimate(message) && client.distance(start) < 0.02);

    let motion = Motion { speed: MetresPerSecond(0.2), turn: RadiansPerSecond(0.3) };
    client.conversation.drive(Some(motion));
    client.watch(60, |client, _| client.distance(start) > 0.2);
    assert!(client.outcomes.contains(&Outcome::Driven(Some(CommandResult::Done))));

    // From here on nothing is sent. What was sent has been read before the next tick but one.
    client.conversation.drive(None);
    client.watch(5, |_, message| is_estimate(message));
    client.watch(5, |_, message| is_estimate(message));
    let cut = client.time();
    let mut rolled = Vec::new();
    client.watch(10, |client, message| {
        if let Telemetry::Odometry(step) = message {
            let totals = [step.right_metres.to_bits(), step.left_metres.to_bits()];
            rolled.push((step.at.ticks(), totals));
        }
        client.time() > cut + 3_000_000
    });
    // The travel of a tick is that of the period before it, and a ping delays a tick by less than a period.
    let after: Vec<_> = rolled.iter().filter(|(at, _)| *at > cut + 350_000 + 200_000).collect();
    let (_, there) = after.first().unwrap();
    assert!(after.len() > 10 && after.iter().all(|(_, rolled)| rolled == there), "{after:?}");
}

#[cfg(unix)]
#[test]
fn a_program_at_the_terminal_drives_the_robot_and_it_stops_when_the_link_is_cut() {
    let dir = tempfile::tempdir().unwrap();
    let link = dir.path().join("robot");
    let name = link.to_str().unwrap().to_owned();
    let open = move |ports: &mut Ports| {
        let terminal = ports.open_terminal(Some(&link)).unwrap();
        assert_eq!(std::fs::read_link(&link).unwrap().to_str().unwrap(), terminal);
        link.to_str().unwrap().to_owned()
    };
    with_robot(open, drive_and_cut);
    assert!(std::fs::symlink_metadata(name).is_err(), "the link stays");
}

#[test]
fn a_program_at_the_socket_drives_the_robot_and_it_stops_when_the_link_is_cut() {
    with_robot(|ports| format!("tcp:{}", ports.listen(0).unwrap()), drive_and_cut);
}
