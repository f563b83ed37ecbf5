//! The first UART of ARM's MPS2 boards (CMSDK APB UART, DDI 0479) as a stream of bytes, polled.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};

/// The registers.
#[repr(C)]
struct Registers {
    data: u32,
    state: u32,
    control: u32,
    interrupt: u32,
    divider: u32,
}

const BASE: usize = 0x4000_4000;
const SENDER_FULL: u32 = 1;
const RECEIVER_FULL: u32 = 1 << 1;
const ENABLE_BOTH: u32 = 0b11;
/// 25 MHz to 115,200 baud; the emulator accepts any divider from 16 on.
const DIVIDER: u32 = 217;

/// The UART.
pub struct Uart(*mut Registers);

impl Uart {
    /// Enables the UART.
    #[must_use]
    pub fn open() -> Self {
        let uart = Self(core::ptr::with_exposed_provenance_mut(BASE));
        // SAFETY: the UART's registers are at this address, and nothing else uses them.
        unsafe {
            (&raw mut (*uart.0).divider).write_volatile(DIVIDER);
            (&raw mut (*uart.0).control).write_volatile(ENABLE_BOTH);
        }
        uart
    }

    fn state(&self) -> u32 {
        // SAFETY: as above.
        unsafe { (&raw const (*self.0).state).read_volatile() }
    }
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let Some(byte) = bytes.first_mut() else { return Ok(0) };
        while self.state() & RECEIVER_FULL == 0 {}
        // SAFETY: as above. A byte has arrived.
        let word = unsafe { (&raw const (*self.0).data).read_volatile() };
        let [low, ..] = word.to_le_bytes();
        *byte = low;
        Ok(1)
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let Some(&byte) = bytes.first() else { return Ok(0) };
        while self.state() & SENDER_FULL != 0 {}
        // SAFETY: as above. There is room.
        unsafe { (&raw mut (*self.0).data).write_volatile(byte.into()) };
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
