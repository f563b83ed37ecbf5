//! Resets in a row, counted in a register that survives a reset but not a power loss.
//!
//! If reading the store caused a reset, the robot would restart endlessly. Therefore a board
//! counts its starts. After [`MAX_RESETS`] resets, each less than [`SETTLED_AFTER`] after a start, the
//! application does not use the store until the next start, and reports this: the robot works without stored state.

use sonarfix::geometry::units::Duration;

/// Resets in a row after which the store is not used.
pub const MAX_RESETS: u8 = 3;
/// Time after which a start counts as a success.
pub const SETTLED_AFTER: Duration = Duration::from_ticks(60_000_000);

/// Upper bits of a register that holds a count; after a power loss its contents are arbitrary.
const MARK: u32 = 0x50F1_B000;
const MARK_BITS: u32 = 0xFFFF_FF00;

/// The resets in a row before this start, from the register; zero if it holds no count.
#[must_use]
pub fn resets(register: u32) -> u8 {
    let [count, ..] = register.to_le_bytes();
    if register & MARK_BITS == MARK { count } else { 0 }
}

/// The register's next value after this many resets.
#[must_use]
pub fn register(resets: u8) -> u32 {
    MARK | u32::from(resets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_holds_a_count_or_none() {
        assert_eq!([0, u32::MAX, 0xDEAD_BEEF, 0x0001_0002].map(resets), [0; 4]);
        for count in 0..=u8::MAX {
            assert_eq!(resets(register(count)), count);
        }
    }
}
