//! A simulated robot: an app on devices that the test controls, with a PC at its link.

use std::cell::Cell;
use std::collections::VecDeque;
use std::rc::Rc;

use embedded_hal::pwm;
use sonarfix::config::{Config, ServoTiming};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents, Link, Polled};
use sonarfix_hal::config::{RobotConfig, WheelConfig};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{
    Echo, NoEcho, Outcome, Ranger, RangerKind, RangerSettings, TriggerError, UnsupportedKind,
};
use sonarfix_hal::robot::Devices;
use sonarfix_hal::servo::{PwmFrame, Servo};
use sonarfix_link::message::{CommandResult, Estimate, LoopStatus, ResetCause};
use sonarfix_link::{Command, Receiver, Sender, SessionCommand, Telemetry, baked, frame};

use crate::flash::{SECTOR, SECTORS, SimFlash};
use crate::room::Truth;

/// At 20 °C, m/s.
const SPEED_OF_SOUND: f32 = 343.2;

/// The error of a device that is missing.
#[derive(Debug, Clone, Copy)]
pub struct Missing;

impl pwm::Error for Missing {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

/// An encoder at a count; `None` if it cannot be read.
pub struct Encoder(pub Option<u16>);

impl Counter for Encoder {
    type Error = Missing;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Missing> {
        self.0.map(u32::from).ok_or(Missing)
    }
}

/// A servo's PWM channel, present or missing, and its last duty.
pub struct Pwm {
    is_there: Rc<Cell<bool>>,
    pub duty: u16,
}

impl pwm::ErrorType for Pwm {
    type Error = Missing;
}

impl pwm::SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        40_000
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Missing> {
        self.duty = duty;
        if self.is_there.get() { Ok(()) } else { Err(Missing) }
    }
}

/// A ranger in a room or without echoes, or a missing one.
pub struct Sonar {
    pub is_there: bool,
    /// The echo that a ping would have; none without a room.
    pub echo: Option<Metres>,
    /// Triggers that it refuses as too soon.
    pub refusals: u32,
    /// The ping in flight.
    ping: Option<Ping>,
}

impl Sonar {
    /// Whether a ping is in flight.
    pub fn is_pinging(&self) -> bool {
        self.ping.is_some()
    }
}

struct Ping {
    sent: Instant,
    echo: Option<Metres>,
}

impl Ranger for Sonar {
    type Error = Missing;

    fn ready_at(&self) -> Instant {
        Instant::from_ticks(0)
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Missing>> {
        if self.refusals > 0 {
            self.refusals -= 1;
            return Err(TriggerError::TooSoon);
        }
        self.ping = Some(Ping { sent: now, echo: self.echo });
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Missing> {
        let Some(Ping { sent, echo }) = self.ping.take() else { return Ok(None) };
        let silence = if self.is_there { NoEcho::Nothing } else { NoEcho::NoResponse };
        let Some(range) = echo.filter(|_| self.is_there) else { return Ok(Some(Err(silence))) };
        let heard = sent + flight(range);
        if now < heard {
            self.ping = Some(Ping { sent, echo });
            return Ok(None);
        }
        Ok(Some(Ok(Echo { sent, heard, range })))
    }

    fn poll_at(&self) -> Option<Instant> {
        let Ping { sent, echo } = self.ping.as_ref()?;
        Some(*sent + flight((*echo)?))
    }

    /// The same check as the driver of a pulse ranger.
    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let is_pulse = matches!(settings.kind, RangerKind::Pulse(_));
        if is_pulse { Ok(()) } else { Err(UnsupportedKind) }
    }
}

/// The time of flight of an echo.
fn flight(range: Metres) -> Duration {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some milliseconds"
    )]
    Duration::from_ticks((2e6 * range.0 / SPEED_OF_SOUND) as u64)
}

type Hardware = Devices<Encoder, Encoder, Pwm, Sonar>;

/// The link, with its bytes counted.
#[derive(Default)]
pub struct Line {
    pub is_unplugged: bool,
    to_robot: VecDeque<u8>,
    from_robot: Vec<u8>,
    pub sent: usize,
}

impl Link for Line {
    fn receive(&mut self) -> Option<u8> {
        let byte = self.to_robot.pop_front();
        byte.filter(|_| !self.is_unplugged)
    }

    fn send(&mut self, frame: &[u8]) {
        if self.is_unplugged {
            return;
        }
        self.sent += frame.len();
        self.from_robot.extend(frame);
    }
}

/// The contents of the flash besides the store.
pub struct Baked {
    pub map: Vec<u8>,
    pub config: Vec<u8>,
}

