//! An echo line whose edges are time-stamped by an interrupt.
//!
//! The interrupt writes and the loop reads; neither waits for the other:
//!
//! ```text
//!   interrupt (or a timer's input capture)          loop
//!     rose(at) ─▶ rise, rise_of ───┐
//!     fell(at) ─▶ fall, heard ─────┴─▶ EchoCapture ◀──▶ Captured: arms a ping, reads its pulse
//! ```
//!
//! The loop numbers its pings (`armed`). The interrupt stores the first pulse of a ping that is long enough and does
//! not change it until the number changes, so that the loop reads both stamps consistently. Only loads and stores
//! are used, because a Cortex-M0 has no compare-and-swap. The stamps are the low 32 bits of the microseconds, which
//! a Cortex-M stores atomically; a pulse must be read within 35 minutes.

use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use sonarfix::geometry::units::{Duration, Instant};

use super::pulse::{EchoLine, Pulse};

/// The edges of an echo line, written by an interrupt. It may be a `static`, or a value to which interrupt and loop
/// share a reference.
///
/// Call [`Self::rose`] and [`Self::fell`] from one interrupt only, with times of the clock whose
/// `now` the loop is polled with.
///
/// ```
/// use sonarfix::geometry::units::Instant;
/// use sonarfix_hal::ranger::EchoCapture;
///
/// static ECHO: EchoCapture = EchoCapture::new();
///
/// /// The pin's interrupt, at both edges.
/// fn on_edge(now: Instant, is_high: bool) {
///     if is_high { ECHO.rose(now) } else { ECHO.fell(now) }
/// }
/// # on_edge(Instant::from_ticks(5), true);
/// ```
#[derive(Debug, Default)]
pub struct EchoCapture {
    /// Number of the present ping, and its shortest valid pulse, µs.
    armed: AtomicU32,
    shortest: AtomicU32,
    /// The last rising edge, and the number of its ping.
    rise: AtomicU32,
    rise_of: AtomicU32,
    /// The falling edge of the pulse of ping `heard`, the last one with a pulse.
    fall: AtomicU32,
    heard: AtomicU32,
    high: AtomicBool,
    /// Whether there was an edge since [`EchoCapture::take_edge`].
    has_edge: AtomicBool,
}

/// The low 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "the low bits are what is asked for")]
fn stamp(at: Instant) -> u32 {
    at.ticks() as u32
}

/// The instant nearest to `now` with this stamp. It may be after `now`, if the interrupt occurred after the clock was
/// read.
fn instant(now: Instant, stamped: u32) -> Instant {
    let ahead = stamped.wrapping_sub(stamp(now)).cast_signed();
    Instant::from_ticks(now.ticks().saturating_add_signed(i64::from(ahead)))
}

impl EchoCapture {
    /// A capture without edges.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            armed: AtomicU32::new(0),
            shortest: AtomicU32::new(0),
            rise: AtomicU32::new(0),
            rise_of: AtomicU32::new(0),
            fall: AtomicU32::new(0),
            heard: AtomicU32::new(0),
            high: AtomicBool::new(false),
            has_edge: AtomicBool::new(false),
        }
    }

    /// Records a rising edge at `at`.
    pub fn rose(&self, at: Instant) {
        self.high.store(true, Ordering::Relaxed);
        let ping = self.armed.load(Ordering::Acquire);
        if self.heard.load(Ordering::Relaxed) != ping {
            self.rise.store(stamp(at), Ordering::Relaxed);
            self.rise_of.store(ping, Ordering::Release);
        }
        self.has_edge.store(true, Ordering::Release);
    }

    /// Records a falling edge at `at`.
    pub fn fell(&self, at: Instant) {
        self.high.store(false, Ordering::Relaxed);
        let ping = self.armed.load(Ordering::Acquire);
        let is_waited_for = self.heard.load(Ordering::Relaxed) != ping
            && self.rise_of.load(Ordering::Relaxed) == ping;
        let width = stamp(at).wrapping_sub(self.rise.load(Ordering::Relaxed));
        if is_waited_for && width >= self.shortest.load(Ordering::Relaxed) {
            self.fall.store(stamp(at), Ordering::Relaxed);
            // Releases both stamps to the loop.
            self.heard.store(ping, Ordering::Release);
        }
        self.has_edge.store(true, Ordering::Release);
    }

    /// Whether there was an edge since [`Self::take_edge`]: a reason not to sleep.
    pub fn has_edge(&self) -> bool {
        self.has_edge.load(Ordering::Acquire)
    }

    /// As [`Self::has_edge`], and forgets it. The clock of the following poll is read afterwards, so that the poll finds the
    /// pulse.
    pub fn take_edge(&self) -> bool {
        let has_edge = self.has_edge();
        if has_edge {
            self.has_edge.store(false, Ordering::Relaxed);
        }
        has_edge
    }
}

