//! The parts that a program links or leaves out.

/// A part that is linked only by its Cargo feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Feature {
    /// Time-of-flight rangers.
    Light,
    /// A gyro beside the wheels.
    Gyro,
    /// More than one ranger.
    Rangers,
    /// Headings, positions and poses from outside.
    Absolute,
    /// The choice of the wall with the highest information gain.
    Informative,
    /// The search for an unknown pose.
    Search,
    /// A motion for the motor code: commanded by a PC, or of a robot that searches.
    Drive,
    /// The place of the first ranger as two states.
    Mount,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Light,
        Self::Gyro,
        Self::Rangers,
        Self::Absolute,
        Self::Informative,
        Self::Search,
        Self::Drive,
        Self::Mount,
    ];

    /// The name of the Cargo feature.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Gyro => "gyro",
            Self::Rangers => "rangers",
            Self::Absolute => "absolute",
            Self::Informative => "informative",
            Self::Mount => "mount",
            Self::Search => "search",
            Self::Drive => "drive",
        }
    }

    /// Whether this program was built with it.
    #[must_use]
    pub const fn is_linked(self) -> bool {
        match self {
            Self::Light => cfg!(feature = "light"),
            Self::Gyro => cfg!(feature = "gyro"),
            Self::Rangers => cfg!(feature = "rangers"),
            Self::Absolute => cfg!(feature = "absolute"),
            Self::Informative => cfg!(feature = "informative"),
            Self::Mount => cfg!(feature = "mount"),
            Self::Search => cfg!(feature = "search"),
            Self::Drive => cfg!(feature = "drive"),
        }
    }
}

/// A part that is asked for and that this program was built without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NotLinked(pub Feature);

impl core::fmt::Display for NotLinked {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "this program was built without `{}`", self.0.name())
    }
}

impl core::error::Error for NotLinked {}
