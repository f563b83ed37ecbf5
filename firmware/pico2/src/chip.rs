//! What the RP2350 has and the RP2040 has not: state machines whose registers can be read at any time.

use core::convert::Infallible;

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
pub const FLASH_SIZE: usize = 4 * 1024 * 1024;

/// The program of the encoders' state machines.
pub fn encoder_program(pio: &mut Common<'static, PIO0>) -> LoadedProgram<'static, PIO0> {
    pio.load_program(&pio_file!("src/quadrature.pio").program)
}

/// A state machine that counts every edge of both channels.
pub struct Encoder<const SM: usize>(StateMachine<'static, PIO0, SM>);

impl<const SM: usize> Encoder<SM> {
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
        config.fifo_join = FifoJoin::RxAsStatus;
        machine.set_config(&config);
        machine.set_enable(true);
        Self(machine)
    }
}

impl<const SM: usize> Counter for Encoder<SM> {
    type Error = Infallible;
    const BITS: u32 = 32;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.get_rxf_entry(0))
    }
}

/// A state machine that stamps the edges of the echo.
pub struct Stamper {
    machine: StateMachine<'static, PIO1, 0>,
    edges: StampedEdges,
}

impl Stamper {
    // As above.
    #[inline(never)]
    pub fn new(
        pio: Pio<'static, PIO1>,
        echo: Peri<'static, impl PioPin>,
        clock_divider: u8,
        _now: Instant,
    ) -> Self {
        let Pio { mut common, sm0: mut machine, .. } = pio;
        let program = common.load_program(&pio_file!("src/echo.pio").program);
        let echo = common.make_pio_pin(echo);
        let mut config = Config::default();
        config.use_program(&program, &[]);
        config.set_jmp_pin(&echo);
        config.fifo_join = FifoJoin::RxAsStatus;
        config.clock_divider = clock_divider.into();
        machine.set_config(&config);
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

fn stamps(machine: &mut StateMachine<'static, PIO1, 0>) -> Stamps {
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
