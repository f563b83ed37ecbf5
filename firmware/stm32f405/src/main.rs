//! The reference board: an STM32F405 with two encoders, two rangers on servos, a gyro and a UART.
//!
//! This file is the board. The robot is described by the baked configuration, and its behaviour is in `sonarfix-app`.
//! The wiring diagram is in the README.
//!
//! | | for | pins |
//! |---|---|---|
//! | TIM1, TIM8 | right and left encoder, counted by hardware | PA8 PA9, PC6 PC7 |
//! | TIM10, TIM11 | the pulses of the servos of both rangers | PB8, PB9 |
//! | TIM5 | the clock, 1 µs in 32 bits, and the stamps of the first echo's edges | PA0 |
//! | TIM12 | the stamps of the second echo's edges, 1 µs in 16 bits | PB14 |
//! | `SysTick` | ends the sleep when the next poll is due | |
//! | TIM3 | the inputs of the motor driver, right and left motor, 20 kHz | PA6 PA7, PB0 PB1 |
//! | USART2 | the link, 115,200 baud | PA2 PA3 |
//! | | the triggers of both rangers; high while the robot may drive | PA1, PA4; PB7 |
//! | | the buses of both rangers, clock and data, for light; the gyro is on the first | PC0 PC1, PC2 PC3 |
//!
//! RTIC gives each interrupt exclusive access to its peripherals and queues. Only lock-free queues and the stamps of the
//! echo are shared, so that no interrupt waits for another. The loop is RTIC's idle task: however long it takes,
//! hardware stamps the edges, and an interrupt receives the bytes. After each poll it runs the motor code (`sonarfix-motors`),
//! and sleeps until something is due, a byte arrives or an edge is stamped.

#![no_std]
#![no_main]

mod alarm;

use core::ops::Deref;

use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use heapless::spsc::{Consumer, Producer, Queue};
use panic_probe as _;
use sonarfix_app::Link;
use sonarfix_hal::bus::{SharedBus, TwoWire};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::EchoCapture;
use sonarfix_motors::Drive;
use sonarfix_robot::guarded::{Guard, Guarded};
use sonarfix_robot::memory;
use stm32f4xx_hal::gpio::{ErasedPin, OpenDrain, Output, Pin, Pull};
use stm32f4xx_hal::pac::{self, tim1};
use stm32f4xx_hal::rcc;

/// The edges of the first echo, from TIM5's interrupt, and of the second one, from TIM12's.
static ECHO: EchoCapture = EchoCapture::new();
static SECOND_ECHO: EchoCapture = EchoCapture::new();

/// The clocks: the internal oscillator at 16 MHz with an error of 1 %, which scales all ranges and is estimated as the
/// filter's range scale. With a crystal of 8 MHz, or a clock of 8 MHz at its pin: 48 MHz.
fn clocks() -> rcc::Config {
    let external = || rcc::Config::hse(fugit::HertzU32::MHz(8)).sysclk(fugit::HertzU32::MHz(48));
    if cfg!(feature = "external-clock") {
        // The oscillator of the crystal is off (RM0090, RCC_CR: HSEBYP).
        external().bypass_hse_oscillator()
    } else if cfg!(feature = "crystal") {
        external()
    } else {
        rcc::Config::hsi()
    }
}

/// The prescaler of a timer for microseconds.
fn microseconds(timer: fugit::HertzU32) -> u16 {
    u16::try_from(timer.to_MHz()).unwrap_or(u16::MAX).saturating_sub(1)
}

/// A peripheral that does not retain what was written to it: it has no clock, or is not emulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NotThere;

/// An advanced timer as a quadrature counter of every edge of both channels.
struct Encoder<T>(T);

impl<T: Deref<Target = tim1::RegisterBlock>> Encoder<T> {
    fn new(timer: T) -> Self {
        timer
            .ccmr1_input()
            .write(|w| w.cc1s().ti1().cc2s().ti2().ic1f().set(0b11).ic2f().set(0b11));
        timer.smcr().write(|w| w.sms().encoder_mode_3());
        timer.arr().write(|w| w.arr().set(u16::MAX));
        timer.cr1().write(|w| w.cen().set_bit());
        Self(timer)
    }
}

