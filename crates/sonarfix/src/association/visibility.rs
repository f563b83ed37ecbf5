//! Which walls the sonar can measure from the estimated pose (`docs/model.md`, "Which walls can be
//! measured").
//!
//! A wall can be measured if the foot of the perpendicular lies on it, the expected range is one that
//! the sonar reports, the beam is square to it, and nothing in the map returns an earlier echo. Each
//! condition holds for every pose within the uncertainty of the estimate.
//!
//! | module | contents |
//! |---|---|
//! | `viewpoint` | the conditions on one wall by itself |
//! | `light` | the same for a beam of light |
//! | `occlusion` | the conditions on all other walls |

mod light;
mod occlusion;
mod viewpoint;

pub(crate) use occlusion::Beam;
pub(crate) use viewpoint::{Sight, Viewpoint, check_range, max_heading_deviation_of};
