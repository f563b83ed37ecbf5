//! The sonar's cycle: where it is.

use sonarfix::aim::{Aim, Reason};
use sonarfix::units::Instant;

use super::odometer::Reading;

/// Where the sonar's cycle is.
///
/// ```text
///          due: aim, send the servo           settled, ranger ready, a wall is square: ping
///   Idle ───────────────────────────▶ Turning ─────────────────────────────────▶ Listening
///   ▲  ▲ │ nothing to look at            │                                           │
///   │  └─┘                               │ no wall is square any more,               │
///   ├────────────────────────────────────┘ or the ranger cannot be triggered         │
///   └────────────────────────── echo, reason for none, failure, or patience over ────┘
/// ```
///
/// While it listens no encoder tick is done (see [`robot`](super)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cycle {
    /// Waits for its time.
    Idle {
        /// When to aim.
        look_at: Instant,
    },
    /// The servo is on its way, or stands and waits for the ranger to be ready.
    Turning {
        /// Why it was sent there.
        why: Reason,
    },
    /// A ping is in flight.
    Listening {
        /// What it is for.
        aim: Aim,
        /// The wheels at the trigger.
        from: Reading,
        /// When the ranger was first asked for the outcome.
        asked: Option<Instant>,
    },
}

impl Cycle {
    pub fn is_listening(&self) -> bool {
        matches!(self, Self::Listening { .. })
    }
}
