//! `sonarfix monitor`: shows the telemetry of a robot and records it.

use std::io::{IsTerminal, stdout};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, ensure};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyModifiers};
use sonarfix_link::{Motion, Telemetry};
use sonarfix_monitor::log_files::LogFiles;
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_monitor::teleoperation::{Direction, Teleoperation};
use sonarfix_monitor::terminal::{self, History};
use sonarfix_sim::trace::Wall;
use sonarfix_telemetry::order::{Order, Orders, Reply};
use sonarfix_telemetry::recording::Recording;
use sonarfix_telemetry::robot::Robot;
use sonarfix_telemetry::{Monitor, Received, view};

use crate::recorded::Sources;
use crate::serve::{self, ServeArgs};
use crate::signs_of_life;
use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::{catch_interrupt, is_interrupted};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Records the inputs of the robot's localizer for `sonarfix replay`. When the robot restarts,
    /// a new log begins, with a number in its name.
    #[arg(long, value_name = "LOG.csv")]
    record: Option<PathBuf>,
    /// Replaces files that exist by the recording.
    #[arg(long, requires = "record")]
    force: bool,
    /// Shows what each device of a robot that waits reads, with hints (docs/build-a-robot.md). The sonar turns and pings; the
    /// motors stay off.
    #[arg(long, conflicts_with_all = ["record", "serve"])]
    signs_of_life: bool,
    /// Ends the signs of life after this time by the robot's clock.
    #[arg(long, requires = "signs_of_life", value_name = "SECONDS")]
    seconds: Option<f64>,
    /// The robot's map, to draw it and to name its walls.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// The robot file, for the place of the sonar, the track width, and wheels that differ from it.
    #[arg(long, value_name = "ROBOT.toml")]
    robot: Option<PathBuf>,
    #[command(flatten)]
    page: ServeArgs,
}

/// The connection to a robot.
#[derive(Debug, clap::Args)]
pub struct PortArgs {
    /// A serial port, `tcp:HOST:PORT`, a file of recorded bytes, or `-` for the standard input.
    #[arg(long)]
    port: String,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
}

impl PortArgs {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.port
    }

    /// Opens it.
    pub fn open(&self) -> anyhow::Result<Port> {
        Port::open(&self.port, self.baud)
    }
}

/// Period of the lines without a terminal, µs of the robot's clock.
const EVERY: u64 = 1_000_000;
/// Least time between two drawings of a terminal.
const REDRAW: Duration = Duration::from_millis(50);
/// Period in which Ctrl-C is noticed after the end of the stream.
const PATIENCE: Duration = Duration::from_millis(100);

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(file) = &args.record {
        check_file("--record", file)?;
        let is_old = std::fs::metadata(file).is_ok_and(|file| file.is_file());
        let file = file.display();
        ensure!(
            args.force || !is_old,
            "--record: {file} exists: name another file, or replace it with --force"
        );
    }
    let title = format!("Sonarfix: {}", args.port.port);
    let (map, robot) = (args.map.as_deref(), args.robot.as_deref());
    let (mut scene, mount) = serve::scene_of_robot(title, map, robot)?;
    let mut port = args.port.open()?;
    if args.signs_of_life {
        return signs_of_life::execute(&mut port, args.seconds);
    }
    scene.commands = port.can_send();
    let (feed, orders) = args.page.start(Sources { map, robot })?;
    let mut screen = Screen::new(scene.walls.clone());
    let mut robot = Robot::new(feed, scene, mount, request::conversation(), new_recording);
    if let Some(path) = &args.record {
        robot.record(Recording::new(LogFiles::new(path.clone(), args.force)));
    }
    catch_interrupt();
    let ended = watch(&mut port, &mut robot, orders.as_ref(), &mut screen);
    let names = screen.end();
    let summarized = summarize(&mut robot, &names);
    let reason = match &ended {
        Ok(End::Asked) => return summarized,
        Ok(End::Stream) => "the stream has ended".to_owned(),
        Err(error) => format!("{error:#}"),
    };
    robot.end(&reason);
    if let Some(orders) = orders {
        eprintln!("{reason}; the page stays until Ctrl-C");
        stay(&orders, &reason);
    }
    ended.and(summarized)
}

/// Why telemetry is no longer read.
enum End {
    /// The user has ended it.
    Asked,
    /// There is no more.
    Stream,
}

/// What interrupts the reading of telemetry.
enum Next {
    Send(Vec<u8>),
    End,
}

/// Reads telemetry and sends commands until the end.
fn watch(
    port: &mut Port,
    robot: &mut Robot,
    orders: Option<&Orders>,
    screen: &mut Screen,
) -> anyhow::Result<End> {
    let began = Instant::now();
    loop {
        let next = port.read(|bytes| -> anyhow::Result<ControlFlow<Next>> {
            robot.take(bytes, |monitor, received| screen.take(monitor, received))?;
            if is_interrupted() || screen.show(robot, began.elapsed())?.is_break() {
                return Ok(ControlFlow::Break(Next::End));
            }
            screen.drive(robot, Instant::now());
            let bytes = robot.obey(orders, began.elapsed());
            Ok(bytes
                .map_or(ControlFlow::Continue(()), |bytes| ControlFlow::Break(Next::Send(bytes))))
        })?;
        match next {
            None => return Ok(End::Stream),
            Some(Next::End) => return Ok(End::Asked),
            Some(Next::Send(bytes)) => port.send(&bytes)?,
        }
    }
}

