//! The format of a baked map: one byte slice, written on a PC (`sonarfix map bake`) and read in place.
//!
//! Numbers are little endian, without alignment. `docs/formats.md` describes the format for writers.
//!
//! | bytes | content |
//! |---|---|
//! | 4 | [`MAGIC`] |
//! | 4 | [`VERSION`], or [`VERSION_WITH_ACCURACIES`] |
//! | 4 | number of walls W |
//! | 4 | number of references R |
//! | 2, 2 | columns and rows of the [`Grid`] |
//! | 4, 4 | origin of the grid, x and y, metres, `f32` |
//! | 4 | size of a cell, metres, `f32` |
//! | [20](WALL) W | the walls, each [as stored](super::Wall::stored): five `f32` |
//! | 4 (cells + 1) | for each cell, row by row, the index of its first reference; finally R |
//! | 2 R or 3 R | the [references](Reference): two bytes each if W ≤ [`MOST_NARROW`], else three |
//! | W | with accuracies: that [of each wall](super::Wall::stored_accuracy) |
//! | 4 | [`checksum`] of all preceding bytes |
//!
//! Each cell refers to every wall whose bounding box touches it, in ascending order.
//!
//! # Non-finite policy
//! A NaN or an infinity in the header is [`MapError::Grid`], in a wall [`MapError::Wall`]; a map that has
//! been read contains none.

use core::ops::Range;

use super::grid::{Cells, Grid};
use super::wall::{Wall, WallId};
use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// First bytes of every baked map.
pub const MAGIC: [u8; 4] = *b"SFXM";
/// Version of the format in which no wall has an accuracy of its own.
pub const VERSION: u32 = 1;
/// Version of the format with an accuracy for each wall.
pub const VERSION_WITH_ACCURACIES: u32 = 2;
/// Size of a wall, bytes.
pub const WALL: usize = 20;
/// Largest number of walls with two-byte references.
pub const MOST_NARROW: u32 = 1 << 14;
/// Largest number of walls of a baked map.
pub const MOST: u32 = 1 << 22;

const HEADER: usize = 32;

/// Reason for which a baked map is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MapError {
    /// The bytes do not start with [`MAGIC`].
    NotAMap,
    /// The map has this format, which this crate does not read.
    Version(u32),
    /// The checksum is wrong: bytes are changed, missing or added.
    Checksum,
    /// The length is not that of the header.
    Length,
    /// The header describes no valid grid.
    Grid,
    /// This wall is degenerate or lies outside the grid.
    Wall(WallId),
    /// The index does not belong to the walls.
    Index,
}

impl core::fmt::Display for MapError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotAMap => f.write_str("this is not a baked map"),
            Self::Version(version) => write!(
                f,
                "the map has format {version} and this reads up to format {VERSION_WITH_ACCURACIES}: bake it again"
            ),
            Self::Checksum => f.write_str("the map is damaged or cut off: its checksum is wrong"),
            Self::Length => f.write_str("the length of the map is not that of its header"),
            Self::Grid => f.write_str("the header of the map describes no valid grid"),
            Self::Wall(WallId(id)) => {
                write!(f, "wall {id} of the map is degenerate or outside the grid")
            }
            Self::Index => f.write_str("the index of the map does not belong to its walls"),
        }
    }
}

impl core::error::Error for MapError {}

/// Reference of a cell to a wall: its number, and whether this is the first column and the first row of
/// cells that the wall touches. With these two bits a query returns each wall once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference(u32);

impl Reference {
    pub(super) const FIRST_COLUMN: u32 = 1;
    pub(super) const FIRST_ROW: u32 = 2;

    /// The reference to a wall below [`MOST`] that touches `cells`, from the cell at this column and
    /// row.
    #[must_use]
    pub fn new(wall: WallId, cells: &Cells, column: u16, row: u16) -> Self {
        let first_column = if column == cells.columns.0 { Self::FIRST_COLUMN } else { 0 };
        let first_row = if row == cells.rows.0 { Self::FIRST_ROW } else { 0 };
        Self((wall.0 << 2) | first_row | first_column)
    }

    /// The stored number: four times the wall, plus two in its first row, plus one in its first column. It
    /// has two bytes if the map has at most [`MOST_NARROW`] walls, otherwise three.
    #[must_use]
    pub fn stored(self) -> u32 {
        self.0
    }

    pub(super) fn wall(self) -> WallId {
        WallId(self.0 >> 2)
    }

    pub(super) fn has(self, flags: u32) -> bool {
        self.0 & flags == flags
    }
}

/// Contribution of a byte to a CRC-32: the polynomial 0xEDB88320, shifted out bit by bit.
const BYTES: [u32; 256] = contributions();

const fn contributions() -> [u32; 256] {
    let mut table = [0; 256];
    let mut rest: &mut [u32] = &mut table;
    let mut byte = 0_u32;
    while let [entry, tail @ ..] = rest {
        let (mut crc, mut bit) = (byte, 0);
        while bit < 8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
            bit += 1;
        }
        *entry = crc;
        (rest, byte) = (tail, byte + 1);
    }
    table
}

