//! What a localizer's handle holds in a library without the search: the localizer.

use sonarfix::aim::Standing;
use sonarfix::config::RangerId;
use sonarfix::filter::ekf::EkfError;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres};
use sonarfix::localizer::{AbsoluteFix, Localizer, Mode, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;

use crate::aim::sonarfix_aim_t;
use crate::fix::sonarfix_fix_t;
use crate::status::Result;

/// The localizer, with the methods of the tracker that has a search.
pub struct Tracker(Localizer<'static>);

impl Tracker {
    pub fn new(localizer: Localizer<'static>) -> Self {
        Self(localizer)
    }

    pub fn localizer(&self) -> &Localizer<'static> {
        &self.0
    }

    pub fn localizer_mut(&mut self) -> &mut Localizer<'static> {
        &mut self.0
    }

    #[expect(clippy::unused_self, reason = "that of a navigator depends on it")]
    pub fn mode(&self) -> Mode {
        Mode::Tracking
    }

    pub fn odometry(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<()> {
        Ok(self.0.odometry_with_turn(now, travel, turn)?)
    }

    pub fn aim(&mut self) -> Result<sonarfix_aim_t> {
        Ok(self.0.aim()?.into())
    }

    pub fn aim_of(&mut self, ranger: RangerId, standing: &Standing) -> Result<sonarfix_aim_t> {
        Ok(self.0.aim_of(ranger, standing)?.into())
    }

    pub fn fix(&mut self, aim: &sonarfix_aim_t, range: Option<Metres>) -> Result<sonarfix_fix_t> {
        Ok(self.0.fix(&aim.target()?, range).into())
    }

    pub fn absolute(&mut self, at: Instant, measured: &AbsoluteMeasurement) -> AbsoluteFix {
        self.0.absolute(at, measured)
    }

    pub fn set_pose(&mut self, start: &Start) -> core::result::Result<(), EkfError> {
        self.0.set_pose(start)
    }
}