impl<T: Deref<Target = tim1::RegisterBlock>> Counter for Encoder<T> {
    type Error = NotThere;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, NotThere> {
        let counts = self.0.smcr().read().sms().is_encoder_mode_3();
        if counts { Ok(u32::from(self.0.cnt().read().cnt().bits())) } else { Err(NotThere) }
    }
}

/// The only channel of TIM10 or TIM11: pulses of half a microsecond's resolution every 20 ms.
enum ServoPwm {
    First(pac::TIM10),
    Second(pac::TIM11),
}

/// The same registers, of which the crate has two types.
macro_rules! of_either {
    ($pwm:expr, $timer:ident => $work:expr) => {
        match $pwm {
            ServoPwm::First($timer) => $work,
            ServoPwm::Second($timer) => $work,
        }
    };
}

impl ServoPwm {
    /// Counts of a 20 ms frame.
    const FRAME: u16 = 40_000;

    fn started(self, clock: fugit::HertzU32) -> Self {
        let divider = u16::try_from(clock.to_MHz() / 2).unwrap_or(u16::MAX).saturating_sub(1);
        of_either!(&self, timer => {
            timer.psc().write(|w| w.psc().set(divider));
            timer.arr().write(|w| w.arr().set(Self::FRAME - 1));
            timer.ccmr1_output().write(|w| w.oc1m().pwm_mode1().oc1pe().set_bit());
            timer.ccer().write(|w| w.cc1e().set_bit());
            timer.egr().write(|w| w.ug().set_bit());
            timer.cr1().write(|w| w.cen().set_bit());
        });
        self
    }
}

impl pwm::Error for NotThere {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl pwm::ErrorType for ServoPwm {
    type Error = NotThere;
}

impl SetDutyCycle for ServoPwm {
    fn max_duty_cycle(&self) -> u16 {
        Self::FRAME
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), NotThere> {
        let runs = of_either!(self, timer => {
            timer.ccr1().write(|w| w.ccr().set(duty));
            timer.cr1().read().cen().bit_is_set()
        });
        if runs { Ok(()) } else { Err(NotThere) }
    }
}

/// TIM3's four channels: the inputs of the motor driver.
struct MotorPwm {
    timer: pac::TIM3,
    /// Counts of a period.
    full: u16,
}

impl MotorPwm {
    /// Periods a second: above what can be heard.
    const FREQUENCY: u32 = 20_000;

    fn new(timer: pac::TIM3, clock: fugit::HertzU32) -> Self {
        let full = u16::try_from(clock.to_Hz() / Self::FREQUENCY).unwrap_or(u16::MAX);
        timer.arr().write(|w| w.arr().set(full.saturating_sub(1)));
        timer.ccmr1_output().write(|w| {
            w.oc1m().pwm_mode1().oc1pe().set_bit();
            w.oc2m().pwm_mode1().oc2pe().set_bit()
        });
        timer.ccmr2_output().write(|w| {
            w.oc3m().pwm_mode1().oc3pe().set_bit();
            w.oc4m().pwm_mode1().oc4pe().set_bit()
        });
        timer
            .ccer()
            .write(|w| w.cc1e().set_bit().cc2e().set_bit().cc3e().set_bit().cc4e().set_bit());
        timer.egr().write(|w| w.ug().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
        Self { timer, full }
    }

    fn set(&mut self, drive: Drive) {
        let [right_1, right_2, left_1, left_2] = drive.inputs(self.full);
        self.timer.ccr1().write(|w| w.ccr().set(right_1));
        self.timer.ccr2().write(|w| w.ccr().set(right_2));
        self.timer.ccr3().write(|w| w.ccr().set(left_1));
        self.timer.ccr4().write(|w| w.ccr().set(left_2));
    }
}

/// The waits of the buses, by the core's clock.
struct Wait {
    cycles_per_microsecond: u32,
}

impl DelayNs for Wait {
    fn delay_ns(&mut self, ns: u32) {
        // At most a microsecond and a half at once.
        cortex_m::asm::delay(ns.saturating_mul(self.cycles_per_microsecond) / 1_000);
    }
}

/// A line of a bus. The module of a sensor has pull-ups; that of the pin keeps the line defined without one.
type Line = ErasedPin<Output<OpenDrain>>;
type Bus = SharedBus<TwoWire<Line, Line, Wait>>;

fn line<const P: char, const N: u8>(pin: Pin<P, N>) -> Line {
    pin.into_open_drain_output().internal_resistor(Pull::Up).erase()
}

fn bus(clock: Line, data: Line, core: fugit::HertzU32) -> Bus {
    let wait = Wait { cycles_per_microsecond: core.to_MHz() };
    SharedBus::new(TwoWire::new(clock, data, wait))
}

/// The loop's side of the link.
struct Uart {
    received: Consumer<'static, u8>,
    to_send: Producer<'static, u8>,
}

/// Within a millisecond, after which bytes are read, at most 12 arrive; a poll sends at most 400.
type Received = Queue<u8, 64>;
type ToSend = Queue<u8, 512>;

impl Uart {
    /// Whether bytes have arrived.
    fn has_bytes(&self) -> bool {
        self.received.ready()
    }

