//! LSM6DSO on I²C, and the LSM6DSOX, which has the same registers.
//!
//! By the maker's data sheet *LSM6DSO*, DS12140, rev. 2. The driver sets 417 samples a second, whose low-pass filter has 136 Hz
//! (table 18), in the mode of high performance and without a high-pass filter, which would remove slow turns; and the smallest range that
//! includes the configured one. The accelerometer stays off. A reading is one transfer of two bytes, 0.1 ms at 400 kHz.

use embedded_hal::i2c::I2c;
use sonarfix::geometry::units::RadiansPerSecond;
use sonarfix::sensor::gyro::GyroParameters;

use super::registers::Registers;
use super::{GyroError, Unreadable, YawRate, range, times_two};

/// The address with SA0 high, as on the boards of the XRP; with SA0 low it is one less.
const ADDRESS: u8 = 0x6B;

const WHO_AM_I: u8 = 0x0F;
const CTRL2_G: u8 = 0x11;
const CTRL3_C: u8 = 0x12;
const CTRL4_C: u8 = 0x13;
const CTRL7_G: u8 = 0x16;
const GYRO_Z: u8 = 0x26;

/// `WHO_AM_I` of both.
const IDENTITY: u8 = 0x6C;
/// Both bytes of a reading are of one sample (`BDU`), and the address increases within a transfer (`IF_INC`).
const BOTH_BYTES: u8 = 0x44;
/// Awake, LPF1 off.
const AWAKE: u8 = 0;
/// High performance, high-pass filter off.
const UNFILTERED: u8 = 0;
/// 417 samples a second (`ODR_G`); the number of the range is beside it (`FS_G`).
const SAMPLES: u8 = 0b0110 << 4;
/// A count of the smallest range, °/s (`G_So`).
const COUNT: f32 = 8.75e-3;

/// The driver.
///
/// ```
/// use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
/// use sonarfix::sensor::gyro::GyroParameters;
/// use sonarfix_hal::gyro::{Lsm6dso, YawRate};
/// let mut bus = Mock::new(&[
///     I2c::write_read(0x6b, vec![0x0f], vec![0x6c]),
///     I2c::write(0x6b, vec![0x12, 0x44]),
///     I2c::write(0x6b, vec![0x13, 0]),
///     I2c::write(0x6b, vec![0x16, 0]),
///     I2c::write(0x6b, vec![0x11, 0x60]),
///     I2c::write_read(0x6b, vec![0x26], vec![0x72, 0x00]),
/// ]);
/// let mut gyro = Lsm6dso::new(bus.clone());
/// gyro.configure(&GyroParameters::MPU_6050)?;
/// // 114 counts of 8.75 m°/s.
/// assert!((gyro.rate().unwrap().to_degrees() - 0.9975).abs() < 1e-4);
/// bus.done();
/// # Ok::<(), sonarfix_hal::gyro::GyroError>(())
/// ```
#[derive(Debug)]
pub struct Lsm6dso<B> {
    registers: Registers<B>,
    /// Radians per second of one count, negative if the sensor is mounted upside down.
    per_count: f32,
}

impl<B: I2c> Lsm6dso<B> {
    /// A driver for the sensor with SA0 high.
    pub fn new(bus: B) -> Self {
        Self { registers: Registers { bus, address: ADDRESS }, per_count: 0.0 }
    }

    /// The same with SA0 low.
    #[must_use]
    pub fn with_sa0_low(mut self) -> Self {
        self.registers.address = ADDRESS - 1;
        self
    }
}

impl<B: I2c> YawRate for Lsm6dso<B> {
    type Error = GyroError;

    fn configure(&mut self, parameters: &GyroParameters) -> Result<(), GyroError> {
        let number = range(parameters)?;
        self.registers.identify(WHO_AM_I, &[IDENTITY])?;
        self.registers.write([
            (CTRL3_C, BOTH_BYTES),
            (CTRL4_C, AWAKE),
            (CTRL7_G, UNFILTERED),
            (CTRL2_G, SAMPLES | number << 2),
        ])?;
        let sign = if parameters.is_inverted { -1.0 } else { 1.0 };
        self.per_count = sign * RadiansPerSecond::from_degrees(times_two(COUNT, number)).0;
        Ok(())
    }

    fn rate(&mut self) -> Result<RadiansPerSecond, Unreadable> {
        let bytes = self.registers.two_bytes(GYRO_Z)?;
        Ok(RadiansPerSecond(self.per_count * f32::from(i16::from_le_bytes(bytes))))
    }
}
