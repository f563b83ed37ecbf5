//! The place of the sonar beside P, if it is estimated: nothing without the feature `mount`.

use crate::filter::covariance::Mount;
use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// A mount that is estimated, or exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mounted {
    #[cfg(feature = "mount")]
    mount: Mount,
}

impl Mounted {
    /// A mount that is not estimated.
    pub const EXACT: Self = Self {
        #[cfg(feature = "mount")]
        mount: Mount::EXACT,
    };

    /// Estimates the mount at `place` with this standard deviation of each coordinate, independent of all states; at zero it is
    /// exact. It has not been estimated before.
    #[inline]
    #[cfg_attr(
        not(feature = "mount"),
        expect(unused_variables, clippy::unused_self, reason = "such a configuration is refused")
    )]
    pub fn estimate(&mut self, place: Point, deviation: Metres) {
        #[cfg(feature = "mount")]
        if deviation.0 > 0.0 {
            self.mount.estimate(place, deviation);
        }
    }

    #[inline]
    pub fn get(&self) -> Option<&Mount> {
        #[cfg(feature = "mount")]
        return self.mount.is_estimated().then_some(&self.mount);
        #[cfg(not(feature = "mount"))]
        return None;
    }

    #[inline]
    pub fn get_mut(&mut self) -> Option<&mut Mount> {
        #[cfg(feature = "mount")]
        return self.mount.is_estimated().then_some(&mut self.mount);
        #[cfg(not(feature = "mount"))]
        return None;
    }
}
