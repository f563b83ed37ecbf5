//! A power cut at any step of a write or erase leaves the old or the new record of each key. Every later start reads
//! the same one, and the next record can be written.

use proptest::prelude::*;
use sonarfix::config::Config;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::Metres;
use sonarfix_app::store::{Saved, Store, StoreError, StoredConfiguration};
use sonarfix_hal::config::RobotConfig;

use crate::flash::{ERASE_STEPS, Random, SECTOR, SECTORS, SimFlash};

const REGION: core::ops::Range<u32> = 0..(SECTOR * SECTORS) as u32;

fn store(flash: SimFlash) -> Store<SimFlash> {
    Store::new(flash, REGION).unwrap()
}

/// The `run`-th record; two records differ in every number.
fn record(run: u32) -> Saved {
    let x = run as f32;
    let numbers = [x, -x, 0.01 * x, 1e-3 * x, -1e-3 * x, 1e-4 * x, 1e-2 * x];
    let state = StateEstimate::from_array(numbers);
    let is_parked = run.is_multiple_of(2);
    let deviation = StandardDeviations::from_array([
        0.1 + x,
        -x,
        0.01 * x,
        1e-3 * x,
        -1e-3 * x,
        1e-4 * x,
        1e-2 * x,
    ]);
    Saved { run, seconds: 300 * run, configuration: !run, is_parked, state, deviation }
}

/// The configuration that was sent in the `run`-th run.
fn kept(run: u32) -> StoredConfiguration {
    let config = Config::for_track_width(Metres(0.1 + 1e-3 * run as f32));
    StoredConfiguration { replaces: !run, config: RobotConfig::with_common_parts(config) }
}

/// Both records, if present.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Records {
    saved: Option<Saved>,
    kept: Option<StoredConfiguration>,
}

impl Records {
    fn read(store: &mut Store<SimFlash>) -> Result<Self, StoreError> {
        Ok(Self { saved: store.load()?, kept: store.load_config()? })
    }
}

/// The write of the `run`-th run: a record, every fifth time a configuration.
#[derive(Debug, Clone, Copy)]
struct Write(u32);

impl Write {
    fn is_config(self) -> bool {
        self.0 % 5 == 3
    }

    fn to(self, store: &mut Store<SimFlash>) -> Result<(), StoreError> {
        if self.is_config() {
            store.save_config(&kept(self.0))
        } else {
            store.save(&record(self.0))
        }
    }

    /// The records after this write, if these were there before.
    fn over(self, old: &Records) -> Records {
        if self.is_config() {
            Records { kept: Some(kept(self.0)), ..*old }
        } else {
            Records { saved: Some(record(self.0)), ..*old }
        }
    }
}

/// Opens and reads the store so many times; every start must read the same.
fn start_again(mut flash: SimFlash, times: usize, what: &str) -> (SimFlash, Records) {
    let mut first = None;
    for _ in 0..times {
        let mut store = store(flash);
        assert_eq!(store.open(), Ok(()), "{what}");
        let read = Records::read(&mut store).unwrap();
        assert_eq!(*first.get_or_insert(read), read, "{what}: a later start reads something else");
        flash = store.release();
    }
    (flash, first.unwrap_or_default())
}

/// Cuts the power at one step of a write, and checks the records.
fn check_cut(before: &SimFlash, old: &Records, write: Write, at: usize, seed: u64) {
    let what = format!("write {}, step {at}, seed {seed}", write.0);
    let mut flash = before.clone();
    flash.cut_after(at, seed);
    let mut cut = store(flash);
    assert!(write.to(&mut cut).is_err(), "{what}: the power went");
    let mut flash = cut.release();
    flash.power_up();

    if *old == Records::default() {
        // The very first erase may leave an invalid store; it is reported, and nothing is lost.
        let mut first = store(flash);
        let opened = first.open();
        assert!(matches!(opened, Ok(()) | Err(StoreError::Corrupt)), "{what}: {opened:?}");
        flash = first.release();
    }
    let (flash, mut found) = start_again(flash, 1 + seed as usize % 3, &what);
    assert!(found == *old || found == write.over(old), "{what}: {found:?}");

    let (mut flash, mut there) = (flash, found);
    for next in [Write(90), Write(93)] {
        let mut writer = store(flash);
        assert_eq!(next.to(&mut writer), Ok(()), "{what}: the next write");
        (flash, found) = start_again(writer.release(), 1, &what);
        there = next.over(&there);
        assert_eq!(found, there, "{what}: after the next write");
    }
}

