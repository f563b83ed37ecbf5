//! What the loop is polled with.

use embedded_hal::pwm::SetDutyCycle;

use crate::encoder::Counter;
use crate::ranger::Ranger;
use crate::servo::Servo;

/// A robot's devices. A board implements it for a struct of its own, or uses [`Devices`].
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
}

/// The devices of a robot, side by side.
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
