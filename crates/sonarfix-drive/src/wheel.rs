//! The speed of a wheel, by its encoder.
//!
//! The model of motor and gear is a first-order lag with dry friction: at the duty u the speed v of the wheel obeys
//!
//! ```text
//! τ v' = K (u − d sgn v) − v         K = v_full / (1 − d)
//! ```
//!
//! with the time constant τ, the speed `v_full` at the full voltage and the dead band d. The controller has two degrees of
//! freedom. The reference r follows the commanded speed with a limited acceleration, and the feed-forward is the duty with which
//! the model has the speed r. A PI controller corrects what is left of the error:
//!
//! ```text
//! u = d sgn r + (r + τ r') / K  +  Kp (r − v) + Ki ∫ (r − v) dt
//! Kp = τ / (K λ)    Ki = 1 / (K λ)
//! ```
//!
//! These gains cancel the pole of the motor, so that an error declines with the time constant λ (lambda tuning). The integral of
//! the measured speed is the travel, which the encoder counts exactly: its coarse steps do not accumulate.
//!
//! **Anti-windup.** While the duty is at its limit, the integral does not grow in the direction of the limit (conditional
//! integration).
//!
//! # Non-finite policy
//! [`SpeedController::new`] refuses NaN and infinity. [`SpeedController::update`] refuses a speed that is not finite, and changes
//! nothing.

use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, seconds};

use crate::clamped;

/// The longest period of [`SpeedController::update`].
pub const LONGEST_PERIOD: Duration = Duration::from_ticks(200_000);

/// A motor with gear, wheel and encoder, as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motor {
    /// Speed of the wheel on the floor at the full voltage.
    pub full_speed: MetresPerSecond,
    /// The duty below which the wheel does not turn, 0 to less than 1.
    pub dead_band: f32,
    /// The time in which the speed makes 63 % of its change after a step of the voltage.
    pub time_constant: Duration,
    /// Travel ahead for a tick of plus one: negative for an encoder that counts down.
    pub travel_per_tick: Metres,
}

/// What the controller is to do with the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// The time constant with which an error of the speed declines.
    pub response: Duration,
    /// The shortest time from rest to the full speed.
    pub ramp: Duration,
    /// The largest duty, more than the dead band and at most 1.
    pub duty: f32,
}

/// Why a controller was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SettingsError {
    /// The full speed is not positive and finite.
    FullSpeed,
    /// The dead band is not in 0 to less than 1.
    DeadBand,
    /// The time constant is zero.
    TimeConstant,
    /// The travel per tick is zero or not finite.
    TravelPerTick,
    /// The response time is zero.
    Response,
    /// The ramp is zero.
    Ramp,
    /// The largest duty is not more than the dead band, or more than 1.
    Duty,
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::FullSpeed => "the full speed must be positive and finite",
            Self::DeadBand => "the dead band must be 0 to less than 1",
            Self::TimeConstant => "the motor's time constant must be positive",
            Self::TravelPerTick => "the travel per tick must be finite and not zero",
            Self::Response => "the response time must be positive",
            Self::Ramp => "the ramp must be positive",
            Self::Duty => "the largest duty must be more than the dead band and at most 1",
        })
    }
}

impl core::error::Error for SettingsError {}

/// Why an update was refused. The controller is as it was before, and the duty before it is not renewed: the caller stops the
/// motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum UpdateError {
    /// The commanded speed is not finite.
    Speed,
    /// The period is zero or longer than [`LONGEST_PERIOD`]. After a pause the controller is stopped first.
    Period,
}

impl core::fmt::Display for UpdateError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Speed => "the commanded speed is not finite",
            Self::Period => "the period is zero or too long",
        })
    }
}

impl core::error::Error for UpdateError {}

/// The speed controller of a wheel.
///
/// ```
/// use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond};
/// use sonarfix_drive::wheel::{Limits, Motor, SpeedController};
/// let motor = Motor {
///     full_speed: MetresPerSecond(0.5),
///     dead_band: 0.15,
///     time_constant: Duration::from_ticks(80_000),
///     travel_per_tick: Metres(0.000_489),
/// };
/// let limits = Limits {
///     response: Duration::from_ticks(150_000),
///     ramp: Duration::from_ticks(500_000),
///     duty: 1.0,
/// };
/// let mut wheel = SpeedController::new(motor, limits)?;
/// // Every 20 ms, with the position of the encoder in ticks:
/// let period = Duration::from_ticks(20_000);
/// let duty = wheel.update(MetresPerSecond(0.2), 0, period).unwrap_or(0.0);
/// assert!(duty > 0.15 && duty < 1.0);
/// wheel.stop();
/// # Ok::<(), sonarfix_drive::wheel::SettingsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpeedController {
    motor: Motor,
    limits: Limits,
    gains: Gains,
    /// The reference r, m/s.
    reference: f32,
    /// The integral of r − v: how far the wheel is behind its reference, metres.
    behind: f32,
    /// The position at the last update; `None` while it is stopped.
    position: Option<i64>,
    is_saturated: bool,
}

/// Gains in duty.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Gains {
    /// Per m/s of the reference: 1 / K.
    speed: f32,
    /// Per m/s² of the reference: τ / K.
    acceleration: f32,
    /// Per m/s of error.
    proportional: f32,
    /// Per metre of error.
    integral: f32,
    /// The largest change of the reference, m/s².
    ramp: f32,
}

