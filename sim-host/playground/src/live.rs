//! A robot on a serial port of the browser: the page passes bytes, and this is what `sonarfix monitor --serve` computes from them.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use serde::Deserialize;
use serde_json::{Value, json};
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Floor, MapFile, robot_file};
use sonarfix_replay::Replay;
use sonarfix_replay::thinned::{CAPACITY, Thinned};
use sonarfix_sim::trace::Trace;
use sonarfix_telemetry::conversation::Conversation;
use sonarfix_telemetry::feed::{Events, Feed, Scene};
use sonarfix_telemetry::order::{Ordered, Reply};
use sonarfix_telemetry::recording::{Logs, Recording};
use sonarfix_telemetry::robot::Robot;
use sonarfix_telemetry::sealed::Output;

/// What a page says of the robot before it connects.
#[derive(Debug, Deserialize)]
struct Request {
    /// Whether it can be commanded: whether the browser has serial ports at all.
    commands: bool,
    /// The sequence number of the first command.
    first_sequence: u16,
    map: Option<File>,
    robot: Option<File>,
    /// A recording of this robot on this map, which is replayed.
    beside: Option<File>,
}

/// A file that was chosen on the page.
#[derive(Debug, Deserialize)]
struct File {
    name: String,
    text: String,
}

/// A robot, and the orders of the page that wait for their answers, by their numbers.
pub struct Live {
    robot: Robot,
    lines: Arc<Lines>,
    waiting: Vec<(u32, Receiver<Reply>)>,
}

impl Live {
    /// A robot of which nothing was received; `request` has JSON.
    ///
    /// # Errors
    /// If map or robot file are wrong.
    pub fn new(request: &str) -> anyhow::Result<Self> {
        let Request { commands, first_sequence, map, robot, beside } =
            serde_json::from_str(request)?;
        let parse = |map: File| MapFile::parse(map.text.into_bytes(), Path::new(&map.name), None);
        let map = map.map(parse).transpose()?;
        let robot = robot.map(|robot| robot_file::parse(&robot.text, &robot.name)).transpose()?;
        let floor = map.as_ref().map(|map| &map.floor);
        let (scene, mount) = Scene::of_robot("Sonarfix live".to_owned(), floor, robot.as_ref());
        let lines = Arc::new(Lines::default());
        let feed = Feed::new(lines.clone());
        if let Some(recording) = beside {
            let run = replayed(&recording, floor, robot.as_ref())?;
            feed.beside(&recording.name, &run)?;
        }
        let conversation = Conversation::new(first_sequence);
        let logs = PageLogs(Arc::clone(&lines));
        let new_recording = move || Recording::new(logs.clone());
        let scene = Scene { commands, ..scene };
        let robot = Robot::new(feed, scene, mount, conversation, new_recording);
        Ok(Self { robot, lines, waiting: Vec::new() })
    }

    /// Takes bytes that the robot has sent.
    pub fn receive(&mut self, bytes: &[u8]) {
        // A recording in memory does not fail.
        let _ = self.robot.take(bytes, |_, _| {});
    }

    /// Takes an order in JSON; its answer is an event with its number.
    pub fn order(&mut self, number: u32, order: &str, now: Duration) {
        let (sender, answer) = sync_channel(1);
        match serde_json::from_str(order) {
            Ok(order) => self.robot.take_order(Ordered::new(order, sender), now),
            Err(error) => {
                // There is room for one answer.
                let _ = sender.try_send(Reply::refused(&format!("this is no order: {error}")));
            }
        }
        self.waiting.push((number, answer));
    }

    /// The bytes to send to the robot now.
    pub fn due(&mut self, now: Duration) -> Vec<u8> {
        self.robot.obey(None, now).unwrap_or_default()
    }

    /// The events since the last call, a line of JSON each: those of a server; `reply`, the answer to the order of a number; and `log`,
    /// a recording that has ended.
    pub fn events(&mut self) -> String {
        let Self { lines, waiting, .. } = self;
        waiting.retain(|(number, answer)| match answer.try_recv() {
            Ok(reply) => {
                lines.event(&json!({ "kind": "reply", "number": number, "reply": reply }));
                false
            }
            Err(error) => error == TryRecvError::Empty,
        });
        lines.take()
    }
}

