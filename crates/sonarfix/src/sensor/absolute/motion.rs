//! The latest step of the odometry, so that a measurement within it is applied at its own time (`docs/model.md`, eq. 40).

use super::decorrelation::PoseVector;
use crate::geometry::units::{Duration, Instant, seconds};

/// The latest step of the odometry.
#[derive(Debug, Clone, Copy)]
pub struct LastStep {
    /// When it began.
    began: Instant,
    /// Its displacement and turn, map frame.
    moved: PoseVector,
}

/// From the present pose back to that at the time of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Return {
    /// Displacement and turn since then.
    pub moved: PoseVector,
    /// How long ago that was.
    pub age: Duration,
}

/// When a measurement is outside the latest step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideStep {
    Before,
    After,
}

impl LastStep {
    /// A step from `began` on with this displacement and turn.
    pub fn new(began: Instant, moved: PoseVector) -> Self {
        Self { began, moved }
    }

    /// No step: only a measurement at `now` is within it.
    pub fn none(now: Instant) -> Self {
        Self::new(now, PoseVector::default())
    }

    // ===== Eq. (40): the pose at the time of a measurement =====
    /// The motion from the end of the step, at `now`, back to the instant `at`.
    pub fn back_to(&self, at: Instant, now: Instant) -> Result<Return, OutsideStep> {
        let age = now.checked_duration_since(at).ok_or(OutsideStep::After)?;
        if at < self.began {
            return Err(OutsideStep::Before);
        }
        if age.is_zero() {
            return Ok(Return { moved: PoseVector::default(), age });
        }
        let lasted = now.checked_duration_since(self.began).unwrap_or(age);
        let share = seconds(age) / seconds(lasted);
        let PoseVector { x, y, h } = self.moved;
        Ok(Return { moved: PoseVector { x: share * x, y: share * y, h: share * h }, age })
    }
}
