//! MPU-6050 on I²C, and the MPU-6500 and MPU-9250, which have the same registers.
//!
//! By the maker's *MPU-6000 and MPU-6050 Register Map*, rev. 4.2. The driver wakes the sensor with the clock of its gyro,
//! sets the smallest range that includes the configured one, and the low-pass filter of 98 Hz, whose delay is 2.8 ms.
//! A reading is one transfer of two bytes, 0.1 ms at 400 kHz. Why not an existing crate: `docs/decisions.md`.

use embedded_hal::i2c::I2c;
use sonarfix::geometry::units::RadiansPerSecond;
use sonarfix::sensor::gyro::GyroParameters;

use super::registers::Registers;
use super::{GyroError, SMALLEST_RANGE, Unreadable, YawRate, range, times_two};

/// The address with AD0 low; with AD0 high it is one more.
const ADDRESS: u8 = 0x68;

const SAMPLE_RATE_DIVIDER: u8 = 0x19;
const CONFIG: u8 = 0x1A;
const GYRO_CONFIG: u8 = 0x1B;
const GYRO_Z: u8 = 0x47;
const POWER: u8 = 0x6B;
const WHO_AM_I: u8 = 0x75;

/// `WHO_AM_I` of MPU-6050, MPU-6500 and MPU-9250.
const IDENTITIES: [u8; 3] = [0x68, 0x70, 0x71];
/// Awake, with the clock of the gyro's x axis.
const AWAKE: u8 = 1;
/// Low-pass filter of 98 Hz.
const FILTER: u8 = 2;
/// The filter's output has 1,000 samples a second, each of which is kept.
const EVERY_SAMPLE: u8 = 0;
/// Counts at the end of the range.
const FULL_SCALE: f32 = 32_768.0;

/// The driver.
///
/// ```
/// use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
/// use sonarfix::sensor::gyro::GyroParameters;
/// use sonarfix_hal::gyro::{Mpu6050, YawRate};
/// let mut bus = Mock::new(&[
///     I2c::write_read(0x68, vec![0x75], vec![0x68]),
///     I2c::write(0x68, vec![0x6b, 1]),
///     I2c::write(0x68, vec![0x19, 0]),
///     I2c::write(0x68, vec![0x1a, 2]),
///     I2c::write(0x68, vec![0x1b, 0]),
///     I2c::write_read(0x68, vec![0x47], vec![0x00, 0x83]),
/// ]);
/// let mut gyro = Mpu6050::new(bus.clone());
/// gyro.configure(&GyroParameters::MPU_6050)?;
/// // 131 counts are 1°/s in the range of 250°/s.
/// assert!((gyro.rate().unwrap().to_degrees() - 1.0).abs() < 1e-3);
/// bus.done();
/// # Ok::<(), sonarfix_hal::gyro::GyroError>(())
/// ```
#[derive(Debug)]
pub struct Mpu6050<B> {
    registers: Registers<B>,
    /// Radians per second of one count, negative if the sensor is mounted upside down.
    per_count: f32,
}

impl<B: I2c> Mpu6050<B> {
    /// A driver for the sensor with AD0 low.
    pub fn new(bus: B) -> Self {
        Self { registers: Registers { bus, address: ADDRESS }, per_count: 0.0 }
    }

    /// The same with AD0 high.
    #[must_use]
    pub fn with_ad0_high(mut self) -> Self {
        self.registers.address = ADDRESS + 1;
        self
    }
}

impl<B: I2c> YawRate for Mpu6050<B> {
    type Error = GyroError;

    fn configure(&mut self, parameters: &GyroParameters) -> Result<(), GyroError> {
        let number = range(parameters)?;
        self.registers.identify(WHO_AM_I, &IDENTITIES)?;
        self.registers.write([
            (POWER, AWAKE),
            (SAMPLE_RATE_DIVIDER, EVERY_SAMPLE),
            (CONFIG, FILTER),
            (GYRO_CONFIG, number << 3),
        ])?;
        let full = RadiansPerSecond::from_degrees(times_two(SMALLEST_RANGE, number));
        let sign = if parameters.is_inverted { -1.0 } else { 1.0 };
        self.per_count = sign * full.0 / FULL_SCALE;
        Ok(())
    }

    fn rate(&mut self) -> Result<RadiansPerSecond, Unreadable> {
        let bytes = self.registers.two_bytes(GYRO_Z)?;
        Ok(RadiansPerSecond(self.per_count * f32::from(i16::from_be_bytes(bytes))))
    }
}
