//! Both directions of the link, and the rhythm of what is told.
//!
//! Every step and look is told at once, the estimate at every tick, [`Loop`](Telemetry::Loop) once a second,
//! [`Hello`](Telemetry::Hello) every ten: at ten ticks and a look a second 1.4 kB/s of the 11.5 kB/s that a link at
//! 115,200 baud carries (`docs/firmware.md`). A frame for which there is no room is dropped; the
//! gap shows in the sequence numbers.

use sonarfix::units::{Duration, Instant};
use sonarfix_link::{Answered, Command, Counters, Frame, Receiver, Sender, Telemetry, frame};

use crate::time::after;

/// From one [`Hello`](Telemetry::Hello) to the next.
const HELLO: Duration = Duration::from_ticks(10_000_000);
/// From one [`Loop`](Telemetry::Loop) to the next.
const LOOP: Duration = Duration::from_ticks(1_000_000);

/// The link's bytes, as far as they are there.
pub trait Link {
    /// The next byte that came in, if any.
    fn receive(&mut self) -> Option<u8>;

    /// Takes a frame to send: all of it, or none of it if there is no room.
    fn send(&mut self, frame: &[u8]);
}

/// The link's state.
#[derive(Default)]
pub(super) struct Wire {
    receiver: Receiver<Command>,
    pub answered: Answered,
    sender: Sender<Telemetry>,
    /// When to tell next; at once after the start.
    hello_at: Option<Instant>,
    loop_at: Option<Instant>,
}

impl Wire {
    /// Reads what has come in, up to the next command.
    pub fn next(&mut self, link: &mut impl Link) -> Option<Frame<Command>> {
        while let Some(byte) = link.receive() {
            let frame = self.receiver.push(byte);
            if frame.is_some() {
                return frame;
            }
        }
        None
    }

    pub fn send(&mut self, message: &Telemetry, link: &mut impl Link) {
        let mut buffer = frame::EMPTY;
        link.send(self.sender.frame(message, &mut buffer));
    }

    pub fn is_hello_due(&mut self, now: Instant) -> bool {
        is_due(&mut self.hello_at, now, HELLO)
    }

    pub fn is_loop_due(&mut self, now: Instant) -> bool {
        is_due(&mut self.loop_at, now, LOOP)
    }

    pub fn counters(&self) -> Counters {
        self.receiver.counters()
    }
}

fn is_due(at: &mut Option<Instant>, now: Instant, period: Duration) -> bool {
    let is_due = at.is_none_or(|at| now >= at);
    if is_due {
        *at = Some(after(now, period));
    }
    is_due
}
