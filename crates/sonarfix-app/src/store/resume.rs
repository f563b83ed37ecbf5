//! What is still true of a record when the robot is switched on again.
//!
//! | state | its deviation is |
//! |---|---|
//! | scale errors, track width | twice the stored one, and with it a tenth of the prior (independent); at most the prior |
//! | range scale | twice the stored one, and with it the whole prior: the air is that of another day |
//! | position, if it was parked | the stored one, and with it 10 cm |
//! | heading, if it was parked | the stored one, and with it 5° |
//!
//! *Twice*, because a record holds deviations and not what the errors know of each other: no
//! covariance of four errors exceeds four times its diagonal, so the robot never claims to know
//! more than it did. The tenth is for tyres that are cleaned, warmed or pressed flat while it
//! stands; the 10 cm and 5° for the hand that takes hold of the switch. Whoever carries the robot
//! farther sets its pose; if not, the health finds out.
//!
//! A record that was written while the robot might drive says nothing of where it stands now:
//! its pose is not used. A calibration belongs to the configuration that it corrects: with
//! another, the prior counts.

use sonarfix::config::Config;
use sonarfix::ekf::State;
use sonarfix::localizer::Start;

use super::Saved;

/// Standard deviations of what a hand at the switch does, metres and radians.
const PUSHED: f32 = 0.10;
const TURNED: f32 = 5.0 * core::f32::consts::PI / 180.0;
/// The share of the prior by which wheels differ from what they were.
const AGED: f32 = 0.1;
/// The square root of the number of correlated calibration errors.
const DECORRELATED: f32 = 2.0;

/// Where a robot starts from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resumed {
    /// Pose and calibration; the pose is zero if it is not known.
    pub state: State,
    /// Their standard deviations.
    pub deviation: State,
    /// Whether the pose is known.
    pub has_pose: bool,
    /// Whether the calibration is a learned one.
    pub has_calibration: bool,
}

impl Resumed {
    /// A robot that knows nothing but its configuration.
    #[must_use]
    pub fn afresh(config: &Config) -> Self {
        let prior = &config.prior;
        let deviation = State {
            scale_right: prior.scale_right,
            scale_left: prior.scale_left,
            track_width_error: prior.track_width.0,
            range_scale: prior.range_scale,
            ..State::default()
        };
        let state = State::default();
        Self { state, deviation, has_pose: false, has_calibration: false }
    }

    /// What remains of a record, for a robot of this configuration with this checksum.
    #[must_use]
    pub fn from(saved: &Saved, config: &Config, configuration: u32) -> Self {
        let afresh = Self::afresh(config);
        if !is_sound(saved) {
            return afresh;
        }
        let has_calibration = saved.configuration == configuration;
        let (state, deviation) = if has_calibration {
            (saved.state, calibration(&saved.deviation, &afresh.deviation))
        } else {
            (afresh.state, afresh.deviation)
        };
        let mut resumed = Self { state, deviation, has_pose: saved.is_parked, has_calibration };
        let pose = if saved.is_parked { saved.state } else { State::default() };
        (resumed.state.x, resumed.state.y) = (pose.x, pose.y);
        resumed.state.heading = pose.heading;
        if saved.is_parked {
            resumed.deviation.x = both(saved.deviation.x, PUSHED);
            resumed.deviation.y = both(saved.deviation.y, PUSHED);
            resumed.deviation.heading = both(saved.deviation.heading, TURNED);
        }
        resumed
    }

    /// The same calibration at another pose.
    #[must_use]
    pub fn at(self, start: &Start) -> Self {
        let mut known = self;
        let Start { pose, position_deviation, heading_deviation } = *start;
        (known.state.x, known.state.y) = (pose.x.0, pose.y.0);
        known.state.heading = pose.heading.radians().0;
        (known.deviation.x, known.deviation.y) = (position_deviation.0, position_deviation.0);
        known.deviation.heading = heading_deviation.0;
        Self { has_pose: true, ..known }
    }

    /// The same pose with another's calibration.
    #[must_use]
    pub fn calibrated_as(self, other: &Self) -> Self {
        let at = |pose: State, calibration: State| State {
            x: pose.x,
            y: pose.y,
            heading: pose.heading,
            ..calibration
        };
        Self {
            state: at(self.state, other.state),
            deviation: at(self.deviation, other.deviation),
            has_pose: self.has_pose,
            has_calibration: other.has_calibration,
        }
    }
}

/// Deviations of the calibration, from those stored and those of the prior; none of the pose.
fn calibration(stored: &State, prior: &State) -> State {
    let wheel = |stored: f32, prior: f32| {
        let aged = both(DECORRELATED * stored, AGED * prior);
        if aged < prior { aged } else { prior }
    };
    State {
        scale_right: wheel(stored.scale_right, prior.scale_right),
        scale_left: wheel(stored.scale_left, prior.scale_left),
        track_width_error: wheel(stored.track_width_error, prior.track_width_error),
        range_scale: both(DECORRELATED * stored.range_scale, prior.range_scale),
        ..State::default()
    }
}

/// The deviation of two independent errors together.
fn both(one: f32, other: f32) -> f32 {
    libm::hypotf(one, other)
}

fn is_sound(saved: &Saved) -> bool {
    let values = numbers(&saved.state).into_iter().all(f32::is_finite);
    values && numbers(&saved.deviation).into_iter().all(|d| d >= 0.0 && d.is_finite())
}

fn numbers(state: &State) -> [f32; sonarfix::ekf::STATES] {
    let State { x, y, heading, scale_right, scale_left, track_width_error, range_scale } = *state;
    [x, y, heading, scale_right, scale_left, track_width_error, range_scale]
}
