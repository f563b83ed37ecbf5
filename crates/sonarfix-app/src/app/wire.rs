//! Both directions of the link, and the schedule of telemetry.
//!
//! Steps and pings are sent at once, the estimate at every tick, [`LoopStatus`](Telemetry::LoopStatus) once a second,
//! [`Hello`](Telemetry::Hello) every ten: at ten ticks and a ping a second 1.4 kB/s of the 11.5 kB/s of a link at
//! 115,200 baud (`docs/firmware.md`). A message for which there is no room is not built; the sequence numbers show the gap.

use sonarfix::geometry::units::{Duration, Instant};
use sonarfix_link::frame::TELEMETRY_FRAME_MAX;
use sonarfix_link::reporter::Outlet;
use sonarfix_link::{
    Frame, Receiver, ReceiverCounters, Sender, Session, SessionCommand, Telemetry,
};

use crate::time::after;

/// Period of [`Hello`](Telemetry::Hello).
const HELLO: Duration = Duration::from_ticks(10_000_000);
/// Period of [`LoopStatus`](Telemetry::LoopStatus).
const LOOP: Duration = Duration::from_ticks(1_000_000);
/// The time for which a busy poll leaves a periodic message to a later poll, so that one poll does not take as long as
/// both. An executor that polls less often finds every poll busy, and sends at once.
const POSTPONED: Duration = Duration::from_ticks(20_000);

/// The most bytes that a poll reads, so that its duration is bounded on a line that never falls silent. Between two polls,
/// which are at most an encoder period apart, a link at 115,200 baud receives more; the next poll then follows at once.
const BYTES_PER_POLL: usize = 64;

/// The bytes of the link, without waiting.
pub trait Link {
    /// The next received byte, if any.
    fn receive(&mut self) -> Option<u8>;

    /// The bytes so far have completed a frame.
    fn understood(&mut self) {}

    /// Queues a whole frame, or nothing if there is no room for it.
    fn send(&mut self, frame: &[u8]);

    /// Whether there is room for a frame of this length. Telemetry without room is not built.
    fn has_room(&self, _length: usize) -> bool {
        true
    }
}

/// The link's state.
pub(super) struct Wire {
    receiver: Receiver<SessionCommand>,
    pub session: Session,
    sender: Sender<Telemetry>,
    /// The next deadlines; immediately after the start.
    hello_at: Option<Instant>,
    loop_at: Option<Instant>,
    /// Whether the latest poll ended at its limit of bytes, so that more may wait.
    is_unread: bool,
    /// The frame that is sent: here, so that no frame must be cleared first.
    frame: [u8; TELEMETRY_FRAME_MAX],
}

impl Default for Wire {
    fn default() -> Self {
        Self {
            receiver: Receiver::default(),
            session: Session::default(),
            sender: Sender::default(),
            hello_at: None,
            loop_at: None,
            is_unread: false,
            frame: [0; TELEMETRY_FRAME_MAX],
        }
    }
}

impl Wire {
    /// Reads the received bytes up to the next command, at most [`BYTES_PER_POLL`].
    #[inline(never)]
    pub fn next(&mut self, link: &mut impl Link) -> Option<Frame<SessionCommand>> {
        self.is_unread = true;
        for _ in 0..BYTES_PER_POLL {
            let Some(byte) = link.receive() else {
                self.is_unread = false;
                return None;
            };
            let frame = self.receiver.push(byte);
            if frame.is_some() {
                link.understood();
                return frame;
            }
        }
        None
    }

    /// Whether received bytes may wait for the next poll.
    pub fn is_unread(&self) -> bool {
        self.is_unread
    }

    /// Sends a message. Not inlined, because of the stack of the serializer.
    #[inline(never)]
    pub fn send(&mut self, message: &Telemetry, link: &mut impl Link) {
        link.send(self.sender.frame(message, &mut self.frame));
    }

    /// The transport of the telemetry.
    pub fn outlet<'w, L: Link>(&'w mut self, link: &'w mut L) -> WireOutlet<'w, L> {
        WireOutlet { wire: self, link }
    }

    pub fn is_hello_due(&mut self, now: Instant, is_busy: bool) -> bool {
        is_due(&mut self.hello_at, now, HELLO, is_busy)
    }

    pub fn is_loop_due(&mut self, now: Instant, is_busy: bool) -> bool {
        is_due(&mut self.loop_at, now, LOOP, is_busy)
    }

    /// When the next periodic message is due.
    pub fn next_deadline(&self) -> Instant {
        let at_once = Instant::from_ticks(0);
        self.hello_at.unwrap_or(at_once).min(self.loop_at.unwrap_or(at_once))
    }

    /// Makes the periodic messages due at once.
    pub fn set_clock(&mut self) {
        (self.hello_at, self.loop_at) = (None, None);
    }

    pub fn counters(&self) -> ReceiverCounters {
        self.receiver.counters()
    }
}

/// Sends telemetry while the link has room; a message that is not sent uses up its sequence number.
pub(super) struct WireOutlet<'w, L> {
    wire: &'w mut Wire,
    link: &'w mut L,
}

impl<L: Link> Outlet for WireOutlet<'_, L> {
    fn send_built(&mut self, build: impl FnOnce() -> Telemetry) {
        if self.link.has_room(TELEMETRY_FRAME_MAX) {
            self.wire.send(&build(), self.link);
        } else {
            self.wire.sender.skip();
        }
    }
}

fn is_due(at: &mut Option<Instant>, now: Instant, period: Duration, is_busy: bool) -> bool {
    let delay = if is_busy { POSTPONED } else { Duration::from_ticks(0) };
    let is_due = at.is_none_or(|at| now >= after(at, delay));
    if is_due {
        *at = Some(after(now, period));
    }
    is_due
}
