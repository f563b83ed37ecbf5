//! ZIP archives of a few text files.

use std::io::{Cursor, Read as _, Write as _};

use anyhow::{Context, ensure};
use zip::result::ZipResult;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// The most bytes of an unpacked file: more than any map.
const MOST: u64 = 16_000_000;

/// An archive of files that are stored as they are, without times: the same files give the same bytes.
///
/// # Errors
/// None: writing to memory does not fail.
pub fn write(files: &[(String, &[u8])]) -> ZipResult<Vec<u8>> {
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(name.as_str(), stored)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// The files of these names in an archive, in any folder of it.
///
/// # Errors
/// If it is no archive, is cut off or damaged, or packs such a file in another way than by deflate.
pub fn read(archive: &[u8], names: &[&str]) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut archive =
        ZipArchive::new(Cursor::new(archive)).context("it is no ZIP archive, or damaged")?;
    let mut files = Vec::new();
    for n in 0..archive.len() {
        let Some(path) = archive.name_for_index(n).map(str::to_owned) else { continue };
        let last = path.rsplit('/').next().unwrap_or_default();
        if names.contains(&last) {
            let bytes = unpacked(&mut archive, n).with_context(|| path.clone())?;
            files.push((last.to_owned(), bytes));
        }
    }
    Ok(files)
}

/// The file of this number.
fn unpacked(archive: &mut ZipArchive<Cursor<&[u8]>>, n: usize) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    archive.by_index(n)?.take(MOST + 1).read_to_end(&mut bytes).context("it is damaged")?;
    ensure!(bytes.len() as u64 <= MOST, "it has more than {MOST} bytes");
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [(&str, &[u8]); 3] =
        [("robot/robot.toml", b"a robot"), ("robot/map.toml", b"a map"), ("robot/x", b"x")];

    fn stored() -> Vec<u8> {
        write(&FILES.map(|(name, bytes)| (name.to_owned(), bytes))).unwrap()
    }

    /// An archive of one file, packed by deflate, with a comment at its end.
    fn deflated(bytes: &[u8]) -> Vec<u8> {
        let options = SimpleFileOptions::default();
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        archive
            .start_file("map.toml", options.compression_method(CompressionMethod::Deflated))
            .unwrap();
        archive.write_all(bytes).unwrap();
        archive.set_comment("made by hand");
        archive.finish().unwrap().into_inner()
    }

    #[test]
    fn files_are_found_by_their_names() {
        let found = read(&stored(), &["map.toml", "robot.toml", "config.bin"]).unwrap();
        let expected = [("robot.toml", "a robot"), ("map.toml", "a map")];
        assert_eq!(found, expected.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())));
        let text = "a map ".repeat(1000);
        let packed = deflated(text.as_bytes());
        assert!(packed.len() < 1000);
        assert_eq!(
            read(&packed, &["map.toml"]).unwrap(),
            [("map.toml".to_owned(), text.into_bytes())]
        );
    }

    #[test]
    fn what_is_wrong_is_named() {
        let whole = stored();
        let directory = whole.windows(4).position(|it| it == b"PK\x01\x02").unwrap();
        let content = whole.windows(7).position(|it| it == b"a robot").unwrap();
        let with = |at: usize, value: u8| {
            let mut archive = whole.clone();
            archive[at] = value;
            archive
        };
        let most = usize::try_from(MOST).unwrap();
        for (archive, reason) in [
            (b"a text".to_vec(), "it is no ZIP archive"),
            (whole[..whole.len() - 1].to_vec(), "it is no ZIP archive, or damaged"),
            (with(directory, 0), "it is no ZIP archive, or damaged"),
            (
                with(directory + 8, 1),
                "robot/robot.toml: unsupported Zip archive: Password required",
            ),
            (
                with(directory + 10, 14),
                "robot/robot.toml: unsupported Zip archive: Compression method",
            ),
            (with(content, b'A'), "robot/robot.toml: it is damaged"),
            (deflated(&vec![0; most + 1]), "more than"),
        ] {
            let error = format!("{:#}", read(&archive, &["robot.toml", "map.toml"]).unwrap_err());
            assert!(error.contains(reason), "{error}");
        }
    }
}
