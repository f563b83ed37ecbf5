//! Times from which the rules count.

/// Since when something has held, real time in µs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Since {
    /// An encoder cannot be read.
    pub blind: Option<u64>,
    /// No ranger measures.
    pub no_range: Option<u64>,
    /// The start of the loop.
    pub began: u64,
    /// The latest command, which may have set the pose.
    pub told: u64,
    /// The latest tick, or the start of the loop.
    pub tick: u64,
    /// The latest status of the loop, or the start.
    pub status: u64,
    /// The latest valid frame.
    pub heard: u64,
    /// In how many polls in a row, up to the latest one, the clock has leapt.
    pub leaps: u32,
}
