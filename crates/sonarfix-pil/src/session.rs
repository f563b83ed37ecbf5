//! Executes requests: on a microcontroller, and on the PC for comparison.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::{self, AbsoluteFix, AbsoluteRefusal, Fix, Localizer};
use sonarfix::map::{Map, image};
use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents, Link};
use sonarfix_hal::robot::Report;
use sonarfix_link::message::ResetCause;
use sonarfix_link::{Command, CommandResult, Sender, SessionCommand, baked, frame};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Search;

use crate::board::{self, WiredDevices};
use crate::load::{Load, Traffic};
use crate::message::{Answer, Begin, Request, RequestError, SessionKind, Snapshot};
use crate::meter::Meter;
use crate::ram_flash::{CAPACITY, RamFlash};
use crate::wires::{Actuators, Sensors, Wires};

/// A session: a localizer alone, or the shipped loop on simulated wires.
#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
pub enum Session<'m> {
    /// A localizer alone.
    Localizer {
        /// The localizer.
        localizer: Localizer<'m>,
        /// Its last aim.
        aim: Option<Aim>,
    },
    /// The shipped loop and the drivers.
    Loop(LoopSession<'m>),
}

/// The application with its devices.
pub struct LoopSession<'m> {
    app: App<'m, RamFlash>,
    wires: &'m Wires,
    devices: WiredDevices<'m>,
    traffic: Traffic,
}

impl<'m> Session<'m> {
    /// Begins a session; returns what the first polls of a loop did to the devices, and the instructions of the longest of them:
    /// the first reads the store, others set the pose and start the loop.
    ///
    /// # Errors
    /// [`RequestError`], by the cause.
    pub fn begin(
        begin: &Begin,
        map: &'m [u8],
        wires: &'m Wires,
        meter: &mut impl Meter,
    ) -> Result<(Self, Actuators, u32), RequestError> {
        if begin.kind == SessionKind::Localizer {
            return Ok((Self::localizer_only(begin, map)?, Actuators::default(), 0));
        }
        let (robot, actuators, longest) = LoopSession::begin(begin, map, wires, meter)?;
        Ok((Self::Loop(robot), actuators, longest))
    }

    /// Begins a session of a localizer alone.
    ///
    /// # Errors
    /// [`RequestError`], by the cause.
    pub fn localizer_only(begin: &Begin, map: &'m [u8]) -> Result<Self, RequestError> {
        let map = Map::read(map).map_err(|_| RequestError::Map)?;
        let start = begin.start.ok_or(RequestError::Start)?;
        let localizer = Localizer::new(begin.config.localizer, map, start, begin.at);
        let localizer = localizer.map_err(|_| RequestError::Start)?;
        Ok(Self::Localizer { localizer, aim: None })
    }

    /// Executes a request; returns the answer and the number of instructions.
    pub fn execute(&mut self, request: &Request, meter: &mut impl Meter) -> (Answer, u32) {
        match (self, request) {
            (Self::Localizer { localizer, aim }, request) => call(localizer, aim, request, meter),
            (Self::Loop(robot), Request::Poll(sensors)) => robot.poll(sensors, meter),
            (Self::Loop(robot), Request::Absolute(at, measurement)) => {
                (Answer::Waits(robot.app.absolute(*at, measurement).is_ok()), 0)
            }
            (Self::Loop(_), _) => (Answer::Refused(RequestError::OutOfPlace), 0),
        }
    }

    /// When a loop must be polled next ([`App::next_poll`]).
    pub fn next_poll(&mut self) -> Instant {
        match self {
            Self::Localizer { localizer, .. } => localizer.time(),
            Self::Loop(LoopSession { app, devices, .. }) => app.next_poll(devices),
        }
    }

