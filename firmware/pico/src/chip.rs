//! What differs on the RP2040: the state machines put counts and stamps into queues.

use embassy_rp::Peri;
use embassy_rp::pac;
use embassy_rp::peripherals::{PIO0, PIO1};
use embassy_rp::pio::{
    Common, Config, FifoJoin, LoadedProgram, Pio, PioPin, ShiftDirection, StateMachine,
};
use embassy_rp::watchdog::{ResetReason, Watchdog};
use pio::pio_file;
use sonarfix::units::Instant;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{EchoCapture, StampedEdges, Stamps};
use sonarfix_link::message::ResetCause;

/// Size of the flash, bytes.
pub const FLASH_SIZE: usize = 2 * 1024 * 1024;

/// The program of the encoders' state machines.
pub fn encoder_program(pio: &mut Common<'static, PIO0>) -> LoadedProgram<'static, PIO0> {
    pio.load_program(&pio_file!("src/quadrature.pio").program)
}

/// A state machine that counts every edge of both channels.
pub struct Encoder<const SM: usize>(StateMachine<'static, PIO0, SM>);

/// The state machine sends no counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stalled;

impl<const SM: usize> Encoder<SM> {
    /// Readings of the queue that outlast any pass of the program.
    const PATIENCE: u32 = 100;

    // Inlined, its calls of embassy's panics would be merged with others and belong to no line, which
    // `cargo xtask test-firmware` checks.
    #[inline(never)]
    pub fn new(
        mut machine: StateMachine<'static, PIO0, SM>,
        pio: &mut Common<'static, PIO0>,
        program: &LoadedProgram<'static, PIO0>,
        a: Peri<'static, impl PioPin>,
        b: Peri<'static, impl PioPin>,
    ) -> Self {
        let (a, b) = (pio.make_pio_pin(a), pio.make_pio_pin(b));
        let mut config = Config::default();
        config.use_program(program, &[]);
        config.set_in_pins(&[&a, &b]);
        config.shift_in.direction = ShiftDirection::Left;
        machine.set_config(&config);
        machine.set_enable(true);
        Self(machine)
    }
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

/// A state machine that stamps the edges of the echo.
pub struct Stamper {
    machine: StateMachine<'static, PIO1, 0>,
    /// The start of its counter. Counter and clock are derived from one crystal.
    start: Instant,
    stamps: Stamps,
    edges: StampedEdges,
}

impl Stamper {
    // As above.
    #[inline(never)]
    pub fn new(
        pio: Pio<'static, PIO1>,
        echo: Peri<'static, impl PioPin>,
        clock_divider: u8,
        now: Instant,
    ) -> Self {
        let Pio { mut common, sm0: mut machine, .. } = pio;
        let program = common.load_program(&pio_file!("src/echo.pio").program);
        let echo = common.make_pio_pin(echo);
        let mut config = Config::default();
        config.use_program(&program, &[]);
        config.set_jmp_pin(&echo);
        config.shift_in.direction = ShiftDirection::Left;
        config.fifo_join = FifoJoin::RxOnly;
        config.clock_divider = clock_divider.into();
        machine.set_config(&config);
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