    fn room(&self) -> usize {
        // Without this bound the compiler would guard the divisions by the capacity with a panic.
        let Some(places) = self.to_send.capacity().checked_add(1) else { return 0 };
        places.saturating_sub(1 + self.to_send.len())
    }
}

impl Link for Uart {
    fn receive(&mut self) -> Option<u8> {
        self.received.dequeue()
    }

    fn send(&mut self, frame: &[u8]) {
        // The same bound here.
        let Some(places) = self.to_send.capacity().checked_add(1) else { return };
        if places - self.to_send.len() <= frame.len() {
            return;
        }
        for byte in frame {
            // There is room for the frame.
            let _ = self.to_send.enqueue(*byte);
        }
        rtic::pend(pac::Interrupt::USART2);
    }

    fn has_room(&self, length: usize) -> bool {
        self.room() >= length
    }
}

/// Sectors 2 and 3 of the flash, 16 KiB each, in addresses from the flash's start on.
struct Sectors(pac::FLASH);

/// An error of the flash controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FlashError;

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Sectors {
    type Error = FlashError;
}

impl Sectors {
    const BASE: u32 = 0x0800_0000;
    const SECTOR: u32 = 16 * 1024;

    /// Unlocks the controller for a command, and locks it again. Errors of an earlier command would
    /// count as its own.
    fn unlocked(
        &mut self,
        work: impl FnOnce(&mut pac::FLASH) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        // A controller that is not locked after reset is not there.
        if self.0.cr().read().lock().bit_is_clear() {
            return Err(FlashError);
        }
        for key in [0x4567_0123, 0xCDEF_89AB] {
            self.0.keyr().write(|w| w.key().set(key));
        }
        Self::clear_errors(&self.0);
        let done = work(&mut self.0);
        self.0.cr().write(|w| w.lock().set_bit());
        done
    }

    /// Clears the flags of errors, each of which is cleared by writing 1.
    fn clear_errors(flash: &pac::FLASH) {
        flash.sr().write(|w| {
            w.pgserr().clear_bit_by_one().pgperr().clear_bit_by_one();
            w.pgaerr().clear_bit_by_one().wrperr().clear_bit_by_one();
            w.operr().clear_bit_by_one().eop().clear_bit_by_one()
        });
    }

    /// Waits for the flash. The core, which runs from it, is stalled meanwhile.
    fn finish(flash: &pac::FLASH) -> Result<(), FlashError> {
        while flash.sr().read().bsy().bit_is_set() {}
        let status = flash.sr().read();
        let failed = status.pgserr().bit_is_set()
            || status.pgperr().bit_is_set()
            || status.pgaerr().bit_is_set()
            || status.wrperr().bit_is_set()
            || status.operr().bit_is_set();
        if failed { Err(FlashError) } else { Ok(()) }
    }