/// CRC-32 (ISO 3309, as in Ethernet, gzip and PNG), by bytes. Every frame on the link has one, so speed
/// justifies a table of 1 KiB.
///
/// ```
/// assert_eq!(sonarfix::map::image::checksum(b"123456789"), 0xCBF4_3926);
/// ```
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(Crc32::default(), |crc, &byte| crc.with(byte)).value()
}

/// The CRC-32 of [`checksum`] over bytes that are taken one by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub struct Crc32(u32);

impl Default for Crc32 {
    fn default() -> Self {
        Self(u32::MAX)
    }
}

impl Crc32 {
    /// Takes one more byte.
    #[inline]
    pub fn with(self, byte: u8) -> Self {
        let [low, ..] = self.0.to_le_bytes();
        // Every byte has an entry.
        Self((self.0 >> 8) ^ BYTES.get(usize::from(low ^ byte)).copied().unwrap_or(0))
    }

    /// The checksum of the bytes taken so far.
    #[must_use]
    pub fn value(self) -> u32 {
        !self.0
    }
}

/// Length in bytes of the image at the start of a region of flash, from its header. Bytes after the image
/// are ignored.
///
/// ```
/// use sonarfix::map::{MapError, image};
/// assert_eq!(image::length(&[0xff; 256]), Err(MapError::NotAMap)); // erased flash
/// ```
///
/// # Errors
/// [`MapError`] if no image of this version starts there.
pub fn length(region: &[u8]) -> Result<usize, MapError> {
    let has_accuracies = has_accuracies(region)?;
    let (header, _) = Header::split(region)?;
    let cells = u64::from(header.columns) * u64::from(header.rows);
    let reference = if header.is_narrow() { 2 } else { 3 };
    // Every part is below 2³⁸ bytes, so no sum overflows. The last four bytes are the checksum.
    let wall = WALL as u64 + u64::from(has_accuracies);
    let tables =
        wall * u64::from(header.walls) + 4 * (cells + 1) + reference * u64::from(header.references);
    usize::try_from(HEADER as u64 + tables + 4).map_err(|_| MapError::Length)
}

/// A header, not yet checked.
struct Header {
    walls: u32,
    references: u32,
    columns: u16,
    rows: u16,
    origin: Point,
    cell: Metres,
}

impl Header {
    /// The header, and the bytes after it.
    fn split(bytes: &[u8]) -> Result<(Self, &[u8]), MapError> {
        let (header, rest) = bytes.split_first_chunk::<HEADER>().ok_or(MapError::Length)?;
        let (words, _) = header.as_chunks::<4>();
        let &[_, _, walls, references, shape, x, y, cell] = words else {
            return Err(MapError::Length);
        };
        let [columns, columns_high, rows, rows_high] = shape;
        let header = Self {
            walls: u32::from_le_bytes(walls),
            references: u32::from_le_bytes(references),
            columns: u16::from_le_bytes([columns, columns_high]),
            rows: u16::from_le_bytes([rows, rows_high]),
            origin: Point::new(f32::from_le_bytes(x), f32::from_le_bytes(y)),
            cell: Metres(f32::from_le_bytes(cell)),
        };
        Ok((header, rest))
    }

    /// Whether references have two bytes.
    fn is_narrow(&self) -> bool {
        self.walls <= MOST_NARROW
    }
}

/// A baked map in which every length, number and reference is checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image<'a> {
    grid: Grid,
    walls: &'a [[u8; WALL]],
    starts: &'a [[u8; 4]],
    references: References<'a>,
    /// Empty in a map without accuracies.
    accuracies: &'a [u8],
}

