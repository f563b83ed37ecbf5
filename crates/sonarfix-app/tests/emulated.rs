//! The shipped firmware of the STM32F405 and of the Nucleo-F446RE, in an emulator, over its UART.
//!
//! `cargo xtask test-firmware` builds it and runs these. The emulator has the core, the clock,
//! the interrupts and the UART; encoders, servo and echo read zero there, and its flash cannot be
//! written. The tests show that the ELF that is flashed boots, meets its deadlines, reports missing devices, executes
//! commands, and ignores garbage.

#![cfg(test)]

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};

use sonarfix::config::{Config, LightBeam, Ranging, ServoTiming};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::ranger::{NoEcho, RangerKind, RangerSettings};
use sonarfix_link::message::{CommandError, CommandResult, ImageStatus, LoopStatus};
use sonarfix_link::{
    Ack, Command, Hello, Receiver, Sender, SessionCommand, Telemetry, baked, frame,
};
use tempfile::TempDir;

/// Where both boards have the configuration; that of the map is in this variable of the environment.
const CONFIG_AT: &str = "0x08004000";
const MAP_AT: &str = "SONARFIX_MAP_AT";
/// Flash, which starts with the stack's top, and memory of the board.
const FLASH_AT: u32 = 0x0800_0000;
const RAM_AT: u32 = 0x2000_0000;
/// Memory that the program does not use.
const CODE_AT: u32 = RAM_AT + 0x1_0000;
const RAM: usize = 128 * 1_024;
/// The compare registers of TIM3's four channels, which are the inputs of the motor driver.
const MOTORS_AT: u32 = 0x4000_0434;
/// Counts of the emulated `SysTick`, 168 MHz, in a millisecond of the firmware, which is 16 µs there.
const SYSTICK_RATE: f64 = 168.0 * 16.0;
/// Limit of each wait, by the clock of this computer; the emulator is ended after it as well.
const TIMEOUT: Duration = Duration::from_secs(100);

/// The board, and the PC at the other end of its link.
struct Robot {
    emulator: Child,
    line: UnixStream,
    receiver: Receiver<Telemetry>,
    sender: Sender<SessionCommand>,
    session: u32,
    /// Bytes for which the line had no room.
    unsent: Vec<u8>,
    /// Messages received and not yet processed, oldest first.
    pending: VecDeque<Telemetry>,
    since: Instant,
    files: TempDir,
}

impl Robot {
    /// Switches the board on, with these bytes in its regions.
    fn switched_on(map: &[u8], config: &[u8]) -> Self {
        let passed = |name| std::env::var(name).expect("run `cargo xtask test-firmware`");
        let (elf, map_at) = (passed("SONARFIX_FIRMWARE"), passed(MAP_AT));
        let files = TempDir::new().unwrap();
        let path = |name: &str| files.path().join(name);
        let mut command = Process::new("timeout");
        command.args([TIMEOUT.as_secs().to_string().as_str(), "qemu-system-arm"]);
        // 1 ns passes with every instruction. The emulator's timers run at 1 GHz in place of
        // 16 MHz, so the firmware's microsecond is 16 instructions: those of a core at 16 MHz that
        // does one in a cycle. While it sleeps no time of this computer passes.
        command.args(["-machine", "netduinoplus2", "-icount", "shift=0,sleep=off"]);
        // Log the writes to devices that are not emulated, among them the ports.
        command.args(["-d", "unimp", "-D"]).arg(path("writes"));
        command.arg("-gdb").arg(format!("unix:{},server=on,wait=off", path("debugger").display()));
        let monitor = path("monitor");
        command.args(["-display", "none", "-kernel", &elf, "-monitor"]);
        command.arg(format!("unix:{},server=on,wait=off", monitor.display()));
        for (name, bytes, at) in [("map", map, &*map_at), ("config", config, CONFIG_AT)] {
            if !bytes.is_empty() {
                std::fs::write(path(name), bytes).unwrap();
                let file = path(name).display().to_string();
                command.args(["-device", &format!("loader,file={file},addr={at},force-raw=on")]);
            }
        }
        let socket = path("uart");
        // USART1 is not connected; the link is USART2. The emulator waits for the connection, so nothing is lost.
        command.args(["-serial", "null", "-serial"]);
        command.arg(format!("unix:{},server=on,wait=on", socket.display()));
        command.stdin(Stdio::null()).stderr(Stdio::null());
        let emulator = command.spawn().expect("is qemu-system-arm installed?");
        let line = connected(&socket);
        line.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        Self {
            emulator,
            line,
            receiver: Receiver::new(),
            sender: Sender::starting_at(100),
            session: 0,
            unsent: Vec::new(),
            pending: VecDeque::new(),
            since: Instant::now(),
            files,
        }
    }

