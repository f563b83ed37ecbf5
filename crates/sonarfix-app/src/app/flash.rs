//! What the application reads from its store at the start, and when it writes to it.

use embedded_storage::nor_flash::NorFlash;
use sonarfix::geometry::units::Instant;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::robot::Hardware;
use sonarfix_link::baked;

use super::{App, Polled, State};
use crate::boots;
use crate::store::{Resumed, Saved, StoreError};
use crate::time::NEVER;

impl<F: NorFlash> App<'_, F> {
    /// Configures the drivers for the present configuration, if there is one.
    fn configure_devices(&mut self, hardware: &mut impl Hardware) {
        self.unsupported = self.config.and_then(|(config, _)| hardware.configure(&config).err());
    }

    /// Reads the store, and configures the drivers. A stored configuration with which the robot could not start is not
    /// used.
    #[inline(never)]
    pub(super) fn load_store(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
    ) -> Result<(), StoreError> {
        if self.ignores_store() {
            self.configure_devices(hardware);
            self.known = self.known_at_start();
            return Err(StoreError::Ignored);
        }
        let opened = self.store.open();
        // A store that cannot be repaired can still be read.
        let read = opened.and(self.load_record());
        let sent = self.load_config();
        let sent = match sent {
            Ok(Some(config)) => self.take_config(now, &config, hardware),
            Ok(None) => Ok(()),
            Err(error) => Err(error),
        };
        if self.known.is_none() {
            self.configure_devices(hardware);
            self.known = self.known_at_start();
        }
        match sent {
            Err(StoreError::Configuration) => sent,
            _ => read.and(sent),
        }
    }

    /// Uses a stored configuration, if the robot can start with it.
    fn take_config(
        &mut self,
        now: Instant,
        config: &RobotConfig,
        hardware: &mut impl Hardware,
    ) -> Result<(), StoreError> {
        let checksum = baked::checksum(config);
        let known = self.known_with(config, checksum);
        let can_start = self.check_start_with(now, config, &known).is_ok();
        if !can_start || hardware.configure(config).is_err() {
            return Err(StoreError::Configuration);
        }
        self.config = Some((*config, checksum));
        self.known = Some(known);
        Ok(())
    }

    fn load_record(&mut self) -> Result<(), StoreError> {
        let stored = self.store.load();
        self.stored = stored.ok().flatten();
        self.run = self.stored.map_or(1, |saved| saved.run.saturating_add(1));
        stored.map(drop)
    }

    /// The configuration that was sent and replaces the baked one, if there is one.
    fn load_config(&mut self) -> Result<Option<RobotConfig>, StoreError> {
        let replaced = self.baked();
        let kept = self.store.load_config()?.filter(|kept| kept.replaces == replaced);
        Ok(kept.map(|kept| kept.config))
    }

    fn known_at_start(&self) -> Option<Resumed> {
        let (config, checksum) = self.config.as_ref()?;
        Some(self.known_with(config, *checksum))
    }

    /// The state at the start with this configuration.
    fn known_with(&self, config: &RobotConfig, checksum: u32) -> Resumed {
        match &self.stored {
            Some(saved) => Resumed::from(saved, &config.localizer, checksum),
            None => Resumed::afresh(&config.localizer),
        }
    }

    /// Checksum of the baked configuration, zero for none.
    pub(super) fn baked(&self) -> u32 {
        self.baked.unwrap_or(0)
    }

    /// The present state as a record; `None` without a configuration.
    fn record(&self, now: Instant) -> Option<Saved> {
        let known = self.known_now()?;
        let is_parked = known.has_pose && !self.is_running();
        Some(self.record_of(now, &known, is_parked))
    }

    pub(super) fn record_of(&self, now: Instant, known: &Resumed, is_parked: bool) -> Saved {
        let configuration = self.config.map_or(0, |(_, checksum)| checksum);
        let seconds = u32::try_from(now.ticks() / 1_000_000).unwrap_or(u32::MAX);
        let Resumed { state, deviation, .. } = *known;
        Saved { run: self.run, seconds, configuration, is_parked, state, deviation }
    }

    /// The present state; while the loop runs, the state after it has stopped.
    pub(super) fn known_now(&self) -> Option<Resumed> {
        match &self.state {
            State::Waiting(_) => self.known,
            State::Running(running) => Some(running.known()),
        }
    }

    /// Whether the store is not used, because reading it may be what resets the robot.
    pub(super) fn ignores_store(&self) -> bool {
        self.board.resets >= boots::MAX_RESETS
    }

    /// Writes pending records to the flash, as far as the write limit permits.
    pub(super) fn write_pending(&mut self, now: Instant, polled: &mut Polled) {
        if self.ignores_store() {
            return;
        }
        let reserve = u8::from(!self.is_running());
        if self.owes_record && self.store.limit().take(now, reserve) {
            if let Some(saved) = self.record(now) {
                polled.saved = Some(self.write(&saved));
            }
        } else if self.owes_config && self.store.limit().take(now, 1) {
            let replaces = self.baked();
            let config = self.config.as_ref();
            let written = config.map(|(config, _)| self.store.save_replacement(replaces, config));
            self.owes_config = matches!(written, Some(Err(_)));
            polled.saved = written;
        }
    }

    /// Writes a record; after a failure it remains pending.
    pub(super) fn write(&mut self, saved: &Saved) -> Result<(), StoreError> {
        let written = self.store.save(saved);
        self.owes_record = written.is_err();
        if written.is_ok() {
            self.stored = Some(*saved);
        }
        written
    }

    /// When a record that is owed can be written.
    pub(super) fn next_write(&self) -> Instant {
        let owed = [(self.owes_record, u8::from(!self.is_running())), (self.owes_config, 1)];
        let owed = owed.into_iter().filter(|&(is_owed, _)| is_owed && !self.ignores_store());
        owed.fold(NEVER, |next, (_, reserve)| next.min(self.store.next_write(reserve)))
    }
}
