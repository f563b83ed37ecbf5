//! The pages of a database file.

use std::io::{Read, Seek, SeekFrom};

use super::error::SqlError;

const MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// The length of the file's header, which is on its first page.
const HEADER: usize = 100;

/// The pages of a file.
#[derive(Debug)]
pub struct Pages<R> {
    bytes: R,
    size: usize,
    /// Size without the bytes that extensions reserve.
    usable: usize,
    count: u32,
}

impl<R: Read + Seek> Pages<R> {
    pub fn of(mut bytes: R) -> Result<Self, SqlError> {
        let length = bytes.seek(SeekFrom::End(0))?;
        bytes.seek(SeekFrom::Start(0))?;
        let mut start = Vec::with_capacity(HEADER);
        (&mut bytes).take(HEADER as u64).read_to_end(&mut start)?;
        let header: [u8; HEADER] = start.try_into().map_err(|_| SqlError::Magic)?;
        if !header.starts_with(MAGIC) {
            return Err(SqlError::Magic);
        }
        let [.., high, low, _, _, reserved] =
            header.first_chunk::<21>().copied().unwrap_or([0; 21]);
        let size = match u16::from_be_bytes([high, low]) {
            1 => 1 << 16,
            size if size.is_power_of_two() && size >= 512 => usize::from(size),
            size => return Err(SqlError::Header("size of a page", size.into())),
        };
        let usable = size - usize::from(reserved);
        if usable < 480 {
            return Err(SqlError::Header("number of reserved bytes", reserved.into()));
        }
        match header.get(56..60) {
            Some([0, 0, 0, 0 | 1]) => {}
            _ => return Err(SqlError::Utf16),
        }
        let count = u32::try_from(length / size as u64);
        let count = count.map_err(|_| SqlError::Header("number of pages", length / size as u64))?;
        Ok(Self { bytes, size, usable, count })
    }

    /// How many whole pages the file has.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Bytes of a page without those that extensions reserve.
    pub fn usable(&self) -> usize {
        self.usable
    }

    pub fn read(&mut self, number: u32) -> Result<Page, SqlError> {
        if number == 0 || number > self.count {
            return Err(SqlError::Page {
                page: number,
                what: "it is not in the file, which is torn",
            });
        }
        self.bytes.seek(SeekFrom::Start(u64::from(number - 1) * self.size as u64))?;
        let mut bytes = vec![0; self.size];
        self.bytes.read_exact(&mut bytes)?;
        bytes.truncate(self.usable);
        Ok(Page { number, bytes })
    }

    /// How many bytes of a row are on its leaf; the others are on pages of their own.
    pub fn part_on_leaf(&self, length: usize) -> usize {
        let most = self.usable - 35;
        if length <= most {
            return length;
        }
        let least = (self.usable - 12) * 32 / 255 - 23;
        let part = least + (length - least) % (self.usable - 4);
        if part <= most { part } else { least }
    }
}

/// A page, without the bytes that extensions reserve.
#[derive(Debug)]
pub struct Page {
    /// From 1.
    pub number: u32,
    bytes: Vec<u8>,
}

impl Page {
    /// Where its own header begins.
    pub fn start(&self) -> usize {
        if self.number == 1 { HEADER } else { 0 }
    }

    pub fn damage(&self, what: &'static str) -> SqlError {
        SqlError::Page { page: self.number, what }
    }

    pub fn from(&self, at: usize) -> Result<&[u8], SqlError> {
        self.bytes.get(at..).ok_or_else(|| self.damage("a place is outside of it"))
    }

    pub fn byte(&self, at: usize) -> Result<u8, SqlError> {
        self.array::<1>(at).map(|[byte]| byte)
    }

    pub fn short(&self, at: usize) -> Result<u16, SqlError> {
        self.array(at).map(u16::from_be_bytes)
    }

    pub fn word(&self, at: usize) -> Result<u32, SqlError> {
        self.array(at).map(u32::from_be_bytes)
    }

    fn array<const N: usize>(&self, at: usize) -> Result<[u8; N], SqlError> {
        let array = self.from(at)?.first_chunk();
        array.copied().ok_or_else(|| self.damage("a number is outside of it"))
    }
}
