//! What determines the pose in the loop of a program without the feature `search`: the localizer. A search and the pings of
//! its sweep are types without a value.

use core::convert::Infallible;
use core::marker::PhantomData;

use sonarfix::aim::{Aim, Choice, NoAim};
use sonarfix::filter::ekf::EkfError;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, Mode, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;

use super::Step;
use crate::ranger::Outcome;

/// A search for the pose, which this program does not have.
#[derive(Debug)]
pub struct Search<'m>(Infallible, PhantomData<&'m ()>);

impl Search<'_> {
    /// Ends code that has a search, and that is never reached.
    pub(super) fn never(&self) -> ! {
        match self.0 {}
    }
}

/// A ping of the sweep of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sweep(Infallible);

impl Sweep {
    pub fn along(self, _: Radians) -> Self {
        self
    }

    /// As [`Search::never`].
    pub fn never(self) -> ! {
        match self.0 {}
    }
}

/// The result of a ping of the sweep of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SweepResult(Infallible);

impl SweepResult {
    /// The bearing of the servo, and the echo or why there is none.
    pub fn ping(&self) -> (Radians, Outcome) {
        match self.0 {}
    }

    /// The step of the wheels up to the reflection.
    #[must_use]
    pub fn step(&self) -> Option<&Step> {
        match self.0 {}
    }
}

/// The localizer, with the methods of a navigator.
#[derive(Debug, Clone)]
pub(super) struct Tracker<'m>(Localizer<'m>);

impl<'m> Tracker<'m> {
    pub fn new(localizer: Localizer<'m>) -> Self {
        Self(localizer)
    }

    pub fn localizer(&self) -> &Localizer<'m> {
        &self.0
    }

    pub fn localizer_mut(&mut self) -> &mut Localizer<'m> {
        &mut self.0
    }

    #[expect(clippy::unused_self, reason = "that of a navigator depends on it")]
    pub fn mode(&self) -> Mode {
        Mode::Tracking
    }

    pub fn odometry_with_turn(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
        _: Option<&mut Search<'m>>,
    ) -> Result<(), OdometryError> {
        self.0.odometry_with_turn(now, travel, turn)
    }

    pub fn choose(&self, choice: &mut Choice) -> Option<Result<Aim, NoAim>> {
        self.0.choose(choice)
    }

    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>, _: Option<&mut Search<'m>>) -> Fix {
        self.0.fix(aim, range)
    }

    pub fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> AbsoluteFix {
        self.0.absolute(at, measurement)
    }

    pub fn set_pose(&mut self, start: &Start) -> Result<(), EkfError> {
        self.0.set_pose(start)
    }
}
