//! The baked map: one byte slice, written on a PC (`sonarfix map bake`) and read in place.
//!
//! Numbers are little endian; nothing needs to be aligned. `docs/formats.md` describes the same
//! from a writer's side.
//!
//! | bytes | what |
//! |---|---|
//! | 4 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | 4 | number of walls W |
//! | 4 | number of references R |
//! | 2, 2 | columns and rows of the [`Grid`] |
//! | 4, 4 | origin of the grid, x and y, metres, `f32` |
//! | 4 | size of a cell, metres, `f32` |
//! | [20](WALL) W | the walls, each [as stored](super::Wall::stored): five `f32` |
//! | 4 (cells + 1) | for each cell, row by row, where its references start; at last R |
//! | 2 R or 3 R | the [references](Reference): two bytes each if W ≤ [`MOST_NARROW`], else three |
//! | 4 | [`checksum`] of all bytes before |
//!
//! Each cell refers to every wall whose bounding box touches it, in ascending order.
//!
//! # Non-finite policy
//! A NaN or an infinity in the header is [`MapError::Grid`], in a wall [`MapError::Wall`]: what has been
//! read holds none.

use core::ops::Range;

use super::grid::{Cells, Grid};
use super::wall::Wall;
use super::{MapError, WallId};
use crate::pose::Point;
use crate::units::Metres;

/// What every baked map starts with.
pub const MAGIC: [u8; 4] = *b"SFXM";
/// The version of the format that this crate reads.
pub const VERSION: u32 = 1;
/// What one wall takes, bytes.
pub const WALL: usize = 20;
/// The most walls that two-byte references can number.
pub const MOST_NARROW: u32 = 1 << 14;
/// The most walls that a baked map can have.
pub const MOST: u32 = 1 << 22;

const HEADER: usize = 32;

/// A cell's reference to a wall: its number, and whether this is the first column and the first row
/// of cells that it touches. Those two bits are all it takes to give each wall once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference(u32);

impl Reference {
    const FIRST_COLUMN: u32 = 1;
    const FIRST_ROW: u32 = 2;

    /// The reference to a wall below [`MOST`] that touches `cells`, from the cell at this column and
    /// row.
    #[must_use]
    pub fn new(wall: WallId, cells: &Cells, column: u16, row: u16) -> Self {
        let first_column = if column == cells.columns.0 { Self::FIRST_COLUMN } else { 0 };
        let first_row = if row == cells.rows.0 { Self::FIRST_ROW } else { 0 };
        Self((wall.0 << 2) | first_row | first_column)
    }

    /// The number that it is stored as: four times the wall, plus two in its first row, plus one in
    /// its first column. In two bytes if the map has no more than [`MOST_NARROW`] walls, else in three.
    #[must_use]
    pub fn stored(self) -> u32 {
        self.0
    }

    fn wall(self) -> WallId {
        WallId(self.0 >> 2)
    }

    fn has(self, flags: u32) -> bool {
        self.0 & flags == flags
    }
}

/// What four bits of a CRC-32 add to the rest: the polynomial 0xEDB88320, shifted out bit by bit.
const NIBBLES: [u32; 16] = [
    0x0000_0000,
    0x1DB7_1064,
    0x3B6E_20C8,
    0x26D9_30AC,
    0x76DC_4190,
    0x6B6B_51F4,
    0x4DB2_6158,
    0x5005_713C,
    0xEDB8_8320,
    0xF00F_9344,
    0xD6D6_A3E8,
    0xCB61_B38C,
    0x9B64_C2B0,
    0x86D3_D2D4,
    0xA00A_E278,
    0xBDBD_F21C,
];

/// CRC-32 (ISO 3309, the one of Ethernet, gzip and PNG), by nibbles: every frame on the link has one,
/// so it is worth 64 bytes of table.
///
/// ```
/// assert_eq!(sonarfix::map::image::checksum(b"123456789"), 0xCBF4_3926);
/// ```
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    let shift = |crc: u32| {
        let low = usize::try_from(crc & 15).unwrap_or(0);
        (crc >> 4) ^ NIBBLES.get(low).copied().unwrap_or(0)
    };
    !bytes.iter().fold(u32::MAX, |crc, &byte| shift(shift(crc ^ u32::from(byte))))
}

/// How many bytes the image at the start of a region of flash has, by its own header; what follows
/// it does not matter.
///
/// ```
/// use sonarfix::map::{MapError, image};
/// assert_eq!(image::length(&[0xff; 256]), Err(MapError::NotAMap)); // erased flash
/// ```
///
/// # Errors
/// [`MapError`], if no image of this version starts there.
pub fn length(region: &[u8]) -> Result<usize, MapError> {
    check_version(region)?;
    let (header, _) = Header::split(region)?;
    let cells = u64::from(header.columns) * u64::from(header.rows);
    let reference = if header.is_narrow() { 2 } else { 3 };
    // Every part is below 2³⁸ bytes, so that no sum overflows; at the end stands the checksum.
    let tables = WALL as u64 * u64::from(header.walls)
        + 4 * (cells + 1)
        + reference * u64::from(header.references);
    usize::try_from(HEADER as u64 + tables + 4).map_err(|_| MapError::Length)
}

/// What a header says, before any of it is believed.
struct Header {
    walls: u32,
    references: u32,
    columns: u16,
    rows: u16,
    origin: Point,
    cell: Metres,
}

impl Header {
    /// The header, and what follows it.
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

    /// Whether two bytes do for a reference.
    fn is_narrow(&self) -> bool {
        self.walls <= MOST_NARROW
    }
}

