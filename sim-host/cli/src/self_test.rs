//! `sonarfix command self-test`: a report of a board, for somebody who has one.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use anyhow::{bail, ensure};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix_link::{Command, CommandResult, Receiver, Telemetry};
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_monitor::self_test::{SelfTest, Verdict};

use crate::goto;

#[derive(Debug, clap::Args)]
#[group(skip)]
pub struct Args {
    /// A wire connects the pin of the servo's pulses with that of the echo, and the sonar is unplugged: the captured widths are compared
    /// with the pulses.
    #[arg(long = "loop")]
    is_looped: bool,
    /// For how long the devices are read: at least a turn of the servo to both sides.
    #[arg(long, default_value_t = 20.0)]
    seconds: f64,
}

/// From a pose to a status of the loop with its record, which comes once a second.
const STORED_WITHIN: Duration = Duration::from_secs(3);

/// The pose that is stored: any one.
fn pose() -> Command {
    Command::SetPose(Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: Metres(0.1),
        heading_deviation: Radians(0.1),
    })
}

/// Tests the board, and prints the report.
pub fn execute(args: &Args, port: &mut Port) -> anyhow::Result<()> {
    let mut watch = Watch {
        test: SelfTest::new(args.is_looped),
        receiver: Receiver::new(),
        began: Instant::now(),
    };
    let shown = watch.ask(port, &Command::ShowDevices)?;
    if let CommandResult::Refused(reason) = shown {
        bail!("the robot refuses: {reason}");
    }
    watch.listen(port, goto::seconds(args.seconds, "--seconds")?)?;
    let before = watch.test.writes();
    let answer = watch.ask(port, &pose())?;
    watch.test.answered(answer, before);
    watch.listen(port, STORED_WITHIN)?;
    let findings = watch.test.findings(&watch.receiver.counters());
    for finding in &findings {
        println!("{finding}");
    }
    let failed = findings.iter().filter(|it| it.verdict == Verdict::Failed).count();
    if answer == CommandResult::Done {
        println!("The robot has the pose 0, 0, 0 now: set its own before a start.");
    }
    println!("Send this report with the board's name and revision (docs/boards.md).");
    ensure!(failed == 0, "{failed} parts failed");
    Ok(())
}

/// The test, and what has been received.
struct Watch {
    test: SelfTest,
    receiver: Receiver<Telemetry>,
    began: Instant,
}

impl Watch {
    fn take(&mut self, byte: u8) {
        if let Some(frame) = self.receiver.push(byte) {
            self.test.take(&frame.message, self.began.elapsed());
        }
    }

    fn ask(&mut self, port: &mut Port, command: &Command) -> anyhow::Result<CommandResult> {
        request::ask_and_watch(port, command, |byte| self.take(byte))
    }

    fn listen(&mut self, port: &mut Port, time: Duration) -> anyhow::Result<()> {
        let since = Instant::now();
        let end = port.read(|bytes| {
            for &byte in bytes {
                self.take(byte);
            }
            let is_over = since.elapsed() >= time;
            Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        })?;
        ensure!(end.is_some(), "the port was closed");
        Ok(())
    }
}