impl SpeedController {
    /// A controller at rest.
    ///
    /// # Errors
    /// [`SettingsError`] of the first value that is not valid.
    pub fn new(motor: Motor, limits: Limits) -> Result<Self, SettingsError> {
        check(&motor, &limits)?;
        let time_constant = seconds(motor.time_constant);
        let speed = (1.0 - motor.dead_band) / motor.full_speed.0;
        let integral = speed / seconds(limits.response);
        let gains = Gains {
            speed,
            acceleration: time_constant * speed,
            proportional: time_constant * integral,
            integral,
            ramp: motor.full_speed.0 / seconds(limits.ramp),
        };
        let (reference, behind) = (0.0, 0.0);
        Ok(Self { motor, limits, gains, reference, behind, position: None, is_saturated: false })
    }

    /// The duty for the next period, −1 to 1, positive ahead; zero once a commanded speed of zero is reached. A speed beyond
    /// the full speed is limited to it.
    ///
    /// `position` is that of the encoder in ticks, from any origin (`Unwrapped` of `sonarfix-hal`); `period` is the time since
    /// the last update. A period in which the wheel makes some ticks is long enough.
    ///
    /// # Errors
    /// [`UpdateError`]; nothing has changed.
    pub fn update(
        &mut self,
        speed: MetresPerSecond,
        position: i64,
        period: Duration,
    ) -> Result<f32, UpdateError> {
        if !speed.is_finite() {
            return Err(UpdateError::Speed);
        }
        if period.ticks() == 0 || period > LONGEST_PERIOD {
            return Err(UpdateError::Period);
        }
        let period = seconds(period);
        let travel = self.travel(position);
        // The error of the past period is that against the reference of the past period.
        let missing = self.reference * period - travel;
        let acceleration = self.follow(speed.0, period);
        if self.is_at_rest(speed.0) {
            (self.behind, self.is_saturated) = (0.0, false);
            return Ok(0.0);
        }
        let Gains { speed: per_speed, acceleration: per_acceleration, proportional, .. } =
            self.gains;
        let friction = self.motor.dead_band * sign(self.reference);
        let forward = friction + per_speed * self.reference + per_acceleration * acceleration;
        let error = missing / period;
        Ok(self.limited(forward + proportional * error, missing))
    }

    /// Stops at once: the next update begins at rest, with the position at that time. The caller sets the duty to zero.
    pub fn stop(&mut self) {
        self.reference = 0.0;
        self.behind = 0.0;
        self.position = None;
        self.is_saturated = false;
    }

    /// Whether the last duty was at its limit: the motor is too weak for the commanded speed, or does not turn.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        self.is_saturated
    }

    /// The travel since the last update, metres.
    fn travel(&mut self, position: i64) -> f32 {
        let ticks = self.position.map_or(0, |last| position.wrapping_sub(last));
        self.position = Some(position);
        #[expect(clippy::cast_precision_loss, reason = "2²⁴ ticks are kilometres")]
        let ticks = ticks as f32;
        ticks * self.motor.travel_per_tick.0
    }

    /// Moves the reference towards the commanded speed; returns its acceleration, m/s².
    fn follow(&mut self, speed: f32, period: f32) -> f32 {
        let full = self.motor.full_speed.0;
        let change = clamped(speed, full) - self.reference;
        let most = self.gains.ramp * period;
        let change = clamped(change, most);
        self.reference += change;
        change / period
    }

    /// Whether a commanded speed of zero is reached.
    fn is_at_rest(&self, speed: f32) -> bool {
        let is_zero = |speed: f32| speed.abs() <= 0.0;
        is_zero(speed) && is_zero(self.reference)
    }

    /// The duty with its integral part, which takes the distance `missing` in this period, within the limits.
    fn limited(&mut self, without: f32, missing: f32) -> f32 {
        let most = self.limits.duty;
        let behind = self.behind + missing;
        let duty = without + self.gains.integral * behind;
        let limited = clamped(duty, most);
        self.is_saturated = duty.abs() > most;
        if !self.is_saturated || missing * duty < 0.0 {
            self.behind = behind;
        }
        limited
    }
}

/// −1, 0 or 1.
fn sign(value: f32) -> f32 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        0.0
    }
}

fn check(motor: &Motor, limits: &Limits) -> Result<(), SettingsError> {
    let Motor { full_speed, dead_band, time_constant, travel_per_tick } = *motor;
    let Limits { response, ramp, duty } = *limits;
    let is_positive = |duration: Duration| duration.ticks() > 0;
    // A comparison with NaN does not hold.
    let checks = [
        (full_speed.0 > 0.0 && full_speed.is_finite(), SettingsError::FullSpeed),
        ((0.0..1.0).contains(&dead_band), SettingsError::DeadBand),
        (is_positive(time_constant), SettingsError::TimeConstant),
        (
            travel_per_tick.is_finite() && travel_per_tick.abs().0 > 0.0,
            SettingsError::TravelPerTick,
        ),
        (is_positive(response), SettingsError::Response),
        (is_positive(ramp), SettingsError::Ramp),
        (duty > dead_band && duty <= 1.0, SettingsError::Duty),
    ];
    checks.into_iter().find(|(is_valid, _)| !is_valid).map_or(Ok(()), |(_, error)| Err(error))
}
