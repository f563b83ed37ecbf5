//! The devices that the loop uses.

use embedded_hal::pwm::SetDutyCycle;
use sonarfix::gyro::GyroParameters;
use sonarfix::units::{Metres, RadiansPerSecond};

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
    /// PWM channel of the servo.
    type Pwm: SetDutyCycle;
    /// The ranger on the servo.
    type Ranger: Ranger;

    /// The right wheel's counter.
    fn right(&mut self) -> &mut Self::Right;
    /// The left wheel's counter.
    fn left(&mut self) -> &mut Self::Left;
    /// The servo.
    fn servo(&mut self) -> &mut Servo<Self::Pwm>;
    /// The ranger.
    fn ranger(&mut self) -> &mut Self::Ranger;

    /// The rate of the gyro now; `None` without a gyro.
    fn yaw_rate(&mut self) -> Option<Result<RadiansPerSecond, Unreadable>> {
        None
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
        let servo = config.servo_settings();
        self.servo().check(&servo).map_err(Unsupported::Servo)?;
        let ranger = self.ranger().configure(&config.ranger_settings());
        ranger.map_err(|_| Unsupported::Ranger)?;
        self.configure_gyro(config.localizer.gyro.as_ref())?;
        self.servo().configure(&servo).map_err(Unsupported::Servo)
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

    fn yaw_rate(&mut self) -> Option<Result<RadiansPerSecond, Unreadable>> {
        Some(self.gyro.rate())
    }

    fn configure_gyro(&mut self, parameters: Option<&GyroParameters>) -> Result<(), Unsupported> {
        let configured = parameters.map(|parameters| self.gyro.configure(parameters));
        configured.transpose().map(|_| ()).map_err(|_| Unsupported::Gyro)
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
