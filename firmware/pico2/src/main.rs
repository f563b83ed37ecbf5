//! A Raspberry Pi Pico 2 or Pico with two encoders, two rangers on servos, a gyro and a UART; or an XRP robot, whose boards have the same chips.
//!
//! This file is the board, except for what differs: between the chips in the module `chip`, between the boards in `pins` and `enable`. The robot is
//! described by the baked configuration, and its behaviour is in `sonarfix-app`. The wiring is a table in `pins`.
//!
//! State machines count the wheels and stamp the edges, however long a poll or a write to flash takes. One executor is
//! therefore sufficient, and no interrupts but those of the clock, of received bytes, which end its sleep, and of USB. It runs two
//! tasks in turn, the loop, and after each of its polls the motor code (`sonarfix-motors`); while they wait, those of [`usb`].

#![no_std]
#![no_main]

use core::mem::ManuallyDrop;
use core::task::Poll;

use defmt_rtt as _;
use embassy_executor::{Executor, Spawner};
use embassy_rp::flash::{self, Flash};
use embassy_rp::gpio::{Level, Output, OutputOpenDrain, Pin};
use embassy_rp::interrupt::typelevel::{Handler, Interrupt, UART0_IRQ};
use embassy_rp::peripherals::{FLASH, PIO0, PIO1, USB, WATCHDOG};
use embassy_rp::pio::{InterruptHandler, Pio};
use embassy_rp::pwm::{self, ChannelAPin, ChannelBPin, Pwm, PwmOutput, Slice};
use embassy_rp::uart::{self, Uart};
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{Peri, bind_interrupts, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, with_deadline};
use embedded_hal_02::serial::{Read, Write};
use heapless::Deque;
use panic_probe as _;
use sonarfix::geometry::units::Instant;
use sonarfix_app::store::Store;
use sonarfix_app::two_links::{Pluggable, TwoLinks};
use sonarfix_app::watchdog::Liveness;
use sonarfix_app::{App, FlashContents, Link, boots, log};
use sonarfix_hal::bus::{SharedBus, TwoWire};
use sonarfix_hal::encoder::Unwrapped;
use sonarfix_hal::ranger::EchoCapture;
use sonarfix_hal::robot::{Devices, WithGyro, WithRangers};
use sonarfix_motors::Drive;
use sonarfix_motors::commanded::{Commanded, Inputs};
use sonarfix_robot::guarded::{Guard, Guarded};
use sonarfix_robot::{AnyRanger, NextPoll, memory};

// The other chip has its module beside its memory map.
#[cfg_attr(rp2040, path = "../../pico/src/chip.rs")]
mod chip;
#[cfg_attr(xrp, path = "../../xrp/src/enable.rs")]
mod enable;
mod machines;
#[macro_use]
#[cfg_attr(all(xrp, rp2040), path = "../../xrp/src/pins.rs")]
#[cfg_attr(all(xrp, not(rp2040)), path = "../../xrp-rp2350/src/pins.rs")]
mod pins;
mod usb;

use chip::{Encoder, FLASH_SIZE, QUEUE, Stamper, reset};
use enable::{Enable, disable_motors};
use pins::Gyro;
use usb::UsbLink;

/// Period at which the loop reads the stamps of the echo while a ping is in flight, and fills the UART's queue while it sends.
const STEP: Duration = Duration::from_millis(1);
/// The window of the watchdog, microseconds: the longest time from a pass of the loop to the reset. Its clock is that of the crystal.
const WINDOW: u32 = 200_000;
/// That of the start and of the erasure of a sector, microseconds: longer than an erasure, at most 0.4 s (`tSE` of the
/// W25Q16JV's data sheet). The motors are disabled meanwhile.
const LONG_WINDOW: u32 = 1_000_000;

/// Address of the flash.
const FLASH_BASE: u32 = 0x1000_0000;

/// The gyro is read and configured only if the robot file has one.
type Hardware = WithGyro<
    WithRangers<Devices<Encoder<0>, Encoder<1>, PwmOutput<'static>, Ranger>, 1>,
    Gyro<&'static Bus>,
>;

