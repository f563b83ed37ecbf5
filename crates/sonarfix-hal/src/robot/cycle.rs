//! The state machine of a measurement cycle.

use sonarfix::aim::{Aim, Reason};
use sonarfix::config::RangerId;
use sonarfix::geometry::units::Instant;

use super::odometer::Reading;
use super::tracker::Sweep;
use crate::ranger::Outcome;

/// The state of a measurement cycle.
///
/// ```text
///          due: choose, turn the servo        settled, ranger ready, a wall is square (or a sweep): ping
///   Idle ───────────────────────────▶ Turning ─────────────────────────────────▶ Listening
///   ▲  ▲ │ no wall                       │                                           │
///   │  └─┘                               │ no wall is square any more,               │
///   ├────────────────────────────────────┘ or the ranger cannot be triggered         │
///   └────────────────────────── echo, no echo, failure, or timeout ──────────────────┘
/// ```
///
/// While it listens the encoders are not sampled (see [`robot`](super)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cycle {
    /// Waits for the next cycle.
    Idle {
        /// The start of the next cycle.
        until: Instant,
    },
    /// The servo turns, or has settled and waits for the ranger.
    Turning {
        /// The ranger that pings next.
        ranger: RangerId,
        /// What it measures.
        target: Target<Reason>,
    },
    /// A ping is in flight.
    Listening {
        /// What is measured.
        target: Target<Aim>,
        /// The position of the wheels at the trigger.
        from: Reading,
        /// The first poll of the ranger.
        polled: Option<Instant>,
    },
}

/// What a ping measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Target<W> {
    /// A wall: why it was chosen, then the aim.
    Wall(W),
    /// Whatever is at a bearing, for the search.
    Sweep(Sweep),
}

/// How a ping ended; `None` if the ranger failed.
pub(super) type PingEnd = Option<Outcome>;

impl Target<Aim> {
    /// The ranger that measures it. The first one sweeps.
    pub fn ranger(&self) -> RangerId {
        match self {
            Self::Wall(aim) => aim.ranger,
            Self::Sweep(_) => RangerId::FIRST,
        }
    }
}

impl Cycle {
    pub fn is_listening(&self) -> bool {
        matches!(self, Self::Listening { .. })
    }
}
