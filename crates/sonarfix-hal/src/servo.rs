//! The servo that turns the ranger: converts a bearing to a pulse, and models the bearing while the servo turns.
//!
//! - [`Calibration`]: pulse width ↔ bearing, from two measured points;
//! - [`ServoTiming`]: speed and settling time; the model is [`sonarfix::sensor::servo::ServoMotion`];
//! - [`ServoSettings`]: the settings of the driver; [`PwmFrame`]: the pulses that a channel can generate;
//! - [`Servo`]: the driver over [`SetDutyCycle`]; [`Servo::settles_at`] is the end of the settle wait;
//! - [`Servo::fix`]: the same for a ranger that is mounted at a fixed bearing; [`NoPwm`] is the channel of a board that
//!   has none.
//!
//! A hobby servo has no feedback. The bearing is that of the model, which assumes a servo that is connected and not
//! blocked; a stalled servo is only detected by innovation gating.
//!
//! # Non-finite policy
//! A NaN or infinite calibration, limit or bearing is a typed error; the servo stays where it is.

mod calibration;
mod error;
mod motion;
mod no_pwm;
mod settings;

use embedded_hal::pwm::SetDutyCycle;
use sonarfix::geometry::units::{Instant, Radians};

use crate::time::{NEVER, micros};

pub use calibration::{Calibration, MeasuredPulse};
pub use error::{PointError, SettingError};
pub use no_pwm::NoPwm;
use settings::Setup;
pub use settings::{PwmFrame, ServoSettings};
pub use sonarfix::config::ServoTiming;

/// The driver of a servo.
///
/// ```
/// use embedded_hal_mock::eh1::pwm::{Mock, Transaction as Pwm};
/// use sonarfix::geometry::units::{Duration, Instant, Radians};
/// use sonarfix_hal::servo::{MeasuredPulse, Servo, ServoSettings, ServoTiming};
///
/// // Two pulses, and the bearing that was measured with each.
/// let settings = ServoSettings {
///     pulses: [
///         MeasuredPulse { width: Duration::from_ticks(1_000), bearing: Radians::from_degrees(-45.0) },
///         MeasuredPulse { width: Duration::from_ticks(2_000), bearing: Radians::from_degrees(45.0) },
///     ],
///     limits: (Radians::from_degrees(-80.0), Radians::from_degrees(80.0)),
///     timing: ServoTiming::SG90,
/// };
///
/// // A timer with a 20 ms period of 40,000 counts: half a microsecond each.
/// let mut pwm = Mock::new(&[
///     Pwm::max_duty_cycle(40_000),
///     Pwm::set_duty_cycle(3_000), // 1,500 µs: straight ahead
/// ]);
/// let mut servo = Servo::configured(&mut pwm, settings)?;
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
    frame: PwmFrame,
    mounting: Mounting,
    /// The present duty; `None` before the first.
    duty: Option<u16>,
}

/// How the ranger is mounted.
#[derive(Debug)]
enum Mounting {
    /// Not configured.
    Unknown,
    /// On a servo.
    Turning(Setup),
    /// At a fixed bearing, since the first command to point there.
    Fixed { bearing: Radians, pointed_at: Option<Instant> },
}

impl<P> Servo<P> {
    /// A driver without settings, on a channel with these pulses.
    #[must_use]
    pub const fn new(pwm: P, frame: PwmFrame) -> Self {
        Self { pwm, frame, mounting: Mounting::Unknown, duty: None }
    }

    /// A configured driver whose bearing is unknown before the first [`Self::point`], on a channel that generates
    /// any pulse within the servo's frame.
    ///
    /// # Errors
    /// [`SettingError`], by what is wrong with the settings.
    pub fn configured(pwm: P, settings: ServoSettings) -> Result<Self, SettingError> {
        let mut servo = Self::new(pwm, PwmFrame::of(settings.timing.frame));
        servo.configure(&settings)?;
        Ok(servo)
    }

    /// Checks settings without applying them.
    ///
    /// # Errors
    /// [`SettingError`], by what is wrong with them.
    pub fn check(&self, settings: &ServoSettings) -> Result<(), SettingError> {
        Setup::of(settings, &self.frame).map(|_| ())
    }

    /// Applies settings. If they differ from the present ones, the bearing is unknown until the next
    /// [`Self::point`].
    ///
    /// # Errors
    /// [`SettingError`], by what is wrong with them; nothing has changed.
    pub fn configure(&mut self, settings: &ServoSettings) -> Result<(), SettingError> {
        let setup = Setup::of(settings, &self.frame)?;
        if self.setup().is_none_or(|before| before.settings != *settings) {
            (self.mounting, self.duty) = (Mounting::Turning(setup), None);
        }
        Ok(())
    }

    /// Configures the driver for a ranger without a servo, at this bearing. It points nowhere else, and generates no pulse.
    pub fn fix(&mut self, bearing: Radians) {
        (self.mounting, self.duty) = (Mounting::Fixed { bearing, pointed_at: None }, None);
    }