    /// The next message.
    fn next(&mut self) -> Telemetry {
        loop {
            if let Some(message) = self.pending.pop_front() {
                return message;
            }
            assert!(
                self.since.elapsed() < TIMEOUT,
                "timeout: the expected message has not arrived"
            );
            let mut bytes = [0; 4_096];
            let count = match self.line.read(&mut bytes) {
                Ok(0) => panic!("the emulator has ended"),
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    panic!("no bytes from the robot")
                }
                Err(error) => panic!("the link: {error}"),
            };
            let receiver = &mut self.receiver;
            let frames = bytes[..count].iter().filter_map(|byte| receiver.push(*byte));
            self.pending.extend(frames.map(|frame| frame.message));
        }
    }

    /// Waits for the first message for which `find` returns something.
    fn wait_for<T>(&mut self, find: impl Fn(&Telemetry) -> Option<T>) -> T {
        loop {
            if let Some(found) = find(&self.next()) {
                return found;
            }
        }
    }

    fn hello(&mut self) -> Hello {
        self.wait_for(
            |message| if let Telemetry::Hello(hello) = message { Some(*hello) } else { None },
        )
    }

    fn loop_status(&mut self) -> LoopStatus {
        self.wait_for(|message| {
            if let Telemetry::LoopStatus(status) = message { Some(*status) } else { None }
        })
    }

    /// Waits for half a second by the robot's clock at least: a message is received before the poll that sends it has ended.
    fn pass_half_a_second(&mut self) {
        let first = self.loop_status().at;
        while self.loop_status().at < first + sonarfix::geometry::units::Duration::millis(500) {}
    }

    /// Sends a command and waits for its answer.
    fn order(&mut self, command: &Command) -> CommandResult {
        if self.session == 0 {
            let CommandResult::Session(session) = self.request(&Command::OpenSession) else {
                panic!("a session is opened at any time")
            };
            self.session = session;
        }
        self.request(command)
    }

    fn request(&mut self, command: &Command) -> CommandResult {
        let sequence = self.sender.next();
        let bytes = self.frame(sequence, command);
        self.sender = Sender::starting_at(sequence + 1);
        self.send(&bytes);
        self.answer_to(sequence)
    }

    /// A command's frame in the present session.
    fn frame(&self, sequence: u16, command: &Command) -> Vec<u8> {
        let command = SessionCommand { session: self.session, command: *command };
        Sender::starting_at(sequence).frame(&command, &mut frame::EMPTY.clone()).to_vec()
    }

    fn answer_to(&mut self, asked: u16) -> CommandResult {
        self.wait_for(|message| match message {
            Telemetry::Ack(Ack { sequence, result }) if *sequence == asked => Some(*result),
            _ => None,
        })
    }

    /// Gives the emulator's monitor an order, which is executed while the connection exists.
    fn monitor(&self, order: &str) -> UnixStream {
        let mut monitor = connected(&self.files.path().join("monitor"));
        monitor.write_all(format!("{order}\n").as_bytes()).unwrap();
        monitor
    }

    /// The board's memory from an address on.
    fn memory(&mut self, from: u32, length: usize) -> Vec<u8> {
        let file = self.files.path().join("memory");
        let _monitor = self.monitor(&format!("pmemsave {from:#x} {length} \"{}\"", file.display()));
        loop {
            match std::fs::read(&file) {
                Ok(bytes) if bytes.len() == length => {
                    std::fs::remove_file(&file).unwrap();
                    return bytes;
                }
                _ => assert!(
                    self.since.elapsed() < TIMEOUT,
                    "the emulator has not dumped its memory"
                ),
            }
            // An emulator that is blocked by an unread line does not serve its monitor.
            let _ = self.line.read(&mut [0; 4_096]).unwrap();
        }
    }

    /// Continues the program at other code, through the debugger. That code enables the motors, which the
    /// program itself does not do without encoders, and jumps to an invalid address.
    fn jump_to_invalid_code(&mut self) {
        // ldr r0, port; movs r1, #0x80; str r1, [r0]; ldr r0, nowhere; bx r0; nop; port; nowhere
        let code = "0248802101600248004700bf1804024001000030";
        let mut debugger = connected(&self.files.path().join("debugger"));
        debugger.set_nonblocking(true).unwrap();
        // Registers can be written once their description was read; 15 is the program counter, little-endian. Then
        // detach.
        let address = format!("Pf={:08x}", CODE_AT.swap_bytes());
        let memory = format!("M{CODE_AT:08x},14:{code}");
        for order in ["qXfer:features:read:target.xml:0,ffb", &memory, &address, "D"] {
            self.debug(&mut debugger, order);
        }
    }

    /// Sends a command to the emulator's debugger, and waits for its answer.
    fn debug(&mut self, debugger: &mut UnixStream, order: &str) {
        let sum = order.bytes().fold(0_u8, u8::wrapping_add);
        debugger.write_all(format!("${order}#{sum:02x}").as_bytes()).unwrap();
        // An answer ends with its checksum.
        let mut answer = Vec::new();
        while answer.iter().rev().nth(2).is_none_or(|byte| *byte != b'#') {
            let mut byte = [0];
            match debugger.read(&mut byte) {
                Ok(0) => panic!("the emulator has ended"),
                Ok(_) => answer.extend(byte),
                Err(_) => self.listen(),
            }
        }
        debugger.write_all(b"+").unwrap();
    }

    /// Reads the line: an emulator that is blocked by an unread line does not proceed.
    fn listen(&mut self) {
        assert!(self.since.elapsed() < TIMEOUT, "timeout: the emulator does not respond");
        self.line.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        let _ = self.line.read(&mut [0; 4_096]);
    }

    /// Whether the last write to the motor driver's pin, PB7, enabled it.
    fn may_drive(&self) -> Option<bool> {
        let log = std::fs::read_to_string(self.files.path().join("writes")).ok()?;
        // The port's BSRR: the lower half sets pins, the upper half clears them.
        let mut writes = log.lines().rev().filter(|line| line.contains("GPIOB: unimplemented"));
        writes.find_map(|line| {
            let (_, value) = line.split_once("write (size 4, offset 0x018, value 0x")?;
            match value {
                "00000080)" => Some(true),
                "00800000)" => Some(false),
                _ => None,
            }
        })
    }

    /// The sleeps since the emulator was told to log them, milliseconds by the robot's clock. A sleep begins with a write of its
    /// length to `SysTick`.
    fn sleeps(&self) -> Vec<f64> {
        let log = std::fs::read_to_string(self.files.path().join("writes")).unwrap_or_default();
        let counts = log.lines().filter_map(|line| {
            let (_, write) = line.split_once("systick write addr 0x4 data 0x")?;
            u32::from_str_radix(write.split_whitespace().next()?, 16).ok()
        });
        // The length is followed by a 0: there is one period only.
        counts.filter(|counts| *counts > 0).map(|counts| f64::from(counts) / SYSTICK_RATE).collect()
    }

    /// Whether the motors have ever been enabled.
    fn has_driven(&self) -> bool {
        let log = std::fs::read_to_string(self.files.path().join("writes")).unwrap_or_default();
        log.lines().any(|line| line.contains("GPIOB") && line.contains("value 0x00000080)"))
    }

    fn send(&mut self, bytes: &[u8]) {
        self.line.write_all(bytes).unwrap();
    }

    /// Sends as much of these bytes as the line has room for, after what is left of the last ones. It never waits: the emulator
    /// may be waiting for this end to read.
    fn offer(&mut self, bytes: impl FnOnce(&Self) -> Vec<u8>) {
        if self.unsent.is_empty() {
            self.unsent = bytes(self);
        }
        self.line.set_nonblocking(true).unwrap();
        let sent = self.line.write(&self.unsent).unwrap_or(0);
        self.line.set_nonblocking(false).unwrap();
        self.unsent.drain(..sent);
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        // An emulator that is blocked by an unread line does not react to signals.
        let _ = self.line.shutdown(Shutdown::Both);
        // `timeout` forwards the signal to the emulator; both may have ended already.
        let _ = Process::new("kill").arg(self.emulator.id().to_string()).status();
        let _ = self.emulator.wait();
    }
}