impl Baked {
    /// A room and a robot, each followed by erased flash.
    pub fn new(config: &RobotConfig) -> Self {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
        let point = |(x, y): (f32, f32)| Point::new(x, y);
        let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
        let walls: Vec<Wall> = corners.windows(2).map(wall).collect();
        let mut map = sonarfix_map::bake(&walls).unwrap();
        let mut config = baked::write(config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec();
        map.resize(map.len() + 1_000, 0xFF);
        config.resize(config.len() + 100, 0xFF);
        Self { map, config }
    }
}

/// The configuration of most tests.
pub fn config() -> RobotConfig {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.prior.range_scale = 0.02;
    localizer.rangers.first.servo = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    let wheel = WheelConfig::of_diameter(Metres(0.065), 1_024.0);
    let config = RobotConfig::with_common_parts(localizer);
    RobotConfig { right_wheel: wheel, left_wheel: wheel, ..config }
}

/// A PWM channel with a frame of 20 ms, which makes pulses of 400 to 2,600 µs.
pub fn servo(is_there: &Rc<Cell<bool>>) -> Servo<Pwm> {
    let micros = Duration::from_ticks;
    let frame = PwmFrame { period: micros(20_000), shortest: micros(400), longest: micros(2_600) };
    Servo::new(Pwm { is_there: Rc::clone(is_there), duty: 0 }, frame)
}

/// A start pose with small deviations.
pub fn start() -> Start {
    Start {
        pose: Pose::new(1.0, 1.5, Radians(0.5)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.01),
    }
}

/// A robot that is switched on.
pub struct Bench<'m> {
    pub app: App<'m, SimFlash>,
    pub hardware: Hardware,
    pub line: Line,
    pub now: u64,
    /// Where the robot is, if its sonar hears the room.
    pub truth: Option<Truth>,
    /// Whether the servo can be commanded.
    pub servo_is_there: Rc<Cell<bool>>,
    /// Edges of the right and the left encoder, which go on while it is dead.
    pub counted: [u16; 2],
    /// The result of its first poll.
    pub first: Polled,
    receiver: Receiver<Telemetry>,
    sender: Sender<SessionCommand>,
    pub session: u32,
}

impl<'m> Bench<'m> {
    /// Switches a robot on, with this in its flash.
    pub fn switched_on(baked: &'m Baked, flash: SimFlash) -> Self {
        Self::reset(baked, flash, 0)
    }

    /// The same after so many resets in a row.
    pub fn reset(baked: &'m Baked, flash: SimFlash, resets: u8) -> Self {
        let board = Board { firmware: [1, 2, 3], reset: ResetCause::PowerOn, resets };
        let store = Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap();
        let flash = FlashContents::read(&baked.map, &baked.config);
        let app = App::new(board, flash, store, Instant::from_ticks(0));
        let servo_is_there = Rc::new(Cell::new(true));
        let hardware = Devices {
            right: Encoder(Some(0)),
            left: Encoder(Some(0)),
            servo: servo(&servo_is_there),
            ranger: Sonar { is_there: true, echo: None, refusals: 0, ping: None },
        };
        let (receiver, sender) = (Receiver::new(), Sender::starting_at(1));
        let (line, first) = (Line::default(), Polled::default());
        let mut bench = Self {
            app,
            hardware,
            line,
            now: 0,
            truth: None,
            servo_is_there,
            counted: [0; 2],
            first,
            receiver,
            sender,
            session: 0,
        };
        bench.first = bench.poll();
        bench.open_session();
        bench
    }

    /// Disconnects devices: a bit for each of right encoder, left encoder, servo and ranger. Those that
    /// remain are at rest.
    pub fn disconnect(&mut self, missing: u32) {
        let has = |bit: u32| missing & (1 << bit) == 0;
        self.hardware.right.0 = has(0).then_some(7);
        self.hardware.left.0 = has(1).then_some(7);
        self.servo_is_there.set(has(2));
        // A driver that has never set its channel.
        self.hardware.servo = servo(&self.servo_is_there);
        self.hardware.servo.configure(&config().servo_settings().unwrap()).unwrap();
        self.hardware.ranger.is_there = has(3);
    }

    /// Switches the robot off and returns its flash.
    pub fn switched_off(self) -> SimFlash {
        self.app.release().release()
    }

