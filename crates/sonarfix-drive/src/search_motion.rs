//! The motion of a robot that searches for its pose: it turns on the spot, or drives ahead where the sonar finds free floor.
//!
//! The search sweeps with the sonar from one limit of its servo to the other. Each echo, at the range r and the bearing β, is taken for
//! the foot of a perpendicular to a wall: driving straight ahead, the robot has left until the bumper distance d
//!
//! ```text
//! free = (r − d) / cos β
//! ```
//!
//! An object smaller than a wall leaves more. A wall beside the robot, from 75° on, may be nearer: 0.6 d. The least of this and of the last sweep, less what the robot has driven since, is its free
//! travel.
//!
//! ```text
//!               two ends of the sweep          free travel is used up
//!   Sweeping ───────────────────────▶ Driving ────────────────────────▶ Turning
//!      ▲                                                                   │
//!      └───────────────────────────────────────────────────────────────────┘
//!                                      70°
//! ```
//!
//! It turns to the side whose nearest echo is farther, and on to the same side if nothing was free there.
//!
//! **What the sonar does not detect, the robot hits**: soft and thin objects, edges above or below the beam, and what stands between two
//! bearings of a sweep. Nothing is measured behind the robot; it never drives backwards.
//!
//! # Non-finite policy
//! A bearing, range or travel that is not finite ends the free travel: the robot stands until the next sweep is complete.

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::numeric::at_most;
use sonarfix::geometry::trig::sin_cos;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix_hal::config::{SearchMotion, SearchMotionKind};
use sonarfix_link::Motion;

/// The speeds of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Speeds {
    /// Straight ahead.
    pub ahead: MetresPerSecond,
    /// On the spot.
    pub turn: RadiansPerSecond,
}

impl Speeds {
    /// 0.15 m/s and 45°/s: a sweep of an HC-SR04 on an SG90 takes 1.2 s.
    pub const SMALL: Self =
        Self { ahead: MetresPerSecond(0.15), turn: RadiansPerSecond(core::f32::consts::FRAC_PI_4) };

    /// The same, each at most so fast that no wheel is faster than half of the fastest.
    #[must_use]
    pub fn within(fastest: MetresPerSecond, track_width: Metres) -> Self {
        let most = 0.5 * fastest.0;
        Self {
            ahead: MetresPerSecond(at_most(Self::SMALL.ahead.0, most)),
            turn: RadiansPerSecond(at_most(Self::SMALL.turn.0, 2.0 * most / track_width.0)),
        }
    }
}

/// The turn after which the robot stands for a sweep: not a divisor of a full one.
const TURN: f32 = 70.0 * core::f32::consts::PI / 180.0;
/// One full turn on the spot.
const FULL_TURN: f32 = 2.0 * core::f32::consts::PI;
/// A larger turn than this makes the echoes so far useless: the direction ahead is another one.
const STRAIGHT: f32 = 0.15;
/// The cosine of the bearing, 75°, from which on a wall is beside the robot, which may come nearer to it, and that of the largest at which an
/// echo limits the way ahead, 88°.
const BESIDE: f32 = 0.26;
const PARALLEL: f32 = 0.035;
/// The least distance from a wall beside the robot, as a part of the bumper distance.
const ASIDE: f32 = 0.6;
/// Ends of the sweep after which it is complete.
const ENDS: u8 = 2;

/// Travel without a ping, metres, after which the robot stands.
const BLIND: f32 = 0.05;

/// The motion of a robot that searches.
///
/// ```
/// use sonarfix::geometry::units::{Metres, Radians};
/// use sonarfix_drive::search_motion::{SearchMover, Speeds};
/// use sonarfix_hal::config::{SearchMotion, SearchMotionKind};
/// let motion = SearchMotion { kind: SearchMotionKind::Ahead, bumper: Metres(0.3) };
/// let mut mover = SearchMover::new(motion, Speeds::SMALL);
/// assert_eq!(mover.motion().speed.0, 0.0);
/// // A sweep to each side finds free floor.
/// for degrees in [-60.0, 0.0, 60.0, 0.0, -60.0, 0.0] {
///     mover.ping(Radians::from_degrees(degrees), Some(Metres(2.0)));
/// }
/// assert!(mover.motion().speed.0 > 0.0);
/// // An object is nearer than the bumper distance.
/// mover.ping(Radians(0.0), Some(Metres(0.25)));
/// let motion = mover.motion();
/// assert!(motion.speed.0 == 0.0 && motion.turn.0 != 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SearchMover {
    bumper: f32,
    spins: bool,
    speeds: Speeds,
    state: State,
    /// The present sweep and the one before it.
    sweeps: [Sweep; 2],
    /// The last bearing, radians; NaN before the first.
    bearing: f32,
    /// Whether the sweep goes to the left, once it is known.
    is_leftward: Option<bool>,
    /// Ends of the sweep since the echoes count.
    ends: u8,
    /// Turned since then, radians.
    turned: f32,
    /// Driven since the last ping, metres.
    blind: f32,
    /// Whether the robot has driven since its last turn.
    has_driven: bool,
    /// Whether its last turn was to the left.
    was_left: bool,
}

