//! The driver of the LSM6DSO on a bus.

use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
use proptest::prelude::*;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::gyro::{GyroError, Lsm6dso, Unreadable, YawRate};

use super::{lost, parameters};

/// The transfers that configure the sensor at this address for a range.
fn configuration(address: u8, range: u8) -> Vec<I2c> {
    let values = [(0x12, 0x44), (0x13, 0), (0x16, 0), (0x11, 0x60 | range << 2)];
    super::configuration(address, (0x0f, 0x6c), values)
}

proptest! {
    /// Every count is the rate of the data sheet, table 2, in the smallest range that suffices.
    #[test]
    fn a_count_is_a_rate(count in any::<i16>(), number in 0_u8..4, spare in 0.51_f32..=1.0, is_inverted in any::<bool>()) {
        let range = 250.0 * f32::from(1_u8 << number);
        let mut transfers = configuration(0x6b, number);
        transfers.push(I2c::write_read(0x6b, vec![0x26], count.to_le_bytes().to_vec()));
        let mut bus = Mock::new(&transfers);
        let mut gyro = Lsm6dso::new(bus.clone());
        gyro.configure(&parameters(range * spare, is_inverted)).unwrap();
        let rate = f64::from(gyro.rate().unwrap().to_degrees());
        let expected = 8.75e-3 * f64::from(1_u8 << number) * f64::from(count);
        let expected = if is_inverted { -expected } else { expected };
        prop_assert!((rate - expected).abs() <= 1e-6 * expected.abs() + 1e-9, "{rate} {expected}");
        bus.done();
    }
}

#[test]
fn sa0_low_is_another_address() {
    let mut bus = Mock::new(&configuration(0x6a, 0));
    let mut gyro = Lsm6dso::new(bus.clone()).with_sa0_low();
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Ok(()));
    bus.done();
}

#[test]
fn another_device_and_a_range_beyond_its_own_are_refused() {
    let mut bus = Mock::new(&[I2c::write_read(0x6b, vec![0x0f], vec![0x12])]);
    let mut gyro = Lsm6dso::new(bus.clone());
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Err(GyroError::Identity(0x12)));
    assert_eq!(gyro.configure(&parameters(2_100.0, false)), Err(GyroError::Range));
    bus.done();
}

#[test]
fn a_bus_without_an_answer_is_an_error() {
    let mut transfers = vec![I2c::write_read(0x6b, vec![0x0f], vec![0]).with_error(lost())];
    transfers.extend(configuration(0x6b, 0));
    transfers.push(I2c::write_read(0x6b, vec![0x26], vec![0, 0]).with_error(lost()));
    let mut bus = Mock::new(&transfers);
    let mut gyro = Lsm6dso::new(bus.clone());
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Err(GyroError::Bus));
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Ok(()));
    assert_eq!(gyro.rate(), Err(Unreadable));
    bus.done();
}
