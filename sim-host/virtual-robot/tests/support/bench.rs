//! A virtual robot by its own time, with a PC at its link.

use std::path::Path;

use sonarfix::localizer::Start;
use sonarfix_link::{Command, CommandResult, Receiver, Sender, SessionCommand, Telemetry, frame};
use sonarfix_map::Scenario;
use sonarfix_virtual_robot::robot::{Parts, VirtualRobot};

pub const SECOND: u64 = 1_000_000;

pub fn classroom() -> Scenario {
    let scenarios =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/sonarfix-map/scenarios");
    Scenario::read(&scenarios.join("classroom.toml")).unwrap()
}

/// A robot with a PC at its link.
pub struct Bench<'p> {
    pub robot: VirtualRobot<'p>,
    sender: Sender<SessionCommand>,
    receiver: Receiver<Telemetry>,
    session: u32,
    /// What arrived before an answer.
    earlier: Vec<Telemetry>,
}

impl<'p> Bench<'p> {
    pub fn new(parts: &'p Parts, seed: u64, stands: bool) -> Self {
        let robot = VirtualRobot::switched_on(parts, seed, stands).unwrap();
        let (sender, receiver) = (Sender::starting_at(1), Receiver::new());
        let mut bench = Self { robot, sender, receiver, session: 0, earlier: Vec::new() };
        let CommandResult::Session(session) = bench.order(&Command::OpenSession) else {
            panic!("no session")
        };
        bench.session = session;
        bench
    }

    pub fn wait(&mut self, micros: u64) -> Vec<Telemetry> {
        let mut all = std::mem::take(&mut self.earlier);
        all.extend(self.pass(micros));
        all
    }

    fn pass(&mut self, micros: u64) -> Vec<Telemetry> {
        self.robot.run_to(self.robot.now() + micros);
        let sent = self.robot.take_sent();
        let frames = sent.into_iter().filter_map(|byte| self.receiver.push(byte));
        frames.map(|frame| frame.message).collect()
    }

    pub fn order(&mut self, command: &Command) -> CommandResult {
        let message = SessionCommand { session: self.session, command: *command };
        let sequence = self.sender.next();
        self.robot.receive(self.sender.frame(&message, &mut frame::EMPTY.clone()));
        for _ in 0..100 {
            let mut result = None;
            for telemetry in self.pass(1_000) {
                match telemetry {
                    Telemetry::Ack(ack) if ack.sequence == sequence => result = Some(ack.result),
                    other => self.earlier.push(other),
                }
            }
            if let Some(result) = result {
                return result;
            }
        }
        panic!("no answer to {command:?}")
    }

    pub fn run(&mut self, start: Start) {
        for command in [Command::SetPose(start), Command::Start] {
            assert_eq!(self.order(&command), CommandResult::Done);
        }
        self.wait(SECOND / 2);
    }
}
