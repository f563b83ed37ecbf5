//! Forecast of the localization accuracy along a path, before a robot is built.
//!
//! The shipped localizer drives the path in simulation, through pins, drivers and loop, with the
//! schedule of the real robot. All parameters are as the filter assumes: wheels, track width and
//! ranges have no errors, so that the estimate stays on the truth. The forecast is the posterior
//! Cramér–Rao bound (`bound`) of the measurements of this schedule. Detection is drawn from the
//! sonar's probability of detection, so a forecast is the root mean square over several runs.
//!
//! | module | what |
//! |---|---|
//! | `forecast` | the runs, and the forecast at each point of the path |
//! | `heading_aid` | gyro or compass beside wheels and sonar |
//! | [`preset`] | presets of common sonars and servos |
//! | [`route`] | a path on the command line |
//! | [`bare`] | the scenario of a map without a robot |
//! | [`overrides`], [`edit`] | a scenario changed by options, and by keys of its file |
//! | [`anywhere`] | starts without a pose anywhere on a map: how long the search takes, what it confuses, which board helps |
//! | [`trial`], [`starts`] | starts without a pose: from where the search finds it, and after how many metres |

pub mod anywhere;
pub mod bare;
pub mod edit;
mod forecast;
mod heading_aid;
pub mod overrides;
pub mod preset;
pub mod route;
pub mod starts;
pub mod trial;

pub use forecast::{BLIND_AFTER, Blind, Forecast, LegForecast, Sample, Spread};
pub use heading_aid::HeadingAid;
