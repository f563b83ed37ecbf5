//! The extended Kalman filter: motion model, process noise, covariance, prediction and correction.

pub(crate) mod covariance;
pub mod ekf;
pub(crate) mod gyro_fusion;
pub mod motion;
pub(crate) mod odometry;
pub(crate) mod process_noise;