/// The last telemetry, and where the recordings are.
fn summarize(robot: &mut Robot, names: &[String]) -> anyhow::Result<()> {
    println!("{}", view::page(robot.monitor(), names));
    for text in robot.recorded() {
        eprintln!("{text}");
    }
    let Some((path, logs)) = robot.end_recording() else { return Ok(()) };
    match logs.with_context(|| format!("cannot write {path}"))? {
        0 => eprintln!("nothing was recorded: the robot sent no estimate"),
        1 => eprintln!("recorded {path}"),
        logs => eprintln!("recorded {path} and {} more, one for each start", logs - 1),
    }
    Ok(())
}

/// A recording into a new file in the working folder.
fn new_recording() -> Recording {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let path = PathBuf::from(format!("recording-{}.csv", now.as_secs()));
    Recording::new(LogFiles::new(path, false))
}

/// Keeps the page until Ctrl-C.
fn stay(orders: &Orders, reason: &str) {
    while !is_interrupted() {
        if let Some(ordered) = orders.wait(PATIENCE) {
            ordered.answer(Reply::refused(reason));
        }
    }
}

/// A terminal that is redrawn; elsewhere periodic lines.
struct Screen {
    walls: Vec<Wall>,
    names: Vec<String>,
    output: Output,
}

enum Output {
    Terminal {
        terminal: Box<DefaultTerminal>,
        history: History,
        drawn: Option<Instant>,
        keys: Teleoperation,
        /// The motion of the keys that was last passed on.
        passed: Option<Motion>,
    },
    Lines {
        next: u64,
    },
}

impl Screen {
    fn new(walls: Vec<Wall>) -> Self {
        let names = walls.iter().map(|wall| wall.name.clone()).collect();
        let terminal = if stdout().is_terminal() { ratatui::try_init().ok() } else { None };
        let output = match terminal {
            Some(terminal) => Output::Terminal {
                terminal: Box::new(terminal),
                history: History::default(),
                drawn: None,
                keys: Teleoperation::default(),
                passed: None,
            },
            None => Output::Lines { next: 0 },
        };
        Self { walls, names, output }
    }

    /// Takes a message; prints a line for a notable one.
    fn take(&mut self, monitor: &Monitor, received: &Received) {
        let next = match &mut self.output {
            Output::Terminal { history, .. } => return history.take(received),
            Output::Lines { next } => next,
        };
        match &received.telemetry {
            Telemetry::Hello(hello) => println!("{}", view::hello(hello)),
            Telemetry::Initialized(_) | Telemetry::PoseSet(_) => {
                println!("began   {}", view::line(monitor, &self.names));
                *next = 0;
            }
            Telemetry::Estimate(estimate) if estimate.at.ticks() >= *next => {
                println!("{}", view::line(monitor, &self.names));
                *next = estimate.at.ticks().saturating_add(EVERY);
            }
            _ => {}
        }
    }

    /// Draws the terminal, if it is due, and takes its keys; breaks to end.
    fn show(&mut self, robot: &mut Robot, time: Duration) -> anyhow::Result<ControlFlow<()>> {
        let Output::Terminal { terminal, history, drawn, keys, .. } = &mut self.output else {
            return Ok(ControlFlow::Continue(()));
        };
        if drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
            return Ok(ControlFlow::Continue(()));
        }
        *drawn = Some(Instant::now());
        while event::poll(Duration::ZERO)? {
            if let Event::Key(key) = event::read()?
                && obey_key(key.code, key.modifiers, robot, keys, time).is_break()
            {
                return Ok(ControlFlow::Break(()));
            }
        }
        let recording = robot.recording();
        let screen = terminal::Screen {
            monitor: robot.monitor(),
            history,
            walls: &self.walls,
            names: &self.names,
            recording: recording.as_deref(),
            notice: robot.notice(),
            teleoperation: robot.can_be_commanded().then_some(&*keys),
        };
        terminal.draw(|frame| screen.draw(frame))?;
        Ok(ControlFlow::Continue(()))
    }

    /// Tells the robot what the keys say, if it has changed: the motion that a page commands stays otherwise.
    fn drive(&mut self, robot: &mut Robot, now: Instant) {
        let Output::Terminal { keys, passed, .. } = &mut self.output else { return };
        let motion = keys.motion(now);
        if *passed != motion {
            *passed = motion;
            robot.drive(motion);
        }
    }

    /// Restores the terminal; the names of the walls.
    fn end(self) -> Vec<String> {
        if let Output::Terminal { .. } = self.output {
            ratatui::restore();
        }
        self.names
    }
}

/// A key of the terminal, where Ctrl-C is one as well.
fn obey_key(
    key: KeyCode,
    modifiers: KeyModifiers,
    robot: &mut Robot,
    keys: &mut Teleoperation,
    time: Duration,
) -> ControlFlow<()> {
    match key {
        KeyCode::Char('c') if modifiers.contains(KeyModifiers::CONTROL) => ControlFlow::Break(()),
        KeyCode::Char('q') => ControlFlow::Break(()),
        _ => {
            match key {
                KeyCode::Char('s') => robot.ask(Order::Start, time),
                KeyCode::Char('x') => {
                    keys.release();
                    robot.ask(Order::Stop, time);
                }
                KeyCode::Char(' ') => keys.stop(),
                KeyCode::Esc => keys.release(),
                KeyCode::Char('+') => keys.change_speed(true),
                KeyCode::Char('-') => keys.change_speed(false),
                KeyCode::Up => keys.press(Direction::Ahead, Instant::now()),
                KeyCode::Down => keys.press(Direction::Back, Instant::now()),
                KeyCode::Left => keys.press(Direction::Left, Instant::now()),
                KeyCode::Right => keys.press(Direction::Right, Instant::now()),
                KeyCode::Char('r') => {
                    let on = robot.recording().is_none();
                    robot.ask(Order::Record { on }, time);
                }
                _ => {}
            }
            ControlFlow::Continue(())
        }
    }
}
