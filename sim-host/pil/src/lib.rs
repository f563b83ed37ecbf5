//! Processor in the loop: the robot's software runs on an emulated microcontroller, the simulation in
//! this process.
//!
//! ```text
//!   Simulation ── Request ──▶ Pair ──▶ Emulator: QEMU, firmware/emulated/pil, the shipped loop
//!        ▲                     │  └──▶ Session: the same code in this process
//!        └────── Answer ───────┘       both answers must be the same bytes
//! ```
//!
//! - [`machine`]: the supported microcontrollers, and the start of one;
//! - [`pair`]: sends each request to both and compares the answers;
//! - [`difference`](mod@difference): the difference between two answers;
//! - [`tally`]: instruction counts; [`progress`]: progress of a run;
//! - [`golden`]: requests and answers in a file, to be replayed;
//! - this file: the pair as the [`Computer`] of a simulated robot.

pub mod difference;
mod error;
mod exchange;
pub mod golden;
pub mod machine;
pub mod pair;
pub mod progress;
pub mod tally;

use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant, Metres};
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_hal::robot::Report;
use sonarfix_pil::{Actuators, Answer, Begin, Request, Sensors, Session, SessionKind, Wires};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Search;

use self::pair::Pair;

pub use error::PilError;
pub use exchange::Exchange;
pub use sonarfix_pil::Load;
use sonarfix_sim::simulate::computer::{Computer, Controller, LocalizerInputs};
use sonarfix_sim::simulate::{Simulation, SimulationError};

/// Period at which bytes arrive, if there is a load.
const BYTES_PERIOD: Duration = Duration::from_ticks(1_000);

/// An emulated microcontroller, compared with this process.
#[derive(Debug)]
pub struct Emulated<'s> {
    simulation: &'s Simulation,
    map: Vec<u8>,
    pair: &'s mut Pair,
    load: Load,
}

impl<'s> Emulated<'s> {
    /// A computer for this scenario.
    ///
    /// # Errors
    /// [`PilError::Map`], if its walls cannot be baked.
    pub fn new(simulation: &'s Simulation, pair: &'s mut Pair) -> Result<Self, PilError> {
        let map = simulation.baked_map().map_err(PilError::Map)?;
        Ok(Self { simulation, map, pair, load: Load::Quiet })
    }

    /// The same with this load on the link.
    #[must_use]
    pub fn under(self, load: Load) -> Self {
        Self { load, ..self }
    }
}

impl Computer for Emulated<'_> {
    type Inputs<'w>
        = ComparedDevice<'w>
    where
        Self: 'w;
    type Controller<'w>
        = ComparedDevice<'w>
    where
        Self: 'w;

    fn localizer(
        &mut self,
        start: Start,
        at: Instant,
    ) -> Result<ComparedDevice<'_>, SimulationError> {
        let (start, config) = (Some(start), self.simulation.robot());
        let begin = Begin { at, start, config, kind: SessionKind::Localizer, load: self.load };
        let session = self.pair.begin_localizer(&begin, &self.map)?;
        Ok(ComparedDevice { session, pair: self.pair, polled: at, load: self.load })
    }

    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Option<Start>,
        at: Instant,
    ) -> Result<(ComparedDevice<'w>, Actuators), SimulationError> {
        let (config, load) = (self.simulation.robot(), self.load);
        let begin = Begin { at, start, config, kind: SessionKind::Loop, load };
        let (session, actuators) = self.pair.begin_loop(&begin, &self.map, wires)?;
        Ok((ComparedDevice { session, pair: self.pair, polled: at, load }, actuators))
    }
}

/// The error for an answer of the wrong kind.
fn mismatched(answer: Answer) -> SimulationError {
    PilError::Mismatched(Box::new(answer)).into()
}

/// A session of both devices.
pub struct ComparedDevice<'w> {
    session: Session<'w>,
    pair: &'w mut Pair,
    /// The time of the last poll.
    polled: Instant,
    /// What arrives over the link.
    load: Load,
}

impl ComparedDevice<'_> {
    fn execute(&mut self, request: &Request) -> Result<Answer, PilError> {
        self.pair.execute(&mut self.session, request)
    }

    /// When the next bytes arrive over the link.
    fn next_bytes(&self) -> Option<Instant> {
        let is_loaded = matches!(self.load, Load::Garbage | Load::Commands | Load::Saturated);
        is_loaded.then(|| self.polled.checked_add_duration(BYTES_PERIOD)).flatten()
    }

    fn running(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(self.session.localizer().ok_or(PilError::Stopped)?)
    }
}

impl LocalizerInputs for ComparedDevice<'_> {
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<Result<(), OdometryError>, SimulationError> {
        match self.execute(&Request::Odometry(at, travel, turn))? {
            Answer::Odometry(taken, _) => Ok(taken),
            other => Err(mismatched(other)),
        }
    }

    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError> {
        match self.execute(&Request::Aim)? {
            Answer::Aim(aim) => Ok(aim),
            other => Err(mismatched(other)),
        }
    }

    fn fix(&mut self, _: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError> {
        match self.execute(&Request::Fix(range))? {
            Answer::Fix(fix, _) => Ok(fix),
            other => Err(mismatched(other)),
        }
    }

    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<AbsoluteFix, SimulationError> {
        match self.execute(&Request::Absolute(at, *measurement))? {
            Answer::Absolute(fix, _) => Ok(fix),
            other => Err(mismatched(other)),
        }
    }

    fn skip(&mut self) -> Result<(), SimulationError> {
        match self.execute(&Request::SkipPing)? {
            Answer::Skipped(_) => Ok(()),
            other => Err(mismatched(other)),
        }
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        self.running()
    }
}

impl Controller for ComparedDevice<'_> {
    fn poll(
        &mut self,
        sensors: &Sensors,
        report: &mut Report,
    ) -> Result<Actuators, SimulationError> {
        self.polled = sensors.at;
        match self.execute(&Request::Poll(*sensors))? {
            Answer::Polled { actuators, .. } => {
                *report = self.session.report();
                Ok(actuators)
            }
            other => Err(mismatched(other)),
        }
    }

    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<bool, SimulationError> {
        match self.execute(&Request::Absolute(at, *measurement))? {
            Answer::Waits(waits) => Ok(waits),
            other => Err(mismatched(other)),
        }
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        self.running()
    }

    fn next_poll(&mut self) -> Instant {
        let next = self.session.next_poll();
        self.next_bytes().map_or(next, |bytes| bytes.min(next))
    }

    fn idle_until(&mut self) -> Option<Instant> {
        let idle = self.session.idle_until()?;
        Some(self.next_bytes().map_or(idle, |bytes| bytes.min(idle)))
    }

    fn mode(&self) -> Result<Mode, SimulationError> {
        Ok(self.session.mode())
    }

    fn search(&self) -> Option<&Search<'_>> {
        self.session.search()
    }
}
