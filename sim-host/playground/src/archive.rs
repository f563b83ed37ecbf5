//! ZIP archives (APPNOTE.TXT of PKWARE, 4.3).

use std::io::{Read as _, Write as _};

use anyhow::{Context, ensure};
use flate2::read::DeflateDecoder;

/// 1980-01-01, the first date of the format: the same answers give the same bytes.
const DATE: u16 = 0x21;
/// Version 2.0 of the format: folders.
const VERSION: u16 = 20;
/// The entry of a file in the directory (4.3.12), and the end of the directory (4.3.16), without what has a length of its own.
const ENTRY: usize = 46;
const END: usize = 22;
/// The header of a file before its name (4.3.7).
const HEADER: usize = 30;
/// The ways in which a file is packed (4.4.5).
const STORED: usize = 0;
const DEFLATED: usize = 8;
/// The most bytes of an unpacked file: more than any map.
const MOST: usize = 16_000_000;

/// An archive of files that are stored as they are.
///
/// # Errors
/// None: writing to memory does not fail.
pub fn write(files: &[(String, &[u8])]) -> std::io::Result<Vec<u8>> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let at = length(&archive);
        // Version, flags, method, time, date; sum, sizes, length of the name, no further fields.
        let mut entry = Vec::new();
        for field in [VERSION, 0, 0, 0, DATE] {
            entry.write_all(&field.to_le_bytes())?;
        }
        for field in [crc32fast::hash(bytes), length(bytes), length(bytes), length(name.as_bytes())]
        {
            entry.write_all(&field.to_le_bytes())?;
        }
        archive.write_all(b"PK\x03\x04")?;
        for part in [entry.as_slice(), name.as_bytes(), bytes] {
            archive.write_all(part)?;
        }
        directory.write_all(b"PK\x01\x02")?;
        directory.write_all(&VERSION.to_le_bytes())?;
        directory.write_all(&entry)?;
        // Comment, disk, attributes.
        directory.write_all(&[0; 10])?;
        directory.write_all(&at.to_le_bytes())?;
        directory.write_all(name.as_bytes())?;
    }
    let count = u16::try_from(files.len()).unwrap_or(u16::MAX).to_le_bytes();
    let (at, size) = (length(&archive).to_le_bytes(), length(&directory).to_le_bytes());
    archive.write_all(&directory)?;
    archive.write_all(b"PK\x05\x06\0\0\0\0")?;
    for part in [&count[..], &count, &size, &at, &[0, 0]] {
        archive.write_all(part)?;
    }
    Ok(archive)
}

fn length(bytes: &[u8]) -> u32 {
    u32::try_from(bytes.len()).unwrap_or(u32::MAX)
}

/// The files of these names in an archive, in any folder of it.
///
/// # Errors
/// If it is no archive, is cut off or damaged, or packs such a file in another way than by deflate.
pub fn read(archive: &[u8], names: &[&str]) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    // A comment may follow the end of the directory.
    let end = archive.windows(END).rposition(|bytes| bytes.starts_with(b"PK\x05\x06"));
    let end = end.context("it is no ZIP archive, or cut off")?;
    let count = number::<2>(archive, end + 10)?;
    let mut at = number::<4>(archive, end + 16)?;
    let mut files = Vec::new();
    for _ in 0..count {
        ensure!(slice(archive, at, 4)? == b"PK\x01\x02", DAMAGED);
        let [name, extra, comment] =
            [28, 30, 32].map(|field| number::<2>(archive, at + field).unwrap_or(0));
        let path = String::from_utf8_lossy(slice(archive, at + ENTRY, name)?);
        let last = path.rsplit('/').next().unwrap_or_default();
        if names.contains(&last) {
            let bytes = unpacked(archive, at).with_context(|| path.to_string())?;
            files.push((last.to_owned(), bytes));
        }
        at += ENTRY + name + extra + comment;
    }
    Ok(files)
}

const DAMAGED: &str = "the archive is damaged";

