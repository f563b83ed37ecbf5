//! An I²C master on two open-drain pins, whose every transfer ends.
//!
//! The I²C blocks of microcontrollers wait for a device that holds the clock low, and so do their drivers without a timeout: a gyro that hangs, or
//! a loose wire, would stop the loop. This master gives up after [`MOST_STRETCHES`] microseconds, and frees a device that holds the data
//! line with up to nine clocks (NXP UM10204, 3.1.16). It waits for its bits: a reading of a gyro, 5 bytes and 3 conditions, takes 0.3 ms.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// Half of a clock, ns: a device of 400 kHz needs 1.3 µs (UM10204, table 10).
const HALF: u32 = 1_300;
/// Microseconds for which a device may hold the clock low; an MPU-6050 never does.
pub const MOST_STRETCHES: u32 = 100;
/// Clocks after which a device has sent the byte that it was interrupted in.
const FREEING_CLOCKS: u8 = 9;

/// The master. A pin is open-drain with a pull-up: high releases the line, and its level can be read.
///
/// ```
/// # fn wired(scl: impl embedded_hal::digital::OutputPin + embedded_hal::digital::InputPin,
/// #     sda: impl embedded_hal::digital::OutputPin + embedded_hal::digital::InputPin,
/// #     delay: impl embedded_hal::delay::DelayNs) {
/// use sonarfix_hal::bus::TwoWire;
/// use sonarfix_hal::gyro::Mpu6050;
/// let gyro = Mpu6050::new(TwoWire::new(scl, sda, delay));
/// # }
/// ```
#[derive(Debug)]
pub struct TwoWire<C, D, W> {
    clock: C,
    data: D,
    delay: W,
}

impl<C, D, W> TwoWire<C, D, W>
where
    C: OutputPin + InputPin,
    D: OutputPin + InputPin,
    W: DelayNs,
{
    /// A master on released lines.
    pub fn new(clock: C, data: D, delay: W) -> Self {
        Self { clock, data, delay }
    }

    fn set_data(&mut self, is_high: bool) -> Result<(), ErrorKind> {
        self.data.set_state(is_high.into()).map_err(|_| ErrorKind::Bus)
    }

    fn data_is_high(&mut self) -> Result<bool, ErrorKind> {
        self.data.is_high().map_err(|_| ErrorKind::Bus)
    }

    fn wait(&mut self) {
        self.delay.delay_ns(HALF);
    }

    /// Releases the clock, and waits until no device holds it.
    fn raise_clock(&mut self) -> Result<(), ErrorKind> {
        self.clock.set_high().map_err(|_| ErrorKind::Bus)?;
        for _ in 0..MOST_STRETCHES {
            if self.clock.is_high().map_err(|_| ErrorKind::Bus)? {
                self.wait();
                return Ok(());
            }
            self.delay.delay_us(1);
        }
        Err(ErrorKind::Bus)
    }

    fn lower_clock(&mut self) -> Result<(), ErrorKind> {
        self.clock.set_low().map_err(|_| ErrorKind::Bus)?;
        self.wait();
        Ok(())
    }

    /// A start or repeated start.
    fn start(&mut self) -> Result<(), ErrorKind> {
        self.set_data(true)?;
        self.wait();
        self.raise_clock()?;
        for _ in 0..FREEING_CLOCKS {
            if self.data_is_high()? {
                break;
            }
            self.lower_clock()?;
            self.raise_clock()?;
        }
        if !self.data_is_high()? {
            return Err(ErrorKind::Bus);
        }
        self.set_data(false)?;
        self.wait();
        self.lower_clock()
    }

    fn stop(&mut self) -> Result<(), ErrorKind> {
        self.set_data(false)?;
        self.wait();
        self.raise_clock()?;
        self.set_data(true)?;
        self.wait();
        Ok(())
    }

    fn write_bit(&mut self, bit: bool) -> Result<(), ErrorKind> {
        self.set_data(bit)?;
        self.wait();
        self.raise_clock()?;
        self.lower_clock()
    }

    fn read_bit(&mut self) -> Result<bool, ErrorKind> {
        self.set_data(true)?;
        self.wait();
        self.raise_clock()?;
        let bit = self.data_is_high()?;
        self.lower_clock()?;
        Ok(bit)
    }

    fn write_byte(&mut self, byte: u8, source: NoAcknowledgeSource) -> Result<(), ErrorKind> {
        for bit in (0..8).rev() {
            self.write_bit(byte >> bit & 1 == 1)?;
        }
        if self.read_bit()? { Err(ErrorKind::NoAcknowledge(source)) } else { Ok(()) }
    }

    fn read_byte(&mut self, is_last: bool) -> Result<u8, ErrorKind> {
        let mut byte = 0;
        for _ in 0..8 {
            byte = byte << 1 | u8::from(self.read_bit()?);
        }
        self.write_bit(is_last)?;
        Ok(byte)
    }

    fn transfer(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let mut direction = None;
        let mut rest = operations;
        while let [operation, after @ ..] = rest {
            let is_read = matches!(operation, Operation::Read(_));
            if direction != Some(is_read) {
                self.start()?;
                let byte = address << 1 | u8::from(is_read);
                self.write_byte(byte, NoAcknowledgeSource::Address)?;
                direction = Some(is_read);
            }
            match operation {
                Operation::Write(bytes) => {
                    for byte in *bytes {
                        self.write_byte(*byte, NoAcknowledgeSource::Data)?;
                    }
                }
                Operation::Read(bytes) => {
                    let more = continues(after);
                    let mut left = bytes.len();
                    for byte in bytes.iter_mut() {
                        left = left.saturating_sub(1);
                        *byte = self.read_byte(left == 0 && !more)?;
                    }
                }
            }
            rest = after;
        }
        Ok(())
    }
}

/// Whether a byte is read by the next operations, without a condition between.
fn continues(after: &[Operation<'_>]) -> bool {
    let lengths = after.iter().map_while(|next| match next {
        Operation::Read(bytes) => Some(bytes.len()),
        Operation::Write(_) => None,
    });
    lengths.sum::<usize>() > 0
}

impl<C, D, W> ErrorType for TwoWire<C, D, W> {
    type Error = ErrorKind;
}

impl<C, D, W> I2c for TwoWire<C, D, W>
where
    C: OutputPin + InputPin,
    D: OutputPin + InputPin,
    W: DelayNs,
{
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        let transferred = self.transfer(address, operations);
        let stopped = self.stop();
        transferred.and(stopped)
    }
}
