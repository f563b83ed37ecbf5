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
    Check { steps: u16 },
}

/// Where the global check is. It goes on from cycle to cycle, so that no cycle is long.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct GlobalCheck {
    /// Where the line is that is being moved along every wall.
    pub along: AlongWalls,
    /// Its turn: the lines are moved one after the other.
    pub turn: u8,
    /// Lines that have reached the end of the last wall since the last rival.
    pub moved: u8,
}

impl GlobalCheck {
    /// Goes on with the next line.
    pub fn end_line(&mut self) {
        self.along = AlongWalls::default();
        self.turn = self.turn.wrapping_add(1);
        self.moved = self.moved.saturating_add(1);
    }
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
