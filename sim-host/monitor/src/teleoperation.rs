//! Driving a robot by keys: a key drives as long as it is held, and the robot stands when it is released.
//!
//! A terminal reports no release of a key, but repeats a key that is held. A key therefore counts as held for [`HELD`] after
//! each report. From the first key until [`Teleoperation::release`] the robot obeys this program: without a key it is commanded to
//! stand, and does not go on by its own motor code. A link that is cut stops it by the robot's dead-man
//! ([`Command::Drive`](sonarfix_link::Command::Drive)).

use std::time::{Duration, Instant};

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_link::Motion;

/// For how long a reported key counts as held: longer than the delay after which a keyboard repeats a key, which is 0.5 s
/// or less by default in the usual systems.
pub const HELD: Duration = Duration::from_millis(600);
/// The speeds at the start, and the factor of a change.
const SPEED: f32 = 0.1;
const TURN: f32 = 45.0;
const FACTOR: f32 = 1.25;
/// The limits of the speed, m/s.
const SPEEDS: (f32, f32) = (0.02, 1.0);

/// A direction to drive in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Forwards.
    Ahead,
    /// Backwards.
    Back,
    /// A turn on the spot, counter-clockwise.
    Left,
    /// A turn on the spot, clockwise.
    Right,
}

/// The keys so far.
#[derive(Debug, Clone)]
pub struct Teleoperation {
    /// Forward speed, m/s; the turn rate changes with it.
    speed: f32,
    state: State,
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// No motion is commanded.
    Released,
    /// It is commanded to stand.
    Standing,
    /// It drives since the last report of the key.
    Driving(Direction, Instant),
}

impl Default for Teleoperation {
    fn default() -> Self {
        Self { speed: SPEED, state: State::Released }
    }
}

impl Teleoperation {
    /// A key of a direction was reported.
    pub fn press(&mut self, direction: Direction, now: Instant) {
        self.state = State::Driving(direction, now);
    }

    /// Stops the robot.
    pub fn stop(&mut self) {
        self.state = State::Standing;
    }

    /// Ends the commands of motions.
    pub fn release(&mut self) {
        self.state = State::Released;
    }

    /// Drives faster, or slower, from the next key on.
    pub fn change_speed(&mut self, is_faster: bool) {
        let factor = if is_faster { FACTOR } else { 1.0 / FACTOR };
        self.speed = (self.speed * factor).clamp(SPEEDS.0, SPEEDS.1);
    }

    /// The motion to command at `now`; `None`: none.
    pub fn motion(&mut self, now: Instant) -> Option<Motion> {
        if let State::Driving(_, pressed) = self.state
            && now.saturating_duration_since(pressed) > HELD
        {
            self.state = State::Standing;
        }
        let turn = TURN.to_radians() * self.speed / SPEED;
        let (speed, turn) = match self.state {
            State::Released => return None,
            State::Standing => (0.0, 0.0),
            State::Driving(Direction::Ahead, _) => (self.speed, 0.0),
            State::Driving(Direction::Back, _) => (-self.speed, 0.0),
            State::Driving(Direction::Left, _) => (0.0, turn),
            State::Driving(Direction::Right, _) => (0.0, -turn),
        };
        Some(Motion { speed: MetresPerSecond(speed), turn: RadiansPerSecond(turn) })
    }

    /// The motion in words, and whether there is one.
    #[must_use]
    pub fn text(&self) -> (String, bool) {
        let (speed, turn) = (self.speed, TURN * self.speed / SPEED);
        let drives = match self.state {
            State::Released => {
                return (format!("arrows drive: {speed:.2} m/s, {turn:.0} deg/s, + -"), false);
            }
            State::Standing => return ("STANDS  Esc releases control".to_owned(), true),
            State::Driving(Direction::Ahead, _) => format!("AHEAD {speed:.2} m/s"),
            State::Driving(Direction::Back, _) => format!("BACK {speed:.2} m/s"),
            State::Driving(Direction::Left, _) => format!("LEFT {turn:.0} deg/s"),
            State::Driving(Direction::Right, _) => format!("RIGHT {turn:.0} deg/s"),
        };
        (format!("{drives}  SPACE STOPS"), true)
    }
}