/// A baked map whose every length, number and reference has been checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image<'a> {
    grid: Grid,
    walls: &'a [[u8; WALL]],
    starts: &'a [[u8; 4]],
    references: References<'a>,
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

    /// Cuts the bytes into their parts, by the numbers in the header.
    fn split(bytes: &'a [u8]) -> Result<Self, MapError> {
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
        };
        let is_whole = rest.0.is_empty() && header.walls <= MOST;
        if is_whole { Ok(image) } else { Err(MapError::Length) }
    }

    fn check_walls(&self) -> Result<(), MapError> {
        for id in (0..self.count()).map(WallId) {
            let is_sound = self.wall(id).is_some_and(|wall| wall.is_sound());
            if !is_sound {
                return Err(MapError::Wall(id));
            }
        }
        Ok(())
    }

    /// Checks that the index is the one that belongs to these walls. A reference for each cell that
    /// each wall touches, none twice and none else: then as many are there as should be.
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

    /// Something, if the references of a cell are in ascending order, each of a wall that touches the
    /// cell, and with the right flags.
    fn check_cell(&self, column: u16, row: u16, run: Range<u32>) -> Option<()> {
        if run.start > run.end {
            return None;
        }
        let mut least = 0;
        for place in run {
            let reference = self.references.get(place)?;
            let id = reference.wall();
            let cells = self.grid.cells_of(&self.wall(id)?)?;
            let is_right = id.0 >= least
                && cells.contain(column, row)
                && reference == Reference::new(id, &cells, column, row);
            if !is_right {
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
        let stored = self.walls.get(usize::try_from(id.0).ok()?)?;
        let (numbers, _) = stored.as_chunks::<4>();
        let &[x, y, tangent_x, tangent_y, length] = numbers else {
            return None;
        };
        Some(Wall::from_stored([x, y, tangent_x, tangent_y, length].map(f32::from_le_bytes)))
    }

    /// Where the references of a cell start, by its place in the order of rows, and those of the cell
    /// before end.
    fn start(&self, cell: u32) -> Option<u32> {
        self.starts.get(usize::try_from(cell).ok()?).map(|&start| u32::from_le_bytes(start))
    }

    pub fn near(self, point: Point, reach: Metres) -> Window<'a> {
        let nothing = Window {
            image: self,
            columns: (0, 0),
            rows: 0..0,
            row_flags: 0,
            run: 0..0,
            others: 0..0,
            flags: 0,
        };
        match self.grid.cells_near(point, reach) {
            None => nothing,
            Some(Cells { columns, rows: (first, last) }) => {
                Window { columns, rows: first..last.saturating_add(1), ..nothing }
            }
        }
    }
}

/// Whether these are the bytes of a map, and of this version.
fn check_version(bytes: &[u8]) -> Result<(), MapError> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or(MapError::NotAMap)?;
    let version = rest.first_chunk().map(|&version| u32::from_le_bytes(version));
    match version.ok_or(MapError::Length)? {
        VERSION => Ok(()),
        other => Err(MapError::Version(other)),
    }
}

/// The bytes of an image of this version without their checksum, if that is right.
fn sealed(bytes: &[u8]) -> Result<&[u8], MapError> {
    check_version(bytes)?;
    let (content, stated) = bytes.split_last_chunk().ok_or(MapError::Length)?;
    if checksum(content) == u32::from_le_bytes(*stated) {
        Ok(content)
    } else {
        Err(MapError::Checksum)
    }
}

/// What of the bytes is not yet taken.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    /// Takes so many chunks of N bytes.
    fn take<const N: usize>(&mut self, count: u64) -> Result<&'a [[u8; N]], MapError> {
        let length = usize::try_from(count).ok().and_then(|count| count.checked_mul(N));
        let parts = length.and_then(|length| self.0.split_at_checked(length));
        let (taken, rest) = parts.ok_or(MapError::Length)?;
        self.0 = rest;
        Ok(taken.as_chunks().0)
    }
}

impl References<'_> {
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

/// The walls of a rectangle of cells, each once: in the rectangle's first column (row) every one
/// that the cell refers to, in the others those for which the column (row) is their first.
///
/// The references of neighbouring cells of a row lie one after the other, so a row is two runs: its
/// first cell, and all others.
#[derive(Debug, Clone)]
pub(super) struct Window<'a> {
    image: Image<'a>,
    /// The first and the last column.
    columns: (u16, u16),
    /// The rows to come.
    rows: Range<u16>,
    /// The flags that a reference in the next row's first cell must have.
    row_flags: u32,
    /// The places of the references to come in this run.
    run: Range<u32>,
    /// Those of the row's other cells, until their run begins.
    others: Range<u32>,
    /// The flags that a reference in this run must have.
    flags: u32,
}

impl Window<'_> {
    /// Goes on to the next run, if there is one. Not inlined: what it needs would be fetched for
    /// every wall.
    #[inline(never)]
    fn turn(&mut self) -> Option<()> {
        if self.others.is_empty() {
            let row = self.rows.next()?;
            let (first, last) = self.columns;
            let start = |column| self.image.start(self.image.grid.place(column, row));
            let (start, middle, end) = (start(first)?, start(first + 1)?, start(last + 1)?);
            (self.run, self.others) = (start..middle, middle..end);
            self.flags = self.row_flags;
            self.row_flags = Reference::FIRST_ROW;
        } else {
            self.run = core::mem::replace(&mut self.others, 0..0);
            self.flags |= Reference::FIRST_COLUMN;
        }
        Some(())
    }
}

impl Iterator for Window<'_> {
    type Item = (WallId, Wall);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            for place in self.run.by_ref() {
                let reference = self.image.references.get(place)?;
                if reference.has(self.flags) {
                    let id = reference.wall();
                    return Some((id, self.image.wall(id)?));
                }
            }
            self.turn()?;
        }
    }
}
