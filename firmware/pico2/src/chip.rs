//! What the RP2350 has and the RP2040 has not: state machines whose registers can be read at any time.

use core::convert::Infallible;

use embassy_rp::pac;
use embassy_rp::pio::FifoJoin;
use embassy_rp::watchdog::{ResetReason, Watchdog};
use sonarfix::geometry::units::Instant;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{EchoCapture, StampedEdges, Stamps};
use sonarfix_link::message::ResetCause;

use crate::machines::{EchoMachine, EncoderMachine};

/// The queues are registers that the processor reads at any time.
pub const QUEUE: FifoJoin = FifoJoin::RxAsStatus;

/// Size of the flash, bytes.
pub const FLASH_SIZE: usize = 4 * 1024 * 1024;

/// Counts of the watchdog in a microsecond: one with each tick (RP2350 data sheet, section 12.9).
pub const WATCHDOG_COUNTS: u32 = 1;

/// An encoder, counted by a state machine.
pub struct Encoder<const SM: usize>(pub EncoderMachine<SM>);

impl<const SM: usize> Counter for Encoder<SM> {
    type Error = Infallible;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.get_rxf_entry(0))
    }
}

/// The stamps of an echo's edges.
pub struct Stamper<const SM: usize> {
    machine: EchoMachine<SM>,
    edges: StampedEdges,
}

impl<const SM: usize> Stamper<SM> {
    pub fn start(mut machine: EchoMachine<SM>, _now: Instant) -> Self {
        let edges = StampedEdges::since(stamps(&mut machine));
        machine.set_enable(true);
        Self { machine, edges }
    }

    /// Passes the newest edges on.
    pub fn update(&mut self, echo: &EchoCapture, now: Instant) {
        let stamps = stamps(&mut self.machine);
        self.edges.update(echo, now, self.machine.get_rxf_entry(0), stamps);
    }
}

fn stamps<const SM: usize>(machine: &mut EchoMachine<SM>) -> Stamps {
    Stamps { rise: machine.get_rxf_entry(1), fall: machine.get_rxf_entry(2) }
}

/// The cause of the reset.
pub fn reset(watchdog: &Watchdog) -> ResetCause {
    let chip = pac::POWMAN.chip_reset().read();
    match watchdog.reset_reason() {
        Some(ResetReason::TimedOut) => ResetCause::Watchdog,
        Some(ResetReason::Forced) => ResetCause::Software,
        None if chip.had_por() => ResetCause::PowerOn,
        None if chip.had_bor() => ResetCause::BrownOut,
        None if chip.had_run_low() => ResetCause::Pin,
        None => ResetCause::Unknown,
    }
}