/// What the robot does.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum State {
    /// It stands until a sweep is complete.
    Sweeping,
    Driving,
    /// It turns by this angle more, radians.
    Turning(f32),
    /// It has turned once around, and stands.
    Done,
}

/// What a sweep has found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Sweep {
    /// Travel that is left straight ahead, metres.
    free: f32,
    /// The nearest echo on the right and on the left, metres.
    nearest: [f32; 2],
}

impl Sweep {
    const EMPTY: Self = Self { free: f32::MAX, nearest: [f32::MAX; 2] };

    fn least(&self, other: &Self) -> Self {
        let ([right, left], [other_right, other_left]) = (self.nearest, other.nearest);
        Self {
            free: at_most(self.free, other.free),
            nearest: [at_most(right, other_right), at_most(left, other_left)],
        }
    }

    /// Takes an echo.
    fn add(&mut self, bearing: Radians, range: f32, bumper: f32) {
        let [right, left] = &mut self.nearest;
        let side = if bearing.0 > 0.0 { left } else { right };
        *side = at_most(*side, range);
        let (_, cosine) = sin_cos(bearing);
        let least = if cosine > BESIDE { bumper } else { ASIDE * bumper };
        if cosine > PARALLEL {
            self.free = at_most(self.free, (range - least) / cosine);
        }
    }
}

impl SearchMover {
    /// A robot at rest that begins to search.
    #[must_use]
    pub fn new(motion: SearchMotion, speeds: Speeds) -> Self {
        let spins = motion.kind == SearchMotionKind::Spin;
        Self {
            bumper: motion.bumper.0,
            spins,
            speeds,
            state: if spins { State::Turning(FULL_TURN) } else { State::Sweeping },
            sweeps: [Sweep::EMPTY; 2],
            bearing: f32::NAN,
            is_leftward: None,
            ends: 0,
            turned: 0.0,
            blind: 0.0,
            has_driven: false,
            was_left: true,
        }
    }

    /// Takes a ping of the sweep: its bearing in the robot frame, and the range from the sonar, as it was measured; `None` without an echo.
    /// One without a result, because the ranger has a fault, is not passed.
    pub fn ping(&mut self, bearing: Radians, range: Option<Metres>) {
        if !bearing.is_finite() || range.is_some_and(|range| !range.is_finite()) {
            self.sweep_again();
            return;
        }
        self.blind = 0.0;
        let step = bearing.0 - core::mem::replace(&mut self.bearing, bearing.0);
        // False for NaN, at the first ping.
        if step.abs() > 0.0 {
            let before = self.is_leftward.replace(step > 0.0);
            if before.is_some_and(|was| was != (step > 0.0)) {
                self.ends = self.ends.saturating_add(1);
                let [present, _] = self.sweeps;
                self.sweeps = [Sweep::EMPTY, present];
            }
        }
        if let (Some(range), [present, _]) = (range, &mut self.sweeps) {
            present.add(bearing, range.0, self.bumper);
        }
        self.decide();
    }

    /// Takes the travel of the wheels of a robot with this track width, metres.
    pub fn odometry(&mut self, travel: WheelTravel, track_width: Metres) {
        let turn = (travel.right.0 - travel.left.0) / track_width.0;
        let advance = travel.distance().0;
        if !turn.is_finite() || !advance.is_finite() {
            self.sweep_again();
            return;
        }
        self.turned += turn;
        if let State::Turning(left) = &mut self.state {
            *left -= if self.was_left { turn } else { -turn };
            if *left <= 0.0 {
                self.sweep_again();
            }
            return;
        }
        self.blind += advance;
        self.has_driven |= self.state == State::Driving && advance > 0.0;
        for sweep in &mut self.sweeps {
            sweep.free -= advance;
        }
        if self.turned.abs() > STRAIGHT || self.blind > BLIND {
            self.sweep_again();
        }
        self.decide();
    }

    /// The motion until the next ping or travel.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let Speeds { ahead, turn } = self.speeds;
        match self.state {
            State::Sweeping | State::Done => Motion::default(),
            State::Driving => Motion { speed: ahead, ..Motion::default() },
            State::Turning(_) => {
                let turn = if self.was_left { turn.0 } else { -turn.0 };
                Motion { turn: RadiansPerSecond(turn), ..Motion::default() }
            }
        }
    }

    /// Drives once a sweep is complete, and turns where the free travel is used up.
    fn decide(&mut self) {
        if self.state == State::Sweeping && self.ends >= ENDS {
            self.state = State::Driving;
        }
        let [present, before] = &self.sweeps;
        let Sweep { free, nearest: [right, left] } = present.least(before);
        if self.state == State::Driving && free <= 0.0 {
            if self.has_driven {
                self.was_left = left > right;
            }
            self.has_driven = false;
            self.state = State::Turning(TURN);
        }
    }

    /// Forgets the echoes: the robot stands until there are new ones. One that has turned once around stays there.
    fn sweep_again(&mut self) {
        self.state = if self.spins { State::Done } else { State::Sweeping };
        self.sweeps = [Sweep::EMPTY; 2];
        self.ends = 0;
        self.turned = 0.0;
        self.blind = 0.0;
    }
}