    /// The time before which a poll of a loop has no effect; `None` while a ping is in flight ([`App::idle_until`]).
    pub fn idle_until(&mut self) -> Option<Instant> {
        match self {
            Self::Localizer { localizer, .. } => Some(localizer.time()),
            Self::Loop(LoopSession { app, devices, .. }) => app.idle_until(devices),
        }
    }

    /// The localizer; `None` if the loop does not run.
    #[must_use]
    pub fn localizer(&self) -> Option<&Localizer<'m>> {
        match self {
            Self::Localizer { localizer, .. } => Some(localizer),
            Self::Loop(robot) => robot.app.localizer(),
        }
    }

    /// What determines the pose.
    #[must_use]
    pub fn mode(&self) -> Mode {
        match self {
            Self::Localizer { .. } => Mode::Tracking,
            Self::Loop(robot) => robot.app.navigation_mode().unwrap_or_default(),
        }
    }

    /// The search of a loop.
    #[must_use]
    pub fn search(&self) -> Option<&Search<'m>> {
        match self {
            Self::Localizer { .. } => None,
            Self::Loop(robot) => Some(robot.app.search()),
        }
    }

    /// What the last poll of a loop did.
    pub fn report(&self) -> Report {
        match self {
            Self::Localizer { .. } => Report::default(),
            Self::Loop(robot) => robot.app.report().copied().unwrap_or_default(),
        }
    }
}

/// Calls the localizer.
fn call(
    localizer: &mut Localizer,
    aim: &mut Option<Aim>,
    request: &Request,
    meter: &mut impl Meter,
) -> (Answer, u32) {
    match *request {
        Request::Odometry(at, travel, turn) => {
            let mut result = Ok(());
            let cost = meter.measure(|| result = localizer.odometry_with_turn(at, travel, turn));
            (Answer::Odometry(result, Snapshot::of(localizer)), cost)
        }
        Request::Aim => {
            let mut result = Err(NoAim::NoWall);
            let cost = meter.measure(|| result = localizer.aim());
            *aim = result.ok();
            (Answer::Aim(result), cost)
        }
        Request::Fix(range) => {
            let Some(aim) = aim else { return (Answer::Refused(RequestError::OutOfPlace), 0) };
            let mut fix = Fix::Refused(localizer::Refusal::NoEcho);
            let cost = meter.measure(|| fix = localizer.fix(aim, range));
            (Answer::Fix(fix, Snapshot::of(localizer)), cost)
        }
        Request::SkipPing => {
            let cost = meter.measure(|| localizer.skip());
            (Answer::Skipped(localizer.health()), cost)
        }
        Request::Absolute(at, ref measurement) => {
            let mut fix = AbsoluteFix::Refused(AbsoluteRefusal::NoPose);
            let cost = meter.measure(|| fix = localizer.absolute(at, measurement));
            (Answer::Absolute(fix, Snapshot::of(localizer)), cost)
        }
        Request::Begin(..) | Request::Poll(_) | Request::End => {
            (Answer::Refused(RequestError::OutOfPlace), 0)
        }
    }
}

impl<'m> LoopSession<'m> {
    /// Starts the application, sets its pose, and starts the loop.
    fn begin(
        begin: &Begin,
        image: &'m [u8],
        wires: &'m Wires,
        meter: &mut impl Meter,
    ) -> Result<(Self, Actuators, u32), RequestError> {
        let Begin { at, start, config, load, .. } = *begin;
        config.check().map_err(|_| RequestError::Start)?;
        let devices = board::devices(&config, wires).map_err(|_| RequestError::Board)?;
        let board = Board { firmware: [0; 3], reset: ResetCause::PowerOn, resets: 0 };
        let mut buffer = [0; baked::LENGTH_MAX];
        let config = baked::write(&config, &mut buffer).map_err(|_| RequestError::Start)?;
        let flash = FlashContents::read(image, config);
        flash.map.map_err(|_| RequestError::Map)?;
        let region = 0..u32::try_from(CAPACITY).unwrap_or(0);
        let store = Store::new(RamFlash::default(), region).map_err(|_| RequestError::Board)?;
        let app = App::new(board, flash, store, at);
        let mut robot = Self { app, wires, devices, traffic: Traffic::new(load, 0, 0) };
        let open = SessionCommand { session: 0, command: Command::OpenSession };
        let (CommandResult::Session(session), mut longest) = robot.send(at, 0, &open, meter)?
        else {
            return Err(RequestError::Start);
        };
        let set_pose = start.map(Command::SetPose);
        for (sequence, command) in (1..).zip(set_pose.into_iter().chain([Command::Start])) {
            let command = SessionCommand { session, command };
            let (_, instructions) = robot.send(at, sequence, &command, meter)?;
            longest = longest.max(instructions);
            robot.traffic = Traffic::new(load, session, sequence);
        }
        Ok((robot, wires.take(), longest))
    }