/// Every step of every write until both sectors have been erased twice over, on flash that writes
/// bytes, words and pages at once.
#[test]
fn a_power_cut_leaves_the_old_or_the_new_records() {
    let (mut writes, mut of_writes, mut erases, mut of_erases) = (0, 0, 0, 0);
    for unit in [1, 4, 256] {
        let mut flash = SimFlash::new().writing(unit);
        let mut old = Records::default();
        for run in 0_u32.. {
            let write = Write(run);
            let after = written(&flash, write);
            for at in 0..after.steps - flash.steps {
                for seed in 0..SEEDS {
                    check_cut(&flash, &old, write, at, seed + 1_000 * at as u64);
                }
            }
            let erased = after.erased - flash.erased;
            (writes, erases) = (writes + 1, erases + erased);
            of_writes += after.steps - flash.steps - erased * ERASE_STEPS;
            of_erases += erased * ERASE_STEPS;
            (flash, old) = (after, write.over(&old));
            if flash.erased > 4 {
                break;
            }
        }
    }
    let cuts = (of_writes + of_erases) * SEEDS as usize;
    println!(
        "{cuts} cuts, {SEEDS} at each step: {of_writes} steps of {writes} writes, {of_erases} of {erases} erases"
    );
    assert!(cuts > 10_000, "{cuts} cuts");
}

/// Random outcomes tried for each cut.
const SEEDS: u64 = 8;

/// A flash before and after this write.
fn written(before: &SimFlash, write: Write) -> SimFlash {
    let mut writer = store(before.clone());
    writer.open().unwrap();
    write.to(&mut writer).unwrap();
    writer.release()
}

/// A flash in which the next configuration needs another sector and the next record does not; its records, and the
/// write of that configuration.
fn nearly_full() -> (SimFlash, Records, Write) {
    let (mut flash, mut old) = (SimFlash::new(), Records::default());
    let sent = Write(98);
    for write in [Write(3)].into_iter().chain((0..60).map(Write)) {
        let is_full = written(&flash, sent).erased > flash.erased;
        if is_full && written(&flash, Write(90)).erased == flash.erased {
            return (flash, old, sent);
        }
        if write.0 < 4 || !write.is_config() {
            (flash, old) = (written(&flash, write), write.over(&old));
        }
    }
    panic!("no record is shorter than a configuration");
}

/// Cuts during the copy to another sector, with many more random outcomes: single unstable bits of single marks
/// matter there.
#[test]
fn a_cut_during_a_copy() {
    let (before, old, write) = nearly_full();
    for at in 0..written(&before, write).steps - before.steps {
        for seed in 0..300 {
            check_cut(&before, &old, write, at, seed);
        }
    }
    println!("300 cuts at each of {} steps", written(&before, write).steps - before.steps);
}

/// A second cut while the store is repaired after the first.
#[test]
fn a_cut_during_a_copy_and_another_during_its_repair() {
    let (before, old, write) = nearly_full();
    let steps = written(&before, write).steps - before.steps;
    let mut settled = 0;
    for at in 0..steps {
        for seed in 0..300 {
            let mut random = Random::new(seed);
            let mut flash = before.clone();
            flash.cut_after(at, seed);
            let mut cut = store(flash);
            assert!(write.to(&mut cut).is_err());
            let mut flash = cut.release();
            flash.power_up();
            flash.cut_after(random.below(steps), random.next());
            let mut cut = store(flash);
            settled += usize::from(cut.open().is_err());
            let mut flash = cut.release();
            flash.power_up();
            let what = format!("step {at}, seed {seed}");
            let (_, found) = start_again(flash, 3, &what);
            assert!(found == old || found == write.over(&old), "{what}: {found:?}");
        }
    }
    println!("{settled} second cuts in {} repairs", 300 * steps);
    assert!(settled > 5_000, "{settled} cuts");
}

/// The values that a start may read of one key.
#[derive(Debug, Clone)]
struct Possible<T>(Vec<Option<T>>);

impl<T: Copy + PartialEq + core::fmt::Debug> Possible<T> {
    fn reads(&mut self, found: Option<T>, what: &str) {
        assert!(self.0.contains(&found), "{what}: {found:?} is not among {:?}", self.0);
        self.0 = vec![found];
    }

    fn written(&mut self, new: T, is_done: bool) {
        if is_done {
            self.0.clear();
        }
        self.0.push(Some(new));
    }
}

/// Repeated power cuts, also while the store is repaired after the last one.
#[test]
fn repeated_power_cuts() {
    for seed in 0..400 {
        let mut random = Random::new(seed);
        let mut flash = SimFlash::new().writing([1, 4, 256][random.below(3)]);
        let mut saved = Possible::<Saved>(vec![None]);
        let mut sent = Possible::<StoredConfiguration>(vec![None]);
        let mut run = 0;
        for life in 0..60 {
            let what = format!("seed {seed}, life {life}");
            let reach = [40, 400, 4_000][random.below(3)];
            flash.cut_after(random.below(reach), random.next());
            let mut store = store(flash);
            if store.open().is_ok()
                && let Ok(found) = Records::read(&mut store)
            {
                saved.reads(found.saved, &what);
                sent.reads(found.kept, &what);
                for _ in 0..random.below(12) {
                    run += 1;
                    let is_done = Write(run).to(&mut store).is_ok();
                    if Write(run).is_config() {
                        sent.written(kept(run), is_done);
                    } else {
                        saved.written(record(run), is_done);
                    }
                    if !is_done {
                        break;
                    }
                }
            }
            flash = store.release();
            flash.power_up();
        }
        let (_, found) = start_again(flash, 3, "at last");
        saved.reads(found.saved, "at last");
        sent.reads(found.kept, "at last");
    }
}

