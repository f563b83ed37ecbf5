//! The computer of a run with guests: what the localizer or the loop takes, the guest takes after it.

use std::cell::RefCell;

use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres};
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_hal::robot::{Report, Step, StepResult};
use sonarfix_pil::{Actuators, Sensors, Wires};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Search;
use sonarfix_sim::simulate::computer::{
    Computer, Controller, LocalizerInputs, RobotOnWires, ThisProcess,
};
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::time::seconds;

use super::call::Guest;

type Result<T> = std::result::Result<T, SimulationError>;

/// This process, with guests.
pub struct Accompanied<'g, 'py> {
    process: ThisProcess<'g>,
    guest: &'g RefCell<Guest<'py>>,
}

impl<'g, 'py> Accompanied<'g, 'py> {
    pub fn new(simulation: &'g Simulation, guest: &'g RefCell<Guest<'py>>) -> Self {
        Self { process: ThisProcess(simulation), guest }
    }
}

/// A localizer or a loop, with guests.
pub struct Beside<'g, 'py, T> {
    inner: T,
    guest: &'g RefCell<Guest<'py>>,
}

impl<'py> Computer for Accompanied<'_, 'py> {
    type Inputs<'w>
        = Beside<'w, 'py, Localizer<'w>>
    where
        Self: 'w;
    type Controller<'w>
        = Beside<'w, 'py, RobotOnWires<'w>>
    where
        Self: 'w;

    fn localizer(&mut self, start: Start, at: Instant) -> Result<Self::Inputs<'_>> {
        let Self { process, guest } = self;
        let inner = process.localizer(start, at)?;
        guest.borrow_mut().begin(&inner)?;
        Ok(Beside { inner, guest })
    }

    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Option<Start>,
        at: Instant,
    ) -> Result<(Self::Controller<'w>, Actuators)> {
        let Self { process, guest } = self;
        let (inner, actuators) = process.controller(wires, start, at)?;
        guest.borrow_mut().begin(inner.localizer()?)?;
        Ok((Beside { inner, guest }, actuators))
    }
}

impl LocalizerInputs for Beside<'_, '_, Localizer<'_>> {
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<std::result::Result<(), OdometryError>> {
        let taken = LocalizerInputs::odometry(&mut self.inner, at, travel, turn)?;
        if taken.is_ok() {
            let mut guest = self.guest.borrow_mut();
            guest.odometry(seconds(at.ticks()), travel.right.0, travel.left.0)?;
        }
        Ok(taken)
    }

    fn aim(&mut self) -> Result<std::result::Result<Aim, NoAim>> {
        match self.guest.borrow_mut().aim(&self.inner)? {
            Some(aim) => Ok(Ok(aim)),
            None => LocalizerInputs::aim(&mut self.inner),
        }
    }

    fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix> {
        let fix = LocalizerInputs::fix(&mut self.inner, aim, range)?;
        self.guest.borrow_mut().fix(aim, range)?;
        Ok(fix)
    }

    fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> Result<AbsoluteFix> {
        LocalizerInputs::absolute(&mut self.inner, at, measurement)
    }

    fn skip(&mut self) -> Result<()> {
        LocalizerInputs::skip(&mut self.inner)
    }

    fn localizer(&self) -> Result<&Localizer<'_>> {
        Ok(&self.inner)
    }
}

impl Beside<'_, '_, RobotOnWires<'_>> {
    /// Passes on a step that the localizer has taken.
    fn step(&self, step: Option<&Step>) -> Result<()> {
        let Some(step) = step.filter(|step| step.result == StepResult::Accepted) else {
            return Ok(());
        };
        let mut guest = self.guest.borrow_mut();
        guest.odometry(seconds(step.at.ticks()), step.travel.right.0, step.travel.left.0)
    }
}

impl Controller for Beside<'_, '_, RobotOnWires<'_>> {
    fn poll(&mut self, sensors: &Sensors, report: &mut Report) -> Result<Actuators> {
        let actuators = self.inner.poll(sensors, report)?;
        self.step(report.reached.as_ref())?;
        if let Some(heard) = report.ping_result.as_ref().filter(|heard| heard.fix.is_some()) {
            let range = heard.outcome.ok().map(|echo| echo.range);
            self.guest.borrow_mut().fix(&heard.aim, range)?;
        }
        if let Some(swept) = &report.swept {
            self.step(swept.step())?;
        }
        self.step(report.tick.as_ref().and_then(|tick| tick.step.as_ref()))?;
        Ok(actuators)
    }

    fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> Result<bool> {
        self.inner.absolute(at, measurement)
    }

    fn localizer(&self) -> Result<&Localizer<'_>> {
        self.inner.localizer()
    }

    fn next_poll(&mut self) -> Instant {
        self.inner.next_poll()
    }

    fn idle_until(&mut self) -> Option<Instant> {
        self.inner.idle_until()
    }

    fn mode(&self) -> Result<Mode> {
        self.inner.mode()
    }

    fn search(&self) -> Option<&Search<'_>> {
        self.inner.search()
    }
}