fn connected(socket: &Path) -> UnixStream {
    let since = Instant::now();
    loop {
        match UnixStream::connect(socket) {
            Ok(line) => return line,
            Err(_) if since.elapsed() < TIMEOUT => std::thread::sleep(Duration::from_millis(20)),
            Err(error) => panic!("cannot connect to the emulator: {error}"),
        }
    }
}

fn walls() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
    let point = |(x, y): (f32, f32)| Point::new(x, y);
    corners.windows(2).map(|ends| Wall::new(point(ends[0]), point(ends[1])).unwrap()).collect()
}

fn map() -> Vec<u8> {
    sonarfix_map::bake(&walls()).unwrap()
}

fn configuration() -> RobotConfig {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.rangers.first.servo = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    RobotConfig::with_common_parts(localizer)
}

fn config() -> Vec<u8> {
    baked::write(&configuration(), &mut [0; baked::LENGTH_MAX]).unwrap().to_vec()
}

fn pose() -> Start {
    Start {
        pose: Pose::new(1.0, 1.0, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    }
}

#[test]
#[ignore = "cargo xtask test-firmware"]
fn without_map_and_configuration_it_does_not_start_and_reports_why() {
    let mut robot = Robot::switched_on(&[], &[]);
    let hello = robot.hello();
    assert_eq!((hello.map, hello.configuration), (ImageStatus::Missing, ImageStatus::Missing));
    assert_eq!(robot.order(&Command::Start), CommandResult::Refused(CommandError::NoMap));
    assert!(!robot.loop_status().running);
}

#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_damaged_map_or_configuration_is_reported() {
    let damaged = |mut bytes: Vec<u8>| {
        bytes[40] ^= 1;
        bytes
    };
    let mut robot = Robot::switched_on(&damaged(map()), &config());
    let hello = robot.hello();
    assert_eq!(hello.map, ImageStatus::Corrupt);
    assert_eq!(hello.configuration, ImageStatus::Valid(baked::checksum(&configuration())));
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Refused(CommandError::NoMap));

    let mut robot = Robot::switched_on(&map(), &damaged(config()));
    let hello = robot.hello();
    assert_eq!(hello.configuration, ImageStatus::Corrupt);
    assert_eq!(robot.order(&Command::Start), CommandResult::Refused(CommandError::NoConfiguration));
    assert!(!robot.loop_status().running);
}

