//! The state of a search between two evaluations: what it does, and what it has found.

use sonarfix::map::WallId;

use super::bank::Entry;
use super::candidates::{AlongWalls, Pairs};
use super::trial::Trial;
use super::window::Straightening;

/// Where a cycle stands.
#[derive(Debug, Clone, Copy)]
pub(super) enum Task {
    Rebase,
    Vote { ping: u16, tilt: u8 },
    Fit { line: u8 },
    Bank,
    Pairs { pair: u8, pairs: Pairs },
    Along { line: u8, along: AlongWalls },
}

/// What takes several evaluations, before the task goes on.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
pub(super) enum Work {
    None,
    Straighten(Straightening),
    Trial(Trial),
}

/// The answer without the poses, which follow the odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Decision {
    Searching,
    Several(usize),
    Along(WallId, f32),
    Nowhere,
    Unique(Entry),
}
