//! An ESP32-C6 DevKitC-1 with two encoders, a servo, a pulse-width sonar and a UART.
//!
//! This file is the board. The robot is described by the baked configuration, and its behaviour is in `sonarfix-app`.
//! The wiring is a table in `docs/firmware.md`.
//!
//! | | for | pins |
//! |---|---|---|
//! | PCNT, units 0 and 1 | right and left encoder, every edge | 18 19, 20 21 |
//! | MCPWM0, capture timer | the stamps of the echo's edges, 1 µs | 2 |
//! | MCPWM0, timer 0, operator 0 | the servo's pulses, 1 µs | 22 |
//! | MCPWM0, timer 1, operators 1 and 2 | the inputs of the motor driver, right and left motor, 20 kHz | 6 7, 10 11 |
//! | system timer | the clock, 1 µs | |
//! | UART0 | the link, 115,200 baud | 16 17 |
//! | | the sonar's trigger; high while the robot may drive | 23; 3 |
//!
//! Hardware counts the wheels and stamps the edges, however long a poll or a write to flash takes. The only interrupt is that of
//! an alarm, which ends the sleep.

#![no_std]
#![no_main]

use core::cell::RefCell;
use core::convert::Infallible;
use core::ops::Range;

use critical_section::Mutex;
use defmt_rtt as _;
use esp_hal::clock::CpuClock;
use esp_hal::gpio::interconnect::InputSignal as Signal;
use esp_hal::gpio::{Input, InputConfig, InputSignal, Level, Output, OutputConfig, Pull};
use esp_hal::interrupt::wait_for_interrupt;
use esp_hal::mcpwm::operator::{PwmPin, PwmPinConfig};
use esp_hal::mcpwm::timer::PwmWorkingMode;
use esp_hal::mcpwm::{McPwm, PeripheralClockConfig};
use esp_hal::pcnt::Pcnt;
use esp_hal::pcnt::channel::{CtrlMode, EdgeMode};
use esp_hal::pcnt::unit::Unit;
use esp_hal::peripherals::{GPIO, LP_ANA, MCPWM0, RTC_TIMER};
use esp_hal::rtc_cntl::{Rtc, Rwdt, RwdtStage, RwdtStageAction, SocResetReason};
use esp_hal::system::{reset_reason, software_reset};
use esp_hal::time::Duration;
use esp_hal::timer::PeriodicTimer;
use esp_hal::timer::systimer::SystemTimer;
use esp_hal::uart::{self, Uart};
use esp_hal::{Blocking, ram};
use esp_storage::FlashStorage;
use heapless::Deque;
use portable_atomic::{AtomicU32, Ordering};
use sonarfix::geometry::units::Instant;
use sonarfix_app::store::Store;
use sonarfix_app::watchdog::Liveness;
use sonarfix_app::{App, FlashContents, Link, boots, log};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{Captured, EchoCapture, PulseRanger, StampedEdges, Stamps};
use sonarfix_hal::robot::Devices;
use sonarfix_link::message::ResetCause;
use sonarfix_motors::{Drive, Pattern};
use sonarfix_robot::guarded::{Guard, Guarded};
use sonarfix_robot::{NextPoll, memory};
use static_cell::ConstStaticCell;

// What the bootloader checks before it starts the program.
esp_bootloader_esp_idf::esp_app_desc!();

/// The longest sleep, microseconds: half of the time in which the UART's FIFO of 128 bytes fills.
const LONGEST_SLEEP: u64 = 5_000;
/// The longest sleep while the stamps of an echo are to be read or bytes are to be sent, microseconds.
const SHORT_SLEEP: u64 = 1_000;
/// The window of the watchdog: the longest time from a pass of the loop to the reset. `esp-hal` measures the watchdog's oscillator
/// against the crystal.
const WINDOW: Duration = Duration::from_millis(200);
/// That of the start and of the erasure of a sector (at most 0.4 s). The motors are disabled meanwhile.
const LONG_WINDOW: Duration = Duration::from_secs(1);
/// Number of the pin that is high while the robot may drive.
const DRIVE: u32 = 3;
/// Periods of 12.5 ns: shorter pulses on an encoder line are interference.
const GLITCH: u16 = 80;
/// Divides the MCPWM's clock of 160 MHz: its timers count microseconds.
const MICROS: u8 = 160 - 1;

/// Counts of a period of the motors' inputs: 20 kHz, above what can be heard.
const MOTOR_PERIOD: u16 = 50;