    /// Empties the data cache, which the HAL enables: it may hold lines of an erased sector (RM0090,
    /// 3.5.4). It can only be reset while it is off. A write updates it.
    fn flush_data_cache(flash: &pac::FLASH) {
        let was_enabled = flash.acr().read().dcen().bit_is_set();
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().bit(was_enabled));
    }
}

impl ReadNorFlash for Sectors {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        for (address, byte) in (Self::BASE + offset..).zip(bytes) {
            *byte = sectors::read(address);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        memory::store(Self::BASE).end as usize
    }
}

impl NorFlash for Sectors {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = Self::SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        for sector in from / Self::SECTOR..to / Self::SECTOR {
            let number = u8::try_from(sector).map_err(|_| FlashError)?;
            self.unlocked(|flash| {
                sectors::select(flash, number);
                flash.cr().modify(|_, w| w.strt().set_bit());
                let done = Self::finish(flash);
                Self::flush_data_cache(flash);
                done
            })?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.unlocked(|flash| {
            // Without this, the value after a reset would lock the controller again.
            flash.cr().write(|w| w.lock().clear_bit().psize().psize32().pg().set_bit());
            let (words, _) = bytes.as_chunks::<4>();
            for (address, word) in (Self::BASE + offset..).step_by(4).zip(words) {
                sectors::write(flash, address, u32::from_le_bytes(*word));
                Self::finish(flash)?;
            }
            Ok(())
        })
    }
}

/// The store's region of the flash.
#[expect(unsafe_code, reason = "memory that the chip writes and Rust does not know")]
mod sectors {
    use stm32f4xx_hal::pac;

    /// Reads a byte of the store.
    pub fn read(address: u32) -> u8 {
        // SAFETY: `Store` keeps to the region, which is readable; volatile, because it is written.
        unsafe { core::ptr::with_exposed_provenance::<u8>(address as usize).read_volatile() }
    }

    /// Selects the sector to erase.
    pub fn select(controller: &mut pac::FLASH, sector: u8) {
        // SAFETY: `Store` keeps to its region, whose sectors hold neither code nor constants.
        controller.cr().write(|w| unsafe {
            w.lock().clear_bit().psize().psize32().ser().set_bit().snb().bits(sector)
        });
    }

    /// Writes a word of the store. The caller has unlocked the controller.
    pub fn write(_controller: &mut pac::FLASH, address: u32, word: u32) {
        // SAFETY: `Store` keeps to the region, in whole words; no reference to it exists.
        unsafe {
            core::ptr::with_exposed_provenance_mut::<u32>(address as usize).write_volatile(word);
        }
    }
}

/// Disables the motors; the next poll may enable them again.
#[expect(unsafe_code, reason = "the loop owns the pin, which faults and erasures clear")]
fn disable_motors() {
    // SAFETY: a write to this register changes this pin only, in one access.
    let port = unsafe { &*pac::GPIOB::ptr() };
    port.bsrr().write(|w| w.br7().set_bit());
}

/// The independent watchdog: an oscillator of its own clocks it. The loop feeds it, and the flash changes its window.
#[expect(unsafe_code, reason = "the flash is part of what the loop polls")]
mod watchdog {
    use stm32f4xx_hal::pac::{self, iwdg};

    /// Its oscillator, kHz: 17 to 47, 32 as a rule (STM32F405 data sheet, table 41: `f_LSI`).
    const OSCILLATOR: u32 = 32;
    /// Divides it, by the value 3 of the field `PR` (RM0090, 21.4.2).
    const DIVIDER: u32 = 32;

    /// From a pass of the loop to the reset: 226 ms with the slowest oscillator, 82 ms with the fastest.
    pub const WINDOW: u16 = counts(120);
    /// That of the start and of the erasure of a sector, at most 0.5 s: 1.02 s with the fastest oscillator. The motors are
    /// disabled meanwhile.
    pub const LONG_WINDOW: u16 = counts(1_500);

    const fn counts(milliseconds: u32) -> u16 {
        let counts = milliseconds * OSCILLATOR / DIVIDER;
        assert!(counts < 1 << 12);
        #[expect(clippy::cast_possible_truncation, reason = "the field has 12 bits")]
        let counts = counts as u16;
        counts
    }

    fn registers() -> &'static iwdg::RegisterBlock {
        // SAFETY: each access is one write or one read, and no interrupt makes any.
        unsafe { &*pac::IWDG::ptr() }
    }

    /// Starts it. It cannot be stopped.
    pub fn start(window: u16) {
        registers().kr().write(|w| w.key().start());
        set(window);
    }

    /// Starts its window again, with this length.
    pub fn set(window: u16) {
        let watchdog = registers();
        watchdog.kr().write(|w| w.key().unlock());
        watchdog.pr().write(|w| w.pr().divide_by32());
        watchdog.rlr().write(|w| w.rl().set(window));
        // Until the registers are updated, at most five periods of the oscillator, the window before would start again.
        while watchdog.sr().read().bits() != 0 {}
        watchdog.kr().write(|w| w.key().feed());
    }

