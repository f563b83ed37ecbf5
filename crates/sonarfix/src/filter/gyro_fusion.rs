//! The turns of a gyro beside those of the wheels (`docs/model.md`, "Gyro").
//!
//! | wheels | gyro | |
//! |---|---|---|
//! | roll | agrees | both turns are combined by their noise; their difference, summed over a second, corrects bias and calibration |
//! | roll | differs by more than both explain | a wheel slips: the turn is the gyro's, the advance is uncertain by the slip |
//! | roll | differs for [`LONGEST_SLIP`] | the gyro may be wrong: its bias is estimated again, the heading is uncertain by the difference |
//! | stand for a second | agrees with its bias | the bias is corrected; the pose does not change |
//! | stand | turns | the robot was turned with standing wheels: as a slip |
//! | any | fails | the wheels alone |
//!
//! # Non-finite policy
//! A turn that is not finite is refused by [`MeasuredTurn::check`]; the wheels alone are used.

use crate::filter::covariance::{GyroBias, TurnDifference};
use crate::filter::ekf::{Ekf, EkfError, GyroTurn, SlipLimits, TurnAgreement};
use crate::filter::motion::WheelTravel;
use crate::geometry::elementary::sqrt;
use crate::geometry::units::{Duration, Radians, RadiansPerSecond, seconds};
use crate::sensor::gyro::{GyroLinked, GyroParameters, MeasuredTurn, TurnRefusal};

/// Standard deviations up to which a difference of turns is noise.
const GATE: f32 = 5.0;
/// A difference in one step up to this angle, rad, is no slip: the edges of coarse encoders and the delay of a gyro's
/// filter in a change of the turn rate cause as much.
const SMALLEST_SLIP: f32 = 0.005;
/// Time over which differences are summed, and that a robot stands before its bias is measured, seconds.
const WINDOW: f32 = 0.99;
/// Time without a slip after which the next is another one, seconds.
const PAUSE: f32 = 0.5;
/// Time in which wheels and gyro differ without a [`PAUSE`], after which it may be the gyro that is wrong, seconds.
const LONGEST_SLIP: f32 = 3.0;

/// What became of the latest turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum TurnUse {
    /// There was none: the wheels alone are used.
    Missing,
    /// It was refused: the wheels alone are used.
    Refused(TurnRefusal),
    /// The wheels stand; it is collected.
    Standing,
    /// It was combined with the turn of the wheels.
    Combined,
    /// A wheel slips: the turn is the gyro's.
    WheelSlip,
}

/// The state of a gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroStatus {
    /// The estimated bias.
    pub bias: RadiansPerSecond,
    /// Its standard deviation.
    pub deviation: RadiansPerSecond,
    /// What became of the latest turn.
    pub latest: TurnUse,
    /// Slips of the wheels since the start.
    pub slips: u32,
    /// How often wheels and gyro differed for so long that the gyro may be wrong.
    pub conflicts: u32,
}

/// A gyro's bias, and what has been collected of its turns.
#[derive(Debug, Clone, Copy)]
pub struct GyroFusion {
    bias: GyroBias,
    /// The turn since the wheels stand, angle and seconds; `None` if a part of it is missing.
    standing: Option<(f32, f32)>,
    /// Differences that have not corrected anything yet.
    difference: TurnDifference,
    slip: Slip,
    latest: TurnUse,
    slips: u32,
    conflicts: u32,
    /// Without the feature `gyro` it has no value, and no code of it is linked.
    _linked: GyroLinked,
}

/// The present slip: its time, the time since its last step, and the difference that it has caused.
#[derive(Debug, Clone, Copy, Default)]
struct Slip {
    lasts: f32,
    quiet: f32,
    angle: f32,
}

#[expect(
    clippy::manual_map,
    clippy::ref_option,
    reason = "the compiler removes an arm without values here, but not a call of `map`, which takes a reference"
)]
impl GyroFusion {
    pub fn new(parameters: &GyroParameters) -> Self {
        Self {
            bias: GyroBias::unknown(parameters.bias.0),
            standing: Some((0.0, 0.0)),
            difference: TurnDifference::default(),
            slip: Slip::default(),
            latest: TurnUse::Missing,
            slips: 0,
            conflicts: 0,
            _linked: parameters.linked,
        }
    }

    fn status(&self) -> GyroStatus {
        GyroStatus {
            bias: RadiansPerSecond(self.bias.rate),
            deviation: RadiansPerSecond(sqrt(self.bias.variance())),
            latest: self.latest,
            slips: self.slips,
            conflicts: self.conflicts,
        }
    }

    /// That of a robot with these parameters.
    #[allow(unreachable_code, reason = "without the feature there are none")]
    pub fn of(parameters: &Option<GyroParameters>) -> Option<Self> {
        match parameters {
            Some(parameters) => Some(Self::new(parameters)),
            None => None,
        }
    }

    /// The bias, for the correction by a range.
    #[inline]
    pub fn bias_of(gyro: &mut Option<Self>) -> Option<&mut GyroBias> {
        match gyro {
            Some(gyro) => Some(&mut gyro.bias),
            None => None,
        }
    }

    /// The status, if there is a gyro.
    pub fn status_of(gyro: &Option<Self>) -> Option<GyroStatus> {
        match gyro {
            Some(gyro) => Some(gyro.status()),
            None => None,
        }
    }

