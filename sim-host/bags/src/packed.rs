//! What zstd and lz4 have packed: whole files, chunks of MCAP and single messages.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;

use crate::error::Defect;

/// The largest file that is unpacked, bytes.
pub const MOST_FILE: u64 = 4 << 30;
/// How many bytes of chunks and messages are unpacked of a file.
pub const MOST_PARTS: u64 = 16 << 30;
/// The largest chunk or message that is unpacked, bytes.
pub const MOST_PART: u64 = 256 << 20;

/// Whether bytes begin as zstd's do. Those of a message begin with a zero.
pub fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x28, 0xb5, 0x2f, 0xfd])
}

/// Unpacks a file into one without a name, which is read from its begin.
pub fn unpack_file(file: File) -> Result<File, Defect> {
    let mut unpacked = tempfile::tempfile()?;
    let copied = io::copy(&mut zstd(file)?.take(MOST_FILE), &mut unpacked)?;
    if copied == MOST_FILE {
        let why = "is unpacked to more than 4 GiB: unpack it with `zstd -d`, and convert that file";
        return Err(Defect::content(why));
    }
    unpacked.seek(SeekFrom::Start(0))?;
    Ok(unpacked)
}

/// A message, unpacked if it is packed. `left` is how many bytes may still be unpacked, and becomes less by them.
pub fn message<'m>(bytes: &'m [u8], left: &mut u64) -> Result<Cow<'m, [u8]>, Defect> {
    if is_packed(bytes) {
        part("zstd", bytes, left).map(Cow::Owned)
    } else {
        Ok(Cow::Borrowed(bytes))
    }
}

/// Unpacks a chunk or a message.
pub fn part(by: &str, bytes: &[u8], left: &mut u64) -> Result<Vec<u8>, Defect> {
    let most = MOST_PART.min(*left);
    let mut unpacked = Vec::new();
    let read = match by {
        "zstd" => zstd(bytes)?.take(most).read_to_end(&mut unpacked),
        "lz4" => FrameDecoder::new(bytes).take(most).read_to_end(&mut unpacked),
        other => {
            let why = format!(
                "a chunk is packed by `{other}`, and only zstd and lz4 are read: unpack it with `mcap compress --compression none`"
            );
            return Err(Defect::content(why));
        }
    };
    read.map_err(|error| {
        let why = format!(
            "what {by} has packed is damaged: {error}; `mcap recover` saves what can be read"
        );
        Defect::content(why)
    })?;
    *left -= unpacked.len() as u64;
    if unpacked.len() as u64 == most {
        let why = "is unpacked to too many bytes (256 MiB a chunk, 16 GiB in all): take the topics that are needed \
                   with `mcap filter`";
        return Err(Defect::content(why));
    }
    Ok(unpacked)
}

fn zstd<R: Read>(bytes: R) -> Result<StreamingDecoder<R, ruzstd::decoding::FrameDecoder>, Defect> {
    StreamingDecoder::new(bytes).map_err(|error| Defect::content(format!("zstd: {error}")))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use lz4_flex::frame::FrameEncoder;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};

    use super::*;

    #[test]
    fn what_is_packed_is_unpacked_up_to_a_limit() {
        let content: Vec<u8> = (0..100_000_u32).flat_map(|n| (n / 7).to_le_bytes()).collect();
        let mut lz4 = FrameEncoder::new(Vec::new());
        lz4.write_all(&content).unwrap();
        let lz4 = lz4.finish().unwrap();
        let zstd = compress_to_vec(content.as_slice(), CompressionLevel::Fastest);
        for (by, packed) in [("lz4", &lz4), ("zstd", &zstd)] {
            let mut left = 1_000_000;
            assert_eq!(part(by, packed, &mut left).unwrap(), content);
            assert_eq!(left, 600_000);
            // A second time it is beyond what is left.
            assert_eq!(part(by, packed, &mut left).unwrap(), content);
            let more = part(by, packed, &mut left).unwrap_err().to_string();
            assert!(more.contains("too many bytes"), "{more}");
            assert!(part(by, &packed[..packed.len() / 2], &mut 1_000_000).is_err());
            assert!(part(by, &content, &mut 1_000_000).is_err());
        }
        let mut left = 1_000_000;
        assert_eq!(message(&zstd, &mut left).unwrap(), content);
        assert_eq!(message(&content, &mut left).unwrap(), content, "not packed");
        let other = part("brotli", &lz4, &mut left).unwrap_err().to_string();
        assert!(other.contains("packed by `brotli`"), "{other}");
    }
}
