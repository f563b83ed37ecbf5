//! The parts of the board. Replace each by that of your chip, from the top; a part that is missing is a compile error with the
//! name of its trait. After the clock and the link the robot sends `Hello`; each further part removes a fault from it.
//!
//! | part | trait or function |
//! |---|---|
//! | clock | [`Clock::now`] |
//! | link to the PC | [`Link`] |
//! | encoders | [`Counter`] |
//! | servo | [`SetDutyCycle`] |
//! | sonar | [`OutputPin`] for the trigger, and edges for [`ECHO`] |
//! | flash | [`ReadNorFlash`], [`NorFlash`] |
//! | enable and inputs of the motor driver, watchdog, count of resets | [`Enable`], [`Motors`], [`Watchdog`], [`Resets`] |

use core::cell::Cell;
use core::convert::Infallible;
use core::ops::Range;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_storage::nor_flash::{
    self, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use heapless::Deque;
use sonarfix::geometry::units::Instant;
use sonarfix_app::Link;
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::EchoCapture;
use sonarfix_link::message::ResetCause;
use sonarfix_motors::Drive;

/// The edges of the echo. The interrupt of the echo's pin calls `ECHO.rose(now)` and `ECHO.fell(now)`; a timer that stamps
/// edges passes them by `sonarfix_hal::ranger::StampedEdges`, as on the Pico 2.
pub static ECHO: EchoCapture = EchoCapture::new();

/// All parts.
pub struct Board {
    pub clock: Clock,
    pub right: Encoder,
    pub left: Encoder,
    pub pulses: Pulses,
    pub trigger: Trigger,
    pub link: Serial,
    pub flash: Flash,
    pub enable: Enable,
    pub motors: Motors,
    pub watchdog: Watchdog,
    pub resets: Resets,
}

impl Board {
    /// Starts clocks, timers and pins of the chip.
    pub fn start() -> Self {
        Self {
            clock: Clock::start(),
            right: Encoder,
            left: Encoder,
            pulses: Pulses,
            trigger: Trigger,
            link: Serial::open(),
            flash: Flash([0xFF; FLASH_BYTES]),
            enable: Enable,
            motors: Motors,
            watchdog: Watchdog,
            resets: Resets,
        }
    }
}

/// A register of the emulated board.
fn register(address: usize) -> *mut u32 {
    core::ptr::with_exposed_provenance_mut(address)
}

/// Microseconds since the start: a timer of 32 bits at 25 MHz that counts down, read at least every two minutes.
pub struct Clock {
    last: Cell<u32>,
    ticks: Cell<u64>,
}

impl Clock {
    const CONTROL: usize = 0x4000_0000;
    const VALUE: usize = 0x4000_0004;
    const RELOAD: usize = 0x4000_000C;

    fn start() -> Self {
        // SAFETY: the registers of the board's first timer, which nothing else uses.
        unsafe {
            register(Self::RELOAD).write_volatile(u32::MAX);
            register(Self::VALUE).write_volatile(u32::MAX);
            register(Self::CONTROL).write_volatile(1);
        }
        Self { last: Cell::new(0), ticks: Cell::new(0) }
    }

    /// The time since the start.
    pub fn now(&self) -> Instant {
        // SAFETY: as above.
        let count = !unsafe { register(Self::VALUE).read_volatile() };
        let passed = count.wrapping_sub(self.last.replace(count));
        self.ticks.set(self.ticks.get() + u64::from(passed));
        Instant::from_ticks(self.ticks.get() / 25)
    }
}

/// The link to the PC: a UART of 115,200 baud, 8N1. Without an interrupt its bytes are read by polls, at most a millisecond apart
/// while there are any.
pub struct Serial {
    /// A poll sends at most 400 bytes.
    to_send: Deque<u8, 512>,
}

impl Serial {
    const DATA: usize = 0x4000_4000;
    const STATE: usize = 0x4000_4004;
    const CONTROL: usize = 0x4000_4008;
    const DIVIDER: usize = 0x4000_4010;
    const SENDER_FULL: u32 = 1;
    const RECEIVER_FULL: u32 = 1 << 1;

    fn open() -> Self {
        // SAFETY: the registers of the board's first UART, which nothing else uses.
        unsafe {
            register(Self::DIVIDER).write_volatile(25_000_000 / 115_200);
            register(Self::CONTROL).write_volatile(0b11);
        }
        Self { to_send: Deque::new() }
    }

    fn is(state: u32) -> bool {
        // SAFETY: as above.
        unsafe { register(Self::STATE).read_volatile() & state != 0 }
    }

    /// Whether bytes have arrived.
    pub fn has_bytes(&self) -> bool {
        Self::is(Self::RECEIVER_FULL)
    }

    /// Writes as many bytes as the UART accepts.
    pub fn transmit(&mut self) {
        while !Self::is(Self::SENDER_FULL)
            && let Some(byte) = self.to_send.pop_front()
        {
            // SAFETY: as above.
            unsafe { register(Self::DATA).write_volatile(byte.into()) };
        }
    }
}

impl Link for Serial {
    fn receive(&mut self) -> Option<u8> {
        if !Self::is(Self::RECEIVER_FULL) {
            return None;
        }
        // SAFETY: as above.
        let [byte, ..] = unsafe { register(Self::DATA).read_volatile() }.to_le_bytes();
        Some(byte)
    }

    fn send(&mut self, frame: &[u8]) {
        if self.to_send.capacity() - self.to_send.len() >= frame.len() {
            self.to_send.extend(frame.iter().copied());
        }
    }
}

/// A counter of wheel edges. The emulated board has none: the robot reports the fault.
pub struct Encoder;

/// There is no counter.
#[derive(Debug)]
pub struct Absent;

impl Counter for Encoder {
    type Error = Absent;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Absent> {
        Err(Absent)
    }
}

/// The servo's pulses: a PWM channel of 50 Hz. The emulated board has none.
pub struct Pulses;

impl pwm::ErrorType for Pulses {
    type Error = Infallible;
}

impl SetDutyCycle for Pulses {
    fn max_duty_cycle(&self) -> u16 {
        20_000
    }

    fn set_duty_cycle(&mut self, _duty: u16) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The sonar's trigger. The emulated board has none.
pub struct Trigger;

impl digital::ErrorType for Trigger {
    type Error = Infallible;
}

impl OutputPin for Trigger {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The flash of the store. This one is in RAM and forgets; your chip's driver takes `sonarfix_robot::memory::store`.
pub struct Flash([u8; FLASH_BYTES]);

/// Two sectors.
const FLASH_BYTES: usize = 2 * 4096;

/// The region of the store in the flash's own addresses.
pub fn store() -> Range<u32> {
    0..8192
}

impl nor_flash::ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let from = offset as usize;
        bytes.copy_from_slice(&self.0[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (held, byte) in self.0[offset as usize..].iter_mut().zip(bytes) {
            *held &= byte;
        }
        Ok(())
    }
}

/// The enable pin of the motor driver, low at the start. The emulated board has none.
pub struct Enable;

impl Enable {
    pub fn set(&mut self, _may_drive: bool) {}
}

/// The inputs of the motor driver: four PWM channels of about 20 kHz, which [`Drive::inputs`] gives the counts of. The
/// emulated board has none.
pub struct Motors;

impl Motors {
    pub fn set(&mut self, _drive: Drive) {}
}

/// The watchdog, and the cause of the reset: a window of at most 250 ms, and a longer one for the start and while a sector of flash is
/// erased, when the motors are disabled (`sonarfix_robot::guarded`). The emulated board has none.
pub struct Watchdog;

impl Watchdog {
    pub fn reset(&self) -> ResetCause {
        ResetCause::Unknown
    }

    pub fn feed(&mut self) {}
}

/// A register that survives a reset but not a power loss. The emulated board has none.
pub struct Resets;

impl Resets {
    pub fn read(&self) -> u32 {
        0
    }

    pub fn write(&self, _value: u32) {}
}
