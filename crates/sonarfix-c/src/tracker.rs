//! What a localizer's handle holds in a library with the search: the navigator, and the search that is attached to it.

#![expect(unsafe_code, reason = "refers to a handle of the caller")]

use sonarfix::aim::Standing;
use sonarfix::config::RangerId;
use sonarfix::filter::ekf::EkfError;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{AbsoluteFix, Localizer, Mode, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::Search;

use crate::aim::sonarfix_aim_t;
use crate::fix::sonarfix_fix_t;
use crate::memory::held_mut;
use crate::search::sonarfix_search_t;
use crate::status::{Result, sonarfix_status_t};

/// The navigator and its search.
pub struct Tracker {
    navigator: Navigator<'static>,
    /// NULL without a search.
    search: *mut sonarfix_search_t,
}

impl Tracker {
    pub fn new(localizer: Localizer<'static>) -> Self {
        Self { navigator: Navigator::new(localizer), search: core::ptr::null_mut() }
    }

    pub fn localizer(&self) -> &Localizer<'static> {
        self.navigator.localizer()
    }

    pub fn localizer_mut(&mut self) -> &mut Localizer<'static> {
        self.navigator.localizer_mut()
    }

    pub fn mode(&self) -> Mode {
        self.navigator.mode()
    }

    pub fn attach(&mut self, search: *mut sonarfix_search_t) {
        self.search = search;
    }

    /// The navigator, and the search if one is attached.
    fn parts(&mut self) -> Result<(&mut Navigator<'static>, Option<&mut Search<'static>>)> {
        let search = if self.search.is_null() {
            None
        } else {
            // SAFETY: by the contract of the crate nothing else uses the search during a call of its localizer.
            Some(unsafe { held_mut(self.search) }?)
        };
        Ok((&mut self.navigator, search))
    }

    /// The navigator and its search.
    pub fn searching(&mut self) -> Result<(&mut Navigator<'static>, &mut Search<'static>)> {
        let (navigator, search) = self.parts()?;
        Ok((navigator, search.ok_or(sonarfix_status_t::SONARFIX_ERROR_NO_SEARCH)?))
    }

    pub fn odometry(
        &mut self,
        now: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<()> {
        if self.search.is_null() {
            // The navigator would prepare what only a search needs.
            return Ok(self.localizer_mut().odometry_with_turn(now, travel, turn)?);
        }
        let (navigator, search) = self.parts()?;
        Ok(navigator.odometry_with_turn(now, travel, turn, search)?)
    }

    pub fn aim(&mut self) -> Result<sonarfix_aim_t> {
        if self.mode() == Mode::Searching {
            let (_, search) = self.searching()?;
            return Ok(sonarfix_aim_t::of_sweep(search.aim()));
        }
        Ok(self.navigator.aim()?.into())
    }

    pub fn aim_of(&mut self, ranger: RangerId, standing: &Standing) -> Result<sonarfix_aim_t> {
        if self.mode() == Mode::Searching && ranger == RangerId::FIRST {
            return self.aim();
        }
        Ok(self.navigator.aim_of(ranger, standing)?.into())
    }

    pub fn fix(&mut self, aim: &sonarfix_aim_t, range: Option<Metres>) -> Result<sonarfix_fix_t> {
        let aimed = aim.target()?;
        if self.mode() == Mode::Searching {
            let (navigator, search) = self.searching()?;
            let taken = navigator.ping(Radians(aim.bearing_rad), range, search);
            return taken
                .map(sonarfix_fix_t::searched)
                .map_err(|_| sonarfix_status_t::SONARFIX_ERROR_NOT_FINITE);
        }
        let (navigator, search) = self.parts()?;
        Ok(navigator.fix(&aimed, range, search).into())
    }

    pub fn absolute(&mut self, at: Instant, measured: &AbsoluteMeasurement) -> AbsoluteFix {
        self.navigator.absolute(at, measured)
    }

    pub fn set_pose(&mut self, start: &Start) -> core::result::Result<(), EkfError> {
        self.navigator.set_pose(start)
    }
}
