//! The registers of a gyro on I²C.

use embedded_hal::i2c::I2c;

use super::{GyroError, Unreadable};

/// A sensor at an address of a bus.
#[derive(Debug)]
pub(super) struct Registers<B> {
    pub bus: B,
    pub address: u8,
}

impl<B: I2c> Registers<B> {
    /// Reads the identity of the sensor.
    ///
    /// # Errors
    /// [`GyroError::Bus`], or [`GyroError::Identity`] if it is none of these.
    pub fn identify(&mut self, register: u8, known: &[u8]) -> Result<(), GyroError> {
        let mut identity = [0];
        let read = self.bus.write_read(self.address, &[register], &mut identity);
        read.map_err(|_| GyroError::Bus)?;
        let [identity] = identity;
        if known.contains(&identity) { Ok(()) } else { Err(GyroError::Identity(identity)) }
    }

    /// Writes values to registers, in this order.
    pub fn write<const N: usize>(&mut self, values: [(u8, u8); N]) -> Result<(), GyroError> {
        values.into_iter().try_for_each(|(register, value)| {
            self.bus.write(self.address, &[register, value]).map_err(|_| GyroError::Bus)
        })
    }

    /// Two bytes from this register on.
    pub fn two_bytes(&mut self, register: u8) -> Result<[u8; 2], Unreadable> {
        let mut bytes = [0; 2];
        let read = self.bus.write_read(self.address, &[register], &mut bytes);
        read.map_err(|_| Unreadable)?;
        Ok(bytes)
    }
}
