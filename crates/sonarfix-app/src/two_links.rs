//! A board with two links, of which that one is used on which the PC has spoken first.
//!
//! Both send until a frame arrives on one of them. That one is then the link: the other one sends nothing, and what it receives is
//! dropped. It is given up when it is unplugged, or has received no frame for [`SILENCE`]; then both send again. Bytes that are no
//! frame do not choose a link, so that noise on one does not close the other. A frame that was being received ends with its link, so
//! that the first frame of the next one is not lost.

use sonarfix::geometry::units::{Duration, Instant};

use crate::Link;
use crate::time::since;

/// Time without a frame after which the other link may become that of the PC.
pub const SILENCE: Duration = Duration::from_ticks(1_000_000);
/// Time within which the bytes of a frame follow each other.
const PAUSE: Duration = Duration::from_ticks(20_000);
/// Bytes of the other link that are dropped before a poll, at most: more than the queue of a UART.
const DROPPED: u32 = 64;
/// The delimiter of frames.
const DELIMITER: u8 = 0;

/// A link that can be unplugged, and checks its bytes.
pub trait Pluggable: Link {
    /// Whether something is at its other end.
    fn is_plugged(&self) -> bool;

    /// Whether a byte has been received.
    fn has_received(&self) -> bool;

    /// Drops what was received.
    fn drop_received(&mut self);
}

/// One of the two links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Fixed,
    Plugged,
}

/// A link that is always there, such as a UART, and one that can be unplugged, such as USB.
#[derive(Debug)]
pub struct TwoLinks<F, P> {
    /// The one that is always there.
    pub fixed: F,
    /// The one that can be unplugged.
    pub plugged: P,
    /// The link of the PC, and when it has last received a frame.
    chosen: Option<(Side, Instant)>,
    /// Whose bytes are read.
    read: Side,
    /// When the last byte was read.
    heard: Instant,
    now: Instant,
}

impl<F: Link, P: Pluggable> TwoLinks<F, P> {
    /// Two links on which nobody has spoken.
    pub const fn new(fixed: F, plugged: P) -> Self {
        let at_once = Instant::from_ticks(0);
        Self { fixed, plugged, chosen: None, read: Side::Fixed, heard: at_once, now: at_once }
    }

    /// Notes the time, and gives up the link that was unplugged or is silent; to be called before each poll.
    pub fn begin(&mut self, now: Instant) {
        self.now = now;
        let plugged = &self.plugged;
        self.chosen = self.chosen.filter(|(side, heard)| {
            let is_there = *side == Side::Fixed || plugged.is_plugged();
            is_there && since(now, *heard) <= SILENCE
        });
        match self.chosen {
            Some((Side::Fixed, _)) => self.plugged.drop_received(),
            Some((Side::Plugged, _)) => {
                // Noise has no end.
                for _ in 0..DROPPED {
                    if self.fixed.receive().is_none() {
                        return;
                    }
                }
            }
            None => {}
        }
    }

    /// The link whose bytes are to be read.
    fn speaker(&self) -> Side {
        let is_speaking = self.read == Side::Plugged && since(self.now, self.heard) <= PAUSE;
        match self.chosen {
            Some((side, _)) => side,
            None if self.plugged.has_received() || is_speaking => Side::Plugged,
            None => Side::Fixed,
        }
    }
}

impl<F: Link, P: Pluggable> Link for TwoLinks<F, P> {
    fn receive(&mut self) -> Option<u8> {
        let speaker = self.speaker();
        if speaker != self.read {
            // What the other one has begun has no end.
            (self.read, self.heard) = (speaker, self.now);
            return Some(DELIMITER);
        }
        let byte = match speaker {
            Side::Fixed => self.fixed.receive(),
            Side::Plugged => self.plugged.receive(),
        };
        if byte.is_some() {
            self.heard = self.now;
        }
        byte
    }

    fn understood(&mut self) {
        self.chosen = Some((self.read, self.now));
    }

    fn send(&mut self, frame: &[u8]) {
        let chosen = self.chosen.map(|(side, _)| side);
        if chosen != Some(Side::Plugged) {
            self.fixed.send(frame);
        }
        if chosen != Some(Side::Fixed) {
            self.plugged.send(frame);
        }
    }

    fn has_room(&self, length: usize) -> bool {
        match self.chosen {
            Some((Side::Plugged, _)) => self.plugged.has_room(length),
            // One that is unplugged has no room, and does not hold the other one up.
            _ => self.fixed.has_room(length),
        }
    }
}