type Ranger = AnyRanger<Output<'static>, &'static Bus>;
/// Never dropped: the pins' drop can panic.
type Buses = ManuallyDrop<[Bus; 2]>;
type Bus = SharedBus<TwoWire<OutputOpenDrain<'static>, OutputOpenDrain<'static>, Delay>>;

/// The bus with these pins for clock and data.
fn bus(clock: Peri<'static, impl Pin>, data: Peri<'static, impl Pin>) -> Bus {
    SharedBus::new(TwoWire::new(line(clock), line(data), Delay))
}

/// A line of a bus. The module of a sensor has pull-ups; that of the pin keeps the line defined without one.
fn line(pin: Peri<'static, impl Pin>) -> OutputOpenDrain<'static> {
    let mut line = OutputOpenDrain::new(pin, Level::High);
    line.set_pullup(true);
    line
}

/// The edges of both echoes, from their [`Stamper`].
static ECHO: EchoCapture = EchoCapture::new();
static SECOND_ECHO: EchoCapture = EchoCapture::new();

/// The inputs of the motor code, from the loop; `None` while the motors are disabled.
static INPUTS: Signal<CriticalSectionRawMutex, Option<Inputs>> = Signal::new();

/// Bytes have arrived.
static RECEIVED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The interrupt of the UART: half of its queue is full, or bytes have waited for the time of three more.
struct ReceivedBytes;

impl ReceivedBytes {
    /// Lets the next bytes interrupt.
    fn listen() {
        pac::UART0.uartimsc().write(|w| {
            w.set_rxim(true);
            w.set_rtim(true);
        });
    }
}

#[expect(unsafe_code, reason = "the vector table calls it; it does nothing that is unsafe")]
impl Handler<UART0_IRQ> for ReceivedBytes {
    unsafe fn on_interrupt() {
        // The loop empties the queue, and listens again before it sleeps.
        pac::UART0.uartimsc().write(|_| {});
        RECEIVED.signal(());
    }
}

bind_interrupts!(struct Interrupts {
    UART0_IRQ => ReceivedBytes;
    PIO0_IRQ_0 => InterruptHandler<PIO0>;
    PIO1_IRQ_0 => InterruptHandler<PIO1>;
    USBCTRL_IRQ => embassy_rp::usb::InterruptHandler<USB>;
});

/// The time since the start.
fn now() -> Instant {
    Instant::from_ticks(embassy_time::Instant::now().as_micros())
}

/// The divider of the system clock for this frequency in Hz.
fn clock_divider(frequency: u32) -> u8 {
    u8::try_from(embassy_rp::clocks::clk_sys_freq() / frequency).unwrap_or(u8::MAX)
}

/// The servo's pulses: a resolution of 0.4 µs, every 20 ms; 2.5 MHz is a whole fraction of both chips' clocks. The driver
/// reports 49,999 counts for the 50,000 of a frame, which is an error of less than one count of any pulse.
fn servo_pulses() -> pwm::Config {
    let mut config = pwm::Config::default();
    config.divider = clock_divider(2_500_000).into();
    config.top = 50_000 - 1;
    config
}

/// Counts of a period of the motors' inputs.
fn motor_period() -> u16 {
    u16::try_from(embassy_rp::clocks::clk_sys_freq() / 20_000).unwrap_or(u16::MAX)
}

/// The inputs of the motor driver: 20 kHz, above what can be heard.
fn motor_pulses() -> pwm::Config {
    let mut config = pwm::Config::default();
    config.top = motor_period().saturating_sub(1);
    config
}

/// The inputs of the motor driver for a motor.
struct MotorInputs {
    slice: usize,
    /// Dropped, it would stop the slice.
    _pwm: Pwm<'static>,
}

impl MotorInputs {
    fn new<S: Slice>(
        (slice, a, b): (
            Peri<'static, S>,
            Peri<'static, impl ChannelAPin<S>>,
            Peri<'static, impl ChannelBPin<S>>,
        ),
    ) -> Self {
        let number = slice.number();
        Self { slice: number, _pwm: Pwm::new_output_ab(slice, a, b, motor_pulses()) }
    }

    /// The counts of a period for which both channels are high. A whole period is a level that is always high.
    fn set(&mut self, [a, b]: [u16; 2]) {
        pac::PWM.ch(self.slice).cc().write(|w| {
            w.set_a(a);
            w.set_b(b);
        });
    }
}

/// Those of the right and the left motor.
struct Motors([MotorInputs; 2]);

impl Motors {
    fn set(&mut self, drive: Drive) {
        for (motor, counts) in self.0.iter_mut().zip(pins::inputs(drive, motor_period())) {
            motor.set(counts);
        }
    }
}

/// The link over the UART, whose FIFOs of 32 bytes last 2.8 ms; an interrupt wakes the loop when 16 have arrived, or fewer and then none.
struct Serial {
    uart: Uart<'static, uart::Blocking>,
    /// A poll sends at most 400 bytes.
    to_send: Deque<u8, 512>,
}

impl Serial {
    /// Whether bytes have arrived.
    fn has_bytes() -> bool {
        !pac::UART0.uartfr().read().rxfe()
    }

    /// Writes as many bytes as the UART accepts.
    fn transmit(&mut self) {
        while let Some(byte) = self.to_send.front()
            && self.uart.write(*byte).is_ok()
        {
            self.to_send.pop_front();
        }
    }
}

impl Link for Serial {
    fn receive(&mut self) -> Option<u8> {
        loop {
            match self.uart.read() {
                Ok(byte) => return Some(byte),
                Err(nb::Error::WouldBlock) => return None,
                // A damaged byte is discarded; the checksum of its frame detects it.
                Err(nb::Error::Other(_)) => {}
            }
        }
    }

    fn send(&mut self, frame: &[u8]) {
        if self.has_room(frame.len()) {
            self.to_send.extend(frame.iter().copied());
        }
    }

    fn has_room(&self, length: usize) -> bool {
        self.to_send.capacity() - self.to_send.len() >= length
    }
}

/// Starts the watchdog's window again, with this length in microseconds.
fn feed(window: u32) {
    let counts = window.saturating_mul(chip::WATCHDOG_COUNTS);
    pac::WATCHDOG.load().write_value(pac::watchdog::regs::Load(counts));
}

/// The flash of the store.
type StoreFlash = Guarded<Flash<'static, FLASH, flash::Blocking, FLASH_SIZE>, Erasure>;

/// The erasure of a sector, which takes longer than the watchdog's window.
struct Erasure;

impl Guard for Erasure {
    fn begins() {
        disable_motors();
        feed(LONG_WINDOW);
    }

    fn ended() {
        feed(WINDOW);
    }
}

/// The end of the program: the motors are disabled, and the chip restarts. If it does not, the watchdog restarts it.
#[expect(unsafe_code, reason = "after a fault the watchdog has no owner")]
fn restart() -> ! {
    disable_motors();
    // SAFETY: no other code runs after a fault.
    Watchdog::new(unsafe { WATCHDOG::steal() }).trigger_reset();
    loop {
        cortex_m::asm::nop();
    }
}

sonarfix_robot::restart_after_faults!(restart);

/// The state of the loop.
struct Board {
    app: App<'static, StoreFlash>,
    hardware: Hardware,
    /// The positions of the right and the left wheel, for the motor code.
    positions: [Unwrapped; 2],
    stampers: (Stamper<0>, Stamper<1>),
    link: TwoLinks<Serial, UsbLink>,
    enable: Enable,
    watchdog: Watchdog,
    liveness: Liveness,
    next_poll: NextPoll,
}

impl Board {
    /// Initializes the board; `None` if the memory map has no store, or a servo no channel.
    // Inlined, its stack frame would remain for the whole runtime.
    #[inline(never)]
    fn new(buses: &'static mut Option<Buses>) -> Option<(Self, Motors, Peri<'static, USB>)> {
        // Before, the watchdog has no clock, and all pins are inputs.
        let board = embassy_rp::init(embassy_rp::config::Config::default());
        let mut watchdog = Watchdog::new(board.WATCHDOG);
        let reset = reset(&watchdog);
        watchdog.start(Duration::from_micros(LONG_WINDOW.into()));
        let resets = boots::resets(watchdog.get_scratch(0));
        watchdog.set_scratch(0, boots::register(resets.saturating_add(1)));
        let Pio { common: mut pio, sm0, sm1, .. } = Pio::new(board.PIO0, Interrupts);
        let program = machines::encoder_program(&mut pio);
        let (a, b) = part!(board.right_encoder);
        let right = machines::encoder(sm0, &mut pio, &program, a, b, QUEUE);
        let (a, b) = part!(board.left_encoder);
        let left = machines::encoder(sm1, &mut pio, &program, a, b, QUEUE);
        let (right, left) = (Encoder(right), Encoder(left));
        let Pio { common: mut pio, sm0, sm1, .. } = Pio::new(board.PIO1, Interrupts);
        let (program, divider) = (machines::echo_program(&mut pio), clock_divider(5_000_000));
        let (first, second) = part!(board.echoes);
        let first = machines::echo(sm0, &mut pio, &program, first, divider, QUEUE);
        let second = machines::echo(sm1, &mut pio, &program, second, divider, QUEUE);
        let stampers = (Stamper::start(first, now()), Stamper::start(second, now()));
        let [pulses, second_pulses] = part!(board.servos);
        let motors = Motors([
            MotorInputs::new(part!(board.right_motor)),
            MotorInputs::new(part!(board.left_motor)),
        ]);
        // An XRP's are those that the PWM has taken.
        let enable = Enable::new(part!(board.enable));
        let made = part!(board.buses);
        let [first, second] = &**buses.insert(ManuallyDrop::new(made));
        let (trigger, second_trigger) = part!(board.triggers);
        let trigger = Output::new(trigger, Level::Low);
        let servo = sonarfix_robot::servo(pulses?);
        let ranger = sonarfix_robot::any_ranger(trigger, &ECHO, first);
        let devices = Devices { right, left, servo, ranger };
        let trigger = Output::new(second_trigger, Level::Low);
        let ranger = sonarfix_robot::any_ranger(trigger, &SECOND_ECHO, second);
        let servos = [sonarfix_robot::servo(second_pulses?)];
        let devices = WithRangers { devices, servos, rangers: [ranger] };

        let flash = FlashContents::read(memory::map(), memory::config());
        log::flash_contents(&flash);
        let flash_of_store = Guarded::new(Flash::new_blocking(board.FLASH));
        let store = Store::new(flash_of_store, memory::store(FLASH_BASE)).ok()?;
        let app = App::new(sonarfix_robot::board(reset, resets), flash, store, now());
        // The default is 115,200 baud, 8N1.
        let uart = uart::Config::default();
        let (block, sends, receives) = part!(board.link);
        let uart = Uart::new_blocking(block, sends, receives, uart);
        // The driver leaves the pins without pull-ups; an open line would be received as noise (PADS_BANK0_GPIOn: PUE).
        pac::PADS_BANK0.gpio(pins::RECEIVES).modify(|w| {
            w.set_pue(true);
            w.set_pde(false);
        });
        listen_to_uart();
        let robot = Self {
            app,
            hardware: WithGyro { devices, gyro: Gyro::new(first) },
            positions: Default::default(),
            stampers,
            link: TwoLinks::new(Serial { uart, to_send: Deque::new() }, UsbLink),
            enable,
            watchdog,
            liveness: Liveness::new(now()),
            next_poll: NextPoll::AT_ONCE,
        };
        Some((robot, motors, board.USB))
    }

    /// One poll; returns when it began.
    // `cargo xtask chips` counts its instructions.
    #[inline(never)]
    fn poll(&mut self) -> Instant {
        let start = now();
        self.link.begin(start);
        let polled = self.app.poll(start, &mut self.hardware, &mut self.link);
        self.enable.set(polled.may_drive);
        let devices = &mut self.hardware.devices.devices;
        let counters = (&mut devices.right, &mut devices.left);
        let positions = &mut self.positions;
        INPUTS.signal(sonarfix_robot::inputs(&self.app, &polled, start, counters, positions));
        if polled.is_settled {
            self.watchdog.set_scratch(0, boots::register(0));
        }
        self.link.fixed.transmit();
        log::polled(&polled, self.app.report());
        if let Some(took) = now().checked_duration_since(start) {
            self.app.took(took);
        }
        let (app, hardware) = (&self.app, &mut self.hardware);
        self.next_poll = sonarfix_robot::next_poll(app, hardware, start, polled.may_drive);
        if self.liveness.is_alive(start, &polled) {
            feed(WINDOW);
        }
        start
    }

    /// The latest time until which the board may sleep: `None` if the next poll is due, a byte has arrived or an edge of
    /// the echo was stamped.
    fn sleeps_until(&mut self) -> Option<embassy_time::Instant> {
        let time = now();
        self.stampers.0.update(&ECHO, time);
        self.stampers.1.update(&SECOND_ECHO, time);
        let has_bytes = Serial::has_bytes() || self.link.plugged.has_received();
        let next = self.next_poll.at(has_bytes);
        if ECHO.take_edge() | SECOND_ECHO.take_edge() || time >= next {
            return None;
        }
        let is_listening = self.app.idle_until(&mut self.hardware).is_none();
        let is_sending = !self.link.fixed.to_send.is_empty();
        let mut wake = embassy_time::Instant::from_micros(next.ticks());
        if is_listening || is_sending {
            wake = wake.min(embassy_time::Instant::now().saturating_add(STEP));
        }
        if !has_bytes {
            ReceivedBytes::listen();
        }
        Some(wake)
    }
}

/// Lets received bytes interrupt, early enough that the queue does not overflow before the loop wakes.
#[expect(unsafe_code, reason = "the handler of the interrupt is bound above")]
fn listen_to_uart() {
    pac::UART0.uartifls().modify(|w| w.set_rxiflsel(0b010));
    // SAFETY: no critical section depends on this interrupt.
    unsafe { UART0_IRQ::enable() };
}

/// Polls when something is due.
#[embassy_executor::task]
async fn polls(mut board: Board) -> ! {
    loop {
        let start = board.poll();
        other_tasks().await;
        board.app.work(start, now);
        // Neither is this an `async fn` of its own.
        while let Some(wake) = board.sleeps_until() {
            // Whatever ends the sleep is found by the next call.
            let _ = with_deadline(wake, RECEIVED.wait()).await;
            board.link.fixed.transmit();
        }
    }
}

/// Lets the other tasks have their turn, the motor code before all. The executor takes the tasks that are ready in reverse order, so that the one
/// that has waited twice comes after all others.
// An `async fn` that returns could panic if it were polled again.
fn other_tasks() -> impl Future<Output = ()> {
    let mut waits = 2_u8;
    core::future::poll_fn(move |context| {
        if waits == 0 {
            return Poll::Ready(());
        }
        waits = waits.saturating_sub(1);
        context.waker().wake_by_ref();
        Poll::Pending
    })
}

/// The motors, after each poll. Your own controller takes the place of the example `Commanded`. The loop waits for it: a task
/// that computes for long must be divided by `await`.
#[embassy_executor::task]
async fn motors(mut motors: Motors) -> ! {
    let mut commanded = Commanded::new(pins::MOTOR);
    loop {
        let inputs = INPUTS.wait().await;
        motors.set(commanded.drive(inputs));
    }
}

/// Initializes the board and starts the tasks.
// Inlined, its stack frame, which holds copies of the board, would remain for the whole runtime.
#[inline(never)]
fn start(
    spawner: Spawner,
    buses: &'static mut Option<Buses>,
    usb_memory: &'static mut usb::Memory,
) {
    let Some((board, inputs, usb)) = Board::new(buses) else {
        defmt::error!("the memory map has no store, or a servo no channel");
        return;
    };
    // Each task is spawned once, for which there is room.
    if let Ok(polls) = polls(board) {
        spawner.spawn(polls);
    }
    if let Ok(motors) = motors(inputs) {
        spawner.spawn(motors);
    }
    usb::start(spawner, usb, Interrupts, usb_memory, &RECEIVED);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut EXECUTOR: Option<Executor> = None;
    static mut BUSES: Option<Buses> = None;
    static mut USB_MEMORY: usb::Memory = usb::Memory::new();
    EXECUTOR.get_or_insert_with(Executor::new).run(|spawner| start(spawner, BUSES, USB_MEMORY))
}