/// The same program follows another configuration, and refuses one that the board does not support.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn one_program_follows_different_configurations() {
    let baked =
        |config: &RobotConfig| baked::write(config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec();
    for (period, expected) in [(100_000, 50), (50_000, 100)] {
        let encoder_period = sonarfix::geometry::units::Duration::from_ticks(period);
        let config = RobotConfig { encoder_period, ..configuration() };
        let mut robot = Robot::switched_on(&map(), &baked(&config));
        assert_eq!(robot.hello().configuration, ImageStatus::Valid(baked::checksum(&config)));
        assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
        assert_eq!(robot.order(&Command::Start), CommandResult::Done);
        robot.loop_status();
        let (mut samples, mut seconds) = (0_u32, 0);
        while seconds < 5 {
            match robot.next() {
                Telemetry::Estimate(_) => samples += 1,
                Telemetry::LoopStatus(_) => seconds += 1,
                _ => {}
            }
        }
        assert!(samples.abs_diff(expected) <= 1, "{samples} samples in 5 s");
    }
    let mut srf = configuration();
    srf.rangers.first.kind = RangerKind::Srf { address: 0x70 };
    let mut robot = Robot::switched_on(&map(), &baked(&srf));
    robot.hello();
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    let refused = CommandError::Unsupported(Unsupported::Ranger);
    assert_eq!(robot.order(&Command::Start), CommandResult::Refused(refused));
}

