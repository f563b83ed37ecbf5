//! A virtual robot: sends the telemetry of a simulated drive to whoever connects, in real time, and acknowledges commands:
//! `robot ADDRESS SECONDS`.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use sonarfix_link::message::Ack;
use sonarfix_link::{Command, CommandResult, Receiver, Sender, SessionCommand, Telemetry, frame};
use sonarfix_ros::drive::Drive;
use sonarfix_ros::parameters::Parameters;
use sonarfix_ros::view::Frames;

struct Robot {
    stream: TcpStream,
    sender: Sender<Telemetry>,
    receiver: Receiver<SessionCommand>,
}

impl Robot {
    fn send(&mut self, telemetry: &Telemetry) -> std::io::Result<()> {
        let mut buffer = frame::EMPTY;
        let bytes = self.sender.frame(telemetry, &mut buffer);
        self.stream.write_all(bytes)
    }

    /// Acknowledges what has arrived.
    fn answer(&mut self) -> std::io::Result<()> {
        let mut buffer = [0; 512];
        let count = match self.stream.read(&mut buffer) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => 0,
            Err(error) => return Err(error),
        };
        for &byte in buffer.get(..count).unwrap_or_default() {
            let Some(frame) = self.receiver.push(byte) else { continue };
            let result = match frame.message.command {
                Command::OpenSession => CommandResult::Session(1),
                _ => CommandResult::Done,
            };
            eprintln!("{:?}", frame.message.command);
            self.send(&Telemetry::Ack(Ack { sequence: frame.sequence, result }))?;
        }
        Ok(())
    }

    fn play(&mut self, drive: &Drive) -> std::io::Result<()> {
        let begin = Instant::now();
        for (at, telemetry) in &drive.telemetry {
            let due = Duration::from_nanos(u64::try_from(*at).unwrap_or(0));
            while begin.elapsed() < due {
                self.answer()?;
            }
            self.send(telemetry)?;
        }
        loop {
            self.answer()?;
        }
    }
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let address = arguments.next().context("robot ADDRESS SECONDS")?;
    let seconds: f64 = arguments.next().context("robot ADDRESS SECONDS")?.parse()?;
    let drive = Drive::classroom(seconds, 0, &Frames::of(&Parameters::default()))?;
    let listener = TcpListener::bind(&address)?;
    eprintln!("listens at {address}");
    for stream in listener.incoming() {
        let stream = stream?;
        stream.set_read_timeout(Some(Duration::from_millis(5)))?;
        let mut robot = Robot { stream, sender: Sender::starting_at(0), receiver: Receiver::new() };
        if let Err(error) = robot.play(&drive) {
            eprintln!("{error}");
            thread::sleep(Duration::from_millis(100));
        }
    }
    Ok(())
}
