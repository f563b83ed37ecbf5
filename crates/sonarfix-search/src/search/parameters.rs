//! What the search is tuned with, and how it follows from the configuration of a robot.

use sonarfix::config::Config;
use sonarfix::geometry::numeric::at_least;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::sensor::echo::EchoParameters;

/// What the search is tuned with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchParameters {
    /// A ping is novel if none was sent from within 20 cm in a direction within this angle. The
    /// plain sweep has steps of this angle.
    pub novel_angle: Radians,
    /// The same before the robot has driven 20 cm: with nothing else to measure, more pings help.
    pub novel_angle_at_rest: Radians,
    /// Deviation of the odometry's heading drift per metre of travel.
    pub drift: Radians,
    /// Deviation of the relative error of turns by the odometry: track width and wheels.
    pub turn_scale: f32,
    /// Deviation that a metre of odometry adds to the place of a ping besides, metres.
    pub odometry: f32,
    /// What a ping returns besides the range of its wall.
    pub echo: EchoParameters,
    /// Logarithm of the odds by which a unique answer leads every other hypothesis and a place without walls, if the map explains all of
    /// many echoes; up to 22 more if they are few, or it explains fewer.
    pub odds: f32,
    /// Largest deviations of position and heading of a unique answer.
    pub sharpness: (Metres, Radians),
}

impl Default for SearchParameters {
    fn default() -> Self {
        Self {
            novel_angle: Radians::from_degrees(10.0),
            novel_angle_at_rest: Radians::from_degrees(3.8),
            drift: Radians::from_degrees(2.0),
            turn_scale: 0.02,
            odometry: 0.015,
            echo: EchoParameters::HC_SR04,
            odds: 6.0,
            sharpness: (Metres(0.05), Radians::from_degrees(3.0)),
        }
    }
}

impl SearchParameters {
    /// For the sonar, the wheels and the priors of a robot.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        let Config { prior, .. } = config;
        Self::calibrated(config, [prior.scale_right, prior.scale_left], prior.track_width)
    }

    /// As [`Self::of`] with the standard deviations that the scales of the right and of the left wheel and the track
    /// width have after a calibration.
    #[must_use]
    pub fn calibrated(config: &Config, wheels: [f32; 2], track_width: Metres) -> Self {
        let drive = &config.drive;
        let width = drive.track_width.0;
        let (common, difference) = mean_and_difference(wheels, config);
        let by_width = track_width.0 / width;
        // Heading noise after a metre: the deviation aside that it causes grows with the distance to the
        // power 1.5, and is this many metres a metre at 4 m.
        let per_root_metre = core::f32::consts::SQRT_2 * drive.wheel_noise.0.0 / width;
        let odometry = at_least(1.2 * per_root_metre, LEAST_ODOMETRY);
        let (position, heading) = Self::default().sharpness;
        Self {
            drift: Radians(at_least(difference / width, LEAST_DRIFT.0)),
            turn_scale: at_least(
                libm::sqrtf(by_width * by_width + common * common),
                LEAST_TURN_SCALE,
            ),
            odometry,
            echo: config.echo,
            sharpness: (Metres(at_least(SHARP_WITHIN * odometry, position.0)), heading),
            ..Self::default()
        }
    }
}

/// Deviations of the mean and of the difference of the scale errors of both wheels, eq. (48).
fn mean_and_difference([right, left]: [f32; 2], config: &Config) -> (f32, f32) {
    let square = right * right + left * left;
    if let Some(difference) = config.prior.difference_of(right, left) {
        let mean = 0.5 * square - 0.25 * difference * difference;
        (libm::sqrtf(mean), difference)
    } else {
        let independent = libm::sqrtf(square);
        (0.5 * independent, independent)
    }
}

/// A unique answer need not be sharper than what the odometry adds within this distance, metres.
const SHARP_WITHIN: f32 = 1.8;
/// Least deviations: a prior of zero would fix what a slip changes.
const LEAST_DRIFT: Radians = Radians(0.005);
const LEAST_TURN_SCALE: f32 = 0.003;
const LEAST_ODOMETRY: f32 = 0.005;
