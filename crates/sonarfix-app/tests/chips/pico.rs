//! A board on an emulated chip, and the PC at the other end of its link, in lock step: each order states for how long the chip executes.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command as Process, Stdio};

use sonarfix_link::message::{CommandResult, LoopStatus};
use sonarfix_link::{
    Ack, Command, Frame, Gaps, Hello, Receiver, Sender, SessionCommand, Telemetry, frame,
};
use tempfile::TempDir;

/// The time of the chip that passes at once, milliseconds.
const SLICE: u32 = 10;
/// The time after which a command without an answer is repeated, milliseconds.
const REPEATED_AFTER: u32 = 200;
/// The longest wait for a message that comes, milliseconds of the chip: that for `Hello`.
const PATIENCE: u32 = 15_000;

/// A board.
pub struct Board {
    /// Its name in `firmware/chips/wirings.mjs`, for an RP2040, or in `firmware/boards.toml`.
    name: &'static str,
    /// The variable of the environment with the path of its program.
    pub elf: &'static str,
    /// Where its flash has the regions.
    config_at: &'static str,
    map_at: &'static str,
    /// The variable with the address of the function that is a poll, if the emulator counts its instructions.
    poll: Option<&'static str>,
}

/// An RP2040: where `memory.x` has the regions.
const RP2040: Board = Board {
    name: "pico",
    elf: "SONARFIX_PICO_ELF",
    config_at: "0x10100000",
    map_at: "0x10180000",
    poll: Some("SONARFIX_PICO_POLL"),
};
pub const PICO: &Board = &RP2040;
pub const XRP: &Board =
    &Board { name: "xrp", elf: "SONARFIX_XRP_ELF", poll: Some("SONARFIX_XRP_POLL"), ..RP2040 };
/// Boards in QEMU, which does not count the instructions of a poll; `cargo xtask worst-poll` does.
pub const STM32F405: &Board = &Board {
    name: "stm32f405",
    elf: "SONARFIX_STM32F405_ELF",
    config_at: "0x08004000",
    map_at: "0x080E0000",
    poll: None,
};
pub const NUCLEO: &Board = &Board {
    name: "nucleo_f446re",
    elf: "SONARFIX_NUCLEO_F446RE_ELF",
    map_at: "0x08060000",
    ..*STM32F405
};

/// What happens around the chip.
pub struct World {
    pub board: &'static Board,
    /// Segments of two points.
    pub walls: Vec<[f32; 4]>,
    pub pose: [f32; 3],
    pub seed: u32,
    /// A second sonar, which does not turn.
    pub second: Option<FixedSonar>,
}

/// A sonar at a fixed bearing.
#[derive(Debug, Clone, Copy)]
pub struct FixedSonar {
    /// Ahead and to the left, metres.
    pub mount: [f32; 2],
    /// Radians.
    pub bearing: f32,
}

/// A robot as the room has it.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    pub x: f64,
    pub y: f64,
    pub heading: f64,
}

impl Truth {
    /// The distance of a position from it, metres.
    pub fn distance(self, x: f32, y: f32) -> f64 {
        (f64::from(x) - self.x).hypot(f64::from(y) - self.y)
    }

    /// The distance to another place, metres.
    pub fn distance_from(self, other: Self) -> f64 {
        (other.x - self.x).hypot(other.y - self.y)
    }
}

/// What the board and the robot have done.
#[derive(Debug, Clone, Copy)]
pub struct State {
    /// Time since power-on, milliseconds.
    pub ms: f64,
    pub truth: Truth,
    pub pings: u32,
    pub is_enabled: bool,
    /// When a motor last had a voltage, milliseconds since power-on.
    pub powered: f64,
    /// When an encoder last changed.
    pub rolled: f64,
}

/// The polls of the program's loop.
#[derive(Debug, Clone, Copy, Default)]
pub struct Polls {
    pub count: u64,
    /// Instructions of the longest one with the motors enabled.
    pub driving: u64,
    /// Instructions of the longest other one.
    pub waiting: u64,
}

impl Polls {
    /// With those of another chip.
    pub fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            driving: self.driving.max(other.driving),
            waiting: self.waiting.max(other.waiting),
        }
    }
}

/// Counters of the chip.
#[derive(Debug, Clone, Copy)]
pub struct Counters {
    /// Executed instructions.
    pub instructions: u64,
    pub overruns: u64,
    pub lost_bytes: u64,
    pub erased: u64,
    pub programmed: u64,
    pub short_triggers: u64,
}

/// Something that happened, at milliseconds since power-on.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    pub what: String,
    pub ms: f64,
}

/// A link of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    Uart,
    Usb,
}

impl Wire {
    /// The order that lets time pass with it.
    fn order(self) -> &'static str {
        match self {
            Self::Uart => "run",
            Self::Usb => "usb",
        }
    }
}