    /// Sends a command over the link; returns its result and the instructions of the poll.
    fn send(
        &mut self,
        at: Instant,
        sequence: u16,
        command: &SessionCommand,
        meter: &mut impl Meter,
    ) -> Result<(CommandResult, u32), RequestError> {
        let mut buffer = frame::EMPTY;
        let frame = Sender::starting_at(sequence).frame(command, &mut buffer);
        let mut link = LinkBuffer::new(frame);
        let Self { app, devices, .. } = self;
        let mut answered = None;
        let cost = meter.measure(|| answered = app.poll(at, devices, &mut link).answered);
        match answered {
            Some(result @ (CommandResult::Done | CommandResult::Session(_))) => Ok((result, cost)),
            _ => Err(RequestError::Start),
        }
    }

    fn poll(&mut self, sensors: &Sensors, meter: &mut impl Meter) -> (Answer, u32) {
        self.wires.apply(sensors);
        let Self { app, devices, traffic, .. } = self;
        let is_unplugged = traffic.load == Load::Unplugged;
        let mut link = LinkBuffer::new(traffic.next(app.localizer()));
        link.is_unplugged = is_unplugged;
        let mut answered = None;
        let cost = meter.measure(|| {
            // What else it did outside the loop is visible in the telemetry.
            answered = app.poll(sensors.at, devices, &mut link).answered;
        });
        if is_unplugged {
            link.length = 0;
        }
        let telemetry = image::checksum(link.sent());
        self.traffic.answered(answered);
        let is_active = self.app.report().is_some_and(|report| !report.is_empty());
        let snapshot = self.app.localizer().filter(|_| is_active).map(Snapshot::of);
        let actuators = self.wires.take();
        (Answer::Polled { actuators, snapshot, telemetry }, cost)
    }
}

/// Bytes that one poll may send: the size of a board's queue.
const CAPACITY_OF_LINK: usize = 512;

/// The robot's link: the bytes to receive, and those that were sent.
struct LinkBuffer<'b> {
    bytes: core::slice::Iter<'b, u8>,
    sent: [u8; CAPACITY_OF_LINK],
    length: usize,
    /// Whether what is sent is lost.
    is_unplugged: bool,
}

impl<'b> LinkBuffer<'b> {
    fn new(bytes: &'b [u8]) -> Self {
        Self { bytes: bytes.iter(), sent: [0; CAPACITY_OF_LINK], length: 0, is_unplugged: false }
    }

    fn sent(&self) -> &[u8] {
        self.sent.get(..self.length).unwrap_or_default()
    }
}

impl Link for LinkBuffer<'_> {
    fn receive(&mut self) -> Option<u8> {
        self.bytes.next().copied()
    }

    fn send(&mut self, frame: &[u8]) {
        let end = self.length + frame.len();
        if let Some(room) = self.sent.get_mut(self.length..end) {
            room.copy_from_slice(frame);
            self.length = end;
        }
    }

    fn has_room(&self, _: usize) -> bool {
        !self.is_unplugged
    }
}
