//! The state machine of a measurement cycle.

use sonarfix::aim::{Aim, Choice, Reason};
use sonarfix::config::{MAX_RANGERS, RangerId};
use sonarfix::geometry::units::Instant;

use super::odometer::Reading;
use super::tracker::Sweep;
use crate::ranger::{Echo, Outcome};

/// The state of a measurement cycle.
///
/// ```text
///        due              chosen: turn the servo      settled, ranger ready, a wall is square: ping
///   Idle ─────▶ Choosing ───────────────────────▶ Turning ─────────────────────────────────▶ Listening
///   ▲ ▲ ▲          │ no wall                       ▲ │                                           │
///   │ │ └──────────┘                               │ │ no wall is square any more,               │
///   │ ├─ a bearing of a sweep ─────────────────────┘ │ or the ranger cannot be triggered         │
///   │ └──────────────────────────────────────────────┘                                           │
///   └────────────────────────── echo, no echo, failure, or timeout ──────────────────────────────┘
/// ```
///
/// While it listens the encoders are not sampled (see [`robot`](super)). After the echo of a wall the travel up to the reflection is passed
/// to the localizer, and the range in the next poll: *Reached*, which is not shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cycle {
    /// Waits for the next cycle.
    Idle {
        /// The start of the next cycle.
        until: Instant,
    },
    /// The rangers choose their walls, one after the other, a slice in each poll.
    Choosing {
        /// The choice of the ranger whose turn it is.
        choice: Choice,
        /// Those of the rangers before it.
        aims: [Option<Aim>; MAX_RANGERS],
    },
    /// The servo turns, or has settled and waits for the ranger.
    Turning {
        /// The ranger that pings next.
        ranger: RangerId,
        /// What it measures.
        target: Target<Reason>,
        /// The choice of the wall along its bearing, a slice in each poll, once it is ready.
        along: Option<Choice>,
    },
    /// The travel up to the reflection was passed to the localizer; the range is not yet.
    Reached {
        /// What was measured.
        aim: Aim,
        /// The echo.
        echo: Echo,
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
    /// Whether a ping is in flight, or its range is still to be taken. Ticks are delayed until then.
    pub fn has_ping(&self) -> bool {
        matches!(self, Self::Listening { .. } | Self::Reached { .. })
    }
}
