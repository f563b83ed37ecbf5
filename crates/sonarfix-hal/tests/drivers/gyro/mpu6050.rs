//! The gyro's driver on a bus.

use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
use proptest::prelude::*;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::gyro::{GyroError, Mpu6050, Unreadable, YawRate};

use super::{lost, parameters};

/// The transfers that configure the sensor at this address for a range.
fn configuration(address: u8, identity: u8, range: u8) -> Vec<I2c> {
    let values = [(0x6b, 1), (0x19, 0), (0x1a, 2), (0x1b, range << 3)];
    super::configuration(address, (0x75, identity), values)
}

proptest! {
    /// Every count is the rate of the datasheet: 32,768 counts are the range, which is the smallest that suffices.
    #[test]
    fn a_count_is_a_rate(count in any::<i16>(), number in 0_u8..4, spare in 0.51_f32..=1.0, is_inverted in any::<bool>()) {
        let range = 250.0 * f32::from(1_u8 << number);
        let mut transfers = configuration(0x68, 0x68, number);
        transfers.push(I2c::write_read(0x68, vec![0x47], count.to_be_bytes().to_vec()));
        let mut bus = Mock::new(&transfers);
        let mut gyro = Mpu6050::new(bus.clone());
        gyro.configure(&parameters(range * spare, is_inverted)).unwrap();
        let rate = f64::from(gyro.rate().unwrap().to_degrees());
        let expected = f64::from(range) * f64::from(count) / 32_768.0;
        let expected = if is_inverted { -expected } else { expected };
        prop_assert!((rate - expected).abs() <= 1e-6 * expected.abs() + 1e-9, "{rate} {expected}");
        bus.done();
    }
}

#[test]
fn its_relatives_have_the_same_registers_and_ad0_another_address() {
    for identity in [0x68, 0x70, 0x71] {
        let mut bus = Mock::new(&configuration(0x69, identity, 0));
        let mut gyro = Mpu6050::new(bus.clone()).with_ad0_high();
        assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Ok(()));
        bus.done();
    }
}

#[test]
fn another_device_and_a_range_beyond_its_own_are_refused() {
    let mut bus = Mock::new(&[I2c::write_read(0x68, vec![0x75], vec![0x12])]);
    let mut gyro = Mpu6050::new(bus.clone());
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Err(GyroError::Identity(0x12)));
    assert_eq!(gyro.configure(&parameters(2_100.0, false)), Err(GyroError::Range));
    bus.done();
}

#[test]
fn a_bus_without_an_answer_is_an_error() {
    let mut transfers = vec![I2c::write_read(0x68, vec![0x75], vec![0]).with_error(lost())];
    transfers.extend(configuration(0x68, 0x68, 0));
    transfers.push(I2c::write_read(0x68, vec![0x47], vec![0, 0]).with_error(lost()));
    let mut bus = Mock::new(&transfers);
    let mut gyro = Mpu6050::new(bus.clone());
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Err(GyroError::Bus));
    assert_eq!(gyro.configure(&GyroParameters::MPU_6050), Ok(()));
    assert_eq!(gyro.rate(), Err(Unreadable));
    bus.done();
}