    /// Starts its window again. The first pass of the loop ends the long one of the start.
    pub fn feed() {
        if registers().rlr().read().rl().bits() == WINDOW {
            registers().kr().write(|w| w.key().feed());
        } else {
            set(WINDOW);
        }
    }
}

/// The flash of the store.
type StoreFlash = Guarded<Sectors, Erasure>;

/// The erasure of a sector, which takes longer than the watchdog's window.
struct Erasure;

impl Guard for Erasure {
    fn begins() {
        disable_motors();
        watchdog::set(watchdog::LONG_WINDOW);
    }

    fn ended() {
        forget_second_echo();
        watchdog::set(watchdog::WINDOW);
    }
}

/// Forgets the edges that TIM12 has stamped and its interrupt has not read. Its count wraps after 65 ms, and only an erasure, which
/// stalls the core, delays the interrupt for longer: it would take an old edge for a later one.
#[expect(unsafe_code, reason = "the interrupt owns the timer")]
fn forget_second_echo() {
    // SAFETY: flags are cleared by one write of 0; the interrupt reads each flag before its stamp.
    let timer = unsafe { &*pac::TIM12::ptr() };
    timer.sr().write(|w| w.cc1if().clear_bit().cc2if().clear_bit());
}

/// Lets the interrupt of the voltage detector end the program when the supply falls below 2.9 V: the level of brown-out resets would be
/// an option of the chip, which a program can set only for good (RM0090, 5.2.3; `PWR_CR`: PLS = 7; line 16 of EXTI).
fn watch_supply(power: &pac::PWR, lines: &pac::EXTI) {
    power.cr().modify(|_, w| w.pls().set(7).pvde().set_bit());
    lines.rtsr().modify(|_, w| w.tr16().set_bit());
    lines.imr().modify(|_, w| w.mr16().set_bit());
}

/// The end of the program: the motors are disabled, and the chip restarts.
fn restart() -> ! {
    disable_motors();
    cortex_m::peripheral::SCB::sys_reset()
}