/// The edges of the echo, from [`Stamper`].
static ECHO: EchoCapture = EchoCapture::new();

/// The alarm that ends the sleep. It repeats, so that one that is early delays the end of the sleep and does not prevent it.
static ALARM: Mutex<RefCell<Option<PeriodicTimer<'static, Blocking>>>> =
    Mutex::new(RefCell::new(None));

/// Does something with the alarm, if it has been started.
fn with_alarm(work: impl FnOnce(&mut PeriodicTimer<'static, Blocking>)) {
    critical_section::with(|section| {
        if let Ok(mut alarm) = ALARM.borrow(section).try_borrow_mut()
            && let Some(alarm) = alarm.as_mut()
        {
            work(alarm);
        }
    });
}

#[esp_hal::handler]
fn woken() {
    with_alarm(PeriodicTimer::clear_interrupt);
}

/// Sleeps for so many microseconds, at least one.
fn sleep(micros: u64) {
    let mut is_set = false;
    with_alarm(|alarm| is_set = alarm.start(Duration::from_micros(micros.max(1))).is_ok());
    if is_set {
        wait_for_interrupt();
    }
}

/// Resets in a row, in memory that survives a reset but not a power loss.
#[ram(unstable(rtc_fast, persistent))]
static BOOTS: AtomicU32 = AtomicU32::new(0);

/// The images are copied, because only the program is mapped into the address space.
static MAP: ConstStaticCell<Image<{ 128 * 1024 }>> = ConstStaticCell::new(Image([0; _]));
static CONFIG: ConstStaticCell<Image<{ 4 * 1024 }>> = ConstStaticCell::new(Image([0; _]));

/// The copy of an image. The flash is read by words.
#[repr(align(4))]
struct Image<const BYTES: usize>([u8; BYTES]);

impl<const BYTES: usize> Image<BYTES> {
    /// Reads a region of the flash. If that fails, the application finds no image, and reports it.
    fn read(&'static mut self, flash: &mut FlashStorage, region: &Range<u32>) -> &'static [u8] {
        if flash.read_nor(region.start, &mut self.0).is_err() {
            defmt::error!("the flash cannot be read");
        }
        &self.0
    }
}

/// The time since the start.
fn now() -> Instant {
    Instant::from_ticks(esp_hal::time::Instant::now().duration_since_epoch().as_micros())
}

/// An encoder, counted by a unit of the pulse counter.
struct Encoder<const UNIT: usize> {
    unit: Unit<'static, UNIT>,
    /// The pins remain inputs as long as these exist.
    _pins: [Input<'static>; 2],
}

impl<const UNIT: usize> Encoder<UNIT> {
    /// Starts the counting of every edge of both channels; A leads when the wheel rolls forwards. Without limits the
    /// count wraps around.
    #[inline(never)]
    fn new(unit: Unit<'static, UNIT>, pins: [Input<'static>; 2]) -> Self {
        let [a, b] = &pins;
        let (a, b) = (a.peripheral_input(), b.peripheral_input());
        if unit.set_filter(Some(GLITCH)).is_err() {
            defmt::error!("the filter of an encoder is too long");
        }
        let channel = &unit.channel0;
        channel.set_edge_signal(a.clone());
        channel.set_ctrl_signal(b.clone());
        channel.set_input_mode(EdgeMode::Decrement, EdgeMode::Increment);
        channel.set_ctrl_mode(CtrlMode::Keep, CtrlMode::Reverse);
        let channel = &unit.channel1;
        channel.set_edge_signal(b);
        channel.set_ctrl_signal(a);
        channel.set_input_mode(EdgeMode::Decrement, EdgeMode::Increment);
        channel.set_ctrl_mode(CtrlMode::Reverse, CtrlMode::Keep);
        unit.clear();
        unit.resume();
        Self { unit, _pins: pins }
    }
}

impl<const UNIT: usize> Counter for Encoder<UNIT> {
    type Error = Infallible;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Infallible> {
        Ok(self.unit.value().cast_unsigned().into())
    }
}

/// The capture timer of the MCPWM, which stamps the edges of the echo: channel 0 the rising, channel 1 the falling ones.
/// Its count is read by a capture of channel 2. `esp-hal` has no driver for it.
struct Stamper {
    edges: StampedEdges,
    /// The pin remains an input as long as this exists.
    _echo: Input<'static>,
}

impl Stamper {
    /// Values of the field `MODE`: the edges of a channel.
    const FALLING: u8 = 0b01;
    const RISING: u8 = 0b10;

    #[inline(never)]
    #[expect(unsafe_code, reason = "the field has two bits, and each value is an edge")]
    fn new(echo: Input<'static>) -> Self {
        let signal: Signal = echo.peripheral_input();
        InputSignal::PWM0_CAP0.connect_to(&signal);
        InputSignal::PWM0_CAP1.connect_to(&signal);
        let registers = MCPWM0::regs();
        registers.cap_timer_cfg().write(|w| w.cap_timer_en().set_bit());
        let channels =
            [(registers.cap_ch_cfg(0), Self::RISING), (registers.cap_ch_cfg(1), Self::FALLING)];
        for (channel, edge) in channels {
            // SAFETY: both values are defined.
            channel.write(|w| unsafe { w.en().set_bit().mode().bits(edge) });
        }
        Self { edges: StampedEdges::since(Self::stamps()), _echo: echo }
    }

    fn stamps() -> Stamps {
        let registers = MCPWM0::regs();
        let stamp = |channel| registers.cap_ch(channel).read().value().bits();
        Stamps { rise: stamp(0), fall: stamp(1) }
    }

    /// The count of microseconds.
    fn count() -> u32 {
        let registers = MCPWM0::regs();
        registers.cap_ch_cfg(2).write(|w| w.en().set_bit().sw().set_bit());
        registers.cap_ch(2).read().value().bits()
    }

    /// Passes the newest edges on.
    fn update(&mut self, echo: &EchoCapture) {
        let stamps = Self::stamps();
        self.edges.update(echo, now(), Self::count(), stamps);
    }
}

/// The link. The UART's FIFOs of 128 bytes last 11 ms, longer than a sleep: no interrupt is needed.
struct Serial {
    uart: Uart<'static, Blocking>,
    /// A poll sends at most 400 bytes.
    to_send: Deque<u8, 512>,
}

impl Serial {
    /// Whether bytes have arrived.
    fn has_bytes(&self) -> bool {
        self.uart.read_ready()
    }

    /// Writes as many bytes as the UART accepts.
    fn transmit(&mut self) {
        while self.uart.write_ready()
            && let Some(byte) = self.to_send.pop_front()
        {
            // There is room for it: this neither waits nor fails.
            let _ = self.uart.write(&[byte]);
        }
    }
}

impl Link for Serial {
    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        // An error belongs to a damaged byte; the checksum of its frame detects it.
        match self.uart.read_buffered(&mut byte) {
            Ok(1..) => Some(byte[0]),
            Ok(_) | Err(_) => None,
        }
    }

    fn send(&mut self, frame: &[u8]) {
        if self.to_send.capacity() - self.to_send.len() >= frame.len() {
            self.to_send.extend(frame.iter().copied());
        }
    }
}

/// The cause of the reset.
fn reset() -> ResetCause {
    use SocResetReason as Reason;
    match reset_reason() {
        Some(Reason::ChipPowerOn) => ResetCause::PowerOn,
        Some(Reason::SysBrownOut) => ResetCause::BrownOut,
        Some(Reason::CoreRtcWdt | Reason::SysRtcWdt | Reason::Cpu0RtcWdt) => ResetCause::Watchdog,
        Some(Reason::CoreSw | Reason::Cpu0Sw) => ResetCause::Software,
        _ => ResetCause::Unknown,
    }
}

/// Disables the motors; the next poll may enable them again.
#[expect(unsafe_code, reason = "each bit of the register is a pin")]
fn disable_motors() {
    // SAFETY: any pattern of bits is valid; a set bit makes its pin low.
    GPIO::regs().out_w1tc().write(|w| unsafe { w.bits(1 << DRIVE) });
}

/// The watchdog of the RTC, which the loop feeds and the flash gives another window.
#[expect(unsafe_code, reason = "the flash is part of what the loop polls")]
fn watchdog() -> Rwdt {
    // SAFETY: nothing else uses the timer of the RTC, and no interrupt uses the watchdog.
    Rtc::new(unsafe { RTC_TIMER::steal() }).rwdt
}

/// Starts the watchdog's window again, with this length.
fn feed(window: Duration) {
    let mut watchdog = watchdog();
    watchdog.set_timeout(RwdtStage::Stage0, window);
    watchdog.feed();
}

/// Lets a supply that breaks down reset the system, which has a reason of its own; `esp-hal` leaves the detector off (ESP32-C6 Technical
/// Reference Manual, brown-out detector: `LP_ANA_BOD_MODE0_INTR_ENA` switches it on, `RESET_SEL` 1 is a reset of the system). Its
/// threshold remains that of the chip.
#[expect(unsafe_code, reason = "the field has ten bits, all of which are valid")]
fn watch_supply() {
    LP_ANA::regs().bod_mode0_cntl().modify(|_, w| {
        // SAFETY: the longest wait before the reset.
        unsafe { w.bod_mode0_reset_wait().bits(0x3ff) };
        w.bod_mode0_reset_sel().set_bit();
        w.bod_mode0_reset_ena().set_bit();
        w.bod_mode0_intr_ena().set_bit()
    });
}

/// The flash of the store.
type StoreFlash = Guarded<FlashStorage<'static>, Erasure>;

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

/// The end of the program by a panic: the motors are disabled, and the chip restarts. An exception of the core panics, as does an
/// overflow of the stack, which a watchpoint at its end detects (`stack-guard-monitoring` of `esp-hal`).
#[panic_handler]
fn panicked(info: &core::panic::PanicInfo) -> ! {
    disable_motors();
    if let Some(at) = info.location() {
        defmt::error!("panicked at {}:{}", at.file(), at.line());
    }
    software_reset()
}

type Pulses = PwmPin<'static, MCPWM0<'static>, 0, true>;

/// Both inputs of an H bridge.
type Bridge<const OPERATOR: u8> = (
    PwmPin<'static, MCPWM0<'static>, OPERATOR, true>,
    PwmPin<'static, MCPWM0<'static>, OPERATOR, false>,
);

/// The inputs of the motor driver. A count of zero keeps its input low, because the end of a pulse comes before its start.
struct Motors {
    right: Bridge<1>,
    left: Bridge<2>,
}

impl Motors {
    fn set(&mut self, drive: Drive) {
        let [right_1, right_2, left_1, left_2] = drive.inputs(MOTOR_PERIOD);
        self.right.0.set_timestamp(right_1);
        self.right.1.set_timestamp(right_2);
        self.left.0.set_timestamp(left_1);
        self.left.1.set_timestamp(left_2);
    }
}

type Hardware =
    Devices<Encoder<0>, Encoder<1>, Pulses, PulseRanger<Output<'static>, Captured<'static>>>;

/// The state of the loop.
struct Board {
    app: App<'static, StoreFlash>,
    hardware: Hardware,
    stamper: Stamper,
    link: Serial,
    drive: Output<'static>,
    motors: Motors,
    /// The example of motor code: your own controller takes its place.
    pattern: Pattern,
    liveness: Liveness,
    next_poll: NextPoll,
}

impl Board {
    /// Initializes the board; `None` if the memory map has no store or a setting is invalid.
    // Inlined, its stack frame would remain for the whole runtime.
    #[inline(never)]
    fn new() -> Option<Self> {
        // It stops the watchdog of the bootloader. All pins are inputs.
        let board = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
        let mut watchdog = watchdog();
        watchdog.enable();
        // The count of resets survives this one.
        watchdog.set_stage_action(RwdtStage::Stage0, RwdtStageAction::ResetCore);
        feed(LONG_WINDOW);
        watch_supply();
        let drive = Output::new(board.GPIO3, Level::Low, OutputConfig::default());
        let reset = reset();
        let resets = boots::resets(BOOTS.load(Ordering::Relaxed));
        BOOTS.store(boots::register(resets.saturating_add(1)), Ordering::Relaxed);

        let pulled_up = InputConfig::default().with_pull(Pull::Up);
        let Pcnt { unit0, unit1, .. } = Pcnt::new(board.PCNT);
        let right = [Input::new(board.GPIO18, pulled_up), Input::new(board.GPIO19, pulled_up)];
        let left = [Input::new(board.GPIO20, pulled_up), Input::new(board.GPIO21, pulled_up)];
        let (right, left) = (Encoder::new(unit0, right), Encoder::new(unit1, left));

        let clock = PeripheralClockConfig::with_prescaler(MICROS);
        let mut pwm = McPwm::new(board.MCPWM0, clock);
        pwm.operator0.set_timer(&pwm.timer0);
        let pulses = pwm.operator0.with_pin_a(board.GPIO22, PwmPinConfig::UP_ACTIVE_HIGH);
        let period = 20_000 - 1;
        pwm.timer0.start(clock.timer_clock_with_prescaler(period, PwmWorkingMode::Increase, 0));
        pwm.operator1.set_timer(&pwm.timer1);
        pwm.operator2.set_timer(&pwm.timer1);
        let (a, b) = (PwmPinConfig::UP_ACTIVE_HIGH, PwmPinConfig::UP_ACTIVE_HIGH);
        let right_motor = pwm.operator1.with_pins(board.GPIO6, a, board.GPIO7, b);
        let (a, b) = (PwmPinConfig::UP_ACTIVE_HIGH, PwmPinConfig::UP_ACTIVE_HIGH);
        let left_motor = pwm.operator2.with_pins(board.GPIO10, a, board.GPIO11, b);
        let mut motors = Motors { right: right_motor, left: left_motor };
        motors.set(Drive::STOP);
        let period = MOTOR_PERIOD - 1;
        pwm.timer1.start(clock.timer_clock_with_prescaler(period, PwmWorkingMode::Increase, 0));
        let stamper = Stamper::new(Input::new(board.GPIO2, InputConfig::default()));
        let trigger = Output::new(board.GPIO23, Level::Low, OutputConfig::default());
        let servo = sonarfix_robot::servo(pulses);
        let ranger = sonarfix_robot::ranger(trigger, &ECHO);

        let mut flash = FlashStorage::new(board.FLASH);
        let map = MAP.try_take()?.read(&mut flash, &memory::map_in(0));
        let config = CONFIG.try_take()?.read(&mut flash, &memory::config_in(0));
        let contents = FlashContents::read(map, config);
        log::flash_contents(&contents);
        let store = Store::new(Guarded::new(flash), memory::store(0)).ok()?;
        let mut alarm = PeriodicTimer::new(SystemTimer::new(board.SYSTIMER).alarm0);
        alarm.set_interrupt_handler(woken);
        alarm.listen();
        critical_section::with(|section| {
            if let Ok(mut place) = ALARM.borrow(section).try_borrow_mut() {
                *place = Some(alarm);
            }
        });
        let app = App::new(sonarfix_robot::board(reset, resets), contents, store, now());
        // The default is 115,200 baud, 8N1.
        let uart = Uart::new(board.UART0, uart::Config::default()).ok()?;
        let uart = uart.with_tx(board.GPIO16).with_rx(board.GPIO17);
        Some(Self {
            app,
            hardware: Devices { right, left, servo, ranger },
            stamper,
            link: Serial { uart, to_send: Deque::new() },
            drive,
            motors,
            pattern: Pattern::default(),
            liveness: Liveness::new(now()),
            next_poll: NextPoll::AT_ONCE,
        })
    }

    /// One poll.
    fn poll(&mut self) {
        let start = now();
        self.stamper.update(&ECHO);
        let polled = self.app.poll(start, &mut self.hardware, &mut self.link);
        self.drive.set_level(polled.may_drive.into());
        if polled.is_settled {
            BOOTS.store(boots::register(0), Ordering::Relaxed);
        }
        self.link.transmit();
        log::polled(&polled, self.app.report());
        // The motor code. The loop waits for it, and the telemetry reports its time as that of the poll.
        let estimate = sonarfix_robot::estimate(&self.app, &polled);
        self.motors.set(self.pattern.drive(estimate));
        if let Some(took) = now().checked_duration_since(start) {
            self.app.took(took);
        }
        self.app.work(start, now);
        let (app, hardware) = (&self.app, &mut self.hardware);
        self.next_poll = sonarfix_robot::next_poll(app, hardware, start, polled.may_drive);
        if self.liveness.is_alive(start, &polled) {
            feed(WINDOW);
        }
    }

    /// How long the board may sleep, microseconds: `None` if the next poll is due, a byte has arrived or an edge of the echo
    /// was stamped.
    fn may_sleep(&mut self) -> Option<u64> {
        self.stamper.update(&ECHO);
        let next = self.next_poll.at(self.link.has_bytes());
        let left = next.checked_duration_since(now())?.ticks();
        if left == 0 || ECHO.take_edge() {
            return None;
        }
        let is_listening = self.app.idle_until(&mut self.hardware).is_none();
        let is_sending = !self.link.to_send.is_empty();
        let longest = if is_listening || is_sending { SHORT_SLEEP } else { LONGEST_SLEEP };
        Some(left.min(longest))
    }
}

/// Polls when something is due, and sleeps until then.
#[esp_hal::main]
fn main() -> ! {
    let Some(mut board) = Board::new() else {
        defmt::error!("the memory map has no store, or a setting of the board is invalid");
        software_reset();
    };
    loop {
        board.poll();
        while let Some(micros) = board.may_sleep() {
            sleep(micros);
            board.link.transmit();
        }
    }
}
