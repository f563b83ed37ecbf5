//! Access to the search for the pose, for a program with the feature `search`.

use embedded_storage::nor_flash::NorFlash;
use sonarfix_hal::robot::Search;

use super::App;

impl<'m, F: NorFlash> App<'m, F> {
    /// The search for the pose; its state has a meaning while the mode is not `Tracking`.
    #[must_use]
    pub fn search(&self) -> &Search<'m> {
        &self.search.0
    }
}
