//! The gyro at its bus: the mean rate over each of its periods, held until the next.

use rand_chacha::ChaCha8Rng;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_pil::GyroSignal;

use super::faults::GyroFaults;
use crate::plant::Travel;
use crate::plant::gyro::Gyro;
use crate::time::seconds;

/// A gyro with a low-pass filter at half of its sample rate, modelled as the mean over a period.
#[derive(Debug, Clone)]
pub struct GyroChip {
    gyro: Gyro,
    /// Seconds.
    period: f64,
    /// 1, or −1 if it is mounted upside down.
    sign: f64,
    /// Turn and time since the last sample.
    turned: f64,
    time: f64,
    signal: GyroSignal,
}

impl GyroChip {
    /// A gyro at rest.
    #[must_use]
    pub fn new(gyro: Gyro, assumed: &GyroParameters) -> Self {
        let period = seconds(assumed.period.to_micros());
        let sign = if assumed.is_inverted { -1.0 } else { 1.0 };
        Self { gyro, period, sign, turned: 0.0, time: 0.0, signal: GyroSignal::default() }
    }

    /// Turns with the robot.
    #[expect(clippy::cast_possible_truncation, reason = "saturates far beyond the sensor's range")]
    pub fn turn(
        &mut self,
        now: u64,
        travel: &Travel,
        faults: &mut GyroFaults,
        rng: &mut ChaCha8Rng,
    ) {
        self.turned += travel.turn;
        self.time += travel.seconds;
        // The loop reads it once in a period, but not exactly.
        if self.time < 0.75 * self.period {
            return;
        }
        let integral = self.gyro.integral(self.turned, self.time, rng);
        let micros = (self.sign * 1e6 * integral / self.time) as i32;
        let right = GyroSignal { micros, has_failed: false };
        self.signal = faults.signal(now, right, self.signal);
        (self.turned, self.time) = (0.0, 0.0);
    }

    /// The bias now, rad/s, as the robot sees it.
    #[must_use]
    pub fn bias(&self) -> f64 {
        self.gyro.bias()
    }

    /// The signal now.
    #[must_use]
    pub fn signal(&self) -> GyroSignal {
        self.signal
    }
}
