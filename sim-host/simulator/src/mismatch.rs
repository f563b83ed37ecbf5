//! For how long a localizer has named a mismatch of the robot file.

use serde::Serialize;
use sonarfix::health::Mismatch;

/// Seconds with each mismatch named.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct MismatchTimes {
    /// [`Mismatch::NoiseTooSmall`].
    pub noise_too_small: f64,
    /// [`Mismatch::WheelsOutsidePrior`].
    pub wheels_outside_prior: f64,
    /// [`Mismatch::MountSuspect`].
    pub mount_suspect: f64,
}

impl MismatchTimes {
    /// Adds so many seconds with this mismatch.
    pub fn add(&mut self, seconds: f64, mismatch: Option<Mismatch>) {
        match mismatch {
            Some(Mismatch::NoiseTooSmall) => self.noise_too_small += seconds,
            Some(Mismatch::WheelsOutsidePrior) => self.wheels_outside_prior += seconds,
            Some(Mismatch::MountSuspect) => self.mount_suspect += seconds,
            _ => {}
        }
    }

    /// Each mismatch with its seconds.
    #[must_use]
    pub fn all(&self) -> [(Mismatch, f64); 3] {
        [
            (Mismatch::NoiseTooSmall, self.noise_too_small),
            (Mismatch::WheelsOutsidePrior, self.wheels_outside_prior),
            (Mismatch::MountSuspect, self.mount_suspect),
        ]
    }
}
