//! An append-only journal of records in two or more sectors of NOR flash.
//!
//! One sector is active: new records are appended to it. When it is full, the newest record of each
//! key is copied to the next sector, which then becomes the active one. Only the next sector is ever
//! erased, so at every instant one sector holds everything.
//!
//! # Entries
//! A sector starts with a header, which is an entry without payload, and holds records behind it.
//! The active sector is that whose header has the highest sequence number.
//!
//! | bytes | | |
//! |---|---|---|
//! | 4 | *begun* | written to 0 before anything else of the entry |
//! | 1, 1, 2 | key, 0, length of the payload | |
//! | 4 | sequence number | |
//! | length, padded to words with 0xFF | payload | |
//! | 4 | CRC-32 of key to payload | |
//! | 4 | *written* | written to 0 after all before it has been read back |
//! | 4 | *trusted* | written to 0 after *written* has been read back |
//!
//! # Power cuts
//! A bit whose write or erase was interrupted may read differently each time, so a single read proves nothing.
//! The order of the writes makes the records safe. A mark counts as set as soon as a single bit of it is 0:
//!
//! - *Begun* is all ones: nothing behind it was ever written, so the space can be used. A *begun* that was only
//!   partly written is written to 0 again by the next entry there, which leaves no unstable bit.
//! - *Trusted* has a 0: *written* is stable, and the entry before it. The entry counts, and will
//!   count at every later start, whatever *trusted* reads then.
//! - Only *written* has a 0: the entry is stable, but *written* itself may not be.
//! - Neither has a 0: the entry may be whole, unstable or missing. It does not count.
//!
//! In the last two cases, and after an interrupted copy, [`Journal::open`] copies everything to the
//! next sector before it returns, so that every later start reads the same records.
//! If only *written* has a 0 in a header, its *trusted* is written before that. A next sector whose
//! header was begun and is not an older one counts as an interrupted copy. The header of a sector is overwritten with zeros before the
//! sector is erased, so that an interrupted erase leaves no header that counts without its records.
//!
//! Assumptions: a write changes only the bytes that are written, and reading changes nothing.
//!
//! # Damage
//! A corrupt byte costs the record that contains it: the search continues at the next word, and all
//! records found are copied.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use sonarfix::map::image::checksum as crc32;

use super::error::StoreError;
use super::record::{KEYS, LONGEST};

/// Unit of all lengths: the longest word that a supported flash writes.
const WORD: u32 = 4;
/// The contents of a mark that is set.
const MARKED: [u8; 4] = [0; 4];
const BLANK: u8 = 0xFF;

/// Bytes before the payload: *begun*, key, length, sequence number.
const HEAD: usize = 12;
/// Bytes behind it: CRC-32, *written*, *trusted*.
const TAIL: usize = 12;
const ENTRY_MAX: usize = HEAD + LONGEST.next_multiple_of(4) + TAIL;
/// Length of a sector's header.
const HEADER: u32 = 24;
/// Room for a header, the copies of both records, and the longest record behind them. Pose and calibration take 88 bytes.
const SECTOR_MIN: usize = 24 + 88 + 2 * ENTRY_MAX;
/// The key of a sector's header.
const HEADER_KEY: u8 = 0;
/// Bytes that are read at once in blank space.
const CHUNK: usize = 32;

type Buffer = [u8; ENTRY_MAX];

/// Which mark of an entry counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Mark {
    None,
    Written,
    Trusted,
}

/// An entry whose checksum is right.
#[derive(Debug, Clone, Copy)]
struct Entry {
    key: u8,
    sequence: u32,
    /// Bytes of its payload.
    length: usize,
    mark: Mark,
}

impl Entry {
    /// Bytes that it takes in flash.
    fn size(&self) -> u32 {
        size(self.length)
    }
}

/// Bytes in flash of an entry with a payload of this length.
fn size(length: usize) -> u32 {
    // A payload has at most `LONGEST` bytes.
    let length = u32::try_from(length).unwrap_or(u32::MAX / 2);
    HEADER + length.next_multiple_of(WORD)
}

