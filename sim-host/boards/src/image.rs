//! The contents of a flash, by address.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, pod};

/// The value of an erased byte of flash.
pub const ERASED: u8 = 0xFF;

/// Bytes at addresses: parts that do not overlap.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Image {
    parts: BTreeMap<u32, Vec<u8>>,
}

impl Image {
    /// What a program of 32 bits loads: the segments of an ELF that have contents, where they lie in flash.
    ///
    /// # Errors
    /// If it is no such file, or if segments overlap.
    pub fn of_elf(elf: &[u8]) -> anyhow::Result<Self> {
        let (header, order) = parse(elf)?;
        let mut image = Self::default();
        for segment in header.program_headers(order, elf).context("no segments")? {
            if segment.p_type(order) == PT_LOAD && segment.p_filesz(order) > 0 {
                let bytes = segment.data(order, elf).ok().context("a segment is cut off")?;
                image.add("a segment", segment.p_paddr(order), bytes)?;
            }
        }
        ensure!(!image.parts.is_empty(), "it loads nothing");
        Ok(image)
    }

    /// Adds a part.
    ///
    /// # Errors
    /// If it overlaps another one or the end of the address space; `what` names it.
    pub fn add(&mut self, what: &str, address: u32, bytes: &[u8]) -> anyhow::Result<()> {
        let end = end_of(address, bytes)
            .with_context(|| format!("{what} at {address:#010x} is too large"))?;
        let below = self.parts.range(..end).next_back();
        if let Some((&other, there)) = below {
            ensure!(
                end_of(other, there).is_some_and(|end| end <= address),
                "{what} at {address:#010x} overlaps what lies at {other:#010x}"
            );
        }
        self.parts.insert(address, bytes.to_vec());
        Ok(())
    }

    /// The parts, by address.
    pub fn parts(&self) -> impl Iterator<Item = (u32, &[u8])> {
        self.parts.iter().map(|(&address, bytes)| (address, bytes.as_slice()))
    }

    /// The bytes from an address on; `None` if some of them are in no part. Neighbouring parts are taken as one.
    #[must_use]
    pub fn at(&self, address: u32, length: usize) -> Option<Vec<u8>> {
        let mut found = Vec::new();
        while found.len() < length {
            let next = address.checked_add(u32::try_from(found.len()).ok()?)?;
            let (first, bytes) = self.parts.range(..=next).next_back()?;
            let rest = bytes.get((next - first) as usize..).filter(|rest| !rest.is_empty())?;
            found.extend(rest.iter().take(length - found.len()));
        }
        Some(found)
    }

    /// The bytes from the first to the last address; what no part has is [`ERASED`].
    #[must_use]
    pub fn flat(&self) -> Vec<u8> {
        let mut flat = Vec::new();
        let first = self.parts.keys().next().copied().unwrap_or(0);
        for (address, bytes) in self.parts() {
            flat.resize((address - first) as usize, ERASED);
            flat.extend_from_slice(bytes);
        }
        flat
    }
}

/// The first address behind a part.
fn end_of(address: u32, bytes: &[u8]) -> Option<u32> {
    address.checked_add(u32::try_from(bytes.len()).ok()?)
}

/// The address at which an ELF starts to run.
pub(crate) fn entry(elf: &[u8]) -> anyhow::Result<u32> {
    let (header, order) = parse(elf)?;
    Ok(header.e_entry(order))
}

fn parse(elf: &[u8]) -> anyhow::Result<(&FileHeader32<Endianness>, Endianness)> {
    ensure!(pod::from_bytes::<[u8; 4]>(elf).is_ok_and(|(start, _)| start == b"\x7fELF"), "no ELF");
    let header = FileHeader32::<Endianness>::parse(elf).ok().context("no ELF of 32 bits")?;
    Ok((header, header.endian().ok().context("an unknown byte order")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made::{Segment, elf, segment};

    #[test]
    fn an_elf_is_where_it_lies_in_flash() {
        let variables = Segment {
            virtual_address: 0x2000_0000,
            address: 0x1000_0200,
            bytes: &[7; 3],
            memory: 9,
        };
        let zeros = Segment { memory: 64, ..segment(0x2000_0010, &[]) };
        let file = elf(0x1000_0101, &[segment(0x1000_0100, &[1, 2, 3, 4]), variables, zeros]);
        let image = Image::of_elf(&file).unwrap();
        let parts: Vec<_> = image.parts().collect();
        assert_eq!(parts, [(0x1000_0100, &[1, 2, 3, 4][..]), (0x1000_0200, &[7, 7, 7])]);
        assert_eq!(entry(&file).unwrap(), 0x1000_0101);
        let flat = image.flat();
        assert_eq!(flat.len(), 0x103);
        assert_eq!((flat[3], flat[4], flat[0xff], flat[0x100]), (4, ERASED, ERASED, 7));
    }

    #[test]
    fn what_is_no_elf_is_refused() {
        let file = elf(0, &[segment(0x1000_0000, &[1; 64])]);
        for (bytes, reason) in [
            (&b"UF2\n"[..], "no ELF"),
            (&[], "no ELF"),
            (&file[..50], "no ELF of 32 bits"),
            (&file[..70], "no segments"),
            (&file[..100], "cut off"),
            (&elf(0, &[]), "it loads nothing"),
        ] {
            let error = format!("{:#}", Image::of_elf(bytes).unwrap_err());
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn parts_do_not_overlap() {
        let mut image = Image::default();
        image.add("program", 0x100, &[0; 0x10]).unwrap();
        for address in [0x0f9, 0x100, 0x10f] {
            let error = image.add("the map", address, &[0; 8]).unwrap_err().to_string();
            assert!(error.contains("the map at") && error.contains("0x00000100"), "{error}");
        }
        image.add("before", 0x0f8, &[0; 8]).unwrap();
        image.add("behind", 0x110, &[0; 8]).unwrap();
        assert!(image.add("the end", u32::MAX, &[0; 2]).is_err());
    }
}
