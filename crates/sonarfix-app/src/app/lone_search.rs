//! The search for the pose in a program without the feature `search`: there is none, and the mode of a loop is always
//! `Tracking`.

use core::marker::PhantomData;

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Mode;
use sonarfix::map::Region;
use sonarfix_hal::robot::{Robot, Search};
use sonarfix_link::Reporter;
use sonarfix_link::reporter::Outlet;

#[derive(Default)]
pub(super) struct PoseSearch<'m>(PhantomData<&'m ()>);

#[expect(clippy::unused_self, reason = "those of a search depend on it")]
impl<'m> PoseSearch<'m> {
    pub fn used(&mut self, _: bool) -> Option<&mut Search<'m>> {
        None
    }

    pub fn begin(&mut self, _: Instant, _: &mut Robot<'m>) {}

    pub fn begin_in(&mut self, _: Instant, _: Option<Region>, _: &mut Robot<'m>) {}

    pub fn report(&self, _: Mode, _: &mut Reporter, _: &mut impl Outlet) {}

    pub fn work(&mut self) {}
}