/// The result of a search of the flash, updated by every write.
#[derive(Debug, Clone, Copy)]
struct View {
    /// Address of the active sector.
    sector: u32,
    /// The mark of its header.
    mark: Mark,
    /// The highest sequence number in it.
    sequence: u32,
    /// Address of the first byte behind the last entry.
    end: u32,
    /// Addresses of the newest records, in the order of [`KEYS`].
    newest: [Option<u32>; KEYS.len()],
    /// Whether something in it, or in the next sector, may read differently at the next start.
    is_unstable: bool,
}

/// The journal.
pub(super) struct Journal<F> {
    flash: F,
    region: Range<u32>,
    /// `None` before the first search, after an error, and without a journal.
    view: Option<View>,
    /// Whether a search has found that nothing was ever written.
    is_new: bool,
}

impl<F: NorFlash> Journal<F> {
    /// A journal in this region, in the flash's own addresses.
    ///
    /// # Errors
    /// [`StoreError::Region`] if it is not two or more whole sectors.
    pub fn new(flash: F, region: Range<u32>) -> Result<Self, StoreError> {
        const {
            assert!(4_usize.is_multiple_of(F::WRITE_SIZE), "the flash writes longer words");
            assert!(F::ERASE_SIZE >= SECTOR_MIN, "a sector is too short");
            assert!(HEADER as usize == HEAD + TAIL, "a header has no payload");
        }
        let journal = Self { flash, region, view: None, is_new: false };
        let Range { start, end } = journal.region;
        let size = Self::sector_size();
        let is_whole = start.is_multiple_of(size) && end.is_multiple_of(size);
        if is_whole && end.saturating_sub(start) / size >= 2 {
            Ok(journal)
        } else {
            Err(StoreError::Region)
        }
    }

    /// Searches the flash, unless that has been done, and repairs the effects of a power cut. Contents that
    /// are not a journal are replaced by an empty one.
    ///
    /// # Errors
    /// [`StoreError::Corrupt`] if it held no journal and was not new either; [`StoreError::Flash`],
    /// [`StoreError::NotWritten`] if it could not be read or settled.
    pub fn open(&mut self) -> Result<(), StoreError> {
        match self.search() {
            Ok(()) => {}
            Err(StoreError::Corrupt) => return self.renew().and(Err(StoreError::Corrupt)),
            Err(error) => return Err(error),
        }
        match self.view {
            Some(view) if view.is_unstable => self.settle(view),
            _ => Ok(()),
        }
    }

