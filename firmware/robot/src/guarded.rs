//! A flash whose sectors take longer to erase than the watchdog's window.

use core::marker::PhantomData;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// What a board does around the erasure of a sector.
pub trait Guard {
    /// Disables the motors and lets the watchdog wait for the erasure. The next poll of the loop enables them again.
    fn begins();
    /// Returns the watchdog to its window.
    fn ended();
}

/// A flash that erases sector by sector, each between the calls of a [`Guard`].
///
/// A program that hangs in an erasure is restarted later than within the window, but its motors are off.
pub struct Guarded<F, G> {
    flash: F,
    guard: PhantomData<G>,
}

impl<F, G> Guarded<F, G> {
    /// Guards this flash.
    pub const fn new(flash: F) -> Self {
        Self { flash, guard: PhantomData }
    }
}

impl<F: ErrorType, G> ErrorType for Guarded<F, G> {
    type Error = F::Error;
}

impl<F: ReadNorFlash, G> ReadNorFlash for Guarded<F, G> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash, G: Guard> NorFlash for Guarded<F, G> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        let mut sector = from;
        while sector < to {
            let end =
                sector.saturating_add(u32::try_from(F::ERASE_SIZE).unwrap_or(u32::MAX)).min(to);
            G::begins();
            let erased = self.flash.erase(sector, end);
            G::ended();
            erased?;
            sector = end;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(offset, bytes)
    }
}
