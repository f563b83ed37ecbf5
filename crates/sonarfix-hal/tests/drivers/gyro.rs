//! The drivers of gyros.

mod lsm6dso;
mod mpu6050;

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::Transaction as I2c;
use sonarfix::geometry::units::RadiansPerSecond;
use sonarfix::sensor::gyro::GyroParameters;

/// The transfers that configure a sensor: the register of its identity with the answer, and the registers that are written.
fn configuration(address: u8, (register, identity): (u8, u8), values: [(u8, u8); 4]) -> Vec<I2c> {
    let mut transfers = vec![I2c::write_read(address, vec![register], vec![identity])];
    transfers.extend(values.map(|(register, value)| I2c::write(address, vec![register, value])));
    transfers
}

fn parameters(range: f32, is_inverted: bool) -> GyroParameters {
    let range = RadiansPerSecond::from_degrees(range);
    GyroParameters { range, is_inverted, ..GyroParameters::MPU_6050 }
}

fn lost() -> ErrorKind {
    ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
}