    /// The pose was replaced.
    pub fn forget_pose(&mut self) {
        self.bias.forget_pose();
    }

    /// All states were replaced.
    pub fn forget_states(&mut self) {
        self.bias = self.bias.independent();
        self.difference = TurnDifference::default();
    }

    /// Predicts over a step with a measured turn.
    ///
    /// # Errors
    /// As of [`Ekf::predict`]; neither has changed.
    pub fn predict(
        &mut self,
        ekf: &mut Ekf,
        travel: WheelTravel,
        elapsed: Duration,
        turn: Option<MeasuredTurn>,
        parameters: &GyroParameters,
    ) -> Result<(), EkfError> {
        let mut next = *self;
        next.step(ekf, travel, elapsed, turn, parameters)?;
        *self = next;
        Ok(())
    }

    fn step(
        &mut self,
        ekf: &mut Ekf,
        travel: WheelTravel,
        elapsed: Duration,
        turn: Option<MeasuredTurn>,
        parameters: &GyroParameters,
    ) -> Result<(), EkfError> {
        let walk = parameters.bias_walk.0.0;
        let prior = parameters.bias.0;
        self.bias.walk(walk * walk * seconds(elapsed), prior * prior);
        let checked = turn.map(|turn| turn.check(parameters, elapsed).map(|()| turn));
        self.latest = match checked {
            None => TurnUse::Missing,
            Some(Err(refusal)) => TurnUse::Refused(refusal),
            Some(Ok(_)) => TurnUse::Combined,
        };
        let together = match (self.standing, checked) {
            (Some((angle, time)), Some(Ok(turn))) => {
                Some((angle + turn.angle.0, time + seconds(turn.duration)))
            }
            _ => None,
        };
        if travel.distance().0 <= 0.0 {
            self.standing = together;
            return self.stand(ekf, travel, parameters);
        }
        self.standing = Some((0.0, 0.0));
        let Some((angle, time)) = together else {
            return ekf.predict_with_bias(travel, &mut self.bias);
        };
        self.roll(ekf, travel, (angle, time), parameters)
    }

    /// Combines a turn with that of the wheels.
    fn roll(
        &mut self,
        ekf: &mut Ekf,
        travel: WheelTravel,
        (angle, time): (f32, f32),
        parameters: &GyroParameters,
    ) -> Result<(), EkfError> {
        let noise = parameters.variance(angle - self.bias.rate * time, time);
        let turn = GyroTurn { angle, seconds: time, noise };
        let limits = SlipLimits { deviations: GATE, angle: SMALLEST_SLIP };
        match ekf.predict_with_turn(travel, &turn, limits, &mut self.bias)? {
            TurnAgreement::Agree(difference) => {
                self.add(ekf, &difference);
                self.slip.quiet += time;
            }
            TurnAgreement::Differ(by) => self.record_slip(ekf, by, time, parameters),
        }
        Ok(())
    }

    // ===== Eq. (38): differences summed over a second =====
    fn add(&mut self, ekf: &mut Ekf, difference: &TurnDifference) {
        self.difference = self.difference.plus(difference);
        if self.difference.by_b >= WINDOW {
            // A sum that does not agree contains a slip too slow to be seen in a step, and is dropped.
            _ = ekf.correct_by_turns(&self.difference, GATE, &mut self.bias);
            self.difference = TurnDifference::default();
        }
    }

    /// Records a step in which wheels and gyro differ.
    fn record_slip(&mut self, ekf: &mut Ekf, by: f32, time: f32, parameters: &GyroParameters) {
        self.latest = TurnUse::WheelSlip;
        self.difference = TurnDifference::default();
        if self.slip.quiet > PAUSE || self.slip.lasts <= 0.0 {
            self.slip = Slip::default();
            self.slips = self.slips.saturating_add(1);
        }
        self.slip = Slip {
            lasts: self.slip.lasts + self.slip.quiet + time,
            quiet: 0.0,
            angle: self.slip.angle + by,
        };
        if self.slip.lasts >= LONGEST_SLIP {
            ekf.inflate_heading(Radians(self.slip.angle));
            self.bias = self.bias.forgotten(parameters.bias.0);
            self.slip = Slip::default();
            self.conflicts = self.conflicts.saturating_add(1);
        }
    }

    /// Measures the bias of a robot whose wheels stand, once a second.
    fn stand(
        &mut self,
        ekf: &mut Ekf,
        travel: WheelTravel,
        parameters: &GyroParameters,
    ) -> Result<(), EkfError> {
        let Some((angle, time)) = self.standing else {
            // The next step begins another measurement.
            self.standing = Some((0.0, 0.0));
            return Ok(());
        };
        if self.latest == TurnUse::Combined {
            self.latest = TurnUse::Standing;
        }
        if time < WINDOW {
            return Ok(());
        }
        self.standing = Some((0.0, 0.0));
        let noise = parameters.variance(0.0, time);
        let still = TurnDifference { value: angle, by_b: time, noise, ..TurnDifference::default() };
        if ekf.correct_by_turns(&still, GATE, &mut self.bias) {
            return Ok(());
        }
        self.roll(ekf, travel, (angle, time), parameters)
    }
}

#[cfg(test)]
#[cfg(feature = "gyro")]
mod tests;
