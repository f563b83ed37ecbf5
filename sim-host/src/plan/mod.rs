//! How well a robot would know where it is, before it is built.
//!
//! The shipped localizer drives the path in simulation, through pins, drivers and loop, with the
//! schedule that it would really have. Everything is as the filter is told: wheels, track width
//! and ranges are true, so that the estimate stays on the truth and what is left is the posterior
//! Cramér–Rao bound (`bound`) of the looks that the schedule takes. Whether a wall is heard is
//! drawn by the sonar's probability of detection, so a forecast is the root mean square over
//! several runs.
//!
//! | module | what |
//! |---|---|
//! | `forecast` | the runs, and what they say of each place of the path |
//! | [`preset`] | sonars and servos that one can buy |
//! | [`route`] | a path as a person writes it |

mod forecast;
pub mod preset;
pub mod route;

pub use forecast::{BLIND_AFTER, Blind, Forecast, LegForecast, Sample, Spread};
