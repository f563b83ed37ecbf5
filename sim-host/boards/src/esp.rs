//! The application image that the bootloader of an ESP32-C6 starts, as Espressif's documentation of `esptool` describes it
//! (<https://docs.espressif.com/projects/esptool/en/latest/esp32c6/advanced-topics/firmware-image-format.html>).
//!
//! The bootloader maps what lies in `MAPPED` from flash in pages, so that such a segment lies in the file at the same offset
//! within a page as in memory; the rest is copied to RAM.

use std::ops::Range;

use anyhow::{Context, ensure};
use sha2::{Digest, Sha256};

use crate::image::{self, Image};

/// Where the boot ROM finds the bootloader in flash.
pub const BOOTLOADER: u32 = 0;
/// Where the bootloader finds the table of partitions: its usual place.
pub const PARTITIONS: u32 = 0x8000;
/// Where the application image lies: the partition `factory` of `firmware/esp32c6/partitions.csv`.
pub const PROGRAM: u32 = 0x1_0000;

/// The addresses at which the flash is mapped.
const MAPPED: Range<u32> = 0x4200_0000..0x4300_0000;
/// RAM: that of the processor, and that of the low-power one (technical reference manual of the chip, 5.3).
const RAM: [Range<u32>; 2] = [0x4080_0000..0x4088_0000, 0x5000_0000..0x5000_4000];
/// Bytes of a mapped page.
const PAGE: u32 = 0x1_0000;
const MAGIC: u8 = 0xE9;
/// Bytes of the header of an image.
const HEADER: usize = 24;
/// The most segments of an image.
const MOST_SEGMENTS: usize = 16;
/// Two lines for data; 4 MiB at 80 MHz.
const FLASH: [u8; 2] = [2, 0x20];
/// The number of the chip in the header.
const CHIP: u16 = 13;
/// No pin protects the flash from writing.
const NO_PIN: u8 = 0xEE;
/// All revisions of the chip.
const REVISIONS: [u16; 2] = [0, u16::MAX];
/// The start value of the checksum.
const CHECKSUM: u8 = 0xEF;

/// The image of an ELF.
///
/// # Errors
/// If it is no ELF, or has too many segments.
pub fn write(elf: &[u8]) -> anyhow::Result<Vec<u8>> {
    let program = Image::of_elf(elf)?;
    let mut file = Vec::new();
    let mut count = 0;
    let (mapped, copied): (Vec<_>, Vec<_>) =
        program.parts().partition(|(address, _)| MAPPED.contains(address));
    header(&mut file, image::entry(elf)?);
    let mut checksum = CHECKSUM;
    let mut segment = |file: &mut Vec<u8>, address: u32, bytes: &[u8]| -> anyhow::Result<()> {
        let padded = bytes.len().next_multiple_of(4);
        file.extend(address.to_le_bytes());
        file.extend(u32::try_from(padded)?.to_le_bytes());
        file.extend(bytes);
        file.resize(file.len() + padded - bytes.len(), 0);
        checksum = bytes.iter().fold(checksum, |sum, byte| sum ^ byte);
        count += 1;
        Ok(())
    };
    for (address, bytes) in mapped {
        // The contents begin behind the 8 bytes of the segment's own header.
        let here = u32::try_from(file.len())? + 8;
        let gap = address.wrapping_sub(here) % PAGE;
        if gap > 0 {
            // A segment without an address is skipped. It takes 8 bytes itself.
            let zeros = if gap < 8 { gap + PAGE - 8 } else { gap - 8 };
            segment(&mut file, 0, &vec![0; zeros as usize])?;
        }
        segment(&mut file, address, bytes)?;
    }
    for (address, bytes) in copied {
        segment(&mut file, address, bytes)?;
    }
    ensure!(count <= MOST_SEGMENTS, "an image has at most {MOST_SEGMENTS} segments, not {count}");
    *file.get_mut(1).context("no header")? = u8::try_from(count)?;
    file.resize((file.len() + 1).next_multiple_of(16) - 1, 0);
    file.push(checksum);
    let hash = Sha256::digest(&file);
    file.extend(hash);
    Ok(file)
}

