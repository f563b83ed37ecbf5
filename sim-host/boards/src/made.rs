//! ELF files that are made instead of linked: for tests, and where a program is asked for that does not matter.

/// A segment.
#[derive(Debug)]
pub struct Segment<'a> {
    /// Its address in memory.
    pub virtual_address: u32,
    /// Its address in flash.
    pub address: u32,
    /// Its contents.
    pub bytes: &'a [u8],
    /// Its size in memory, bytes.
    pub memory: u32,
}

/// A segment that runs where it is loaded.
#[must_use]
pub fn segment(address: u32, bytes: &[u8]) -> Segment<'_> {
    Segment { virtual_address: address, address, bytes, memory: length(bytes) }
}

fn length(bytes: &[u8]) -> u32 {
    u32::try_from(bytes.len()).unwrap_or(u32::MAX)
}

/// An ELF of 32 bits, by the tables of the specification (TIS ELF 1.2, figures 1-3 and 2-1), which starts at `entry`.
#[must_use]
pub fn elf(entry: u32, segments: &[Segment]) -> Vec<u8> {
    const HEADER: u16 = 52;
    const ENTRY: u16 = 32;
    let count = u16::try_from(segments.len()).unwrap_or(u16::MAX);
    let mut file = b"\x7fELF\x01\x01\x01".to_vec();
    file.resize(16, 0);
    // An executable for Arm.
    for half in [2_u16, 40] {
        file.extend(half.to_le_bytes());
    }
    for word in [1, entry, HEADER.into(), 0, 0] {
        file.extend(u32::to_le_bytes(word));
    }
    for half in [HEADER, ENTRY, count, 40, 0, 0] {
        file.extend(half.to_le_bytes());
    }
    let mut offset = u32::from(HEADER) + u32::from(ENTRY) * u32::from(count);
    for it in segments {
        let length = length(it.bytes);
        for word in [1, offset, it.virtual_address, it.address, length, it.memory, 5, 4] {
            file.extend(word.to_le_bytes());
        }
        offset += length;
    }
    file.extend(segments.iter().flat_map(|it| it.bytes));
    file
}