/// The file whose entry in the directory is here.
fn unpacked(archive: &[u8], entry: usize) -> anyhow::Result<Vec<u8>> {
    let [flags, method] = [8, 10].map(|field| number::<2>(archive, entry + field).unwrap_or(0));
    ensure!(flags & 1 == 0, "it is encrypted");
    ensure!([STORED, DEFLATED].contains(&method), "it is packed by a method that is not read");
    let (sum, packed) = (number::<4>(archive, entry + 16)?, number::<4>(archive, entry + 20)?);
    let header = number::<4>(archive, entry + 42)?;
    let start =
        header + HEADER + number::<2>(archive, header + 26)? + number::<2>(archive, header + 28)?;
    let packed = slice(archive, start, packed)?;
    let mut bytes = Vec::new();
    if method == DEFLATED {
        let most = MOST as u64 + 1;
        DeflateDecoder::new(packed).take(most).read_to_end(&mut bytes).context(DAMAGED)?;
    } else {
        bytes.extend(packed);
    }
    ensure!(bytes.len() <= MOST, "it has more than {MOST} bytes");
    ensure!(crc32fast::hash(&bytes) as usize == sum, DAMAGED);
    Ok(bytes)
}

/// A number of so many bytes.
fn number<const BYTES: usize>(archive: &[u8], at: usize) -> anyhow::Result<usize> {
    let bytes = slice(archive, at, BYTES)?;
    Ok(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
}

fn slice(archive: &[u8], at: usize, length: usize) -> anyhow::Result<&[u8]> {
    let end = at.checked_add(length).context(DAMAGED)?;
    archive.get(at..end).context(DAMAGED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::DeflateEncoder;

    const FILES: [(&str, &[u8]); 3] =
        [("robot/robot.toml", b"a robot"), ("robot/map.toml", b"a map"), ("robot/x", b"x")];

    fn stored() -> Vec<u8> {
        write(&FILES.map(|(name, bytes)| (name.to_owned(), bytes))).unwrap()
    }

    /// An archive of one file, packed by deflate, with a comment at its end.
    fn deflated(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(bytes).unwrap();
        let packed = encoder.finish().unwrap();
        let mut archive = write(&[("map.toml".to_owned(), &packed)]).unwrap();
        let directory = archive.windows(4).position(|it| it == b"PK\x01\x02").unwrap();
        archive[directory + 10] = 8;
        archive[directory + 16..directory + 20]
            .copy_from_slice(&crc32fast::hash(bytes).to_le_bytes());
        archive.extend(b"made by hand");
        archive
    }

    #[test]
    fn files_are_found_by_their_names() {
        let found = read(&stored(), &["map.toml", "robot.toml", "config.bin"]).unwrap();
        let expected = [("robot.toml", "a robot"), ("map.toml", "a map")];
        assert_eq!(found, expected.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())));
        let text = "a map ".repeat(1000);
        let found = read(&deflated(text.as_bytes()), &["map.toml"]).unwrap();
        assert_eq!(found, [("map.toml".to_owned(), text.into_bytes())]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let whole = stored();
        let directory = whole.windows(4).position(|it| it == b"PK\x01\x02").unwrap();
        let with = |at: usize, value: u8| {
            let mut archive = whole.clone();
            archive[at] = value;
            archive
        };
        for (archive, reason) in [
            (b"a text".to_vec(), "no ZIP archive"),
            (whole[..whole.len() - 1].to_vec(), "no ZIP archive, or cut off"),
            (with(directory, 0), "damaged"),
            (with(directory + 8, 1), "robot/robot.toml: it is encrypted"),
            (with(directory + 10, 14), "method"),
            (with(HEADER + FILES[0].0.len(), b'A'), "robot/robot.toml: the archive is damaged"),
            (deflated(&vec![0; MOST + 1]), "more than"),
        ] {
            let error = format!("{:#}", read(&archive, &["robot.toml", "map.toml"]).unwrap_err());
            assert!(error.contains(reason), "{error}");
        }
    }
}