/// The image in the file of a program: an ELF, or an image, whose header and hash are checked.
///
/// # Errors
/// If it is neither, for another chip, cut off or damaged.
pub fn read(file: &[u8]) -> anyhow::Result<Vec<u8>> {
    if file.starts_with(b"\x7fELF") {
        let is_of_chip = |address: &u32| RAM.iter().chain([&MAPPED]).any(|it| it.contains(address));
        let program = Image::of_elf(file)?;
        let other = program.parts().find(|(address, _)| !is_of_chip(address));
        ensure!(
            other.is_none(),
            "it is for another chip: a part of it lies at {:#010x}",
            other.map_or(0, |(address, _)| address)
        );
        return write(file);
    }
    let header = file.first_chunk::<HEADER>().filter(|[magic, ..]| *magic == MAGIC);
    let header = header.context("it is neither an ELF nor an application image")?;
    let [.., low, high, _, _, _, _, _, _, _, _, _, _] = *header;
    let chip = u16::from_le_bytes([low, high]);
    ensure!(chip == CHIP, "it is for another chip: number {chip} of Espressif, and not {CHIP}");
    let hashed = file.split_last_chunk::<32>();
    let is_whole = hashed.is_some_and(|(contents, hash)| Sha256::digest(contents)[..] == hash[..]);
    ensure!(is_whole, "it is cut off or damaged: its hash differs");
    Ok(file.to_vec())
}

fn header(file: &mut Vec<u8>, entry: u32) {
    let [mode, size] = FLASH;
    // The number of segments is written when it is known.
    file.extend([MAGIC, 0, mode, size]);
    file.extend(entry.to_le_bytes());
    file.extend([NO_PIN, 0, 0, 0]);
    file.extend(CHIP.to_le_bytes());
    file.push(0);
    file.extend(REVISIONS.iter().flat_map(|revision| revision.to_le_bytes()));
    // Four reserved bytes; the hash of all before it ends the file.
    file.extend([0, 0, 0, 0, 1]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made::{elf, segment};

    #[test]
    fn an_image_has_the_segments_where_the_bootloader_needs_them() {
        let constants = vec![0x11; 1001];
        let code = vec![0x22; 70_000];
        let ram = vec![0x33; 64];
        let program = elf(
            0x4080_0010,
            &[
                segment(0x4080_0000, &ram),
                segment(0x4200_0020, &constants),
                segment(0x4201_0500, &code),
            ],
        );
        let file = write(&program).unwrap();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!((file[0], word(4), file[12], file[23]), (0xE9, 0x4080_0010, 13, 1));
        let (mut at, mut sum, mut found) = (24, 0xEF, Vec::new());
        for _ in 0..file[1] {
            let (address, length) = (word(at), word(at + 4) as usize);
            let contents = &file[at + 8..at + 8 + length];
            sum = contents.iter().fold(sum, |sum, byte| sum ^ byte);
            if address >= 0x4200_0000 {
                assert_eq!((at + 8) % 0x1_0000, address as usize % 0x1_0000);
            }
            if address > 0 {
                found.push((address, contents.to_vec()));
            }
            at += 8 + length;
        }
        let padded = [constants, vec![0; 3]].concat();
        assert_eq!(found, [(0x4200_0020, padded), (0x4201_0500, code), (0x4080_0000, ram)]);
        let end = file.len() - 32;
        assert_eq!((end % 16, file[end - 1]), (0, sum));
        assert!(end - at <= 16);
        assert_eq!(Sha256::digest(&file[..end])[..], file[end..]);
    }

    #[test]
    fn a_gap_that_is_too_small_for_a_segment_takes_a_page_more() {
        // The first segment ends at the offset 40, so that the contents of the next could begin at 48: 4 bytes too early.
        let program = elf(0, &[segment(0x4200_0020, &[1; 8]), segment(0x4201_0034, &[2; 4])]);
        let file = write(&program).unwrap();
        assert_eq!(file[1], 3);
        assert_eq!(file[0x1_0034..0x1_0038], [2; 4]);
    }

    #[test]
    fn an_image_is_made_of_an_elf_and_read_again() {
        let program = elf(0x4080_0010, &[segment(0x4200_0020, &[7; 100])]);
        let image = read(&program).unwrap();
        assert_eq!((&image, &image), (&write(&program).unwrap(), &read(&image).unwrap()));
        let mut of_a_c3 = image.clone();
        of_a_c3[12] = 5;
        let mut damaged = image.clone();
        damaged[60] ^= 1;
        for (file, reason) in [
            (elf(0, &[segment(0x0800_0000, &[1; 8])]), "lies at 0x08000000"),
            (of_a_c3, "number 5 of Espressif, and not 13"),
            (damaged, "damaged"),
            (image[..image.len() - 1].to_vec(), "cut off"),
            (vec![MAGIC; 8], "neither"),
            (b"UF2\n".to_vec(), "neither"),
            (Vec::new(), "neither"),
        ] {
            let error = read(&file).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
