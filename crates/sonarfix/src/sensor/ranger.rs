//! A ranger: what it measures with, where it is mounted, its servo and its timing.
//!
//! # Non-finite policy
//! The fields are checked by [`Config::check`](crate::config::Config::check).

use crate::geometry::pose::Point;
use crate::geometry::units::{Duration, Metres, Radians};
use crate::sensor::range::RangeNoise;

/// What a ranger measures the range with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Ranging {
    /// Sound: the first echo comes from the foot of the perpendicular on a wall, if it is in the cone
    /// (`docs/model.md`, eq. 11).
    #[default]
    Sound,
    /// Light: a time-of-flight ranger measures along its beam to the wall that it meets first (eq. 45).
    Light(LightBeam),
}

/// Exists only in a program that is linked with the feature `light`.
#[cfg(feature = "light")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightLinked;

/// Has no value: this program is linked without the feature `light`.
#[cfg(not(feature = "light"))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LightLinked {}

/// The beam of a time-of-flight ranger.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightBeam {
    /// Half of the angle of the inner cone that returns most of the light. A wall is measured if the whole field of view, which is
    /// twice as wide, is on it.
    pub spot: Radians,
    /// Standard deviation of the direction of the beam: of the servo, the mount and the spot's centre.
    pub pointing: Radians,
    /// The feature `light`.
    pub linked: LightLinked,
}

#[cfg(feature = "light")]
impl LightBeam {
    /// VL53L1X with all 16 × 16 detectors: a field of view of 27°, of which the inner half returns most of the
    /// light (assumed), on a hobby servo that is off by 1.1° (assumed).
    pub const VL53L1X: Self =
        Self { spot: Radians(0.12), pointing: Radians(0.02), linked: LightLinked };
}

/// One of a robot's rangers, by its place in the robot file, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangerId(pub u8);

impl RangerId {
    /// The first one.
    pub const FIRST: Self = Self(0);

    /// The number as an index.
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// The ranger, a sonar or a time-of-flight ranger, on its servo or at a fixed bearing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RangerParameters {
    /// Position of the sonar's axis in the robot frame.
    pub mount: Point,
    /// Rightmost and leftmost bearing of the servo, relative to the heading of the robot; −π and π
    /// for one without limits. Twice the same bearing: the sonar is fixed there, without a servo.
    pub servo: (Radians, Radians),
    /// Largest angle between the beam's axis and the perpendicular on a wall at which its range is measured: half
    /// of the cone of a sonar, largest angle of incidence of light.
    pub cone: Radians,
    /// Shortest range that the sonar reports.
    pub min_range: Metres,
    /// Longest range that the sonar reports.
    pub max_range: Metres,
    /// Noise of a range.
    pub noise: RangeNoise,
    /// Duration of a ping.
    pub timing: PingTiming,
    /// Whether it is a sonar or a time-of-flight ranger.
    pub ranging: Ranging,
}

impl RangerParameters {
    /// The bearing of a sonar without a servo; `None` for one with a servo.
    ///
    /// ```
    /// use sonarfix::config::Config;
    /// use sonarfix::geometry::units::{Metres, Radians};
    /// let mut config = Config::for_track_width(Metres(0.16));
    /// assert_eq!(config.rangers.first.fixed_bearing(), None);
    /// config.rangers.first.servo = (Radians(1.5), Radians(1.5));
    /// assert_eq!(config.rangers.first.fixed_bearing(), Some(Radians(1.5)));
    /// assert!(config.check().is_ok());
    /// ```
    #[must_use]
    pub fn fixed_bearing(&self) -> Option<Radians> {
        let (right, left) = self.servo;
        (right.0.to_bits() == left.0.to_bits()).then_some(right)
    }

    /// Whether this ranger may take the late echoes of another one's ping for its own: sound disturbs sound.
    #[must_use]
    pub fn hears(&self, other: &Self) -> bool {
        matches!((self.ranging, other.ranging), (Ranging::Sound, Ranging::Sound))
    }
}

impl Default for RangerParameters {
    /// An ideal ranger at the centre of the robot, on a servo without limits or delay: one
    /// ping per second.
    fn default() -> Self {
        let half_turn = Radians(core::f32::consts::PI);
        Self {
            mount: Point::new(0.0, 0.0),
            servo: (-half_turn, half_turn),
            cone: Radians::from_degrees(15.0),
            min_range: Metres(0.05),
            max_range: Metres(4.0),
            noise: RangeNoise { floor: Metres(0.005), per_metre: 0.002 },
            timing: PingTiming::EVERY_SECOND,
            ranging: Ranging::Sound,
        }
    }
}

/// How often the sonar pings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PingSchedule {
    /// Once per period. The servo starts at the beginning of the period, and the ping follows when it
    /// has settled. A ping that takes longer than the period delays the next one to a later period.
    Every(Duration),
    /// As often as servo and ranger allow.
    AsFastAsPossible,
}

/// Timing of a servo. A video of the servo gives better values than its datasheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ServoTiming {
    /// Period of the pulses. A new pulse width takes effect with the next pulse; a whole period of
    /// delay is assumed.
    pub frame: Duration,
    /// Time for a turn of 60°, as in datasheets.
    pub sixty_degrees: Duration,
    /// Time from arrival until the oscillation has decayed.
    pub settle: Duration,
}

impl ServoTiming {
    /// A servo without delay, as in the paper.
    pub const INSTANT: Self = Self {
        frame: Duration::from_ticks(0),
        sixty_degrees: Duration::from_ticks(0),
        settle: Duration::from_ticks(0),
    };

    /// SG90: 0.10–0.12 s/60° by its datasheets (4.8 V), pulses at 50 Hz; settling of 30–60 ms is
    /// assumed (`docs/hardware.md`).
    pub const SG90: Self = Self {
        frame: Duration::from_ticks(20_000),
        sixty_degrees: Duration::from_ticks(120_000),
        settle: Duration::from_ticks(60_000),
    };
}

/// Timing of pings, for the choice of the wall and for the loop of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PingTiming {
    /// How often the sonar pings.
    pub schedule: PingSchedule,
    /// Timing of the servo.
    pub servo: ServoTiming,
    /// Least time between two pings, so that echoes of the first have decayed.
    pub cycle: Duration,
}

impl PingTiming {
    /// One ping per second with a servo without delay, as in the paper.
    pub const EVERY_SECOND: Self = Self {
        schedule: PingSchedule::Every(Duration::from_ticks(1_000_000)),
        servo: ServoTiming::INSTANT,
        cycle: Duration::from_ticks(0),
    };
}
