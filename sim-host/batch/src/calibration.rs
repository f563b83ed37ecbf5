//! What a calibration needs, and what it results in.

use nalgebra::Vector3;

use crate::bearings::Bearings;
use crate::constants::{Constants, Name};
use crate::echoes::Echoes;
use crate::problem::Noise;
use crate::recording::RecordingError;
use crate::solve::SolveError;
use crate::wheel_noise::Estimated;

/// The robot as its file describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nominal {
    /// Track width, metres.
    pub track_width: f64,
    /// Position of the sonar: ahead, left, metres.
    pub mount: [f64; 2],
    /// Shortest and longest range, metres.
    pub reach: [f64; 2],
    /// Range up to which the sonar hardly misses an echo, metres: what it returns is counted beyond.
    pub sure_within: f64,
    /// Noises.
    pub noise: Noise,
    /// Whether the recording's pings are those of a sonar on a servo, whose missing echoes are evidence of its bearing.
    pub has_servo: bool,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// The recording cannot be used.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The equations have no solution.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Neither ranges nor reference.
    #[error(
        "the log has no echo and there is no reference: nothing measures the wheels. Record ranges, or pass the true poses"
    )]
    NothingMeasured,
    /// The search finds no pose.
    #[error(
        "the log has no start pose, and the search finds none in its first 90 s: pass the start (x, y in metres, heading in \
         degrees), or check map and robot file"
    )]
    NoPose,
    /// Too short.
    #[error("the robot drives only {0:.1} m: at least 3 m are needed")]
    TooShort(f64),
    /// Too few inliers.
    #[error(
        "only {inliers} of {expected} echoes that the map explains fit it ({:.0} %, needed: {:.0} %): check map, start \
         pose and robot file, or record again with fewer unmapped objects",
        100.0 * share(*inliers, *expected), 100.0 * FEWEST_INLIERS
    )]
    FewInliers {
        /// Echoes within three deviations of their wall.
        inliers: usize,
        /// Echoes for which the map has a wall.
        expected: usize,
    },
    /// The path has left the map.
    #[error(
        "only {inliers} of {echoes} echoes are those of a wall of the map ({:.0} %, needed: {:.0} %): the estimated path is \
         not in the room. Check map, start pose and robot file",
        100.0 * share(*inliers, *echoes), 100.0 * FEWEST_EXPLAINED
    )]
    Unexplained {
        /// Echoes within three deviations of their wall.
        inliers: usize,
        /// All echoes.
        echoes: usize,
    },
    /// A constant is far outside of its prior.
    #[error(
        "the {} would be further from the robot file than any ruler is wrong: the solution is not the right one. Check \
         robot file, start pose and map",
        .0.label()
    )]
    Implausible(Name),
    /// The drive does not fit its model.
    #[error(
        "the wheels' noise would be {0:.0} mm/sqrt(m): the wheel travel does not fit the ranges. Check the robot file \
         (travel per edge, mirrored wheels), the start pose and the map"
    )]
    NoisyWheels(f64),
}

/// Smallest share of inliers among the echoes from walls. Right calibrations have 75 % and more, those with a room that is 10 cm longer and
/// narrower up to 64 %.
pub const FEWEST_INLIERS: f64 = 0.7;
/// Smallest share of the inliers of all echoes, unmapped objects and other echoes included. A path outside of the room has
/// no wall that an echo could contradict. Right calibrations explain more than a quarter of all echoes, wrong ones a few
/// percent.
pub const FEWEST_EXPLAINED: f64 = 0.15;
/// Smallest angle turned to either side for which wheel difference and track width are separated in any case, radians.
pub const BOTH_WAYS: f64 = std::f64::consts::PI;

/// How well a value is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Determined {
    /// By the recording.
    Yes,
    /// Only together with another value: the turns go to one side.
    Jointly,
    /// The interval is hardly narrower than the prior.
    No,
}

/// An estimated constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Which.
    pub name: Name,
    /// Its value.
    pub value: f64,
    /// Standard deviation, widened by the scatter between the halves.
    pub deviation: f64,
    /// Difference of the halves, in its own standard deviations.
    pub scatter: f64,
    /// How well it is known.
    pub determined: Determined,
}

/// A residual of the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Time, seconds.
    pub time: f64,
    /// Measured minus expected range, metres.
    pub value: f64,
    /// In standard deviations.
    pub normalized: f64,
    /// Its reflector: the walls of the map in their order, then their corners.
    pub reflector: usize,
}

/// A calibration.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The estimated constants.
    pub estimates: Vec<Estimate>,
    /// All constants.
    pub constants: Constants,
    /// The bearings, if the recording determines them.
    pub bearings: Option<Bearings>,
    /// Noises of the inliers.
    pub noise: Noise,
    /// The noise of the wheels, with its parts and intervals.
    pub wheel_noise: Estimated,
    /// Smoothed poses: time, pose, standard deviations.
    pub trajectory: Vec<(f64, Vector3<f64>, Vector3<f64>)>,
    /// Residuals of the associated ranges.
    pub residuals: Vec<Residual>,
    /// What the sonar measures at square and at oblique walls.
    pub echoes: Echoes,
    /// Echoes within three deviations of their wall.
    pub inliers: usize,
    /// Echoes for which the map has a wall.
    pub expected: usize,
    /// Poses compared with the reference stream.
    pub referenced: usize,
    /// Angles turned to the left and to the right, radians.
    pub turned: [f64; 2],
    /// Distance driven, metres.
    pub distance: f64,
}

/// `part` of `of`, 0 of nothing.
pub(crate) fn share(part: usize, of: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "numbers of pings")]
    let share = part as f64 / of.max(1) as f64;
    share
}
