//! Sectors that are exactly full, partly new or followed by foreign bytes.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::map::image::checksum;
use sonarfix_app::store::{Saved, Store};
use sonarfix_link::baked;

use crate::flash::{FlashError, SECTOR, SECTORS, SimFlash};

/// Bytes of a record in flash, and of a sector's header.
const RECORD: usize = 92;
const HEADER: usize = 24;

fn store(flash: SimFlash) -> Store<SimFlash> {
    Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap()
}

/// A record of [`RECORD`] bytes: 22 of them fill a sector to the last byte.
fn record(number: u32) -> Saved {
    let state = StateEstimate::from_array([1.0, 2.0, 0.5, 0.01, 0.02, 0.001, 0.003]);
    let deviation = StandardDeviations::from_array([0.1; 7]);
    let (run, seconds) = (1, 0x0100_0000 + number);
    Saved { run, seconds, configuration: 3, is_parked: true, state, deviation }
}

/// Whatever record is the last one of its sector, it is found again; opening a journal that is in order changes nothing.
#[test]
fn the_last_record_of_a_sector_is_found_again() {
    let mut flash = SimFlash::new();
    assert_eq!((SECTOR - HEADER) % RECORD, 0);
    for number in 0..3 * (SECTOR / RECORD) as u32 {
        let mut opened = store(flash);
        opened.save(&record(number)).unwrap();
        flash = opened.release();
        let (written, erased) = (flash.written, flash.erased);
        let mut opened = store(flash);
        opened.open().unwrap();
        assert_eq!(opened.load().unwrap(), Some(record(number)), "{number}");
        flash = opened.release();
        assert_eq!((flash.written, flash.erased), (written, erased), "{number}");
    }
    assert!(flash.erased >= 3, "{} erases", flash.erased);
}

/// A power cut during the very first write leaves a part of the first header: the store is new, and nothing is lost.
#[test]
fn a_part_of_the_first_header_is_a_new_store() {
    for at in 0..HEADER {
        let mut flash = SimFlash::new();
        flash.damage(at, 0);
        let mut opened = store(flash);
        assert_eq!(opened.open(), Ok(()), "byte {at}");
        assert_eq!(opened.load(), Ok(None));
        opened.save(&record(7)).unwrap();
        assert_eq!(opened.load(), Ok(Some(record(7))));
    }
    let mut flash = SimFlash::new();
    flash.damage(HEADER + 40, 0);
    assert!(store(flash).open().is_err(), "it held something else");
}

/// Foreign bytes at the end of a sector that look like the head of a long entry: they are not one, and nothing beyond
/// the store is read.
#[test]
fn an_entry_never_extends_beyond_its_sector() {
    let full = ((SECTOR - HEADER) / RECORD) as u32;
    // In the first sector, in the last one, and in the first again.
    for (records, tail) in [1, full + 2, 2 * full + 2]
        .into_iter()
        .flat_map(|records| (2..30).map(move |tail| (records, tail)))
    {
        let mut opened = store(SimFlash::new());
        for number in 1..=records {
            opened.save(&record(number)).unwrap();
        }
        let mut flash = opened.release();
        let sector = flash.erased.saturating_sub(1) % SECTORS;
        let at = (sector + 1) * SECTOR - 4 * tail;
        // Key and length of a head; the rest of the sector stays blank.
        for (offset, byte) in [(0, 0), (4, 1), (5, 0), (6, 160), (7, 0)] {
            flash.damage(at + offset, byte);
        }
        let mut opened = store(flash);
        assert_eq!(opened.open(), Ok(()), "{records} {tail}");
        assert_eq!(opened.load(), Ok(Some(record(records))), "{records} {tail}");
        opened.save(&record(0)).unwrap();
        assert_eq!(opened.load(), Ok(Some(record(0))));
    }
}

/// A record whose payload is as long as the format permits, longer than any of this firmware, counts; one byte more does not.
#[test]
fn a_payload_of_the_greatest_length_counts() {
    const LONGEST: usize = baked::LENGTH_MAX + 5;
    /// Of an entry before its payload.
    const HEAD: usize = 12;
    for (length, counts) in [(LONGEST, true), (LONGEST + 1, false)] {
        let payload = {
            let mut other = store(SimFlash::new());
            other.save(&record(8)).unwrap();
            let mut payload = [0; RECORD - HEADER];
            other.release().read((HEADER + HEAD) as u32, &mut payload).unwrap();
            payload
        };
        let mut opened = store(SimFlash::new());
        opened.save(&record(7)).unwrap();
        let mut flash = opened.release();
        let mut head = [0; HEAD];
        flash.read(HEADER as u32, &mut head).unwrap();
        head[6..8].copy_from_slice(&u16::try_from(length).unwrap().to_le_bytes());
        head[8] += 1;
        let mut entry = head.to_vec();
        entry.extend(payload);
        entry.resize(HEAD + length.next_multiple_of(4), 0);
        let sum = checksum(&entry[4..]);
        entry.extend(sum.to_le_bytes());
        entry.extend([0; 8]);
        for (offset, byte) in entry.into_iter().enumerate() {
            flash.damage(HEADER + RECORD + offset, byte);
        }
        let expected = record(if counts { 8 } else { 7 });
        assert_eq!(store(flash).load(), Ok(Some(expected)), "{length}");
    }
}

/// A flash that counts the bytes that are read.
struct Counting(SimFlash, usize);

impl ErrorType for Counting {
    type Error = FlashError;
}

impl ReadNorFlash for Counting {
    const READ_SIZE: usize = SimFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.1 += bytes.len();
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Counting {
    const WRITE_SIZE: usize = SimFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = SimFlash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.0.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.0.write(offset, bytes)
    }
}

/// All of a new flash is read once, at the start, and not again by the first record, which a command may write while the robot drives.
#[test]
fn the_first_record_does_not_read_all_of_a_new_flash() {
    let flash = Counting(SimFlash::new(), 0);
    let mut store = Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap();
    store.open().unwrap();
    assert!(store.flash().1 >= SECTOR * SECTORS);
    store.flash_mut().1 = 0;
    store.save(&record(1)).unwrap();
    assert!(store.flash().1 < 300, "{} bytes", store.flash().1);
    assert_eq!(store.load(), Ok(Some(record(1))));
}
