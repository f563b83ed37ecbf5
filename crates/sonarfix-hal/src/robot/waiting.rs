//! Absolute measurements that wait for the step of the wheels in which they were made.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::AbsoluteFix;
use sonarfix::sensor::absolute::AbsoluteMeasurement;

/// An absolute measurement, the localizer's response, and their times.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AbsoluteResult {
    /// The localizer's time when it took the measurement.
    pub at: Instant,
    /// When it was made.
    pub measured_at: Instant,
    /// The measurement.
    pub measurement: AbsoluteMeasurement,
    /// The localizer's response.
    pub fix: AbsoluteFix,
}

/// An earlier measurement of this kind still waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Occupied;

/// A measurement with its time.
type Timed = (Instant, AbsoluteMeasurement);

/// At most one heading and one position or pose.
#[derive(Debug, Clone, Copy, Default)]
pub struct Waiting {
    heading: Option<Timed>,
    position: Option<Timed>,
}

impl Waiting {
    /// Adds a measurement.
    pub fn add(&mut self, at: Instant, measurement: &AbsoluteMeasurement) -> Result<(), Occupied> {
        let slot = match measurement {
            AbsoluteMeasurement::Heading { .. } => &mut self.heading,
            AbsoluteMeasurement::Position { .. } | AbsoluteMeasurement::Pose { .. } => {
                &mut self.position
            }
        };
        if slot.is_some() {
            return Err(Occupied);
        }
        *slot = Some((at, *measurement));
        Ok(())
    }

    /// Whether one was made up to `now`.
    pub fn is_due(&self, now: Instant) -> bool {
        [self.heading, self.position].into_iter().flatten().any(|(at, _)| at <= now)
    }

    /// Takes one that was made up to `now`.
    pub fn take(&mut self, now: Instant) -> Option<Timed> {
        let is_due = |slot: &mut Timed| slot.0 <= now;
        self.heading.take_if(is_due).or_else(|| self.position.take_if(is_due))
    }
}