    fn setup(&self) -> Option<&Setup> {
        match &self.mounting {
            Mounting::Turning(setup) => Some(setup),
            Mounting::Unknown | Mounting::Fixed { .. } => None,
        }
    }

    /// Releases the PWM channel.
    pub fn release(self) -> P {
        self.pwm
    }
}

impl<P: SetDutyCycle> Servo<P> {
    /// Turns the servo to `bearing` (relative to the robot's heading) and returns at once. A repeated command to the
    /// same bearing has no effect and needs no settling.
    ///
    /// The pulse is quantized by the counts of the PWM; [`Self::target`] is the resulting bearing.
    ///
    /// # Errors
    /// [`PointError`]; the servo keeps its target.
    pub fn point(&mut self, now: Instant, bearing: Radians) -> Result<(), PointError<P::Error>> {
        let setup = match &mut self.mounting {
            Mounting::Unknown => return Err(PointError::NotConfigured),
            Mounting::Turning(setup) => setup,
            Mounting::Fixed { bearing: fixed, pointed_at } => {
                let is_there = bearing.0.to_bits() == fixed.0.to_bits();
                *pointed_at = is_there.then_some(now).or(*pointed_at);
                return if is_there { Ok(()) } else { Err(PointError::OutOfReach) };
            }
        };
        let ServoSettings { limits, timing, .. } = setup.settings;
        let (rightmost, leftmost) = limits;
        let in_reach = bearing >= rightmost && bearing <= leftmost;
        if !in_reach {
            return Err(PointError::OutOfReach);
        }
        let frame = micros(timing.frame);
        let counts = f32::from(self.pwm.max_duty_cycle());
        let duty = to_duty(setup.calibration.pulse(bearing) / frame * counts);
        if self.duty == Some(duty) {
            return Ok(());
        }
        self.pwm.set_duty_cycle(duty).map_err(PointError::Pwm)?;
        self.duty = Some(duty);
        let reached = setup.calibration.bearing(f32::from(duty) / counts * frame);
        setup.motion.start(now, reached, limits);
        Ok(())
    }
}

impl<P> Servo<P> {
    /// The target bearing; `None` before the first [`Self::point`] of a servo. That of a fixed ranger is its bearing.
    #[must_use]
    pub fn target(&self) -> Option<Radians> {
        match &self.mounting {
            Mounting::Unknown => None,
            Mounting::Turning(setup) => setup.motion.target(),
            Mounting::Fixed { bearing, .. } => Some(*bearing),
        }
    }

    /// The width of the present pulses, µs; `None` before the first [`Self::point`], and without a servo.
    #[must_use]
    pub fn pulse(&self) -> Option<f32> {
        let setup = self.setup()?;
        Some(setup.calibration.pulse(setup.motion.target()?))
    }

    /// The bearing at `now` by the model; `None` before the first [`Self::point`] of a servo.
    #[must_use]
    pub fn bearing(&self, now: Instant) -> Option<Radians> {
        match &self.mounting {
            Mounting::Turning(setup) => setup.motion.bearing(now),
            Mounting::Unknown | Mounting::Fixed { .. } => self.target(),
        }
    }

    /// Whether it has settled at its target. False before the first [`Self::point`].
    #[must_use]
    pub fn is_settled(&self, now: Instant) -> bool {
        self.target().is_some() && now >= self.settles_at()
    }

    /// The clock was set back to `now`: it settles as from an unknown bearing.
    pub fn set_clock(&mut self, now: Instant) {
        match &mut self.mounting {
            Mounting::Turning(setup) => setup.motion.set_clock(now, setup.settings.limits),
            Mounting::Fixed { pointed_at, .. } => *pointed_at = pointed_at.map(|_| now),
            Mounting::Unknown => {}
        }
    }

    /// The instant at which it is at its target and still oscillates by a few degrees; centuries ahead before the first
    /// [`Self::point`]. A fixed ranger is there with the command.
    #[must_use]
    pub fn arrives_at(&self) -> Instant {
        match &self.mounting {
            Mounting::Turning(setup) => setup.motion.arrives_at(),
            Mounting::Unknown | Mounting::Fixed { .. } => self.settles_at(),
        }
    }

    /// The instant at which it has settled at its target; centuries ahead before the first
    /// [`Self::point`]. A fixed ranger has settled with the command.
    #[must_use]
    pub fn settles_at(&self) -> Instant {
        match &self.mounting {
            Mounting::Turning(setup) => setup.motion.settles_at(),
            Mounting::Fixed { pointed_at: Some(at), .. } => *at,
            Mounting::Unknown | Mounting::Fixed { .. } => NEVER,
        }
    }
}

/// The nearest duty. The pulse has been checked to be within the frame.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and the maximum duty; the cast saturates in any case"
)]
fn to_duty(counts: f32) -> u16 {
    (counts + 0.5) as u16
}