#[derive(Debug, Clone, Copy)]
enum References<'a> {
    Narrow(&'a [[u8; 2]]),
    Wide(&'a [[u8; 3]]),
}

impl<'a> Image<'a> {
    pub fn read(bytes: &'a [u8]) -> Result<Self, MapError> {
        let image = Self::split(bytes)?;
        image.check_walls()?;
        image.check_index()?;
        Ok(image)
    }

    /// Splits the bytes into their parts, by the numbers in the header.
    fn split(bytes: &'a [u8]) -> Result<Self, MapError> {
        let has_accuracies = has_accuracies(bytes)?;
        let (header, rest) = Header::split(sealed(bytes)?)?;
        let grid = Grid::new(header.origin, header.cell, header.columns, header.rows);
        let grid = grid.ok_or(MapError::Grid)?;
        let mut rest = Rest(rest);
        let image = Self {
            grid,
            walls: rest.take(header.walls.into())?,
            starts: rest.take(u64::from(grid.cells()) + 1)?,
            references: if header.is_narrow() {
                References::Narrow(rest.take(header.references.into())?)
            } else {
                References::Wide(rest.take(header.references.into())?)
            },
            accuracies: if has_accuracies {
                rest.take::<1>(header.walls.into())?.as_flattened()
            } else {
                &[]
            },
        };
        let is_whole = rest.0.is_empty() && header.walls <= MOST;
        if is_whole { Ok(image) } else { Err(MapError::Length) }
    }

    fn check_walls(&self) -> Result<(), MapError> {
        for id in (0..self.count()).map(WallId) {
            let is_valid = self.wall(id).is_some_and(|wall| wall.is_valid());
            if !is_valid {
                return Err(MapError::Wall(id));
            }
        }
        Ok(())
    }

    /// Checks that the index belongs to these walls: one reference for each cell that each wall touches, and
    /// no other. The references of each cell are valid and different, and their number is the expected
    /// one.
    fn check_index(&self) -> Result<(), MapError> {
        let mut expected = 0_u64;
        for id in (0..self.count()).map(WallId) {
            let cells = self.wall(id).and_then(|wall| self.grid.cells_of(&wall));
            expected += cells.ok_or(MapError::Wall(id))?.count();
        }
        let mut end = 0;
        for row in 0..self.grid.rows() {
            for column in 0..self.grid.columns() {
                let next = self.start(self.grid.place(column, row) + 1).ok_or(MapError::Index)?;
                self.check_cell(column, row, end..next).ok_or(MapError::Index)?;
                end = next;
            }
        }
        let is_whole = self.start(0) == Some(0)
            && u64::from(end) == expected
            && usize::try_from(end) == Ok(self.references.len());
        if is_whole { Ok(()) } else { Err(MapError::Index) }
    }

    /// `Some` if the references of a cell are in ascending order, each of a wall that touches the cell, and
    /// with the right flags.
    fn check_cell(&self, column: u16, row: u16, run: Range<u32>) -> Option<()> {
        if run.start > run.end {
            return None;
        }
        let mut least = 0;
        for place in run {
            let reference = self.references.get(place)?;
            let id = reference.wall();
            let cells = self.grid.cells_of(&self.wall(id)?)?;
            let is_valid = id.0 >= least
                && cells.contain(column, row)
                && reference == Reference::new(id, &cells, column, row);
            if !is_valid {
                return None;
            }
            least = id.0 + 1;
        }
        Some(())
    }

    pub fn grid(&self) -> Grid {
        self.grid
    }

    #[expect(clippy::cast_possible_truncation, reason = "counted by a u32 in the header")]
    pub fn count(&self) -> u32 {
        self.walls.len() as u32
    }

    pub fn wall(&self, id: WallId) -> Option<Wall> {
        let index = usize::try_from(id.0).ok()?;
        let stored = self.walls.get(index)?;
        let (numbers, _) = stored.as_chunks::<4>();
        let &[x, y, tangent_x, tangent_y, length] = numbers else {
            return None;
        };
        let accuracy = self.accuracies.get(index).copied().unwrap_or(0);
        let numbers = [x, y, tangent_x, tangent_y, length].map(f32::from_le_bytes);
        Some(Wall::from_stored(numbers, accuracy))
    }

    /// The reference at an index.
    pub fn reference(&self, index: u32) -> Option<Reference> {
        self.references.get(index)
    }

    /// Index of the first reference of a cell, which is also the end of those of the cell before.
    pub fn start(&self, cell: u32) -> Option<u32> {
        self.starts.get(usize::try_from(cell).ok()?).map(|&start| u32::from_le_bytes(start))
    }
}

/// Whether the bytes are a map with accuracies.
///
/// # Errors
/// [`MapError`], if they are no map, or of another version.
fn has_accuracies(bytes: &[u8]) -> Result<bool, MapError> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or(MapError::NotAMap)?;
    let version = rest.first_chunk().map(|&version| u32::from_le_bytes(version));
    match version.ok_or(MapError::Length)? {
        VERSION => Ok(false),
        VERSION_WITH_ACCURACIES => Ok(true),
        other => Err(MapError::Version(other)),
    }
}

/// The bytes of an image without their checksum, if it is right.
fn sealed(bytes: &[u8]) -> Result<&[u8], MapError> {
    let (content, stated) = bytes.split_last_chunk().ok_or(MapError::Length)?;
    if checksum(content) == u32::from_le_bytes(*stated) {
        Ok(content)
    } else {
        Err(MapError::Checksum)
    }
}

/// The bytes that are not yet read.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    /// Reads a number of chunks of N bytes.
    fn take<const N: usize>(&mut self, count: u64) -> Result<&'a [[u8; N]], MapError> {
        let length = usize::try_from(count).ok().and_then(|count| count.checked_mul(N));
        let parts = length.and_then(|length| self.0.split_at_checked(length));
        let (taken, rest) = parts.ok_or(MapError::Length)?;
        self.0 = rest;
        Ok(taken.as_chunks().0)
    }
}

impl References<'_> {
    /// Number of references.
    fn len(self) -> usize {
        match self {
            Self::Narrow(references) => references.len(),
            Self::Wide(references) => references.len(),
        }
    }

    fn get(self, place: u32) -> Option<Reference> {
        let place = usize::try_from(place).ok()?;
        match self {
            Self::Narrow(references) => {
                references.get(place).map(|&bytes| Reference(u16::from_le_bytes(bytes).into()))
            }
            Self::Wide(references) => {
                let wide =
                    |&[low, middle, high]: &[u8; 3]| u32::from_le_bytes([low, middle, high, 0]);
                references.get(place).map(wide).map(Reference)
            }
        }
    }
}
