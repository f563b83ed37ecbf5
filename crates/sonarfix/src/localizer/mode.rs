//! The modes of a robot that may have lost its pose.

/// What determines the pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Mode {
    /// The localizer tracks it.
    #[default]
    Tracking,
    /// It is unknown, and a search for it is running.
    Searching,
    /// The localizer tracks a pose that a search has found, which is not confirmed yet.
    Provisional,
}