sonarfix_robot::restart_after_faults!(restart);

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use heapless::spsc::{Consumer, Producer};
    use sonarfix::geometry::units::Instant;
    use sonarfix_app::store::Store;
    use sonarfix_app::watchdog::Liveness;
    use sonarfix_app::{App, FlashContents, boots, log};
    use sonarfix_hal::gyro::Mpu6050;
    use sonarfix_hal::robot::{Devices, WithGyro, WithRangers};
    use sonarfix_link::message::ResetCause;
    use sonarfix_motors::Pattern;
    use sonarfix_robot::guarded::Guarded;
    use sonarfix_robot::{AnyRanger, NextPoll, memory};
    use stm32f4xx_hal::gpio::{ErasedPin, GpioExt, Output, Pin, Pull};
    use stm32f4xx_hal::hal_02::serial::{Read, Write};
    use stm32f4xx_hal::pac::{self, PWR, RTC, TIM1, TIM3, TIM5, TIM8, TIM10, TIM11, TIM12, USART2};
    use stm32f4xx_hal::rcc::{Enable, RccExt};
    use stm32f4xx_hal::serial::{self, Rx, RxListen, SerialExt, Tx, TxISR, TxListen};
    use stm32f4xx_hal::time::Bps;

    use super::alarm::Alarm;
    use super::{
        Bus, ECHO, Encoder, MotorPwm, Received, SECOND_ECHO, Sectors, ServoPwm, StoreFlash, ToSend,
        Uart, bus, line, microseconds, restart, watch_supply, watchdog,
    };

    type Hardware = WithGyro<
        WithRangers<Devices<Encoder<TIM1>, Encoder<TIM8>, ServoPwm, Ranger>, 1>,
        Mpu6050<&'static Bus>,
    >;

    type Ranger = AnyRanger<ErasedPin<Output>, &'static Bus>;

    #[shared]
    struct Shared {
        clock: TIM5,
    }

    #[local]
    struct Local {
        app: App<'static, StoreFlash>,
        hardware: Hardware,
        link: Uart,
        drive: Pin<'B', 7, Output>,
        liveness: Liveness,
        alarm: Alarm,
        backup: RTC,
        motors: MotorPwm,
        second_echo: TIM12,
        rx: (Rx<USART2>, Producer<'static, u8>),
        tx: (Tx<USART2>, Consumer<'static, u8>),
    }

    #[init(local = [
        received: Received = Received::new(),
        to_send: ToSend = ToSend::new(),
        buses: Option<[Bus; 2]> = None,
    ])]
    // Inlined, its stack frame would remain for the whole runtime.
    #[inline(never)]
    fn init(context: init::Context) -> (Shared, Local) {
        // Before anything that can hang, as the start of a clock. All pins are inputs.
        watchdog::start(watchdog::LONG_WINDOW);
        let board = context.device;
        let reset = reset(&board.RCC);
        // The log can be read while the core sleeps.
        board.DBGMCU.cr().modify(|_, w| w.dbg_sleep().set_bit());
        // A program that a probe has halted is not restarted.
        board.DBGMCU.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
        let mut rcc = board.RCC.freeze(super::clocks());
        TIM1::enable(&mut rcc);
        TIM3::enable(&mut rcc);
        TIM5::enable(&mut rcc);
        TIM8::enable(&mut rcc);
        TIM10::enable(&mut rcc);
        TIM11::enable(&mut rcc);
        TIM12::enable(&mut rcc);
        let a = board.GPIOA.split(&mut rcc);
        let b = board.GPIOB.split(&mut rcc);
        let c = board.GPIOC.split(&mut rcc);
        // The pins of encoders, echo, servo and motors belong to the timers from here on.
        let _ = (a.pa8.into_alternate::<1>(), a.pa9.into_alternate::<1>());
        let _ = (c.pc6.into_alternate::<3>(), c.pc7.into_alternate::<3>());
        let _ = (a.pa0.into_alternate::<2>(), b.pb8.into_alternate::<3>());
        let _ = (b.pb14.into_alternate::<9>(), b.pb9.into_alternate::<3>());
        let _ = (a.pa6.into_alternate::<2>(), a.pa7.into_alternate::<2>());
        let _ = (b.pb0.into_alternate::<2>(), b.pb1.into_alternate::<2>());
        let timer_clock = rcc.clocks.timclk1();
        start_clock(&board.TIM5, microseconds(timer_clock));
        let alarm = Alarm::new(context.core.SYST, || board.TIM5.cnt().read().bits());
        start_stamps(&board.TIM12, microseconds(timer_clock));

        let uart = serial::Config::default().baudrate(Bps(115_200));
        // An open line would be received as noise.
        let receiver = a.pa3.into_alternate::<7>().internal_resistor(Pull::Up);
        let uart = board.USART2.serial((a.pa2, receiver), uart, &mut rcc);
        let pulses = [ServoPwm::First(board.TIM10), ServoPwm::Second(board.TIM11)];
        let [first, second] = pulses.map(|pwm| pwm.started(rcc.clocks.timclk2()));
        let servos = (sonarfix_robot::servo(first), sonarfix_robot::servo(second));
        let flash = FlashContents::read(memory::map(), memory::config());
        log::flash_contents(&flash);
        let flash_of_store = Guarded::new(Sectors(board.FLASH));
        let store = Store::new(flash_of_store, memory::store(Sectors::BASE));
        let (Ok(uart), Ok(store)) = (uart, store) else {
            defmt::error!("the store's region or the UART cannot be set up");
            restart();
        };
        PWR::enable(&mut rcc);
        board.PWR.cr().modify(|_, w| w.dbp().set_bit());
        watch_supply(&board.PWR, &board.EXTI);
        let resets = boots::resets(board.RTC.bkpr(0).read().bkp().bits());
        set_resets(&board.RTC, resets.saturating_add(1));
        let board_info = sonarfix_robot::board(reset, resets);
        let app = App::new(board_info, flash, store, Instant::from_ticks(0));
        let [first, second] = context.local.buses.insert([
            bus(line(c.pc0), line(c.pc1), rcc.clocks.sysclk()),
            bus(line(c.pc2), line(c.pc3), rcc.clocks.sysclk()),
        ]);
        let (first, second) = (&*first, &*second);
        let trigger = a.pa1.into_push_pull_output().erase();
        let devices = Devices {
            right: Encoder::new(board.TIM1),
            left: Encoder::new(board.TIM8),
            servo: servos.0,
            ranger: sonarfix_robot::any_ranger(trigger, &ECHO, first),
        };
        let trigger = a.pa4.into_push_pull_output().erase();
        let ranger = sonarfix_robot::any_ranger(trigger, &SECOND_ECHO, second);
        let devices = WithRangers { devices, servos: [servos.1], rangers: [ranger] };
        let hardware = WithGyro { devices, gyro: Mpu6050::new(first) };
        let (tx, mut rx) = uart.split();
        rx.listen();
        let (received, incoming) = context.local.received.split();
        let (to_send, outgoing) = context.local.to_send.split();
        let local = Local {
            app,
            hardware,
            link: Uart { received: incoming, to_send },
            drive: b.pb7.into_push_pull_output(),
            liveness: Liveness::new(Instant::from_ticks(0)),
            backup: board.RTC,
            alarm,
            second_echo: board.TIM12,
            motors: MotorPwm::new(board.TIM3, timer_clock),
            rx: (rx, received),
            tx: (tx, outgoing),
        };
        (Shared { clock: board.TIM5 }, local)
    }

    /// Polls when something is due, and sleeps until then.
    #[idle(shared = [clock], local = [app, hardware, link, drive, liveness, alarm, backup, motors])]
    #[inline(never)]
    fn idle(mut context: idle::Context) -> ! {
        let idle::LocalResources {
            app,
            hardware,
            link,
            drive,
            liveness,
            alarm,
            backup,
            motors,
            ..
        } = context.local;
        let mut now = Instant::from_ticks(0);
        let mut pattern = Pattern::default();
        let mut next_poll = NextPoll::AT_ONCE;
        loop {
            loop {
                let has_edge = ECHO.take_edge() | SECOND_ECHO.take_edge();
                now = context.shared.clock.lock(|clock| advanced(now, clock.cnt().read().bits()));
                let next = next_poll.at(link.has_bytes());
                if has_edge || now >= next {
                    break;
                }
                // An interrupt between this condition and the instruction ends the sleep at once.
                let had_bytes = link.has_bytes();
                cortex_m::interrupt::free(|_| {
                    let has_edge = ECHO.has_edge() || SECOND_ECHO.has_edge();
                    if !has_edge && link.has_bytes() == had_bytes {
                        alarm.sleep(next.ticks().saturating_sub(now.ticks()));
                    }
                });
            }
            let polled = app.poll(now, hardware, link);
            drive.set_state(polled.may_drive.into());
            if polled.is_settled {
                set_resets(backup, 0);
            }
            log::polled(&polled, app.report());
            // The motor code: your own controller takes the place of the example. The loop waits for it, and the telemetry
            // reports its time as that of the poll.
            motors.set(pattern.drive(sonarfix_robot::estimate(app, &polled)));
            let mut clock =
                || context.shared.clock.lock(|clock| advanced(now, clock.cnt().read().bits()));
            if let Some(took) = clock().checked_duration_since(now) {
                app.took(took);
            }
            app.work(now, clock);
            next_poll = sonarfix_robot::next_poll(app, hardware, now, polled.may_drive);
            if liveness.is_alive(now, &polled) {
                watchdog::feed();
            }
        }
    }

    /// The supply falls.
    #[task(binds = PVD, priority = 3)]
    fn supply_falls(_: supply_falls::Context) {
        restart();
    }

    /// Reads the edges of the echo, which the timer has stamped.
    #[task(binds = TIM5, shared = [clock], priority = 2)]
    fn echo(mut context: echo::Context) {
        context.shared.clock.lock(|clock| {
            let status = clock.sr().read();
            let rise = clock.ccr1().read().bits();
            let fall = clock.ccr2().read().bits();
            clock.sr().write(|w| w.cc1if().clear_bit().cc2if().clear_bit());
            if status.cc1if().bit_is_set() {
                ECHO.rose(Instant::from_ticks(rise.into()));
            }
            if status.cc2if().bit_is_set() {
                ECHO.fell(Instant::from_ticks(fall.into()));
            }
        });
    }

    /// Reads the edges of the second echo. The timer has 16 bits; the interrupt is served long before they wrap, but for edges
    /// during an erasure, which are forgotten.
    #[task(binds = TIM8_BRK_TIM12, shared = [clock], local = [second_echo], priority = 2)]
    fn second_echo(mut context: second_echo::Context) {
        let timer = context.local.second_echo;
        let status = timer.sr().read();
        let rise = timer.ccr1().read().ccr().bits();
        let fall = timer.ccr2().read().ccr().bits();
        timer.sr().write(|w| w.cc1if().clear_bit().cc2if().clear_bit());
        let (now, count) = context
            .shared
            .clock
            .lock(|clock| (clock.cnt().read().bits(), timer.cnt().read().cnt().bits()));
        let at = |stamp: u16| {
            let stamp = now.wrapping_sub(count.wrapping_sub(stamp).into());
            Instant::from_ticks(stamp.into())
        };
        if status.cc1if().bit_is_set() {
            SECOND_ECHO.rose(at(rise));
        }
        if status.cc2if().bit_is_set() {
            SECOND_ECHO.fell(at(fall));
        }
    }

    /// Receives a byte, or sends the next one; the loop pends this interrupt when it has bytes to send.
    #[task(binds = USART2, local = [rx, tx])]
    fn uart(context: uart::Context) {
        let uart::LocalResources { rx: (rx, received), tx: (tx, outgoing), .. } = context.local;
        if let Ok(byte) = rx.read() {
            // The loop empties the queue ten times faster than the line fills it.
            let _ = received.enqueue(byte);
        }
        while tx.is_tx_empty() {
            let Some(byte) = outgoing.dequeue() else {
                tx.unlisten();
                return;
            };
            let _ = tx.write(byte);
        }
        tx.listen();
    }

    /// Starts TIM5: it counts microseconds, and stamps both edges at its first pin.
    fn start_clock(timer: &TIM5, divider: u16) {
        timer.psc().write(|w| w.psc().set(divider));
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().set_bit());
        // Both channels capture the first pin, through a filter of eight clocks.
        timer.ccmr1_input().write(|w| {
            w.cc1s().ti1().ic1f().fck_int_n8();
            w.cc2s().ti1().ic2f().set(0b11)
        });
        timer.ccer().write(|w| {
            w.cc1e().set_bit().cc1p().clear_bit();
            w.cc2e().set_bit().cc2p().set_bit()
        });
        timer.dier().write(|w| w.cc1ie().set_bit().cc2ie().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
    }

    /// Starts TIM12: it counts microseconds, and stamps both edges at its first pin.
    fn start_stamps(timer: &TIM12, divider: u16) {
        timer.psc().write(|w| w.psc().set(divider));
        timer.arr().write(|w| w.arr().set(u16::MAX));
        timer.egr().write(|w| w.ug().set_bit());
        timer.ccmr1_input().write(|w| {
            w.cc1s().ti1().ic1f().fck_int_n8();
            w.cc2s().ti1().ic2f().set(0b11)
        });
        timer.ccer().write(|w| {
            w.cc1e().set_bit().cc1p().clear_bit();
            w.cc2e().set_bit().cc2p().set_bit()
        });
        timer.sr().write(|w| w.cc1if().clear_bit().cc2if().clear_bit());
        timer.dier().write(|w| w.cc1ie().set_bit().cc2ie().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
    }

    /// The time from its low 32 bits, shortly after `then`.
    fn advanced(then: Instant, count: u32) -> Instant {
        #[expect(clippy::cast_possible_truncation, reason = "the low bits are what is asked for")]
        let elapsed = count.wrapping_sub(then.ticks() as u32);
        Instant::from_ticks(then.ticks().saturating_add(elapsed.into()))
    }

    /// Counts the resets in a row in a register of the backup domain, which survives them and not a
    /// power loss.
    fn set_resets(backup: &RTC, resets: u8) {
        backup.bkpr(0).write(|w| w.bkp().set(boots::register(resets)));
    }

    /// The cause of the reset; clears the flags.
    fn reset(rcc: &pac::RCC) -> ResetCause {
        let flags = rcc.csr().read();
        rcc.csr().modify(|_, w| w.rmvf().set_bit());
        if flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set() {
            ResetCause::Watchdog
        } else if flags.sftrstf().bit_is_set() {
            ResetCause::Software
        } else if flags.porrstf().bit_is_set() {
            ResetCause::PowerOn
        } else if flags.borrstf().bit_is_set() {
            ResetCause::BrownOut
        } else if flags.padrstf().bit_is_set() {
            ResetCause::Pin
        } else {
            ResetCause::Unknown
        }
    }
}
