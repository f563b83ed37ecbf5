//! What differs on the RP2040: the state machines put counts and stamps into queues.

use embassy_rp::pac;
use embassy_rp::pio::FifoJoin;
use embassy_rp::watchdog::{ResetReason, Watchdog};
use sonarfix::geometry::units::Instant;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{EchoCapture, StampedEdges, Stamps};
use sonarfix_link::message::ResetCause;
// The products and sums of the program; embassy-rp has none without its feature `intrinsics`.
use sonarfix_soft_float as _;

use crate::machines::{EchoMachine, EncoderMachine};

/// The state machines only send: eight words.
pub const QUEUE: FifoJoin = FifoJoin::RxOnly;

/// Size of the flash, bytes.
pub const FLASH_SIZE: usize = 2 * 1024 * 1024;

/// Counts of the watchdog in a microsecond: it counts twice with each tick (RP2040 data sheet, erratum RP2040-E1).
pub const WATCHDOG_COUNTS: u32 = 2;

/// An encoder, counted by a state machine.
pub struct Encoder<const SM: usize>(pub EncoderMachine<SM>);

/// The state machine sends no counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stalled;

impl<const SM: usize> Encoder<SM> {
    /// Readings of the queue that outlast any pass of the program.
    const PATIENCE: u32 = 100;
}

impl<const SM: usize> Counter for Encoder<SM> {
    type Error = Stalled;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, Stalled> {
        let queue = self.0.rx();
        // What is in the queue may be old; what comes after it is not.
        for _ in 0..queue.level() {
            let _old = queue.try_pull();
        }
        (0..Self::PATIENCE).find_map(|_| queue.try_pull()).ok_or(Stalled)
    }
}

/// The stamps of an echo's edges.
pub struct Stamper<const SM: usize> {
    machine: EchoMachine<SM>,
    /// The start of its counter. Counter and clock are derived from one crystal.
    start: Instant,
    stamps: Stamps,
    edges: StampedEdges,
}

impl<const SM: usize> Stamper<SM> {
    pub fn start(mut machine: EchoMachine<SM>, now: Instant) -> Self {
        machine.set_enable(true);
        let stamps = Stamps { rise: 0, fall: 0 };
        Self { machine, start: now, stamps, edges: StampedEdges::since(stamps) }
    }

    /// Passes the newest edges on.
    pub fn update(&mut self, echo: &EchoCapture, now: Instant) {
        let count = micros(self.start, now);
        while let Some(edge) = self.machine.rx().try_pull() {
            let (stamp, is_high) = stamp(edge, count);
            if is_high {
                self.stamps.rise = stamp;
            } else {
                self.stamps.fall = stamp;
            }
        }
        self.edges.update(echo, now, count, self.stamps);
    }
}

/// The count of microseconds since the start, which wraps after 71 minutes.
#[expect(clippy::cast_possible_truncation, reason = "the low 32 bits of a count that wraps")]
fn micros(start: Instant, now: Instant) -> u32 {
    now.ticks().wrapping_sub(start.ticks()) as u32
}

/// The stamp of an edge in 32 bits, and the level after it. The state machine counts down, and sends 31 bits of its
/// count; `now` is less than 17 minutes later.
fn stamp(edge: u32, now: u32) -> (u32, bool) {
    const BITS: u32 = u32::MAX >> 1;
    let at = !(edge >> 1) & BITS;
    let age = now.wrapping_sub(at) & BITS;
    // An edge may come between the reading of the clock and that of the queue.
    let age = if age > BITS / 2 { 0 } else { age };
    (now.wrapping_sub(age), edge & 1 == 1)
}

/// The cause of the reset.
pub fn reset(watchdog: &Watchdog) -> ResetCause {
    let chip = pac::VREG_AND_CHIP_RESET.chip_reset().read();
    match watchdog.reset_reason() {
        Some(ResetReason::TimedOut) => ResetCause::Watchdog,
        Some(ResetReason::Forced) => ResetCause::Software,
        None if chip.had_por() => ResetCause::PowerOn,
        None if chip.had_run() => ResetCause::Pin,
        None => ResetCause::Unknown,
    }
}
