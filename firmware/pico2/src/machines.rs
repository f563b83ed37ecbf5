//! The state machines of the encoders and of the echoes, as far as both chips configure them alike. The programs are those
//! of the chip that is built for.

use embassy_rp::Peri;
use embassy_rp::peripherals::{PIO0, PIO1};
use embassy_rp::pio::{
    Common, Config, FifoJoin, LoadedProgram, PioPin, ShiftDirection, StateMachine,
};
use pio::pio_file;

/// A state machine that counts the edges of an encoder.
pub type EncoderMachine<const SM: usize> = StateMachine<'static, PIO0, SM>;
/// A state machine that stamps the edges of an echo.
pub type EchoMachine<const SM: usize> = StateMachine<'static, PIO1, SM>;

/// The program of the encoders' state machines.
// Inlined, its calls of embassy's panics would be merged with others and belong to no line, which
// `cargo xtask test-firmware` checks.
#[inline(never)]
pub fn encoder_program(pio: &mut Common<'static, PIO0>) -> LoadedProgram<'static, PIO0> {
    #[cfg(rp2040)]
    let program = pio_file!("../pico/src/quadrature.pio").program;
    #[cfg(not(rp2040))]
    let program = pio_file!("../pico2/src/quadrature.pio").program;
    pio.load_program(&program)
}

/// Starts the counting of every edge of both channels. `queue` is the use of the machine's queues.
// As above.
#[inline(never)]
pub fn encoder<const SM: usize>(
    mut machine: EncoderMachine<SM>,
    pio: &mut Common<'static, PIO0>,
    program: &LoadedProgram<'static, PIO0>,
    a: Peri<'static, impl PioPin>,
    b: Peri<'static, impl PioPin>,
    queue: FifoJoin,
) -> EncoderMachine<SM> {
    let (a, b) = (pio.make_pio_pin(a), pio.make_pio_pin(b));
    let mut config = Config::default();
    config.use_program(program, &[]);
    config.set_in_pins(&[&a, &b]);
    config.shift_in.direction = ShiftDirection::Left;
    config.fifo_join = queue;
    machine.set_config(&config);
    machine.set_enable(true);
    machine
}

/// The program of the echoes' state machines.
// As above.
#[inline(never)]
pub fn echo_program(pio: &mut Common<'static, PIO1>) -> LoadedProgram<'static, PIO1> {
    #[cfg(rp2040)]
    let program = pio_file!("../pico/src/echo.pio").program;
    #[cfg(not(rp2040))]
    let program = pio_file!("../pico2/src/echo.pio").program;
    pio.load_program(&program)
}

/// Prepares the stamping of an echo's edges, which begins when the machine is enabled.
// As above.
#[inline(never)]
pub fn echo<const SM: usize>(
    mut machine: EchoMachine<SM>,
    pio: &mut Common<'static, PIO1>,
    program: &LoadedProgram<'static, PIO1>,
    echo: Peri<'static, impl PioPin>,
    clock_divider: u8,
    queue: FifoJoin,
) -> EchoMachine<SM> {
    let echo = pio.make_pio_pin(echo);
    let mut config = Config::default();
    config.use_program(program, &[]);
    config.set_jmp_pin(&echo);
    config.shift_in.direction = ShiftDirection::Left;
    config.fifo_join = queue;
    config.clock_divider = clock_divider.into();
    machine.set_config(&config);
    machine
}