/// The emulator has no bus. A ranger of light is taken, with a second one beside it, and the first is reported as missing before
/// the loop runs and while it does; a third ranger is refused.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn rangers_of_light_are_taken_and_reported_as_missing() {
    let baked =
        |config: &RobotConfig| baked::write(config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec();
    for kind in [RangerSettings::VL53L1X.kind, RangerSettings::VL53L0X.kind] {
        let mut config = configuration();
        config.rangers.first.kind = kind;
        config.localizer.rangers.first.ranging = Ranging::Light(LightBeam::VL53L1X);
        let mut left = config.localizer.rangers.first;
        left.servo = (Radians::from_degrees(90.0), Radians::from_degrees(90.0));
        config.localizer.rangers.push(left).unwrap();
        config.rangers.push(config.rangers.first).unwrap();
        let mut robot = Robot::switched_on(&map(), &baked(&config));
        robot.hello();
        assert_eq!(robot.order(&Command::ShowDevices), CommandResult::Done);
        let ping = robot.wait_for(|message| match message {
            Telemetry::Devices(readings) => readings.ping,
            _ => None,
        });
        assert_eq!(ping, Err(NoEcho::Failed), "no sensor acknowledges its address");
        assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
        assert_eq!(robot.order(&Command::Start), CommandResult::Done);
        assert!(robot.loop_status().faults.ranger > 0);

        config.localizer.rangers.push(left).unwrap();
        config.rangers.push(config.rangers.first).unwrap();
        let mut robot = Robot::switched_on(&map(), &baked(&config));
        robot.hello();
        assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
        let refused = CommandError::Unsupported(Unsupported::Rangers);
        assert_eq!(robot.order(&Command::Start), CommandResult::Refused(refused));
    }
}

/// The emulator has no sensor. Each is reported as missing, before the loop runs and while it does; the loop runs
/// nevertheless.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_minute_of_ticks_without_a_missed_deadline() {
    let mut robot = Robot::switched_on(&map(), &config());
    let image = map();
    let checksum = u32::from_le_bytes(*image.last_chunk().unwrap());
    assert_eq!(robot.hello().map, ImageStatus::Valid(checksum));
    robot.loop_status();
    let status = robot.loop_status();
    let faults = status.faults;
    assert!(faults.right.errors > 0 && faults.left.errors > 0, "encoders: {faults:?}");
    assert!(faults.servo > 0 && faults.ranger > 0, "servo and ranger: {faults:?}");

    assert_eq!(
        robot.order(&Command::MapChecksum),
        CommandResult::Map(ImageStatus::Valid(checksum))
    );
    assert_eq!(robot.order(&Command::Start), CommandResult::Refused(CommandError::NoPose));
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Done);
    let began = robot.wait_for(|message| match message {
        Telemetry::Initialized(estimate) => Some(*estimate),
        _ => None,
    });
    assert_eq!(began.state.x.0.to_bits(), 1.0_f32.to_bits());

    // A minute by the robot's clock.
    let (mut ticks, mut worst) = (0, 0);
    let status = loop {
        match robot.next() {
            Telemetry::Estimate(_) => ticks += 1,
            Telemetry::LoopStatus(status) => {
                assert!(status.running && status.faults.deadlines == 0, "{status:?}");
                worst = worst.max(status.worst_poll.to_micros());
                if status.at > began.at + sonarfix::geometry::units::Duration::secs(60) {
                    break status;
                }
            }
            _ => {}
        }
    };
    assert!(ticks >= 600, "{ticks} ticks in a minute");
    assert!(status.faults.right.errors >= 600, "missing encoders are not counted: {status:?}");
    assert_eq!(status.faults.clock, 0);
    assert_eq!(robot.receiver.counters().skipped(), 0);
    println!("{ticks} ticks in a minute, none late; worst poll {worst} µs; {:?}", status.faults);
    check_memory(&mut robot);
}

/// The emulator has no device: the readings say so, ten times a second, and end when the loop starts.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_robot_that_waits_shows_that_its_devices_are_missing() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    assert_eq!(robot.order(&Command::ShowDevices), CommandResult::Done);
    let shown = |message: &Telemetry| match message {
        Telemetry::Devices(readings) => Some(*readings),
        _ => None,
    };
    let first = robot.wait_for(shown);
    let mut last = first;
    for _ in 0..50 {
        last = robot.wait_for(shown);
    }
    let micros = last.at.ticks() - first.at.ticks();
    assert!((4_900_000..5_200_000).contains(&micros), "50 readings in {micros} µs");
    assert_eq!((last.right.count, last.left.count, last.servo), (None, None, None));
    assert_eq!(last.ping, Some(Err(NoEcho::NoResponse)));
    assert_eq!((last.right.bits, last.right.metres_per_edge > 0.0), (16, true));
    assert_eq!(robot.may_drive(), Some(false));

    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Done);
    let refused = CommandResult::Refused(CommandError::Running);
    assert_eq!(robot.order(&Command::ShowDevices), refused);
    robot.pending.clear();
    for _ in 0..30 {
        assert_eq!(shown(&robot.next()), None, "the loop runs");
    }
}