/// The loop's side of an [`EchoCapture`]. There must be only one, because it numbers the pings.
#[derive(Debug)]
pub struct Captured<'c>(&'c EchoCapture);

impl<'c> Captured<'c> {
    /// Reads the pulses of this capture.
    #[must_use]
    pub const fn new(capture: &'c EchoCapture) -> Self {
        Self(capture)
    }

    fn ping(&self) -> u32 {
        self.0.armed.load(Ordering::Relaxed)
    }
}

impl EchoLine for Captured<'_> {
    type Error = Infallible;
    const WAKES: bool = true;

    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.high.load(Ordering::Relaxed))
    }

    fn arm(&mut self, shortest: Duration) -> Result<(), Infallible> {
        let shortest = u32::try_from(shortest.ticks()).unwrap_or(u32::MAX);
        self.0.shortest.store(shortest, Ordering::Relaxed);
        let next = self.ping().wrapping_add(1);
        self.0.armed.store(next, Ordering::Release);
        Ok(())
    }

    fn pulse(&mut self, now: Instant) -> Result<Option<Pulse>, Infallible> {
        if self.0.heard.load(Ordering::Acquire) != self.ping() {
            return Ok(None);
        }
        let pulse = Pulse {
            rise: instant(now, self.0.rise.load(Ordering::Relaxed)),
            fall: instant(now, self.0.fall.load(Ordering::Relaxed)),
        };
        // A pulse that ended after the clock was read belongs to the next poll.
        Ok(Some(pulse).filter(|pulse| pulse.fall <= now))
    }

    fn has_risen(&self) -> bool {
        self.0.rise_of.load(Ordering::Acquire) == self.ping()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORTEST: Duration = Duration::from_ticks(100);

    fn at(micros: u64) -> Instant {
        // Close below a wrap of the 32-bit stamps.
        Instant::from_ticks((7 << 32) - 2_000 + micros)
    }

    fn armed(capture: &EchoCapture) -> Captured<'_> {
        let mut line = Captured::new(capture);
        let Ok(()) = line.arm(SHORTEST);
        line
    }

    #[test]
    fn the_first_long_pulse_is_kept_across_the_wrap_of_the_stamps() {
        let capture = EchoCapture::new();
        let mut line = armed(&capture);
        assert!(!line.has_risen());
        for (rise, fall) in [(10, 60), (500, 3_500), (4_000, 4_500)] {
            capture.rose(at(rise));
            capture.fell(at(fall));
        }
        let pulse = Pulse { rise: at(500), fall: at(3_500) };
        assert_eq!(line.pulse(at(9_000)), Ok(Some(pulse)));
    }

    #[test]
    fn a_falling_edge_without_a_rising_edge_is_not_a_pulse() {
        let capture = EchoCapture::new();
        let mut line = armed(&capture);
        capture.rose(at(0));
        assert!(line.has_risen());
        assert_eq!(line.is_high(), Ok(true));
        let Ok(()) = line.arm(SHORTEST);
        capture.fell(at(1_000));
        assert_eq!(line.pulse(at(2_000)), Ok(None));
        assert!(!line.has_risen());
        assert_eq!(line.is_high(), Ok(false));
    }

    #[test]
    fn an_interrupt_after_the_clock_was_read_waits_for_the_next_poll() {
        let capture = EchoCapture::new();
        let mut line = armed(&capture);
        capture.rose(at(500));
        capture.fell(at(3_500));
        assert_eq!(line.pulse(at(3_499)), Ok(None));
        let fall = line.pulse(at(3_500)).map(|pulse| pulse.map(|pulse| pulse.fall));
        assert_eq!(fall, Ok(Some(at(3_500))));
    }

    #[test]
    fn an_edge_is_a_reason_to_wake_once() {
        let capture = EchoCapture::new();
        assert!(!capture.take_edge());
        let edges: [fn(&EchoCapture, Instant); 2] = [EchoCapture::rose, EchoCapture::fell];
        for edge in edges {
            edge(&capture, at(0));
            assert!(capture.has_edge() && capture.take_edge());
            assert!(!capture.has_edge() && !capture.take_edge());
        }
    }

    #[test]
    fn an_unarmed_capture_records_nothing() {
        let capture = EchoCapture::new();
        capture.rose(at(0));
        capture.fell(at(1_000));
        assert_eq!(armed(&capture).pulse(at(2_000)), Ok(None));
    }
}
