//! The servo that turns the ranger: a bearing becomes a pulse, and a model says where the servo
//! points while it follows.
//!
//! Responsibilities:
//! - [`Calibration`]: pulse width ↔ bearing, from two measured points;
//! - [`Pace`]: how fast it turns, and how long it shakes before it stands still;
//! - [`Servo`]: the driver over [`SetDutyCycle`].
//!
//! A hobby servo has no feedback. Everything said here about where it points is the model's
//! word: it holds for a servo that is alive and not blocked. That one is not, the localizer's
//! gate finds out.
//!
//! # Non-finite policy
//! A NaN or infinite calibration, limit or bearing is a typed error; the servo stays where it is.

mod calibration;
mod motion;

use embedded_hal::pwm::SetDutyCycle;
use sonarfix::units::{Duration, Instant, Radians};

use crate::time::micros;

pub use calibration::{Calibration, MeasuredPulse};
use motion::Motion;
pub use sonarfix::config::Pace;

/// What does not describe a servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SettingError {
    /// The two measured points are not finite, or share a pulse width or a bearing.
    Calibration,
    /// The limits are not finite, or not a rightmost bearing below a leftmost one.
    Limits,
    /// A pulse at one of the limits does not fit into the frame.
    Pulse,
}

impl core::fmt::Display for SettingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Calibration => "a calibration needs two different, finite points",
            Self::Limits => "the limits must be finite, the rightmost below the leftmost",
            Self::Pulse => "a pulse at one of the limits does not fit into the frame",
        })
    }
}

impl core::error::Error for SettingError {}

/// Why the servo was not turned. It stays where it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PointError<E> {
    /// The bearing is beyond a limit, or NaN.
    OutOfReach,
    /// The PWM channel's error.
    Pwm(E),
}

impl<E: core::fmt::Debug> core::fmt::Display for PointError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::OutOfReach => f.write_str("the bearing is out of the servo's reach"),
            Self::Pwm(error) => write!(f, "the PWM channel: {error:?}"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for PointError<E> {}

/// A servo and what it is known to do.
///
/// ```
/// use embedded_hal_mock::eh1::pwm::{Mock, Transaction as Pwm};
/// use sonarfix::units::{Duration, Instant, Radians};
/// use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo};
///
/// // Two pulses tried on the bench, and where the sonar looked with each.
/// let calibration = Calibration::new(
///     MeasuredPulse { width: Duration::from_ticks(1_000), bearing: Radians::from_degrees(-45.0) },
///     MeasuredPulse { width: Duration::from_ticks(2_000), bearing: Radians::from_degrees(45.0) },
/// )?;
/// let limits = (Radians::from_degrees(-80.0), Radians::from_degrees(80.0));
///
/// // A timer with a 20 ms period of 40,000 counts: half a microsecond each.
/// let mut pwm = Mock::new(&[
///     Pwm::max_duty_cycle(40_000),
///     Pwm::set_duty_cycle(3_000), // 1,500 µs: straight ahead
/// ]);
/// let mut servo = Servo::new(&mut pwm, calibration, limits, Pace::SG90)?;
/// let now = Instant::from_ticks(0);
/// servo.point(now, Radians(0.0))?;
/// assert!(!servo.is_settled(now));
/// assert!(servo.is_settled(servo.settles_at()));
/// # drop(servo);
/// # pwm.done();
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Servo<P> {
    pwm: P,
    calibration: Calibration,
    limits: (Radians, Radians),
    motion: Motion,
    /// The duty that stands at the pin; `None` before the first.
    duty: Option<u16>,
}

impl<P: SetDutyCycle> Servo<P> {
    /// A servo that has not been pointed yet, so that nobody knows where it looks. `limits` are
    /// the rightmost and the leftmost bearing that it may be sent to, relative to the robot's
    /// heading; they should contain those of [`Sonar::servo`](sonarfix::config::Sonar::servo).
    ///
    /// # Errors
    /// [`SettingError`], by what is wrong with an argument.
    pub fn new(
        pwm: P,
        calibration: Calibration,
        limits: (Radians, Radians),
        pace: Pace,
    ) -> Result<Self, SettingError> {
        let (rightmost, leftmost) = limits;
        let in_order = rightmost < leftmost && rightmost.is_finite() && leftmost.is_finite();
        if !in_order {
            return Err(SettingError::Limits);
        }
        let frame = micros(pace.frame);
        let fits = |bearing| (0.0..=frame).contains(&calibration.pulse(bearing));
        if !fits(rightmost) || !fits(leftmost) {
            return Err(SettingError::Pulse);
        }
        Ok(Self { pwm, calibration, limits, motion: Motion::unknown(pace), duty: None })
    }

    /// Sends the servo to `bearing` (relative to the robot's heading) and returns at once.
    /// Pointing again to where it is already sent changes nothing, and costs no settling.
    ///
    /// The PWM's counts round the pulse, so the servo is sent to the nearest bearing they can
    /// make: [`Self::target`].
    ///
    /// # Errors
    /// [`PointError`]; the servo stays where it was sent before.
    pub fn point(&mut self, now: Instant, bearing: Radians) -> Result<(), PointError<P::Error>> {
        let (rightmost, leftmost) = self.limits;
        let in_reach = bearing >= rightmost && bearing <= leftmost;
        if !in_reach {
            return Err(PointError::OutOfReach);
        }
        let frame = micros(self.motion.pace().frame);
        let counts = f32::from(self.pwm.max_duty_cycle());
        let duty = to_duty(self.calibration.pulse(bearing) / frame * counts);
        if self.duty == Some(duty) {
            return Ok(());
        }
        self.pwm.set_duty_cycle(duty).map_err(PointError::Pwm)?;
        self.duty = Some(duty);
        let reached = self.calibration.bearing(f32::from(duty) / counts * frame);
        self.motion.start(now, reached, self.limits);
        Ok(())
    }

    /// The bearing it was sent to; `None` before the first [`Self::point`].
    #[must_use]
    pub fn target(&self) -> Option<Radians> {
        self.motion.target()
    }

    /// Where it points at `now`, by the model; `None` before the first [`Self::point`].
    #[must_use]
    pub fn bearing(&self, now: Instant) -> Option<Radians> {
        self.motion.bearing(now)
    }

    /// Whether it stands still at its target. Never before the first [`Self::point`].
    #[must_use]
    pub fn is_settled(&self, now: Instant) -> bool {
        self.target().is_some() && now >= self.settles_at()
    }

    /// When it stands still at its target; the end of time before the first [`Self::point`].
    #[must_use]
    pub fn settles_at(&self) -> Instant {
        self.motion.settles_at()
    }

    /// How long it would take, pointed to `bearing` at `now`, to stand still there.
    #[must_use]
    pub fn time_to(&self, now: Instant, bearing: Radians) -> Duration {
        self.motion.time_to(now, bearing, self.limits)
    }

    /// Gives the PWM channel back.
    pub fn release(self) -> P {
        self.pwm
    }
}

/// The nearest duty; the pulse was checked to lie inside the frame, so it fits.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and the maximum duty; the cast saturates in any case"
)]
fn to_duty(counts: f32) -> u16 {
    (counts + 0.5) as u16
}
