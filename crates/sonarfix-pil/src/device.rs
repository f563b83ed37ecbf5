//! What answers: on a microcontroller, and on the PC that compares.

use serde::{Deserialize, Serialize};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::localizer::{self, Fix, Localizer};
use sonarfix::map::{Map, image};
use sonarfix::units::Instant;
use sonarfix_app::store::Store;
use sonarfix_app::{App, Body, Flashed, Link};
use sonarfix_hal::robot::Report;
use sonarfix_link::message::Reset;
use sonarfix_link::{Command, Outcome, Sender, baked, frame};

use crate::board::WiredDevices;
use crate::message::{Answer, Begin, Belief, Request};
use crate::ram_flash::{CAPACITY, RamFlash};
use crate::serve::Meter;
use crate::wires::{Actuators, Sensors, Wires};

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The map's image is not one.
    Map,
    /// The configuration or the start is not one that a localizer takes.
    Start,
    /// A device of the board cannot be driven.
    Board,
    /// What was asked does not belong to this kind of session, or to this moment of it.
    OutOfPlace,
    /// The request could not be read.
    Unreadable,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Map => "the map's image is not one",
            Self::Start => "the localizer refuses its configuration or its start",
            Self::Board => "a device of the board cannot be driven",
            Self::OutOfPlace => "the request does not belong to this session",
            Self::Unreadable => "the request cannot be read",
        })
    }
}

impl core::error::Error for Refusal {}

/// A session: a localizer that is told everything, or the loop that ships, on wires.
#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
pub enum Device<'m> {
    /// A localizer alone.
    Localizer {
        /// It.
        localizer: Localizer<'m>,
        /// Where it last said to look.
        aim: Option<Aim>,
    },
    /// The shipped loop and the drivers.
    Loop(LoopOnWires<'m>),
}

/// The application, with its devices.
pub struct LoopOnWires<'m> {
    app: App<'m, RamFlash>,
    wires: &'m Wires,
    devices: WiredDevices<'m>,
}

impl<'m> Device<'m> {
    /// Begins a session; of a loop with what its first polls did to the devices.
    ///
    /// # Errors
    /// [`Refusal`], by what is wrong with the request.
    pub fn begin(
        begin: &Begin,
        map: &'m [u8],
        wires: &'m Wires,
    ) -> Result<(Self, Actuators), Refusal> {
        if begin.board.is_none() {
            return Ok((Self::localizer_only(begin, map)?, Actuators::default()));
        }
        let (robot, actuators) = LoopOnWires::begin(begin, map, wires)?;
        Ok((Self::Loop(robot), actuators))
    }

    /// Begins a session of a localizer alone.
    ///
    /// # Errors
    /// [`Refusal`], by what is wrong with the request.
    pub fn localizer_only(begin: &Begin, map: &'m [u8]) -> Result<Self, Refusal> {
        let map = Map::read(map).map_err(|_| Refusal::Map)?;
        let localizer = Localizer::new(begin.config, map, begin.start, begin.at);
        let localizer = localizer.map_err(|_| Refusal::Start)?;
        Ok(Self::Localizer { localizer, aim: None })
    }

