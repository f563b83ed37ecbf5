//! Aims: the wall to measure next.

#![expect(unsafe_code, reason = "exports a function to C")]

use sonarfix::aim::{Aim, Reason, Standing};
use sonarfix::config::RangerId;
use sonarfix::geometry::units::{Duration, Metres, Radians, SquareMetres};
use sonarfix::map::WallId;

use crate::config::policy_of;
use crate::memory::{give, value};
use crate::state::{finite, micros};
use crate::status::{Result, sonarfix_status_t};

/// The wall of an aim that is a step of the sweep of a search.
pub const SONARFIX_WALL_OF_SWEEP: u32 = u32::MAX;

/// One ping of one ranger: at a wall, or of the sweep of a search.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_aim_t {
    /// Number of the wall in the map; SONARFIX_WALL_OF_SWEEP while a search determines the pose.
    pub wall: u32,
    /// Number of the ranger, from 0.
    pub ranger: u32,
    /// Bearing of the servo, radians, counter-clockwise from the robot's heading.
    pub bearing_rad: f32,
    /// The range expected now, metres; zero in a sweep.
    pub range_m: f32,
    /// Expected decrease of the variance of the position and of the other weighted states, square metres.
    pub gain_m2: f32,
    /// Probability that the wall returns its range.
    pub success: f32,
    /// Duration of the ping, microseconds: servo, ranger and flight of sound.
    pub duration_us: u32,
    /// Number of walls that can be measured.
    pub candidates: u32,
}

impl From<Aim> for sonarfix_aim_t {
    fn from(aim: Aim) -> Self {
        Self {
            wall: aim.wall.0,
            ranger: u32::from(aim.ranger.0),
            bearing_rad: aim.bearing.0,
            range_m: aim.range.0,
            gain_m2: aim.why.gain.0,
            success: aim.why.success,
            duration_us: micros(aim.why.time),
            candidates: u32::from(aim.why.candidates),
        }
    }
}

/// The number of a ranger.
pub(crate) fn ranger_of(number: u32) -> Result<RangerId> {
    let ranger = u8::try_from(number).map(RangerId);
    ranger.map_err(|_| sonarfix_status_t::SONARFIX_ERROR_VALUE)
}

impl sonarfix_aim_t {
    /// A ping of the first ranger along a bearing that a search has chosen.
    #[cfg(feature = "search")]
    pub(crate) fn of_sweep(bearing: Radians) -> Self {
        Self {
            wall: SONARFIX_WALL_OF_SWEEP,
            ranger: 0,
            bearing_rad: bearing.0,
            range_m: 0.0,
            gain_m2: 0.0,
            success: 0.0,
            duration_us: 0,
            candidates: 0,
        }
    }

    /// The aim with the numbers behind it.
    fn aim(&self) -> Result<Aim> {
        let why = Reason {
            gain: SquareMetres(self.gain_m2),
            success: self.success,
            time: Duration::from_ticks(u64::from(self.duration_us)),
            candidates: u16::try_from(self.candidates).unwrap_or(u16::MAX),
        };
        Ok(Aim { why, ..self.target()? })
    }

    /// The aim for a measurement, to which the numbers behind it do not matter.
    #[inline]
    pub(crate) fn target(&self) -> Result<Aim> {
        Ok(Aim {
            wall: WallId(self.wall),
            bearing: Radians(finite(self.bearing_rad)?),
            range: Metres(finite(self.range_m)?),
            why: Reason {
                gain: SquareMetres(0.0),
                success: 0.0,
                time: Duration::from_ticks(0),
                candidates: 0,
            },
            ranger: ranger_of(self.ranger)?,
        })
    }
}

/// Where the servo of a ranger stands, and when it can ping.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_standing_t {
    /// The bearing to which its servo is commanded, radians from the robot's heading.
    pub bearing_rad: f32,
    /// Time until it can ping there, microseconds.
    pub ready_in_us: u32,
    /// 0 before the first command of the servo: bearing_rad has no meaning.
    pub has_bearing: u8,
}

impl sonarfix_standing_t {
    pub(crate) fn standing(&self) -> Result<Standing> {
        let bearing = (self.has_bearing != 0).then(|| finite(self.bearing_rad)).transpose()?;
        let ready_in = Duration::from_ticks(u64::from(self.ready_in_us));
        Ok(Standing { bearing: bearing.map(Radians), ready_in })
    }
}

/// Computes what a policy maximizes over all rangers of a robot: the expected gain per time, or the nearness.
///
/// @param aim  an aim
/// @param policy  a sonarfix_policy_t
/// @param score  gets the score, in square metres per second or in 1/metre
/// @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such policy; or an error of a pointer or a number of the aim
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_aim_score(
    aim: *const sonarfix_aim_t,
    policy: i32,
    score: *mut f32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { give(score, || Ok(value(aim)?.aim()?.score(policy_of(policy)?))) }
}
