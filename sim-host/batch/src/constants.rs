//! The constants that a recording shares: calibration of drive and sonar, and the clock of a reference stream.

use crate::odometry::Drive;

/// Number of constants.
pub const COUNT: usize = 13;

/// A constant of the equations; its position in their border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// Scale error of the right wheel.
    Right = 0,
    /// Scale error of the left wheel.
    Left,
    /// Relative error of the track width.
    Track,
    /// Scale error of the ranger: it reports 1 + this times the distance.
    RangeScale,
    /// Position of the sonar ahead of the axle, metres.
    MountAhead,
    /// Position of the sonar to the left of the midpoint, metres.
    MountLeft,
    /// Constant error of a range, metres.
    RangeOffset,
    /// Growth of a range with the angle off the axis, metres per radian.
    OffAxis,
    /// The reference stream is late by this, seconds, in the middle of the recording.
    Lag,
    /// Growth of the lag, seconds per second.
    ClockRate,
    /// Position of the reference's marker ahead of the axle, metres.
    MarkerAhead,
    /// Position of the marker to the left, metres.
    MarkerLeft,
    /// Heading of the marker relative to the robot, radians.
    MarkerHeading,
}

impl Name {
    /// All of them, in their order.
    pub const ALL: [Self; COUNT] = [
        Self::Right,
        Self::Left,
        Self::Track,
        Self::RangeScale,
        Self::MountAhead,
        Self::MountLeft,
        Self::RangeOffset,
        Self::OffAxis,
        Self::Lag,
        Self::ClockRate,
        Self::MarkerAhead,
        Self::MarkerLeft,
        Self::MarkerHeading,
    ];

    /// Its name in reports.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Right => "right wheel",
            Self::Left => "left wheel",
            Self::Track => "track width",
            Self::RangeScale => "range scale",
            Self::MountAhead => "mount ahead",
            Self::MountLeft => "mount left",
            Self::RangeOffset => "range offset",
            Self::OffAxis => "off-axis bias",
            Self::Lag => "lag of the reference",
            Self::ClockRate => "clock rate of the reference",
            Self::MarkerAhead => "marker ahead",
            Self::MarkerLeft => "marker left",
            Self::MarkerHeading => "marker heading",
        }
    }
}

/// Values of the constants, and the line that turns commanded into true bearings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constants {
    /// Nominal track width, metres.
    pub track_width: f64,
    /// The values.
    pub values: [f64; COUNT],
    /// True bearing of a command of zero, radians.
    pub bearing_offset: f64,
    /// Growth of the true bearing with the command.
    pub bearing_scale: f64,
}

impl Constants {
    /// Those of a robot as its file describes it.
    #[must_use]
    pub fn nominal(track_width: f64, mount: [f64; 2]) -> Self {
        let mut constants =
            Self { track_width, values: [0.0; COUNT], bearing_offset: 0.0, bearing_scale: 1.0 };
        let [ahead, left] = mount;
        constants.set(Name::MountAhead, ahead);
        constants.set(Name::MountLeft, left);
        constants
    }

    /// A value.
    #[must_use]
    pub fn get(&self, name: Name) -> f64 {
        self.values.get(name as usize).copied().unwrap_or(0.0)
    }

    /// Sets a value.
    pub fn set(&mut self, name: Name, value: f64) {
        if let Some(slot) = self.values.get_mut(name as usize) {
            *slot = value;
        }
    }

    /// The errors of the drive.
    #[must_use]
    pub fn drive(&self) -> Drive {
        Drive {
            track_width: self.track_width,
            right: self.get(Name::Right),
            left: self.get(Name::Left),
            track: self.get(Name::Track),
        }
    }

    /// The true bearing of a command, radians.
    #[must_use]
    pub fn bearing(&self, commanded: f64) -> f64 {
        self.bearing_offset + self.bearing_scale * commanded
    }
}

/// Prior of each constant: mean and standard deviation; a deviation of zero fixes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Means.
    pub means: [f64; COUNT],
    /// Standard deviations.
    pub deviations: [f64; COUNT],
    /// Standard deviation of the difference of the two wheels' scale errors.
    pub wheel_difference: f64,
}

impl Priors {
    /// Fixed at the values of some constants.
    #[must_use]
    pub fn fixed_at(constants: &Constants) -> Self {
        Self { means: constants.values, deviations: [0.0; COUNT], wheel_difference: f64::INFINITY }
    }

    /// The same with another deviation of one constant.
    #[must_use]
    pub fn with(mut self, name: Name, deviation: f64) -> Self {
        if let Some(slot) = self.deviations.get_mut(name as usize) {
            *slot = deviation;
        }
        self
    }

    /// What a builder's ruler leaves open: wheels to 6 %, track width to 8 %, range scale to 2 %, mount to 12 mm.
    #[must_use]
    pub fn of_a_builder(constants: &Constants, has_ranges: bool, has_references: bool) -> Self {
        let mut priors = Self::fixed_at(constants)
            .with(Name::Right, 0.06)
            .with(Name::Left, 0.06)
            .with(Name::Track, 0.08);
        if has_ranges {
            priors = priors
                .with(Name::RangeScale, 0.02)
                .with(Name::MountAhead, 0.012)
                .with(Name::MountLeft, 0.012)
                .with(Name::RangeOffset, 0.003)
                .with(Name::OffAxis, 0.02);
        }
        if has_references {
            priors = priors
                .with(Name::Lag, 0.5)
                .with(Name::ClockRate, 0.005)
                .with(Name::MarkerAhead, 0.1)
                .with(Name::MarkerLeft, 0.1)
                .with(Name::MarkerHeading, 0.1);
        }
        priors
    }

    /// Whether a constant is estimated.
    #[must_use]
    pub fn is_free(&self, name: Name) -> bool {
        self.deviations.get(name as usize).is_some_and(|&deviation| deviation > 0.0)
    }
}
