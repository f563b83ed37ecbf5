//! The power may go at any byte of a write: the old record or the new one is there, never neither.

use proptest::prelude::*;
use sonarfix::ekf::State;
use sonarfix_app::store::{Saved, Store, StoreError};

use crate::flash::{SECTOR, SECTORS, SimFlash, Torn};

const REGION: core::ops::Range<u32> = 0..(SECTOR * SECTORS) as u32;

fn store(flash: SimFlash) -> Store<SimFlash> {
    Store::new(flash, REGION).unwrap()
}

/// The `run`-th record; no two are alike in any number.
fn record(run: u32) -> Saved {
    let x = run as f32;
    let state = State {
        x,
        y: -x,
        heading: 0.01 * x,
        scale_right: 1e-3 * x,
        scale_left: -1e-3 * x,
        track_width_error: 1e-4 * x,
        range_scale: 1e-2 * x,
    };
    let is_parked = run.is_multiple_of(2);
    let deviation = State { x: 0.1 + x, ..state };
    Saved { run, seconds: 300 * run, configuration: !run, is_parked, state, deviation }
}

/// A flash that has seen `count` records, and what was spent on the next one.
fn worn(count: u32) -> (SimFlash, usize) {
    let mut store = store(SimFlash::new());
    for run in 0..count {
        store.save(&record(run)).unwrap();
    }
    let flash = store.release();
    let mut next = self::store(flash.clone());
    next.save(&record(count)).unwrap();
    let spent = next.release().spent - flash.spent;
    (flash, spent)
}

/// Cuts the power at byte `at` of writing record `count`, and looks what is there.
fn cut(flash: &SimFlash, count: u32, at: usize, torn: Torn) -> SimFlash {
    let mut flash = flash.clone();
    flash.cut_after(at, torn);
    let mut store = store(flash);
    assert!(store.save(&record(count)).is_err(), "the power went at byte {at}");
    let mut flash = store.release();
    flash.power_up();
    flash
}

fn is_old_or_new(found: Result<Option<Saved>, StoreError>, count: u32) -> bool {
    let old = count.checked_sub(1).map(record);
    found == Ok(old) || found == Ok(Some(record(count)))
}

/// Every byte of every write until both sectors have been erased twice over.
#[test]
fn the_old_record_or_the_new_one_wherever_the_power_goes() {
    let (mut cuts, mut erased) = (0, 0);
    for count in 0..14 {
        let (flash, spent) = worn(count);
        erased = flash.erased;
        for at in 0..spent {
            for torn in [Torn::Untouched, Torn::Half, Torn::Done] {
                let mut store = store(cut(&flash, count, at, torn));
                let found = store.load();
                assert!(
                    is_old_or_new(found, count),
                    "record {count}, byte {at}, {torn:?}: {found:?}"
                );
                // And the next run can write again.
                store.save(&record(99)).unwrap();
                assert_eq!(store.load(), Ok(Some(record(99))));
                cuts += 1;
            }
        }
    }
    assert!(erased >= 4, "{erased} sectors erased: not every kind of write was cut");
    assert!(cuts > 3_000, "{cuts} cuts");
}

proptest! {
    /// Power that goes again and again: what was last known to be there stays until something
    /// newer is.
    #[test]
    fn a_robot_whose_power_always_goes(
        cuts in prop::collection::vec((0_usize..600, 0_u8..3), 1..30),
    ) {
        let mut flash = SimFlash::new();
        let mut there = None;
        for (run, (at, torn)) in (0..).zip(cuts) {
            let torn = [Torn::Untouched, Torn::Half, Torn::Done][usize::from(torn)];
            flash.cut_after(at, torn);
            let mut writer = store(flash);
            let written = writer.save(&record(run));
            flash = writer.release();
            flash.power_up();
            let mut reader = store(flash);
            let found = reader.load().unwrap();
            let is_new = found == Some(record(run));
            prop_assert!(is_new || (written.is_err() && found == there), "{run}: {found:?}");
            there = found;
            flash = reader.release();
        }
    }
}

proptest! {
    /// Bytes changed anywhere: what is read was once written, or nothing is, and the robot can
    /// write again; nothing panics on the way.
    #[test]
    fn a_damaged_store_gives_only_what_was_written(
        count in 0_u32..14,
        damage in prop::collection::vec((0..SECTOR * SECTORS, any::<u8>()), 1..40),
    ) {
        let (mut flash, _) = worn(count);
        for (at, to) in damage {
            flash.damage(at, to);
        }
        let mut store = store(flash);
        match store.load() {
            Ok(Some(found)) => prop_assert!((0..count).map(record).any(|old| old == found)),
            Ok(None) | Err(StoreError::Corrupt) => {}
            Err(error) => prop_assert!(false, "{error:?}"),
        }
        if store.save(&record(99)).is_err() {
            store.format().unwrap();
            store.save(&record(99)).unwrap();
        }
        prop_assert_eq!(store.load(), Ok(Some(record(99))));
    }
}

#[test]
fn a_new_flash_holds_nothing() {
    assert_eq!(store(SimFlash::new()).load(), Ok(None));
}

#[test]
fn what_is_no_store_is_said_to_be_none_and_can_be_formatted() {
    let mut store = store(SimFlash::filled(0x5A));
    assert_eq!(store.load(), Err(StoreError::Corrupt));
    store.format().unwrap();
    assert_eq!(store.load(), Ok(None));
    store.save(&record(7)).unwrap();
    assert_eq!(store.load(), Ok(Some(record(7))));
}

#[test]
fn a_flash_that_takes_nothing_is_found_out() {
    let mut flash = SimFlash::new();
    flash.is_read_only = true;
    let written = store(flash).save(&record(1));
    assert!(written.is_err(), "{written:?}");
}

#[test]
fn a_region_of_less_than_two_sectors_is_refused() {
    for region in [0..SECTOR as u32, 0..100, 8..(SECTOR * 2) as u32] {
        assert_eq!(Store::new(SimFlash::new(), region).err(), Some(StoreError::Region));
    }
}

/// What the flash stands: `docs/firmware.md` computes with this.
#[test]
fn how_often_a_sector_is_erased() {
    let (_, bytes) = worn(1);
    println!("a record takes {bytes} bytes of flash");
    assert!(bytes <= 96, "{bytes}");
}
