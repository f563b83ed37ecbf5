//! The devices that the loop uses.

use embedded_hal::pwm::SetDutyCycle;
use sonarfix::config::{MAX_RANGERS, RangerId};
use sonarfix::geometry::units::{Instant, Metres, RadiansPerSecond};
use sonarfix::sensor::gyro::GyroParameters;

use crate::config::{RobotConfig, Unsupported};
use crate::encoder::Counter;
use crate::gyro::{Unreadable, YawRate};
use crate::ranger::Ranger;
use crate::servo::Servo;
use crate::time::micros;

use super::Settings;

/// The devices of a robot. A board implements it for a type of its own, or uses [`Devices`].
pub trait Hardware {
    /// Counter of the right wheel.
    type Right: Counter;
    /// Counter of the left wheel.
    type Left: Counter;
    /// PWM channel of the servo; [`NoPwm`](crate::servo::NoPwm) without one.
    type Pwm: SetDutyCycle;
    /// The ranger on the servo; those of a robot with several have one type.
    type Ranger: Ranger;

    /// The right wheel's counter.
    fn right(&mut self) -> &mut Self::Right;
    /// The left wheel's counter.
    fn left(&mut self) -> &mut Self::Left;
    /// The servo of the first ranger.
    fn servo(&mut self) -> &mut Servo<Self::Pwm>;
    /// The first ranger.
    fn ranger(&mut self) -> &mut Self::Ranger;

    /// Whether the robot has this ranger.
    fn has_ranger(&self, ranger: RangerId) -> bool {
        ranger == RangerId::FIRST
    }

    /// The servo of a ranger that the robot [has](Self::has_ranger).
    fn servo_of(&mut self, _: RangerId) -> &mut Servo<Self::Pwm> {
        self.servo()
    }

    /// A ranger that the robot [has](Self::has_ranger).
    fn ranger_of(&mut self, _: RangerId) -> &mut Self::Ranger {
        self.ranger()
    }

    /// The rate of the gyro now; `None` without a gyro.
    fn yaw_rate(&mut self) -> Option<Result<RadiansPerSecond, Unreadable>> {
        None
    }

    /// The clock was set back to `now`: no device waits for a time of the clock before.
    fn set_clock(&mut self, now: Instant) {
        let mut ranger = RangerId::FIRST;
        while ranger.index() < MAX_RANGERS && self.has_ranger(ranger) {
            self.ranger_of(ranger).set_clock(now);
            self.servo_of(ranger).set_clock(now);
            ranger.0 = ranger.0.saturating_add(1);
        }
    }

    /// Configures the gyro of this robot.
    ///
    /// # Errors
    /// [`Unsupported::Gyro`], if the robot has one and these devices do not, or if it does not respond.
    fn configure_gyro(&mut self, parameters: Option<&GyroParameters>) -> Result<(), Unsupported> {
        if parameters.is_some() { Err(Unsupported::Gyro) } else { Ok(()) }
    }

    /// Configures the drivers for this robot. The configuration has passed [`RobotConfig::check`].
    ///
    /// # Errors
    /// [`Unsupported`], if these devices cannot do it; nothing has changed.
    fn configure(&mut self, config: &RobotConfig) -> Result<(), Unsupported> {
        let right = counts_unambiguously::<Self::Right>(config, config.right_wheel.travel_per_edge);
        let left = counts_unambiguously::<Self::Left>(config, config.left_wheel.travel_per_edge);
        if !(right && left) {
            return Err(Unsupported::Counter);
        }
        for (ranger, _) in config.localizer.rangers.iter() {
            let known = self.has_ranger(ranger).then(|| config.ranger_of(ranger)).flatten();
            let (sonar, driver) = known.ok_or(Unsupported::Rangers)?;
            if let Some(servo) = driver.servo_settings(sonar) {
                self.servo_of(ranger).check(&servo).map_err(Unsupported::Servo)?;
            }
        }
        for (ranger, _) in config.localizer.rangers.iter() {
            let Some((sonar, driver)) = config.ranger_of(ranger) else { continue };
            let configured = self.ranger_of(ranger).configure(&driver.settings(sonar));
            configured.map_err(|_| Unsupported::Ranger)?;
        }
        self.configure_gyro(config.localizer.gyro.as_ref())?;
        for (ranger, _) in config.localizer.rangers.iter() {
            let Some((sonar, driver)) = config.ranger_of(ranger) else { continue };
            match driver.servo_settings(sonar) {
                None => self.servo_of(ranger).fix(sonar.servo.0),
                Some(servo) => {
                    self.servo_of(ranger).configure(&servo).map_err(Unsupported::Servo)?;
                }
            }
        }
        Ok(())
    }
}

/// The devices of a robot and its gyro. A robot file without `[gyro]` leaves the gyro as it is.
#[derive(Debug)]
pub struct WithGyro<H, G> {
    /// The devices without the gyro.
    pub devices: H,
    /// The gyro.
    pub gyro: G,
}