/// A robot that waits checks its devices once a second and sends a few messages a second. It sleeps between, and not a
/// millisecond at a time.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_robot_that_waits_sleeps_until_something_is_due() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    let _monitor = robot.monitor("trace-event systick_write on");
    while robot.sleeps().len() < 100 {
        robot.next();
    }
    let sleeps = robot.sleeps();
    let mean = sleeps.iter().sum::<f64>() / f64::from(u32::try_from(sleeps.len()).unwrap());
    println!(
        "sleeps of {mean:.0} ms on average, at most {:.0} ms",
        sleeps.iter().copied().fold(0.0, f64::max)
    );
    // The watchdog needs a pass every 50 ms.
    assert!(mean > 35.0, "sleeps of {mean} ms");
}

/// The motor code runs in the firmware: forwards while the motors are enabled, and neither before nor after. The emulator
/// has no encoders, so the motors are enabled without them.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn the_motor_code_drives_while_the_motors_are_enabled() {
    let mut config = configuration();
    config.motors.dead_encoder = true;
    let image = baked::write(&config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec();
    let mut robot = Robot::switched_on(&map(), &image);
    robot.hello();
    let inputs = |robot: &mut Robot| -> Vec<u32> {
        let bytes = robot.memory(MOTORS_AT, 16);
        bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
    };
    assert_eq!(inputs(&mut robot), [0; 4], "it waits");
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Done);
    robot.pass_half_a_second();
    assert_eq!(robot.may_drive(), Some(true));
    // Four tenths of the 800 counts of a period at 16 MHz, on the inputs that drive forwards.
    assert_eq!(inputs(&mut robot), [320, 0, 320, 0]);
    assert_eq!(robot.order(&Command::Stop), CommandResult::Done);
    robot.pass_half_a_second();
    assert_eq!((robot.may_drive(), inputs(&mut robot)), (Some(false), vec![0; 4]));
}

/// Checks the deepest stack against the bound of `cargo xtask stack`. The stack lies below everything else
/// (`flip-link`) and grows down; the emulator's memory is zero at first, so the lowest byte that is not zero is the
/// deepest point.
fn check_memory(robot: &mut Robot) {
    let ram = robot.memory(RAM_AT, RAM);
    let deepest = ram.iter().position(|byte| *byte != 0).unwrap();
    let top = robot.memory(FLASH_AT, 4);
    let top = u32::from_le_bytes(*top.first_chunk().unwrap()) - RAM_AT;
    let (stack, rest) = (top as usize - deepest, RAM - top as usize);
    let bound: usize = std::env::var("SONARFIX_STACK").unwrap().parse().unwrap();
    println!("stack {stack} bytes at the deepest, of at most {bound}; everything else {rest}");
    assert!(rest > 1_000, "flip-link has not put the stack below everything else");
    assert!(stack <= bound, "the stack is deeper than its bound");
}

#[test]
#[ignore = "cargo xtask test-firmware"]
fn garbage_is_counted_and_later_commands_are_executed_once() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    let before = robot.loop_status().commands;

    // Noise, a cut frame, and a damaged one.
    let whole = robot.frame(200, &Command::Start);
    let mut damaged = whole.clone();
    damaged[5] ^= 0x10;
    let noise: Vec<u8> = (1..200_u8).map(|n| n.wrapping_mul(113)).collect();
    for garbage in [&noise[..], &whole[..whole.len() / 2], &damaged] {
        robot.send(garbage);
    }
    // Later commands are executed, and the garbage has not been taken for a start.
    assert_eq!(robot.order(&Command::MapChecksum), {
        let image = map();
        CommandResult::Map(ImageStatus::Valid(u32::from_le_bytes(*image.last_chunk().unwrap())))
    });
    robot.loop_status();
    let status = robot.loop_status();
    assert!(!status.running, "garbage has started the loop");
    assert!(status.commands.skipped() >= before.skipped() + 3, "{:?}", status.commands);

    // A frame that is sent twice, because its answer was lost, is answered twice and executed once.
    robot.send(&whole);
    assert_eq!(robot.answer_to(200), CommandResult::Done);
    robot.sender = Sender::starting_at(201);
    assert_eq!(robot.order(&Command::Stop), CommandResult::Done);
    assert!(!robot.loop_status().running);
    // The same frame now is an old one.
    robot.send(&whole);
    assert_eq!(robot.answer_to(200), CommandResult::Refused(CommandError::Session));
    let again = robot.frame(210, &Command::Start);
    robot.send(&again);
    robot.send(&again);
    let began = |message: &Telemetry| matches!(message, Telemetry::Initialized(_)).then_some(());
    assert_eq!(robot.answer_to(210), CommandResult::Done);
    robot.wait_for(began);
    assert_eq!(robot.answer_to(210), CommandResult::Done);
    assert!(robot.loop_status().running);
}

