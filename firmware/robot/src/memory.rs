//! The regions of flash beside the program, defined by the board's `memory.x`.
#![expect(unsafe_code, reason = "memory that the linker script names and Rust does not know")]

use core::ops::Range;

unsafe extern "C" {
    static __map_start: u8;
    static __map_length: u8;
    static __config_start: u8;
    static __config_length: u8;
    static __store_start: u8;
    static __store_length: u8;
}

/// The baked map's region.
#[must_use]
pub fn map() -> &'static [u8] {
    // SAFETY: a region of flash of this length, which contains no linked section and is never written.
    unsafe { core::slice::from_raw_parts(&raw const __map_start, (&raw const __map_length).addr()) }
}

/// The baked configuration's region.
#[must_use]
pub fn config() -> &'static [u8] {
    // SAFETY: as above.
    unsafe {
        core::slice::from_raw_parts(&raw const __config_start, (&raw const __config_length).addr())
    }
}

/// The baked map's region, in addresses relative to the start of the flash at `base`: for a board whose flash cannot be read
/// in place.
#[must_use]
pub fn map_in(base: u32) -> Range<u32> {
    region(&raw const __map_start, &raw const __map_length, base)
}

/// The baked configuration's region, likewise.
#[must_use]
pub fn config_in(base: u32) -> Range<u32> {
    region(&raw const __config_start, &raw const __config_length, base)
}

/// The store's region, likewise.
#[must_use]
pub fn store(base: u32) -> Range<u32> {
    region(&raw const __store_start, &raw const __store_length, base)
}

fn region(start: *const u8, length: *const u8, base: u32) -> Range<u32> {
    let number = |address: *const u8| u32::try_from(address.addr()).unwrap_or(u32::MAX);
    let start = number(start).saturating_sub(base);
    start..start.saturating_add(number(length))
}