pub struct Pico {
    /// The link that the PC uses.
    wire: Wire,
    emulator: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    receiver: Receiver<Telemetry>,
    gaps: Gaps,
    sender: Sender<SessionCommand>,
    session: u32,
    pending: VecDeque<Telemetry>,
    /// All messages since power-on.
    pub heard: Vec<Telemetry>,
    /// The longest wait for a message, milliseconds of the chip.
    pub patience: u32,
    pub seed: u32,
    counts_polls: bool,
    files: TempDir,
}

impl Pico {
    /// Switches a board on, with the program of this variable of the environment, and these bytes in its regions.
    pub fn switched_on(variable: &str, world: &World, map: &[u8], config: &[u8]) -> Self {
        let files = TempDir::new().unwrap();
        let path = |name: &str| files.path().join(name);
        let walls: Vec<String> = world.walls.iter().map(|wall| format!("{wall:?}")).collect();
        let &World { board, pose, seed, second, .. } = world;
        let (name, walls) = (board.name, walls.join(","));
        let second = second.map_or("null".to_owned(), |FixedSonar { mount, bearing }| {
            format!(r#"{{"mount":{mount:?},"bearing":{bearing}}}"#)
        });
        let world = format!(
            r#"{{"board":"{name}","walls":[{walls}],"pose":{pose:?},"seed":{seed},"second":{second}}}"#
        );
        std::fs::write(path("world.json"), world).unwrap();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/chips");
        let mut command = Process::new("node");
        command.arg(folder.join("serve.mjs")).arg(path("world.json"));
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut emulator = command.spawn().expect("is node installed?");
        let orders = emulator.stdin.take().unwrap();
        let answers = BufReader::new(emulator.stdout.take().unwrap());
        let program = passed(variable);
        let mut pico = Self {
            wire: Wire::Uart,
            emulator,
            orders,
            answers,
            receiver: Receiver::new(),
            gaps: Gaps::default(),
            sender: Sender::starting_at(100),
            session: 0,
            pending: VecDeque::new(),
            heard: Vec::new(),
            patience: PATIENCE,
            seed,
            counts_polls: board.poll.is_some(),
            files,
        };
        pico.ask(&format!("image {program}"));
        for (name, bytes, at) in [("map", map, board.map_at), ("config", config, board.config_at)] {
            if !bytes.is_empty() {
                let file = pico.files.path().join(name);
                std::fs::write(&file, bytes).unwrap();
                pico.ask(&format!("image {at} {}", file.display()));
            }
        }
        if let Some(poll) = board.poll {
            pico.ask(&format!("count {}", passed(poll)));
        }
        pico.ask("start");
        pico
    }

    /// Gives an order; returns the answer.
    pub fn ask(&mut self, order: &str) -> String {
        writeln!(self.orders, "{order}").unwrap();
        let mut answer = String::new();
        self.answers.read_line(&mut answer).unwrap();
        assert!(!answer.is_empty() && !answer.starts_with("error"), "{order}: {answer}");
        answer.trim().to_owned()
    }

    /// Lets the chip execute for so many milliseconds, while the line takes these bytes to it.
    pub fn run(&mut self, ms: u32, bytes: &[u8]) {
        let mut order = format!("{} {} ", self.wire.order(), 1_000 * ms);
        for byte in bytes {
            write!(order, "{byte:02x}").unwrap();
        }
        let sent = self.ask(&order);
        for pair in sent.as_bytes().chunks(2).filter(|pair| pair.len() == 2) {
            let byte = u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
            if let Some(Frame { sequence, message, .. }) = self.receiver.push(byte) {
                self.gaps.take(sequence);
                self.heard.push(message);
                self.pending.push_back(message);
            }
        }
    }

    /// The PC uses another link from now on, with another program: the one before and what it has received are forgotten.
    pub fn speak_over(&mut self, wire: Wire) {
        self.wire = wire;
        (self.receiver, self.gaps) = (Receiver::new(), Gaps::default());
        self.ask(&format!("{} 0", wire.order()));
        self.pending.clear();
    }

    /// How many bytes have arrived at the link that the PC does not use.
    pub fn arrived_elsewhere(&mut self) -> usize {
        let other = if self.wire == Wire::Uart { Wire::Usb } else { Wire::Uart };
        let bytes = self.ask(&format!("{} 0", other.order()));
        if bytes == "-" { 0 } else { bytes.len() / 2 }
    }

    /// The messages so far that were not yet taken.
    pub fn messages(&mut self) -> Vec<Telemetry> {
        self.pending.drain(..).collect()
    }

    /// Takes all messages but the first ones, of this number, also those that [`Self::wait_for`] has dropped.
    pub fn take_after(&mut self, number: usize) -> Vec<Telemetry> {
        self.pending.clear();
        self.heard[number..].to_vec()
    }

    /// Waits for the first message for which `find` returns something; earlier ones are lost.
    pub fn wait_for<T>(&mut self, find: impl Fn(&Telemetry) -> Option<T>) -> Option<T> {
        for _ in 0..self.patience / SLICE {
            while let Some(message) = self.pending.pop_front() {
                if let Some(found) = find(&message) {
                    return Some(found);
                }
            }
            self.run(SLICE, &[]);
        }
        None
    }

    pub fn hello(&mut self) -> Hello {
        self.wait_for(|it| if let Telemetry::Hello(hello) = it { Some(*hello) } else { None })
            .expect("no Hello")
    }

    pub fn loop_status(&mut self) -> LoopStatus {
        self.wait_for(|it| if let Telemetry::LoopStatus(it) = it { Some(*it) } else { None })
            .expect("no LoopStatus")
    }

    /// Sends a command; returns the answer, if one comes.
    pub fn order(&mut self, command: &Command) -> Option<CommandResult> {
        if self.session == 0 {
            let Some(CommandResult::Session(session)) = self.request(&Command::OpenSession) else {
                return None;
            };
            self.session = session;
        }
        self.request(command)
    }

    fn request(&mut self, command: &Command) -> Option<CommandResult> {
        let sequence = self.sender.next();
        let bytes = self.frame(sequence, command);
        self.sender = Sender::starting_at(sequence + 1);
        let until = self.patience;
        self.patience = until.min(REPEATED_AFTER);
        // A robot whose line has no room drops the answer.
        let answer = (0..until / self.patience).find_map(|_| {
            self.run(SLICE, &bytes);
            self.wait_for(|message| match message {
                Telemetry::Ack(Ack { sequence: of, result }) if *of == sequence => Some(*result),
                _ => None,
            })
        });
        self.patience = until;
        answer
    }

    /// The frame that the next command would have.
    pub fn next_frame(&mut self, command: &Command) -> Vec<u8> {
        let sequence = self.sender.next();
        self.frame(sequence, command)
    }

    fn frame(&self, sequence: u16, command: &Command) -> Vec<u8> {
        let command = SessionCommand { session: self.session, command: *command };
        Sender::starting_at(sequence).frame(&command, &mut frame::EMPTY.clone()).to_vec()
    }

    /// After a reset: the robot has another session.
    pub fn forget_session(&mut self) {
        self.session = 0;
        self.pending.clear();
        self.patience = PATIENCE;
    }

    pub fn state(&mut self) -> State {
        let answer = self.ask("state");
        let [us, x, y, heading, pings, enabled, powered, rolled] = numbers(&answer)[..] else {
            panic!("{answer}")
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let pings = pings as u32;
        State {
            ms: us / 1e3,
            truth: Truth { x, y, heading },
            pings,
            is_enabled: enabled > 0.0,
            powered: powered / 1e3,
            rolled: rolled / 1e3,
        }
    }

    /// The robot at a time of the chip's clock.
    pub fn truth(&mut self, at: sonarfix::geometry::units::Instant) -> Truth {
        let answer = self.ask(&format!("truth {}", at.ticks()));
        let [x, y, heading] = numbers(&answer)[..] else { panic!("{answer}") };
        Truth { x, y, heading }
    }

    pub fn counters(&mut self) -> Counters {
        let answer = self.ask("chip");
        let counts: Vec<u64> = answer.split(' ').map(|word| word.parse().unwrap()).collect();
        let [instructions, overruns, lost_bytes, erased, programmed, short_triggers] = counts[..]
        else {
            panic!("{answer}")
        };
        Counters { instructions, overruns, lost_bytes, erased, programmed, short_triggers }
    }

    pub fn polls(&mut self) -> Polls {
        if !self.counts_polls {
            return Polls::default();
        }
        let answer = self.ask("calls");
        let counts: Vec<u64> = answer.split(' ').map(|word| word.parse().unwrap()).collect();
        let [count, driving, waiting] = counts[..] else { panic!("{answer}") };
        Polls { count, driving, waiting }
    }

    /// How many pings each sonar has sent.
    pub fn pings(&mut self) -> Vec<f64> {
        numbers(&self.ask("pings"))
    }

    /// How many samples of the gyro were read.
    pub fn gyro_samples(&mut self) -> u64 {
        self.ask("gyro").parse().unwrap()
    }

    /// Frames of the robot that were damaged, that this program cannot decode, or for which the line had no room.
    pub fn missing(&self) -> u32 {
        self.receiver.counters().skipped() + self.gaps.lost()
    }

    /// What has happened since the last time.
    pub fn events(&mut self) -> Vec<Event> {
        let answer = self.ask("events");
        let words: Vec<&str> = answer.split(' ').collect();
        let event = |pair: &[&str]| Event {
            what: pair[0].to_owned(),
            ms: pair[1].parse::<f64>().unwrap() / 1e6,
        };
        words.chunks(2).filter(|pair| pair.len() == 2).map(event).collect()
    }
}

/// What `cargo xtask chips` passes in a variable of the environment.
fn passed(variable: &str) -> String {
    std::env::var(variable).expect("run `cargo xtask chips`")
}

fn numbers(answer: &str) -> Vec<f64> {
    answer.split(' ').map(|word| word.parse().unwrap_or_else(|_| panic!("{answer}"))).collect()
}

impl Drop for Pico {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}
