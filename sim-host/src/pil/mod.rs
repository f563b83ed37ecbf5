//! Processor in the loop: the robot's software runs on an emulated microcontroller, the world here.
//!
//! ```text
//!   Simulation ── Request ──▶ Pair ──▶ Emulator: QEMU, bench/pil, the shipped loop
//!        ▲                     │  └──▶ Device: the same code in this process
//!        └────── Answer ───────┘       both answers must be the same bytes
//! ```
//!
//! - [`machine`]: which microcontrollers there are, and how one is started;
//! - [`pair`]: asks both and compares;
//! - [`difference`](mod@difference): in what two answers differ;
//! - [`tally`]: what the emulator counted; [`progress`]: how far it is;
//! - [`golden`]: questions and answers as a file, to be asked again;
//! - this file: the pair as the [`Computer`] of a simulated robot.

pub mod difference;
pub mod golden;
pub mod machine;
pub mod pair;
pub mod progress;
pub mod tally;

use sonarfix::aim::{Aim, NoAim};
use sonarfix::localizer::{Fix, Localizer, OdometryError, Start};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Duration, Instant, Metres};
use sonarfix_hal::robot::Report;
use sonarfix_pil::{Actuators, Answer, Begin, Device, Request, Sensors, Wires};

use self::pair::{Pair, PilError};
use crate::pins::devices;
use crate::simulate::computer::{Computer, Controller, Told};
use crate::simulate::{Simulation, SimulationError};

/// From one turn of the firmware's loop to the next.
const TURN: Duration = Duration::from_ticks(1_000);

/// An emulated microcontroller, and this process beside it.
#[derive(Debug)]
pub struct Emulated<'s> {
    simulation: &'s Simulation,
    map: Vec<u8>,
    pair: &'s mut Pair,
}

impl<'s> Emulated<'s> {
    /// For this scenario.
    ///
    /// # Errors
    /// [`PilError::Map`], if its walls cannot be baked.
    pub fn new(simulation: &'s Simulation, pair: &'s mut Pair) -> Result<Self, PilError> {
        let map = simulation.baked_map().map_err(PilError::Map)?;
        Ok(Self { simulation, map, pair })
    }
}

impl Computer for Emulated<'_> {
    type Told<'w>
        = Twins<'w>
    where
        Self: 'w;
    type Controller<'w>
        = Twins<'w>
    where
        Self: 'w;

    fn localizer(&mut self, start: Start, at: Instant) -> Result<Twins<'_>, SimulationError> {
        let begin = Begin { at, start, config: self.simulation.config(), board: None };
        let device = self.pair.begin_localizer(&begin, &self.map)?;
        Ok(Twins { device, pair: self.pair, polled: at })
    }

    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Start,
        at: Instant,
    ) -> Result<(Twins<'w>, Actuators), SimulationError> {
        let Simulation { scenario, stamp, .. } = self.simulation;
        let board = Some(devices::board(scenario, *stamp));
        let begin = Begin { at, start, config: self.simulation.config(), board };
        let (device, actuators) = self.pair.begin_loop(&begin, &self.map, wires)?;
        Ok((Twins { device, pair: self.pair, polled: at }, actuators))
    }
}

/// An answer to something else.
fn unasked(answer: Answer) -> SimulationError {
    PilError::Unasked(Box::new(answer)).into()
}

/// A session of both.
pub struct Twins<'w> {
    device: Device<'w>,
    pair: &'w mut Pair,
    /// The time of the last poll.
    polled: Instant,
}

impl Twins<'_> {
    fn ask(&mut self, request: &Request) -> Result<Answer, PilError> {
        self.pair.ask(&mut self.device, request)
    }

    fn known(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(self.device.localizer().ok_or(PilError::Stopped)?)
    }
}

impl Told for Twins<'_> {
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
    ) -> Result<Result<(), OdometryError>, SimulationError> {
        match self.ask(&Request::Odometry(at, travel))? {
            Answer::Rolled(taken, _) => Ok(taken),
            other => Err(unasked(other)),
        }
    }

    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError> {
        match self.ask(&Request::Aim)? {
            Answer::Aimed(aim) => Ok(aim),
            other => Err(unasked(other)),
        }
    }

    fn fix(&mut self, _: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError> {
        match self.ask(&Request::Fix(range))? {
            Answer::Fixed(fix, _) => Ok(fix),
            other => Err(unasked(other)),
        }
    }

    fn skip(&mut self) -> Result<(), SimulationError> {
        match self.ask(&Request::Skip)? {
            Answer::Skipped(_) => Ok(()),
            other => Err(unasked(other)),
        }
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        self.known()
    }
}

impl Controller for Twins<'_> {
    fn poll(&mut self, sensors: &Sensors) -> Result<(Report, Actuators), SimulationError> {
        self.polled = sensors.at;
        match self.ask(&Request::Poll(*sensors))? {
            Answer::Polled { actuators, .. } => Ok((self.device.report(), actuators)),
            other => Err(unasked(other)),
        }
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        self.known()
    }

    /// The firmware's loop does not ask whether a turn is of use.
    fn idle_until(&mut self) -> Option<Instant> {
        self.polled.checked_add_duration(TURN)
    }
}
