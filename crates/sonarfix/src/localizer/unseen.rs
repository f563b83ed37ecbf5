//! Growth of the pose's covariance while the wheels cannot be observed (`docs/model.md`, "Missing odometry").
//!
//! While no encoder sample arrives, a wheel may roll at up to the maximum wheel speed v. After a time τ the midpoint
//! between the wheels may be v τ away, and the heading may have changed by 2 v τ/W. These are added to P as the standard
//! deviations of independent errors. When a sample arrives that contains the whole travel, they are replaced:
//!
//! | sample | position | heading |
//! |---|---|---|
//! | within [`DEGRADED_WITHOUT_ODOMETRY`] | as if none had been missed | as if none had been missed |
//! | later | the distance rolled: the path is unknown | as if none had been missed: the turn is known |
//! | later, after a sample was refused | the growth remains | the growth remains |
//!
//! # Non-finite policy
//! The additions are finite and bounded by [`UNKNOWN_POSITION`] and [`UNKNOWN_HEADING`].

use crate::config::Config;
use crate::filter::ekf::{Ekf, PoseVariances};
use crate::filter::odometry::largest_travel;
use crate::geometry::numeric::at_most;
use crate::geometry::units::{Duration, Instant, Metres, Radians};
use crate::health::DEGRADED_WITHOUT_ODOMETRY;

/// Standard deviation of x and of y of a pose that is unknown.
pub const UNKNOWN_POSITION: Metres = Metres(1_000.0);
/// Standard deviation of its heading.
pub const UNKNOWN_HEADING: Radians = Radians(core::f32::consts::PI);

/// A period without odometry.
#[derive(Debug, Clone, Copy)]
pub struct Unseen {
    /// The last instant at which the pose contained the whole travel.
    since: Instant,
    /// The variances of the pose then.
    before: PoseVariances,
    /// Whether a part of the travel will not be reported.
    is_lost: bool,
}

impl Unseen {
    /// The wheels have not been observed since `since`, when this was the filter.
    pub fn new(since: Instant, ekf: &Ekf) -> Self {
        Self { since, before: ekf.pose_variances(), is_lost: false }
    }

    /// The same with the pose of this filter, which was measured at `now`. Travel before and after
    /// that time cannot be separated.
    pub fn with_pose(ekf: &Ekf, now: Instant) -> Self {
        Self { is_lost: true, ..Self::new(now, ekf) }
    }

    fn time(&self, now: Instant) -> Duration {
        now.checked_duration_since(self.since).unwrap_or(Duration::from_ticks(0))
    }

    // ===== Eq. (24): growth of P without odometry =====
    /// Sets P to that at `now`.
    pub fn grow(&self, ekf: &mut Ekf, now: Instant, config: &Config) {
        let distance = largest_travel(self.time(now), config.max_wheel_speed).0;
        let turn = 2.0 * distance / config.drive.track_width.0;
        let position = at_most(distance, UNKNOWN_POSITION.0);
        ekf.set_pose_variances(self.before.plus(position, at_most(turn, UNKNOWN_HEADING.0)));
    }

    /// Records that a sample was refused at `now`. Its travel may have been discarded.
    pub fn refuse(&mut self, now: Instant) {
        self.is_lost |= self.time(now) > DEGRADED_WITHOUT_ODOMETRY;
    }

    /// Sets P to that before a step over the whole travel since, of this distance.
    pub fn end(&self, ekf: &mut Ekf, now: Instant, distance: Metres, config: &Config) {
        if self.is_lost {
            return self.grow(ekf, now, config);
        }
        let is_path_unknown = self.time(now) > DEGRADED_WITHOUT_ODOMETRY;
        let position = if is_path_unknown { distance.0 } else { 0.0 };
        ekf.set_pose_variances(self.before.plus(position, 0.0));
    }
}