    /// Polls the app, a millisecond after the last poll.
    pub fn poll(&mut self) -> Polled {
        self.now += 1_000;
        if let Some(truth) = &self.truth {
            let bearing = self.hardware.servo.target().unwrap_or(Radians(0.0));
            let range = truth.range(bearing.0.into());
            self.hardware.ranger.echo = range.map(|range| Metres(range as f32));
        }
        self.app.poll(Instant::from_ticks(self.now), &mut self.hardware, &mut self.line)
    }

    /// The time of the last poll, µs.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Sets the clock: the next poll is a millisecond later.
    pub fn set_now(&mut self, now: u64) {
        self.now = now;
    }

    /// Bytes on the line to the robot that it has not read.
    pub fn unread(&self) -> usize {
        self.line.to_robot.len()
    }

    /// When the app asks to be polled next, µs.
    pub fn next_poll(&mut self) -> u64 {
        self.app.next_poll(&mut self.hardware).ticks()
    }

    /// Rolls both wheels, whose encoders count unless they are dead.
    pub fn roll(&mut self, right: i16, left: i16) {
        let count = |encoder: &mut Encoder, counted: &mut u16, edges: i16| {
            *counted = counted.wrapping_add_signed(edges);
            encoder.0 = encoder.0.and(Some(*counted));
        };
        let [counted_right, counted_left] = &mut self.counted;
        count(&mut self.hardware.right, counted_right, right);
        count(&mut self.hardware.left, counted_left, left);
        if let Some(truth) = &mut self.truth {
            truth.roll(right, left);
        }
    }

    /// Makes encoders, servo and sonar work again; the encoders have gone on counting.
    pub fn mend(&mut self) {
        let [right, left] = self.counted;
        (self.hardware.right.0, self.hardware.left.0) = (Some(right), Some(left));
        self.servo_is_there.set(true);
        self.hardware.ranger.is_there = true;
    }

    /// Distance of the estimated position from the true one, metres.
    pub fn error(&self) -> f64 {
        let truth = self.truth.expect("the robot is in the room");
        let state = self.estimate().state;
        (f64::from(state.x.0) - truth.x).hypot(f64::from(state.y.0) - truth.y)
    }

    /// Polls for a time, and returns the messages received.
    pub fn wait(&mut self, millis: u64) -> Vec<Telemetry> {
        for _ in 0..millis {
            let _ = self.poll();
        }
        self.received()
    }

    /// The messages received since the last call.
    pub fn received(&mut self) -> Vec<Telemetry> {
        let bytes = std::mem::take(&mut self.line.from_robot);
        let frames = bytes.into_iter().filter_map(|byte| self.receiver.push(byte));
        frames.map(|frame| frame.message).collect()
    }

    /// Opens a session, and restarts the sequence numbers.
    pub fn open_session(&mut self) {
        self.sender = Sender::starting_at(1);
        let CommandResult::Session(session) = self.order(&Command::OpenSession) else {
            panic!("a session is opened at any time")
        };
        self.session = session;
    }

    /// Puts a command on the line.
    pub fn send(&mut self, command: &Command) {
        let frame = self.frame(command);
        self.line.to_robot.extend(&frame);
    }

    /// The next frame, of this command.
    pub fn frame(&mut self, command: &Command) -> Vec<u8> {
        let command = SessionCommand { session: self.session, command: *command };
        self.sender.frame(&command, &mut frame::EMPTY.clone()).to_vec()
    }

    /// Puts these bytes on the line.
    pub fn garble(&mut self, bytes: &[u8]) {
        self.line.to_robot.extend(bytes);
    }

    /// Polls until the robot has read the whole line, and discards its messages.
    pub fn drain(&mut self) {
        while !self.line.to_robot.is_empty() {
            let _ = self.poll();
        }
        self.line.from_robot.clear();
    }

    /// Sends a command, and returns its answer: by the poll that reads its last byte.
    pub fn order(&mut self, command: &Command) -> CommandResult {
        self.send(command);
        loop {
            let answered = self.poll().answered;
            if self.line.to_robot.is_empty() {
                return answered.expect("a command is answered at once");
            }
        }
    }

    /// The estimate of a running robot.
    pub fn estimate(&self) -> Estimate {
        sonarfix_link::reporter::estimate(self.app.localizer().expect("it runs"))
    }
}

/// A robot whose loop runs.
pub fn running(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done);
    }
    bench
}

/// The last loop status among these messages.
pub fn loop_status(messages: &[Telemetry]) -> LoopStatus {
    let found = messages.iter().rev().find_map(|message| match message {
        Telemetry::LoopStatus(status) => Some(*status),
        _ => None,
    });
    found.expect("no LoopStatus, which is sent once a second")
}
