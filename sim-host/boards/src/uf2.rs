//! Files in Microsoft's USB Flashing Format (<https://github.com/microsoft/uf2>): blocks of 512 bytes, each with 256 bytes of
//! contents and their address, so that a boot ROM can write each block as it comes.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};

use crate::image::{ERASED, Image};

/// Bytes of a block.
pub const BLOCK: usize = 512;
/// Bytes of contents of a block.
pub const PAGE: usize = 256;
/// The same as a field of the format.
const PAGE_BYTES: u32 = 256;
const _: () = assert!(PAGE == PAGE_BYTES as usize);
/// Bytes that the flash erases at once.
const SECTOR: u32 = 4096;

const MAGIC: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];
const MAGIC_END: u32 = 0x0AB1_6F30;
/// Flags of a block: not for the flash; the family is in it.
const NOT_FLASH: u32 = 0x0000_0001;
const HAS_FAMILY: u32 = 0x0000_2000;
/// Bytes before the contents.
const HEADER: usize = 32;
/// The most contents that a block of the format has.
const MOST: usize = 476;

/// A file with the contents of an image, for chips of a family.
///
/// Sectors are written whole: the boot ROM of the RP2040 erases a sector when it writes its first page, and it takes a
/// sector of which a page is missing for one that was erased before (erratum RP2040-E14).
///
/// # Errors
/// If the image is empty, or ends at the end of the address space.
pub fn write(image: &Image, family: u32) -> anyhow::Result<Vec<u8>> {
    let mut pages = BTreeMap::<u32, [u8; PAGE]>::new();
    for (first, bytes) in image.parts() {
        for (address, &byte) in (first..).zip(bytes) {
            let within = address % SECTOR;
            let sector = address - within;
            if !pages.contains_key(&sector) {
                pages.extend(
                    (sector..=sector + (SECTOR - 1)).step_by(PAGE).map(|at| (at, [ERASED; PAGE])),
                );
            }
            let page = pages.get_mut(&(address - address % PAGE_BYTES));
            *page.and_then(|page| page.get_mut(address as usize % PAGE)).context("no page")? = byte;
        }
    }
    let count = u32::try_from(pages.len())?;
    ensure!(count > 0, "there is nothing to write");
    let mut file = Vec::with_capacity(pages.len() * BLOCK);
    for (number, (address, page)) in (0..).zip(&pages) {
        let [first, second] = MAGIC;
        for word in [first, second, HAS_FAMILY, *address, PAGE_BYTES, number, count, family] {
            file.extend(u32::to_le_bytes(word));
        }
        file.extend(page);
        file.resize(file.len() + BLOCK - HEADER - PAGE - 4, 0);
        file.extend(MAGIC_END.to_le_bytes());
    }
    Ok(file)
}

/// Whether a file starts as one of this format.
#[must_use]
pub fn is_uf2(file: &[u8]) -> bool {
    word(file, 0) == Some(MAGIC[0]) && word(file, 1) == Some(MAGIC[1])
}

/// The contents of a file, and the family that it is for.
///
/// # Errors
/// If it is no file of this format, names no family or several, or has not all of its blocks.
pub fn read(file: &[u8]) -> anyhow::Result<(Image, u32)> {
    ensure!(is_uf2(file), "no UF2");
    ensure!(file.len().is_multiple_of(BLOCK), "it is cut off within a block of {BLOCK} bytes");
    let (blocks, _) = file.as_chunks::<BLOCK>();
    let (mut parts, mut family) = (BTreeMap::new(), None);
    for (number, block) in blocks.iter().enumerate() {
        let field = |n| word(block, n).unwrap_or_default();
        let (flags, address, length) = (field(2), field(3), field(4) as usize);
        ensure!(
            is_uf2(block) && field(BLOCK / 4 - 1) == MAGIC_END && length <= MOST,
            "block {number} is damaged"
        );
        ensure!(
            field(5) as usize == number && field(6) as usize == blocks.len(),
            "it has not all of its blocks"
        );
        if flags & NOT_FLASH != 0 {
            continue;
        }
        ensure!(flags & HAS_FAMILY != 0, "it does not say for which chip it is");
        let known = *family.get_or_insert(field(7));
        ensure!(known == field(7), "it is for several chips");
        parts.insert(address, block.get(HEADER..HEADER + length).unwrap_or_default());
    }
    let mut image = Image::default();
    for (address, bytes) in parts {
        image.add("a block", address, bytes)?;
    }
    Ok((image, family.context("it has nothing for the flash")?))
}

