//! The sensors: the measurement model and the parameters of each in one place.

pub mod absolute;
pub mod echo;
pub mod gyro;
pub mod range;
pub mod ranger;
pub mod rangers;
pub mod servo;
pub mod timing;