impl<H: Hardware, G: YawRate> Hardware for WithGyro<H, G> {
    type Right = H::Right;
    type Left = H::Left;
    type Pwm = H::Pwm;
    type Ranger = H::Ranger;

    fn right(&mut self) -> &mut H::Right {
        self.devices.right()
    }

    fn left(&mut self) -> &mut H::Left {
        self.devices.left()
    }

    fn servo(&mut self) -> &mut Servo<H::Pwm> {
        self.devices.servo()
    }

    fn ranger(&mut self) -> &mut H::Ranger {
        self.devices.ranger()
    }

    fn has_ranger(&self, ranger: RangerId) -> bool {
        self.devices.has_ranger(ranger)
    }

    fn servo_of(&mut self, ranger: RangerId) -> &mut Servo<H::Pwm> {
        self.devices.servo_of(ranger)
    }

    fn ranger_of(&mut self, ranger: RangerId) -> &mut H::Ranger {
        self.devices.ranger_of(ranger)
    }

    fn yaw_rate(&mut self) -> Option<Result<RadiansPerSecond, Unreadable>> {
        Some(self.gyro.rate())
    }

    fn configure_gyro(&mut self, parameters: Option<&GyroParameters>) -> Result<(), Unsupported> {
        let configured = parameters.map(|parameters| self.gyro.configure(parameters));
        configured.transpose().map(|_| ()).map_err(|_| Unsupported::Gyro)
    }
}

/// The devices of a robot, with `N` further rangers of the same type, each on a servo or at a fixed bearing
/// ([`NoPwm`](crate::servo::NoPwm) where none has a servo).
#[derive(Debug)]
pub struct WithRangers<H: Hardware, const N: usize> {
    /// The devices with the first ranger.
    pub devices: H,
    /// The servos of the further rangers.
    pub servos: [Servo<H::Pwm>; N],
    /// The further rangers.
    pub rangers: [H::Ranger; N],
}

impl<H: Hardware, const N: usize> Hardware for WithRangers<H, N> {
    type Right = H::Right;
    type Left = H::Left;
    type Pwm = H::Pwm;
    type Ranger = H::Ranger;

    fn right(&mut self) -> &mut H::Right {
        self.devices.right()
    }

    fn left(&mut self) -> &mut H::Left {
        self.devices.left()
    }

    fn servo(&mut self) -> &mut Servo<H::Pwm> {
        self.devices.servo()
    }

    fn ranger(&mut self) -> &mut H::Ranger {
        self.devices.ranger()
    }

    fn has_ranger(&self, ranger: RangerId) -> bool {
        ranger.index() <= N
    }

    fn servo_of(&mut self, ranger: RangerId) -> &mut Servo<H::Pwm> {
        let further = ranger.index().checked_sub(1);
        let further = further.and_then(|further| self.servos.get_mut(further));
        further.unwrap_or_else(|| self.devices.servo())
    }

    fn ranger_of(&mut self, ranger: RangerId) -> &mut H::Ranger {
        let further = ranger.index().checked_sub(1);
        let further = further.and_then(|further| self.rangers.get_mut(further));
        further.unwrap_or_else(|| self.devices.ranger())
    }

    fn yaw_rate(&mut self) -> Option<Result<RadiansPerSecond, Unreadable>> {
        self.devices.yaw_rate()
    }

    fn configure_gyro(&mut self, parameters: Option<&GyroParameters>) -> Result<(), Unsupported> {
        self.devices.configure_gyro(parameters)
    }
}

#[expect(clippy::cast_precision_loss, reason = "a power of two")]
/// Whether a wheel at full speed makes fewer edges between two readings than half of what its
/// counter holds.
fn counts_unambiguously<C: Counter>(config: &RobotConfig, travel_per_edge: Metres) -> bool {
    // A ping delays a sample that is due while it is in flight.
    let seconds = 1e-6 * (micros(config.encoder_period) + micros(Settings::default().patience));
    let edges = config.localizer.max_wheel_speed.0 * seconds / travel_per_edge.0;
    let range = (1_u64 << C::BITS.min(32)) as f32;
    edges < 0.5 * range
}

/// The devices of a robot as a struct.
#[derive(Debug)]
pub struct Devices<R, L, P, S> {
    /// Counter of the right wheel.
    pub right: R,
    /// Counter of the left wheel.
    pub left: L,
    /// The servo that turns the ranger.
    pub servo: Servo<P>,
    /// The ranger.
    pub ranger: S,
}

impl<R: Counter, L: Counter, P: SetDutyCycle, S: Ranger> Hardware for Devices<R, L, P, S> {
    type Right = R;
    type Left = L;
    type Pwm = P;
    type Ranger = S;

    fn right(&mut self) -> &mut R {
        &mut self.right
    }

    fn left(&mut self) -> &mut L {
        &mut self.left
    }

    fn servo(&mut self) -> &mut Servo<P> {
        &mut self.servo
    }

    fn ranger(&mut self) -> &mut S {
        &mut self.ranger
    }
}
