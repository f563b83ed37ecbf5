//! The sleep until the next poll: `SysTick`, which runs while the core sleeps, ends it.

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};

/// The largest period: `SysTick` has 24 bits, which is 1 s at 16 MHz.
const LARGEST: u32 = (1 << 24) - 1;
/// The smallest period: longer than the counter's start.
const SHORTEST: u32 = 64;
/// The time in which the counter's rate is measured, µs.
const MEASURED: u32 = 10_000;

/// `SysTick` as an alarm, off but during a sleep.
pub struct Alarm {
    timer: SYST,
    /// Its counts in [`MEASURED`].
    rate: u32,
}

impl Alarm {
    /// Measures the rate by a clock of microseconds. On the chip it is that of the core; the emulator's timers and its core
    /// have unrelated clocks.
    pub fn new(mut timer: SYST, clock: impl Fn() -> u32) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(LARGEST);
        timer.clear_current();
        timer.enable_counter();
        let began = clock();
        while clock().wrapping_sub(began) < MEASURED {}
        let rate = LARGEST - SYST::get_current();
        timer.disable_counter();
        timer.enable_interrupt();
        Self { timer, rate }
    }

    /// Sleeps for this many microseconds, at most for [`LARGEST`] counts, or until an interrupt is pending. Interrupts
    /// must be masked: that of the alarm ends the sleep, and is not served.
    pub fn sleep(&mut self, microseconds: u64) {
        let counts = microseconds.saturating_mul(self.rate.into()) / u64::from(MEASURED);
        let counts = u32::try_from(counts).unwrap_or(LARGEST).clamp(SHORTEST, LARGEST);
        self.timer.set_reload(counts);
        self.timer.clear_current();
        self.timer.enable_counter();
        // Once it counts, it has no further period. At the begin of one, QEMU with `-icount sleep=off` would continue at its
        // end, before the core has woken.
        while SYST::get_current() == 0 {}
        self.timer.set_reload(0);
        cortex_m::asm::wfi();
        // After another interrupt it still counts, or its own is pending as well, which would end the next sleep.
        self.timer.disable_counter();
        SCB::clear_pendst();
    }
}