    /// The payload of the newest record with this key, in `buffer`; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError::Corrupt`] if the flash holds no journal and is not new either;
    /// [`StoreError::Flash`] if it could not be read.
    pub fn read<'b>(
        &mut self,
        key: u8,
        buffer: &'b mut [u8; LONGEST],
    ) -> Result<Option<&'b [u8]>, StoreError> {
        self.search()?;
        let newest = self.view.map_or([None; KEYS.len()], |view| view.newest);
        let newest = KEYS.iter().zip(newest).find(|(known, _)| **known == key);
        let Some(at) = newest.and_then(|(_, at)| at) else { return Ok(None) };
        let mut whole = [0; ENTRY_MAX];
        // It was whole when it was found.
        let entry = self.entry(at, &mut whole)?.ok_or(StoreError::Flash)?;
        let payload = whole.get(HEAD..HEAD + entry.length).ok_or(StoreError::Flash)?;
        let copy = buffer.get_mut(..entry.length).ok_or(StoreError::Flash)?;
        copy.copy_from_slice(payload);
        Ok(Some(copy))
    }

    /// Appends a record, and reads it back.
    ///
    /// # Errors
    /// [`StoreError::Flash`], [`StoreError::NotWritten`]; the record before it still counts.
    pub fn write(&mut self, key: u8, payload: &[u8]) -> Result<(), StoreError> {
        match self.open() {
            Ok(()) | Err(StoreError::Corrupt) => {}
            Err(error) => return Err(error),
        }
        if self.append(key, payload).is_ok() {
            return Ok(());
        }
        // The sector is full or cannot be written: use the next one.
        self.renew()?;
        self.append(key, payload)
    }

    pub fn flash(&self) -> &F {
        &self.flash
    }

    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    pub fn release(self) -> F {
        self.flash
    }

    fn sector_size() -> u32 {
        // No flash has sectors of 4 GiB.
        u32::try_from(F::ERASE_SIZE).unwrap_or(u32::MAX)
    }

    fn sectors(&self) -> impl Iterator<Item = u32> + use<F> {
        self.region.clone().step_by(F::ERASE_SIZE)
    }

    /// The sector that follows this one; the first after the last.
    fn next_sector(&self, sector: u32) -> u32 {
        let next = sector.saturating_add(Self::sector_size());
        if next < self.region.end { next } else { self.region.start }
    }

    /// The sector that holds this address.
    fn sector_of(at: u32) -> u32 {
        at - at % Self::sector_size()
    }

    /// Finds the active sector and its records, unless that has been done.
    fn search(&mut self) -> Result<(), StoreError> {
        if self.view.is_some() || self.is_new {
            return Ok(());
        }
        let mut active: Option<(u32, Entry)> = None;
        for sector in self.sectors() {
            if let Some(header) = self.header(sector)?
                && active.is_none_or(|(_, other)| header.sequence > other.sequence)
            {
                active = Some((sector, header));
            }
        }
        let Some((sector, header)) = active else {
            // It takes long to read all of a flash: the first write does not do it again.
            self.is_new = self.is_blank_but_for_a_header()?;
            return if self.is_new { Ok(()) } else { Err(StoreError::Corrupt) };
        };
        let mut view = self.view_of(sector, &header)?;
        let next = self.next_sector(sector);
        view.is_unstable |= !self.is_older(next, header.sequence)?;
        self.view = Some(view);
        Ok(())
    }

    fn header(&mut self, sector: u32) -> Result<Option<Entry>, StoreError> {
        let entry = self.entry(sector, &mut [0; ENTRY_MAX])?;
        Ok(entry.filter(|entry| entry.key == HEADER_KEY && entry.mark > Mark::None))
    }

    /// Whether nothing was ever written, except perhaps a part of the first header.
    fn is_blank_but_for_a_header(&mut self) -> Result<bool, StoreError> {
        let Range { start, end } = self.region;
        self.is_blank(start + HEADER..end)
    }

    /// Whether a sector can never read as one that is newer than this.
    fn is_older(&mut self, sector: u32, sequence: u32) -> Result<bool, StoreError> {
        let mut begun = [0; 4];
        self.load(sector, &mut begun)?;
        let header = self.header(sector)?;
        Ok(begun == [BLANK; 4] || header.is_some_and(|header| header.sequence < sequence))
    }

    /// Reads all entries of a sector.
    fn view_of(&mut self, sector: u32, header: &Entry) -> Result<View, StoreError> {
        let mut view = View {
            sector,
            mark: header.mark,
            sequence: header.sequence,
            end: sector + HEADER,
            newest: [None; KEYS.len()],
            is_unstable: header.mark < Mark::Trusted,
        };
        let sector_end = sector.saturating_add(Self::sector_size());
        let mut buffer = [0; ENTRY_MAX];
        let mut at = view.end;
        while at < sector_end && !self.is_blank(at..sector_end)? {
            // An old entry among newer ones is left of an incomplete erase.
            let entry = self.entry(at, &mut buffer)?;
            let counts = |entry: &Entry| entry.mark > Mark::None && entry.sequence > view.sequence;
            let Some(entry) = entry.filter(counts) else {
                view.is_unstable = true;
                at += WORD;
                continue;
            };
            view.is_unstable |= entry.mark < Mark::Trusted;
            view.sequence = entry.sequence;
            note(&mut view.newest, entry.key, at);
            at += entry.size();
        }
        view.end = at;
        Ok(view)
    }

    fn is_blank(&mut self, range: Range<u32>) -> Result<bool, StoreError> {
        let mut chunk = [0; CHUNK];
        for at in range.clone().step_by(CHUNK) {
            let length = usize::try_from(range.end - at).unwrap_or(CHUNK).min(CHUNK);
            let bytes = chunk.get_mut(..length).ok_or(StoreError::Flash)?;
            self.load(at, bytes)?;
            if bytes.iter().any(|byte| *byte != BLANK) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The entry at this address, with its bytes in `buffer`; `None` where none is whole.
    fn entry(&mut self, at: u32, buffer: &mut Buffer) -> Result<Option<Entry>, StoreError> {
        let room = Self::sector_of(at).saturating_add(Self::sector_size()) - at;
        let Some((head, _)) = buffer.split_first_chunk_mut::<HEAD>() else { return Ok(None) };
        if room < HEADER {
            return Ok(None);
        }
        self.load(at, head)?;
        let [_, _, _, _, key, _, l0, l1, s0, s1, s2, s3] = *head;
        let length = usize::from(u16::from_le_bytes([l0, l1]));
        if length > LONGEST || size(length) > room {
            return Ok(None);
        }
        let whole = HEAD + length.next_multiple_of(4) + TAIL;
        let Some(rest) = buffer.get_mut(HEAD..whole) else { return Ok(None) };
        self.load(at + 3 * WORD, rest)?;
        let Some((body, [c0, c1, c2, c3, written @ .., t0, t1, t2, t3])) =
            buffer.get(4..whole).and_then(|bytes| bytes.split_last_chunk::<TAIL>())
        else {
            return Ok(None);
        };
        let mark = if [*t0, *t1, *t2, *t3] != [BLANK; 4] {
            Mark::Trusted
        } else if *written != [BLANK; 4] {
            Mark::Written
        } else {
            Mark::None
        };
        let is_whole = crc32(body) == u32::from_le_bytes([*c0, *c1, *c2, *c3]);
        let sequence = u32::from_le_bytes([s0, s1, s2, s3]);
        Ok(is_whole.then_some(Entry { key, sequence, length, mark }))
    }

    /// Rewrites entries that are not trusted, so that the contents in use read the same at every start.
    fn settle(&mut self, view: View) -> Result<(), StoreError> {
        if view.mark < Mark::Trusted {
            self.store(view.sector + HEADER - WORD, &MARKED)?;
        }
        self.renew()
    }

    /// Copies the newest records to the next sector and makes it the active one; without a journal,
    /// makes the first sector an empty one.
    #[inline(never)]
    fn renew(&mut self) -> Result<(), StoreError> {
        // The view is invalid until the copy is complete: an error leads to another search.
        let old = self.view.take();
        self.is_new = false;
        let (sector, sequence) = match old {
            Some(view) => (self.next_sector(view.sector), view.sequence.saturating_add(1)),
            None => (self.region.start, 1),
        };
        let end = sector.saturating_add(Self::sector_size());
        self.invalidate(sector)?;
        self.flash.erase(sector, end).map_err(|_| StoreError::Flash)?;
        let mut view = View {
            sector,
            mark: Mark::Trusted,
            sequence,
            end: sector + HEADER,
            newest: [None; KEYS.len()],
            is_unstable: false,
        };
        let mut buffer = [0; ENTRY_MAX];
        for at in old.iter().flat_map(|old| old.newest).flatten() {
            let entry = self.entry(at, &mut buffer)?.ok_or(StoreError::Flash)?;
            let copy = Entry { sequence: view.sequence.saturating_add(1), ..entry };
            self.put(view.end, &copy, &mut buffer)?;
            view.sequence = copy.sequence;
            note(&mut view.newest, copy.key, view.end);
            view.end += copy.size();
        }
        let header = Entry { key: HEADER_KEY, sequence, length: 0, mark: Mark::Trusted };
        self.put(sector, &header, &mut buffer)?;
        self.view = Some(view);
        Ok(())
    }

    /// Makes the header of a sector unreadable before the sector is erased: a header of an interrupted copy counts, and an erase
    /// that is interrupted as well can leave it whole and the records damaged.
    fn invalidate(&mut self, sector: u32) -> Result<(), StoreError> {
        let mut begun = [0; 4];
        self.load(sector, &mut begun)?;
        // Key, sequence number and CRC-32: that of zeros is not zero.
        if begun == [BLANK; 4] { Ok(()) } else { self.store(sector + WORD, &[0; 12]) }
    }

    /// Appends a record to the active sector.
    ///
    /// # Errors
    /// [`StoreError::NotWritten`], also if there is no room or no active sector;
    /// [`StoreError::Flash`].
    #[inline(never)]
    fn append(&mut self, key: u8, payload: &[u8]) -> Result<(), StoreError> {
        let Some(view) = self.view else { return Err(StoreError::NotWritten) };
        let entry = Entry {
            key,
            sequence: view.sequence.saturating_add(1),
            length: payload.len(),
            mark: Mark::Trusted,
        };
        let end = view.end + entry.size();
        if end > view.sector.saturating_add(Self::sector_size()) {
            return Err(StoreError::NotWritten);
        }
        let mut buffer = [0; ENTRY_MAX];
        let space = buffer.get_mut(HEAD..HEAD + payload.len()).ok_or(StoreError::NotWritten)?;
        space.copy_from_slice(payload);
        let written = self.put(view.end, &entry, &mut buffer);
        let mut newest = view.newest;
        note(&mut newest, key, view.end);
        self.view = Some(match written {
            Ok(()) => View { sequence: entry.sequence, end, newest, ..view },
            Err(_) => View { is_unstable: true, ..view },
        });
        written
    }

    /// Writes an entry whose payload is in `buffer`, in the order that survives a power cut.
    fn put(&mut self, at: u32, entry: &Entry, buffer: &mut Buffer) -> Result<(), StoreError> {
        let body_end = HEAD + entry.length.next_multiple_of(4);
        fill(entry, buffer, body_end).ok_or(StoreError::NotWritten)?;
        let body = buffer.get(4..body_end + 4).ok_or(StoreError::NotWritten)?;
        let marks = at + entry.size() - 2 * WORD;
        self.store(at, &MARKED)?;
        self.store(at + WORD, body)?;
        self.store(marks, &MARKED)?;
        self.store(marks + WORD, &MARKED)
    }

    fn load(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), StoreError> {
        self.flash.read(at, bytes).map_err(|_| StoreError::Flash)
    }

    /// Writes whole words, and reads them back.
    fn store(&mut self, at: u32, bytes: &[u8]) -> Result<(), StoreError> {
        self.flash.write(at, bytes).map_err(|_| StoreError::Flash)?;
        let mut chunk = [0; CHUNK];
        for (at, written) in (at..).step_by(CHUNK).zip(bytes.chunks(CHUNK)) {
            let read = chunk.get_mut(..written.len()).ok_or(StoreError::Flash)?;
            self.load(at, read)?;
            if read != written {
                return Err(StoreError::NotWritten);
            }
        }
        Ok(())
    }
}

/// Records the address of a record. Records with a key that this firmware does not use are not copied.
fn note(newest: &mut [Option<u32>; KEYS.len()], key: u8, at: u32) {
    for (known, newest) in KEYS.iter().zip(newest) {
        if *known == key {
            *newest = Some(at);
        }
    }
}

/// Completes an entry around the payload in `buffer`, up to its CRC-32.
fn fill(entry: &Entry, buffer: &mut Buffer, body_end: usize) -> Option<()> {
    let [l0, l1] = u16::try_from(entry.length).ok()?.to_le_bytes();
    let [s0, s1, s2, s3] = entry.sequence.to_le_bytes();
    *buffer.first_chunk_mut::<HEAD>()? = [0, 0, 0, 0, entry.key, 0, l0, l1, s0, s1, s2, s3];
    buffer.get_mut(HEAD + entry.length..body_end)?.fill(BLANK);
    let checksum = crc32(buffer.get(4..body_end)?);
    buffer.get_mut(body_end..)?.first_chunk_mut()?.clone_from(&checksum.to_le_bytes());
    Some(())
}
