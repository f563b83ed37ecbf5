//! The checksum of frames and of baked bytes.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// Without a table: a kilobyte of flash would save some 40 instructions a byte, of which a UART
/// at 115,200 baud brings at most one every 87 µs.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// CRC-32 as in Ethernet and zip (CRC-32/ISO-HDLC): it finds every error of up to 32 bits in a
/// row, and of any other all but one in 2³².
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