/// The nth word.
fn word(bytes: &[u8], n: usize) -> Option<u32> {
    bytes.get(4 * n..)?.first_chunk().map(|word| u32::from_le_bytes(*word))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RP2040: u32 = 0xe48b_ff56;

    fn image(parts: &[(u32, Vec<u8>)]) -> Image {
        let mut image = Image::default();
        for (address, bytes) in parts {
            image.add("a part", *address, bytes).unwrap();
        }
        image
    }

    /// The fields of each block, at the offsets of the table in the format's description.
    #[test]
    fn a_file_has_the_blocks_of_the_format() {
        let image = image(&[(0x1000_0100, vec![0xAB; 300]), (0x1010_0000, vec![0xCD; 1])]);
        let file = write(&image, RP2040).unwrap();
        // Two sectors of 4096 bytes, each of 16 pages.
        assert_eq!(file.len(), 32 * 512);
        for (number, block) in file.chunks(512).enumerate() {
            let word = |at: usize| u32::from_le_bytes(block[at..at + 4].try_into().unwrap());
            assert_eq!(&block[0..4], b"UF2\n");
            assert_eq!((word(4), word(508)), (0x9E5D_5157, 0x0AB1_6F30));
            assert_eq!((word(8), word(16), word(28)), (0x0000_2000, 256, 0xe48b_ff56));
            assert_eq!((word(20) as usize, word(24)), (number, 32));
            let sector = if number < 16 { 0x1000_0000 } else { 0x1010_0000 };
            assert_eq!(word(12) as usize, sector + number % 16 * 256);
            assert!(block[32 + 256..508].iter().all(|byte| *byte == 0));
        }
        let contents = |block: usize| &file[block * 512 + 32..block * 512 + 32 + 256];
        assert!(contents(0).iter().all(|byte| *byte == 0xFF));
        assert!(contents(1).iter().all(|byte| *byte == 0xAB));
        assert_eq!((contents(2)[43], contents(2)[44]), (0xAB, 0xFF));
        assert_eq!((contents(16)[0], contents(16)[1]), (0xCD, 0xFF));
    }

    #[test]
    fn a_file_is_read_back() {
        let parts = [(0x1000_0ff0, (0..=255).collect()), (0x1018_0000, vec![9; 5000])];
        let (read, family) = read(&write(&image(&parts), RP2040).unwrap()).unwrap();
        assert_eq!(family, RP2040);
        for (address, bytes) in parts {
            assert_eq!(read.at(address, bytes.len()), Some(bytes));
        }
        assert_eq!(read.at(0x1000_0fef, 1), Some(vec![ERASED]));
        for nothing in [0x1000_2000, 0x1018_2000] {
            assert_eq!(read.at(nothing, 1), None);
        }
        assert_eq!(read.at(0x1000_1fff, 2), None);
    }

    #[test]
    fn a_damaged_file_is_refused() {
        let good = write(&image(&[(0x1000_0000, vec![1; 8])]), RP2040).unwrap();
        let with = |at: usize, byte: u8| {
            let mut file = good.clone();
            file[at] = byte;
            file
        };
        for (file, reason) in [
            (b"\x7fELF".to_vec(), "no UF2"),
            (good[..good.len() - 1].to_vec(), "cut off"),
            (good[..good.len() - 512].to_vec(), "not all of its blocks"),
            (with(512, 0), "block 1 is damaged"),
            (with(511, 0), "block 0 is damaged"),
            (with(18, 1), "block 0 is damaged"),
            (with(9, 0), "does not say"),
            (with(512 + 28, 0x57), "several chips"),
        ] {
            let error = read(&file).unwrap_err().to_string();
            assert!(error.contains(reason), "{error} for {reason}");
        }
        assert!(write(&Image::default(), RP2040).is_err());
    }
}
