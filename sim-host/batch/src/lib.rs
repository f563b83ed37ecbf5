//! Estimates the calibration of a robot, and its trajectory, from a whole recording at once.
//!
//! The estimator is offline, in `f64`, and independent of the filter. Its unknowns are a pose every few centimetres and
//! the constants that the recording shares; its equations come from wheel travel, from ranges to known walls and from the
//! poses of a reference stream. `docs/calibrate.md` derives them.
//!
//! | module | what |
//! |---|---|
//! | [`recording`] | what was recorded |
//! | [`log`] | reads it from a log |
//! | [`chain_of_poses`] | the poses, the travel between them, the pings of each |
//! | [`odometry`] | the motion by a travel, its derivatives and noise |
//! | [`wall`] | a wall, and the sonar beside it |
//! | [`reflector`] | which wall or corner a ping comes from |
//! | [`constants`] | the constants and their priors |
//! | [`problem`] | residuals and derivatives |
//! | [`chain`] | normal equations of a chain, their solution and covariance |
//! | [`solve`] | Levenberg–Marquardt |
//! | [`noise`] | noises from the residuals |
//! | [`wheel_noise`] | noise of the wheels from the marginal likelihood |
//! | [`bearings`] | bearings of the servo, from answers and missing answers |
//! | `lone_walls` | pings at walls that stand alone |
//! | [`echoes`] | what the sonar measures at square and at oblique walls |
//! | [`calibration`] | what a calibration needs, and what it results in |
//! | `fit` | association, checks |
//! | `growth` | how the window grows |
//! | [`calibrate`] | the calibration: attempts, intervals |
//! | [`unknown_start`] | the calibration of a recording without a start pose |
//! | [`robot_edit`] | what was found, in the text of a robot file |
//! | [`turned`] | a wheel that was turned by hand |

pub mod bearings;
pub mod calibrate;
pub mod calibration;
pub mod chain;
pub mod chain_of_poses;
pub mod constants;
pub mod echoes;
mod fit;
mod growth;
pub mod log;
mod lone_walls;
pub mod noise;
pub mod odometry;
pub mod problem;
pub mod recording;
pub mod reflector;
pub mod robot_edit;
pub mod solve;
pub mod turned;
pub mod unknown_start;
pub mod wall;
pub mod wheel_noise;
