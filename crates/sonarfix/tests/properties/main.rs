//! Properties of the core crate, and its `f32` filter against a dense `f64` one. One binary, one
//! module per subject. Every tolerance has its reason in a comment; every test was seen to fail
//! with a fault in the code.

#[cfg(test)]
mod absolute;
#[cfg(test)]
mod aim;
#[cfg(test)]
mod angles;
#[cfg(test)]
mod covariance;
#[cfg(test)]
mod filter;
#[cfg(test)]
mod gyro;
#[cfg(test)]
mod health;
#[cfg(test)]
mod jacobians;
#[cfg(test)]
mod light;
#[cfg(test)]
mod limits;
#[cfg(test)]
mod map;
#[cfg(test)]
mod oracle;
#[cfg(test)]
mod planning;
#[cfg(test)]
mod rangers;
#[cfg(test)]
mod refusals;
#[cfg(test)]
mod six_states;
#[cfg(test)]
mod strategies;
#[cfg(test)]
mod unseen;
#[cfg(test)]
mod wheels;