/// A recording as its replay.
fn replayed(
    recording: &File,
    floor: Option<&Floor>,
    robot: Option<&RobotConfig>,
) -> anyhow::Result<Trace> {
    let (Some(floor), Some(robot)) = (floor, robot) else {
        bail!(
            "{}: choose the map and the robot file, too: a recording is replayed",
            recording.name
        );
    };
    let walls = floor.walls();
    let mut run = Thinned::new(floor, robot.localizer.rangers.first.cone, CAPACITY);
    let replay = Replay { robot, walls: &walls, strict: false, pings_per_scan: 1 };
    replay
        .run(recording.text.as_bytes(), None::<&[u8]>, &mut run, &mut |_| {})
        .with_context(|| recording.name.clone())?;
    ensure!(!run.trace().ticks.is_empty(), "{}: no encoder tick", recording.name);
    Ok(run.trace().clone())
}

/// Events that the page has not taken yet.
#[derive(Debug, Default)]
struct Lines(Mutex<String>);

impl Lines {
    fn event(&self, event: &Value) {
        self.push(&event.to_string());
    }

    fn take(&self) -> String {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Events for Lines {
    fn push(&self, line: &str) {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Writing to a string does not fail.
        let _ = writeln!(lines, "{line}");
    }

    fn close(&self) {}
}

/// Logs that the page saves when they have ended.
#[derive(Debug, Clone)]
struct PageLogs(Arc<Lines>);

impl Logs for PageLogs {
    fn name(&self) -> String {
        "recording.csv".to_owned()
    }

    fn create(&mut self, number: u32) -> io::Result<Box<dyn Output>> {
        let name = if number > 1 { format!("recording-{number}.csv") } else { self.name() };
        Ok(Box::new(PageLog { name, bytes: Vec::new(), lines: Arc::clone(&self.0) }))
    }
}

#[derive(Debug)]
struct PageLog {
    name: String,
    bytes: Vec<u8>,
    lines: Arc<Lines>,
}

impl Write for PageLog {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Output for PageLog {
    fn end(self: Box<Self>) -> io::Result<()> {
        let text = String::from_utf8_lossy(&self.bytes);
        self.lines.event(&json!({ "kind": "log", "name": self.name, "text": text }));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_map::Scenario;
    use sonarfix_virtual_robot::robot::{Parts, VirtualRobot};

    const STEP: u64 = 10_000;

    fn classroom() -> Scenario {
        Scenario::parse(sonarfix_map::CLASSROOM, "", "".as_ref()).unwrap()
    }

    /// The request of a page with map and robot file.
    fn request(scenario: &Scenario) -> Value {
        json!({
            "commands": true,
            "first_sequence": 7,
            "map": { "name": "map.toml", "text": scenario.floor.to_toml() },
            "robot": { "name": "robot.toml", "text": robot_file::text(&scenario.robot) },
        })
    }

    /// A page that is connected to a virtual robot.
    struct Bench<'p> {
        live: Live,
        robot: VirtualRobot<'p>,
        events: Vec<Value>,
        orders: u32,
    }

    impl<'p> Bench<'p> {
        fn new(parts: &'p Parts) -> Self {
            let request = request(&classroom());
            let robot = VirtualRobot::switched_on(parts, 1, true).unwrap();
            Self {
                live: Live::new(&request.to_string()).unwrap(),
                robot,
                events: Vec::new(),
                orders: 0,
            }
        }

        /// Lets time pass until an event is the last one, for at most 10 s of the robot.
        fn until(&mut self, is_last: impl Fn(&Value) -> bool) -> Value {
            for _ in 0..10_000_000 / STEP {
                let now = Duration::from_micros(self.robot.now());
                self.robot.receive(&self.live.due(now));
                self.robot.run_to(self.robot.now() + STEP);
                self.live.receive(&self.robot.take_sent());
                let events = self.live.events();
                let events = events.lines().map(|line| serde_json::from_str(line).unwrap());
                self.events.extend(events);
                if let Some(found) = self.events.iter().find(|event| is_last(event)) {
                    return found.clone();
                }
            }
            panic!("it has not happened: {:?}", self.events.last());
        }

        /// The answer to an order.
        fn order(&mut self, order: &Value) -> (bool, String) {
            self.orders += 1;
            let now = Duration::from_micros(self.robot.now());
            self.live.order(self.orders, &order.to_string(), now);
            let number = self.orders;
            let event = self.until(|event| event["kind"] == "reply" && event["number"] == number);
            let reply = &event["reply"];
            (reply["done"].as_bool().unwrap(), reply["text"].as_str().unwrap().to_owned())
        }
    }

    fn is_tick(event: &Value) -> bool {
        event["columns"]["ticks"].is_object()
    }

    /// The robot of the classroom is started from the page, drives and is recorded.
    #[test]
    fn a_robot_is_commanded_and_its_pose_arrives() {
        let parts = Parts::new(classroom()).unwrap();
        let start = parts.start().unwrap().pose;
        let mut bench = Bench::new(&parts);
        let scene = bench.until(|event| event["kind"] == "scene");
        assert!(!scene["walls"].as_array().unwrap().is_empty());
        assert_eq!(
            bench.order(&json!({ "order": "record", "on": true })).1,
            "recording recording.csv"
        );
        let refused = bench.order(&json!({ "order": "start" }));
        assert!(!refused.0 && refused.1.starts_with("the robot refuses"), "{refused:?}");
        let heading = start.heading.radians().0;
        let pose = json!({ "order": "set_pose", "x": start.x.0, "y": start.y.0, "heading": heading,
            "position_deviation": 0.05, "heading_deviation": 0.05 });
        let done = (true, "done".to_owned());
        assert_eq!(bench.order(&pose), done);
        assert_eq!(bench.order(&json!({ "order": "start" })), done);
        let drive = json!({ "order": "drive", "speed": 0.1, "turn": 0 });
        assert_eq!(bench.order(&drive), (true, String::new()));
        bench.events.clear();
        let tick = bench.until(is_tick);
        let estimate = &tick["columns"]["ticks"]["estimate"];
        let x = estimate["x"][0].as_f64().unwrap();
        assert!((x - f64::from(start.x.0)).abs() < 0.1, "{estimate}");
        assert_eq!(bench.order(&json!({ "order": "stop" })), done);
        assert_eq!(
            bench.order(&json!({ "order": "record", "on": false })).1,
            "recorded recording.csv"
        );
        let log = bench.until(|event| event["kind"] == "log");
        let text = log["text"].as_str().unwrap();
        assert!(text.contains("\nwheels,") && text.ends_with("\n# end\n"), "{text}");
        a_recording_is_shown_beside(text, x);
    }

    /// With map and robot file the recording is replayed; its estimate begins where the robot was.
    fn a_recording_is_shown_beside(log: &str, x: f64) {
        let mut request = request(&classroom());
        request["beside"] = json!({ "name": "first.csv", "text": log });
        let mut live = Live::new(&request.to_string()).unwrap();
        let events = live.events();
        let events = events.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let beside = events.into_iter().find(|event| event["kind"] == "beside").unwrap();
        assert_eq!(beside["name"], "first.csv");
        let ticks = &beside["run"]["ticks"];
        let begun = ticks["estimate"]["x"][0].as_f64().unwrap();
        assert!((begun - x).abs() < 0.05, "{ticks}");
        assert_eq!(ticks["verdict"][0], 0);
        request["robot"] = Value::Null;
        let Err(error) = Live::new(&request.to_string()) else { panic!("there is no robot file") };
        assert!(error.to_string().starts_with("first.csv: choose the map and"), "{error}");
    }

    /// A command that no robot acknowledges expires; text that is not a command is refused.
    #[test]
    fn an_order_without_a_robot_is_answered() {
        let parts = Parts::new(classroom()).unwrap();
        let mut bench = Bench::new(&parts);
        assert!(bench.order(&json!({ "order": "jump" })).1.starts_with("this is no order"));
        bench.live.order(9, "{\"order\":\"stop\"}", Duration::ZERO);
        let mut attempts = 0;
        for millis in (0..10_000).step_by(20) {
            attempts += usize::from(!bench.live.due(Duration::from_millis(millis)).is_empty());
        }
        let events = bench.live.events();
        assert!(attempts > 3 && events.contains("the robot does not answer"), "{events}");
    }

    #[test]
    fn a_wrong_file_is_named() {
        let request = json!({ "commands": true, "first_sequence": 0, "robot": null,
            "map": { "name": "room.toml", "text": "[[wall]]\nfrom = 1" } });
        let Err(error) = Live::new(&request.to_string()) else { panic!("the map is wrong") };
        assert!(error.to_string().contains("room.toml:"), "{error}");
    }
}
