//! The place of the first ranger as the robot file states it, if the filter estimates it: nothing without the feature `mount`.

use crate::config::Config;
use crate::filter::ekf::Ekf;
#[cfg(feature = "mount")]
use crate::geometry::pose::Point;
#[cfg(feature = "mount")]
use crate::geometry::vector::Vector;

/// The mount at which the estimate began.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatedMount {
    #[cfg(feature = "mount")]
    place: Point,
}

impl StatedMount {
    #[cfg_attr(not(feature = "mount"), expect(unused_variables, reason = "nothing is stored"))]
    pub fn of(config: &Config) -> Self {
        Self {
            #[cfg(feature = "mount")]
            place: config.rangers.first.mount,
        }
    }

    /// The square of the distance from it to the estimated place, m².
    #[cfg_attr(
        not(feature = "mount"),
        expect(unused_variables, clippy::unused_self, reason = "nothing is stored")
    )]
    pub fn off(self, ekf: &Ekf) -> Option<f32> {
        #[cfg(feature = "mount")]
        return Some(Vector::from(ekf.place_of_sonar()?).minus(self.place.into()).length_squared());
        #[cfg(not(feature = "mount"))]
        return None;
    }
}