/// Bytes in 100 ms at 115,200 baud.
const LINE_RATE: usize = 1_152;

/// Runs the loop for a minute by the robot's clock. With each sample of the encoders, every 100 ms, `load` arrives. Nothing
/// is late, the robot is not reset, and, because its encoders cannot be read here, it is not `Tracking` after 0.7 s.
fn a_minute_under(robot: &mut Robot, mut load: impl FnMut(&Robot) -> Vec<u8>) -> LoopStatus {
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Done);
    let first = robot.loop_status();
    let (mut ticks, mut blind) = (0, 0);
    loop {
        match robot.next() {
            Telemetry::Estimate(estimate) => {
                ticks += 1;
                blind += 1;
                let is_tracking = estimate.health.verdict == Verdict::Tracking;
                assert!(blind < 7 || !is_tracking, "{blind} samples without odometry");
                robot.offer(&mut load);
            }
            // The pose was set again.
            Telemetry::PoseSet(_) => blind = 0,
            Telemetry::LoopStatus(status) => {
                assert!(status.running && status.faults.deadlines == 0, "{status:?}");
                assert!(status.at > first.at, "the robot was reset: {status:?}");
                if status.at > first.at + sonarfix::geometry::units::Duration::secs(60) {
                    let worst = status.worst_poll.to_micros();
                    println!("{ticks} ticks; worst poll {worst} µs; {:?}", status.commands);
                    // Telemetry for which the line has no room is dropped.
                    return status;
                }
            }
            _ => {}
        }
    }
}

/// As much garbage as the line takes while the loop runs.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_minute_of_garbage_costs_no_deadline() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    let mut random = 1_u32;
    let status = a_minute_under(&mut robot, |_| {
        let mut byte = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as u8
        };
        (0..LINE_RATE).map(|_| byte()).collect()
    });
    // Of the line rate the emulated UART accepts an eighth; `cargo xtask pil` loads the loop with all of it.
    assert!(status.commands.skipped() > 60, "{:?}", status.commands);
}

/// As many valid commands as the line takes while the loop runs.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_minute_of_commands_costs_no_deadline() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    let mut sequence = 1_000;
    let before = robot.receiver.counters();
    let status = a_minute_under(&mut robot, |robot| {
        let mut bytes = Vec::new();
        while bytes.len() < LINE_RATE - 60 {
            sequence += 1;
            let command = match sequence % 40 {
                0 => Command::SetPose(pose()),
                odd if odd % 2 == 1 => Command::Start,
                _ => Command::MapChecksum,
            };
            bytes.extend(robot.frame(sequence, &command));
        }
        bytes
    });
    assert!(status.commands.frames > 1_000, "{:?}", status.commands);
    assert_eq!(robot.receiver.counters().corrupt, before.corrupt);
}

/// Nobody reads the link for a while in the middle of a frame, then commands are executed again.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn half_a_frame_and_silence_cost_no_deadline() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.hello();
    let mut samples = 0;
    a_minute_under(&mut robot, |robot| {
        samples += 1;
        let frame = robot.frame(500, &Command::Stop);
        if samples % 50 == 0 { frame[..frame.len() / 2].to_vec() } else { Vec::new() }
    });
    robot.send(&[0]);
    robot.sender = Sender::starting_at(600);
    assert_eq!(robot.order(&Command::Stop), CommandResult::Done);
}

/// After a fault the program clears the motor pin before it ends.
#[test]
#[ignore = "cargo xtask test-firmware"]
fn a_fault_stops_the_motors() {
    let mut robot = Robot::switched_on(&map(), &config());
    robot.pass_half_a_second();
    assert_eq!(robot.may_drive(), Some(false));
    assert_eq!(robot.order(&Command::SetPose(pose())), CommandResult::Done);
    assert_eq!(robot.order(&Command::Start), CommandResult::Done);
    robot.pass_half_a_second();
    // Its encoders cannot be read here.
    assert_eq!(robot.may_drive(), Some(false));
    robot.jump_to_invalid_code();
    while !robot.has_driven() || robot.may_drive() == Some(true) {
        robot.listen();
    }
}
