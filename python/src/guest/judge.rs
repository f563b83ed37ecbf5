//! The recorder of a run with guests: passes the ticks to them.

use std::cell::RefCell;

use sonarfix_sim::trace::{AbsoluteRecord, FixRecord, Recorder, SearchRecord, Tick};

use super::call::Guest;

/// A recorder that passes the ticks to the guests, too.
pub struct Judge<'r, 'py, R> {
    pub inner: &'r mut R,
    pub guest: &'r RefCell<Guest<'py>>,
}

impl<R: Recorder> Recorder for Judge<'_, '_, R> {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        self.inner.started(make);
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        self.guest.borrow_mut().tick(&tick);
        self.inner.tick(|| tick);
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        self.inner.fix(make);
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        self.inner.absolute(make);
    }

    fn search(&mut self, make: impl FnOnce() -> SearchRecord) {
        self.inner.search(make);
    }
}
