//! Studies that are pages of the documentation, and the command `sonarfix-studies` that runs them.
//!
//! | module | page |
//! |---|---|
//! | [`calibration`] | `docs/calibrate.md` |
//! | [`fault_campaign`] | none: `docs/faults.md` describes it |
//! | [`fault_table`], [`fault_search`], [`fault_rangers`] | `docs/faults.md` |
//! | [`find_forecast`] | `docs/search.md` |
//! | [`floor_plan`] | `docs/floor-plans.md` |
//! | [`health_page`], [`kidnapped`] | `docs/health.md` |
//! | [`peers`] | `docs/peers.md` |
//! | [`reality`] | `docs/reality.md` |
//! | [`recordings`] | none: a table of recordings with their robot files |
//! | [`rooms`] | `docs/rooms.md` |
//! | [`search_motion`], [`search_study`], [`quantiles`] | `docs/search.md` |
//! | [`sonar_model`] | `docs/sonar-model.md` |

pub mod calibration;
pub mod fault_campaign;
pub mod fault_rangers;
pub mod fault_search;
pub mod fault_table;
pub mod find_forecast;
pub mod find_standing;
pub mod floor_plan;
pub mod health_page;
pub mod kidnapped;
pub mod peers;
pub mod quantiles;
pub mod reality;
pub mod recordings;
pub mod relocalization;
pub mod rooms;
pub mod search_bound;
pub mod search_motion;
pub mod search_study;
pub mod sonar_model;
pub mod surveys;
mod sweeping_robot;
