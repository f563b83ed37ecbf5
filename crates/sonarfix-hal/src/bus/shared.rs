//! One bus for several drivers.

use core::cell::RefCell;

use embedded_hal::i2c::{Error as _, ErrorKind, ErrorType, I2c, Operation};

/// A bus that drivers of one task use in turn; each has a reference to it.
///
/// ```
/// # fn wired(bus: impl embedded_hal::i2c::I2c) {
/// use sonarfix_hal::bus::SharedBus;
/// use sonarfix_hal::gyro::Mpu6050;
/// use sonarfix_hal::ranger::Vl53l1x;
///
/// let bus = SharedBus::new(bus);
/// let (gyro, ranger) = (Mpu6050::new(&bus), Vl53l1x::new(&bus));
/// # }
/// ```
#[derive(Debug)]
pub struct SharedBus<B>(RefCell<B>);

impl<B> SharedBus<B> {
    /// Shares a bus.
    pub const fn new(bus: B) -> Self {
        Self(RefCell::new(bus))
    }
}

impl<B> ErrorType for &SharedBus<B> {
    type Error = ErrorKind;
}

impl<B: I2c> I2c for &SharedBus<B> {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        // A transfer within a transfer cannot occur in one task; it would be an error.
        let Ok(mut bus) = self.0.try_borrow_mut() else { return Err(ErrorKind::Other) };
        bus.transaction(address, operations).map_err(|error| error.kind())
    }
}
