//! Kinds of plans, and units.

/// A point of a plan, centimetres.
pub(super) type Point = [i32; 2];

/// Clearance of the robot, centimetres.
pub(super) const CLEARANCE: i32 = 20;

/// The kind of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Rooms that open into each other.
    Home,
    /// Rooms on both sides of a corridor.
    Office,
    /// Few large rooms.
    Lab,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Home, Self::Office, Self::Lab];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Office => "office",
            Self::Lab => "lab",
        }
    }
}