/// A flash that has seen `count` records.
fn worn(count: u32) -> SimFlash {
    let mut store = store(SimFlash::new());
    for run in 0..count {
        Write(run).to(&mut store).unwrap();
    }
    store.release()
}

proptest! {
    /// After changes of arbitrary bytes, each record read is one that was written, the next records can be written,
    /// and nothing panics.
    #[test]
    fn a_damaged_store_gives_only_what_was_written(
        count in 0_u32..40,
        damage in prop::collection::vec((0..SECTOR * SECTORS, any::<u8>()), 1..40),
    ) {
        let mut flash = worn(count);
        for (at, to) in damage {
            flash.damage(at, to);
        }
        let mut store = store(flash);
        let opened = store.open();
        prop_assert!(matches!(opened, Ok(()) | Err(StoreError::Corrupt)), "{opened:?}");
        let found = Records::read(&mut store).unwrap();
        prop_assert!(found.saved.is_none_or(|found| found == record(found.run)));
        prop_assert!(found.kept.is_none_or(|found| found == kept(!found.replaces)));
        Write(90).to(&mut store).unwrap();
        Write(93).to(&mut store).unwrap();
        let found = Records::read(&mut store);
        prop_assert_eq!(found, Ok(Write(93).over(&Write(90).over(&Records::default()))));
    }
}

/// A corrupt byte costs the record that contains it, and no other.
#[test]
fn one_damaged_byte_costs_one_record() {
    let whole = worn(5);
    let bytes = whole.written;
    for at in 24..bytes {
        let mut flash = whole.clone();
        flash.damage(at, 0x3C);
        let mut store = store(flash);
        assert_eq!(store.open(), Ok(()), "byte {at}");
        let found = Records::read(&mut store).unwrap();
        let lost =
            usize::from(found.saved != Some(record(4))) + usize::from(found.kept != Some(kept(3)));
        assert!(lost <= 1, "byte {at}: {found:?}");
    }
}

#[test]
fn a_new_flash_holds_nothing_and_is_not_written() {
    let (flash, found) = start_again(SimFlash::new(), 2, "new");
    assert_eq!((found, flash.steps), (Records::default(), 0));
}

#[test]
fn an_invalid_store_is_reported_once_and_formatted() {
    let mut first = store(SimFlash::filled(0x5A));
    assert_eq!(first.load(), Err(StoreError::Corrupt));
    assert_eq!(first.open(), Err(StoreError::Corrupt));
    assert_eq!(first.load(), Ok(None));
    let (flash, found) = start_again(first.release(), 2, "formatted");
    assert_eq!(found, Records::default());
    let mut store = store(flash);
    assert_eq!(store.save(&record(7)), Ok(()));
    assert_eq!(store.load(), Ok(Some(record(7))));
}

/// A store that was not opened opens at the first write.
#[test]
fn an_invalid_store_is_formatted_by_the_first_write() {
    let mut store = store(SimFlash::filled(0x00));
    assert_eq!(store.save(&record(7)), Ok(()));
    assert_eq!(store.load(), Ok(Some(record(7))));
}

#[test]
fn a_read_only_flash_is_reported() {
    let mut flash = SimFlash::new();
    flash.is_read_only = true;
    assert_eq!(store(flash).save(&record(1)), Err(StoreError::NotWritten));
}

#[test]
fn a_region_of_less_than_two_sectors_is_refused() {
    for region in [0..SECTOR as u32, 0..100, 8..(SECTOR * 2) as u32, 0..0] {
        assert_eq!(Store::new(SimFlash::new(), region).err(), Some(StoreError::Region));
    }
}

/// A configuration that is already stored is not written again.
#[test]
fn the_same_configuration_is_written_once() {
    let mut store = store(SimFlash::new());
    store.save_config(&kept(1)).unwrap();
    for _ in 0..100 {
        store.save_config(&kept(1)).unwrap();
    }
    assert!(store.release().written < 300);
}

/// The size of a record in flash, from which `docs/firmware.md` computes the wear.
#[test]
fn bytes_of_a_record() {
    let bytes = |write: Write| {
        let mut store = store(worn(1));
        write.to(&mut store).unwrap();
        store.release().written - worn(1).written
    };
    let (saved, sent) = (bytes(Write(1)), bytes(Write(3)));
    println!("a record takes {saved} bytes of flash, a configuration {sent}");
    assert!(saved <= 100 && sent <= 240, "{saved}, {sent}");
}