    /// Answers a request, and how many instructions that took.
    pub fn answer(&mut self, request: &Request, meter: &mut impl Meter) -> (Answer, u32) {
        match (self, request) {
            (Self::Localizer { localizer, aim }, request) => tell(localizer, aim, request, meter),
            (Self::Loop(robot), Request::Poll(sensors)) => robot.poll(sensors, meter),
            (Self::Loop(_), _) => (Answer::Refused(Refusal::OutOfPlace), 0),
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

    /// What the last poll of a loop did.
    pub fn report(&self) -> Report {
        match self {
            Self::Localizer { .. } => Report::default(),
            Self::Loop(robot) => robot.app.report().copied().unwrap_or_default(),
        }
    }
}

fn tell(
    localizer: &mut Localizer,
    aim: &mut Option<Aim>,
    request: &Request,
    meter: &mut impl Meter,
) -> (Answer, u32) {
    match *request {
        Request::Odometry(at, travel) => {
            let mut taken = Ok(());
            let cost = meter.measure(|| taken = localizer.odometry(at, travel));
            (Answer::Rolled(taken, Belief::of(localizer)), cost)
        }
        Request::Aim => {
            let mut aimed = Err(NoAim::NoWall);
            let cost = meter.measure(|| aimed = localizer.aim());
            *aim = aimed.ok();
            (Answer::Aimed(aimed), cost)
        }
        Request::Fix(range) => {
            let Some(aim) = aim else { return (Answer::Refused(Refusal::OutOfPlace), 0) };
            let mut fix = Fix::Refused(localizer::Refusal::NoEcho);
            let cost = meter.measure(|| fix = localizer.fix(aim, range));
            (Answer::Fixed(fix, Belief::of(localizer)), cost)
        }
        Request::Skip => {
            let cost = meter.measure(|| localizer.skip());
            (Answer::Skipped(localizer.health()), cost)
        }
        Request::Begin(..) | Request::Poll(_) | Request::End => {
            (Answer::Refused(Refusal::OutOfPlace), 0)
        }
    }
}

impl<'m> LoopOnWires<'m> {
    /// Switches the robot on, tells it where it stands, and lets the loop run.
    fn begin(
        begin: &Begin,
        image: &'m [u8],
        wires: &'m Wires,
    ) -> Result<(Self, Actuators), Refusal> {
        let Begin { at, start, config, board } = *begin;
        let board = board.ok_or(Refusal::Board)?;
        let wheels = board.wheels().map_err(|_| Refusal::Board)?;
        let devices = board.devices(wires).map_err(|_| Refusal::Board)?;
        let body =
            Body { wheels, settings: board.settings, firmware: [0; 3], reset: Reset::PowerOn };
        let mut buffer = [0; baked::LENGTH_MAX];
        let config = baked::write(&config, &mut buffer).map_err(|_| Refusal::Start)?;
        let flashed = Flashed::read(image, config);
        flashed.map.map_err(|_| Refusal::Map)?;
        let region = 0..u32::try_from(CAPACITY).unwrap_or(0);
        let store = Store::new(RamFlash::default(), region).map_err(|_| Refusal::Board)?;
        let app = App::new(body, flashed, store, at).map_err(|_| Refusal::Board)?;
        let mut robot = Self { app, wires, devices };
        robot.order(at, &Command::SetPose(start))?;
        robot.order(at, &Command::Start)?;
        Ok((robot, wires.take()))
    }

    /// A command over the link.
    fn order(&mut self, at: Instant, command: &Command) -> Result<(), Refusal> {
        let mut buffer = frame::EMPTY;
        let mut line = Cable::bringing(Sender::new().frame(command, &mut buffer));
        let polled = self.app.poll(at, &mut self.devices, &mut line);
        if polled.answered == Some(Outcome::Done) { Ok(()) } else { Err(Refusal::Start) }
    }

    fn poll(&mut self, sensors: &Sensors, meter: &mut impl Meter) -> (Answer, u32) {
        self.wires.show(sensors);
        let mut cable = Cable::bringing(&[]);
        let Self { app, devices, .. } = self;
        let cost = meter.measure(|| {
            // What it did beside the loop shows in the telemetry.
            let _ = app.poll(sensors.at, devices, &mut cable);
        });
        let has_worked = self.app.report().is_some_and(|report| !report.is_empty());
        let belief = self.app.localizer().filter(|_| has_worked).map(Belief::of);
        let (actuators, telemetry) = (self.wires.take(), image::checksum(cable.said()));
        (Answer::Polled { actuators, belief, telemetry }, cost)
    }
}

/// What is said in a poll: as much as the queue of a board takes.
const ROOM: usize = 512;

/// The far end of the robot's link: what it brings, and room for what is said in a poll.
struct Cable<'b> {
    bytes: core::slice::Iter<'b, u8>,
    said: [u8; ROOM],
    length: usize,
}

impl<'b> Cable<'b> {
    fn bringing(bytes: &'b [u8]) -> Self {
        Self { bytes: bytes.iter(), said: [0; ROOM], length: 0 }
    }

    fn said(&self) -> &[u8] {
        self.said.get(..self.length).unwrap_or_default()
    }
}

impl Link for Cable<'_> {
    fn receive(&mut self) -> Option<u8> {
        self.bytes.next().copied()
    }

    fn send(&mut self, frame: &[u8]) {
        let end = self.length + frame.len();
        if let Some(room) = self.said.get_mut(self.length..end) {
            room.copy_from_slice(frame);
            self.length = end;
        }
    }
}
