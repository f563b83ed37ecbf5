//! The errors of the store.

/// Why the store could not be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoreError {
    /// The region is not two or more whole sectors.
    Region,
    /// The flash failed to read, write or erase.
    Flash,
    /// The contents of the region were not a store.
    Corrupt,
    /// The written bytes do not read back.
    NotWritten,
    /// A record is valid, but has a layout that this firmware does not read.
    Layout,
    /// The robot cannot start with the configuration that it was sent; the baked one is used.
    Configuration,
    /// The robot was reset several times in a row; the store is not used until the next start.
    Ignored,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Region => "the store's region is not two or more whole sectors of flash",
            Self::Flash => "the flash failed to read, write or erase",
            Self::Corrupt => "the contents of the store's region were not a store",
            Self::NotWritten => "the bytes written to flash do not read back",
            Self::Layout => "a record in flash has a layout that this firmware does not read",
            Self::Configuration => "the robot cannot start with the configuration that it was sent",
            Self::Ignored => "several resets in a row: the store is not used until the next start",
        })
    }
}

impl core::error::Error for StoreError {}
