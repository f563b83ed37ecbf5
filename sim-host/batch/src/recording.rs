//! A recording as the estimator uses it: wheel travel over time, pings, and poses of a reference stream.

use nalgebra::Vector3;

use crate::odometry::Travel;

/// A reading of the encoders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Seconds.
    pub time: f64,
    /// Cumulative travel, right and left, metres by the nominal wheels.
    pub travel: Travel,
}

/// One ping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ping {
    /// Time of the reflection, seconds.
    pub time: f64,
    /// Commanded bearing, radians from the heading.
    pub bearing: f64,
    /// The range, metres; `None` without an echo.
    pub range: Option<f64>,
}

/// One pose of a reference stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferencePose {
    /// Seconds on the clock of the stream.
    pub time: f64,
    /// x, y (metres) and heading (radians).
    pub pose: Vector3<f64>,
}

/// The pose at the start, with its standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartPose {
    /// Seconds.
    pub time: f64,
    /// x, y (metres) and heading (radians).
    pub pose: Vector3<f64>,
    /// Standard deviation of x and y, metres.
    pub position: f64,
    /// Standard deviation of the heading, radians.
    pub heading: f64,
}

/// A whole recording, each part in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Readings of the encoders.
    pub readings: Vec<Reading>,
    /// Pings.
    pub pings: Vec<Ping>,
    /// Poses of a reference stream.
    pub references: Vec<ReferencePose>,
    /// The start.
    pub start: Option<StartPose>,
}

/// Why a recording cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// No encoder records.
    #[error(
        "the log has fewer than two encoder records after its start: record while the robot drives"
    )]
    NoTravel,
    /// No start.
    #[error(
        "the log has no start pose: add a `start` record, or pass one (x, y in metres, heading in degrees)"
    )]
    NoStart,
    /// A value that is not finite.
    #[error("the record at {0} s has a value that is not finite")]
    NotFinite(f64),
    /// Times go back.
    #[error("the encoder record at {0} s is not later than the one before it")]
    TimeWentBack(f64),
}

impl Recording {
    /// Ends the recording once the robot has driven this far, metres.
    pub fn cut(&mut self, metres: f64) {
        let mut driven = 0.0;
        let pairs = self.readings.iter().zip(self.readings.iter().skip(1));
        let mut lengths = pairs.map(|(one, next)| {
            let [r0, l0] = one.travel;
            let [r1, l1] = next.travel;
            f64::midpoint(r1 - r0, l1 - l0).abs()
        });
        let steps = lengths.position(|length| {
            driven += length;
            driven > metres
        });
        self.readings.truncate(steps.map_or(usize::MAX, |steps| steps + 1));
        let end = self.readings.last().map_or(f64::INFINITY, |reading| reading.time);
        self.pings.retain(|ping| ping.time <= end);
    }

    /// Whether it has neither a start pose nor a reference that has one.
    #[must_use]
    pub fn has_no_start(&self) -> bool {
        self.start.is_none() && self.references.is_empty()
    }

    /// The recording from a time on.
    #[must_use]
    pub fn after(&self, time: f64) -> Self {
        let mut after = self.clone();
        after.readings.retain(|reading| reading.time >= time);
        after.pings.retain(|ping| ping.time >= time);
        after
    }

    /// Checks values and order.
    ///
    /// # Errors
    /// [`RecordingError`] of the first defect.
    pub fn check(&self) -> Result<(), RecordingError> {
        let finite = |time: f64, values: &[f64]| {
            let is_finite = time.is_finite() && values.iter().all(|value| value.is_finite());
            if is_finite { Ok(()) } else { Err(RecordingError::NotFinite(time)) }
        };
        for reading in &self.readings {
            finite(reading.time, &reading.travel)?;
        }
        for ping in &self.pings {
            finite(ping.time, &[ping.bearing, ping.range.unwrap_or(0.0)])?;
        }
        for row in &self.references {
            finite(row.time, row.pose.as_slice())?;
        }
        if let Some(start) = &self.start {
            finite(start.time, start.pose.as_slice())?;
            finite(start.time, &[start.position, start.heading])?;
        }
        for (one, next) in self.readings.iter().zip(self.readings.iter().skip(1)) {
            if next.time <= one.time {
                return Err(RecordingError::TimeWentBack(next.time));
            }
        }
        Ok(())
    }
}
