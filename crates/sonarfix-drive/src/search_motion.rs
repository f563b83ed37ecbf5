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
//!            has looked 45° to both sides       free travel is used up
//!   Sweeping ───────────────────────────▶ Driving ────────────────────▶ Turning
//!      ▲                                                                   │
//!      └───────────────────────────────────────────────────────────────────┘
//!                              to where the most is free
//! ```
//!
//! It turns to the heading, at most 82° aside, with the most free travel by the same equation. While it turns, it takes the echoes as they will be seen
//! after the turn, so that it stands for a shorter time. If nowhere 0.4 m are free, or nothing was free where it has turned to, it turns by 70°.
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
    /// On the spot, to another heading.
    pub turn: RadiansPerSecond,
    /// Once around on the spot: the sonar sweeps meanwhile.
    pub spin: RadiansPerSecond,
}

impl Speeds {
    /// 0.25 m/s, 90°/s and 45°/s: a sweep of an HC-SR04 on an SG90 takes 1.2 s.
    pub const SMALL: Self = Self {
        ahead: MetresPerSecond(0.25),
        turn: RadiansPerSecond(core::f32::consts::FRAC_PI_2),
        spin: RadiansPerSecond(core::f32::consts::FRAC_PI_4),
    };

    /// The same, each at most so fast that no wheel is faster than half of the fastest.
    #[must_use]
    pub fn within(fastest: MetresPerSecond, track_width: Metres) -> Self {
        let most = 0.5 * fastest.0;
        let turn = |small: RadiansPerSecond| {
            RadiansPerSecond(at_most(small.0, 2.0 * most / track_width.0))
        };
        Self {
            ahead: MetresPerSecond(at_most(Self::SMALL.ahead.0, most)),
            turn: turn(Self::SMALL.turn),
            spin: turn(Self::SMALL.spin),
        }
    }
}

/// The turn where nothing is free: not a divisor of a full one.
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
/// Travel without a ping, metres, after which the robot stands.
const BLIND: f32 = 0.05;

/// The bearings of a sweep are kept in sectors of this angle, 15°, from 90° on the right to 90° on the left.
const SECTOR: f32 = core::f32::consts::PI / 12.0;
const SECTORS: usize = 12;
/// The sectors within 45°, at all of which a robot looks before it drives.
const AHEAD: core::ops::Range<usize> = 3..9;
/// The inverse cosine of so many sectors, up to those where an echo limits the way ahead.
const PER_COSINE: [f32; 6] =
    [1.0, 1.035_276_2, 1.154_700_5, core::f32::consts::SQRT_2, 2.0, 3.863_703_3];
/// Sectors from which on a wall is beside the robot.
const SECTORS_BESIDE: usize = 5;
/// Nothing is known of a heading unless the sectors up to so many beside it were looked at.
const KNOWN: usize = 1;
/// The least free travel of a heading to which the robot turns, metres; more than the second is not better.
const LEAST_FREE: f32 = 0.4;
const ENOUGH: f32 = 2.5;
/// What a turn by one sector costs, in metres of free travel.
const BY_SECTOR: f32 = 0.026;

/// The motion of a robot that searches.
///
/// ```
/// use sonarfix::geometry::units::{Metres, Radians};
/// use sonarfix_drive::search_motion::{SearchMover, Speeds};
/// use sonarfix_hal::config::{SearchMotion, SearchMotionKind};
/// let motion = SearchMotion { kind: SearchMotionKind::Ahead, bumper: Metres(0.3) };
/// let mut mover = SearchMover::new(motion, Speeds::SMALL);
/// assert_eq!(mover.motion().speed.0, 0.0);
/// // A sweep from one side to the other finds free floor.
/// for step in -6_i8..=6 {
///     mover.ping(Radians::from_degrees(10.0 * f32::from(step)), Some(Metres(2.0)));
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
    /// Turned since it stood, radians.
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
    /// It stands until it has looked ahead.
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
    /// The nearest echo of each sector, metres, the rightmost first; the largest number without one, infinite without a ping.
    nearest: [f32; SECTORS],
}

impl Sweep {
    const EMPTY: Self = Self { free: f32::MAX, nearest: [f32::INFINITY; SECTORS] };

    fn least(&self, other: &Self) -> Self {
        let mut least = Self { free: at_most(self.free, other.free), ..*self };
        for (nearest, other) in least.nearest.iter_mut().zip(other.nearest) {
            *nearest = at_most(*nearest, other);
        }
        least
    }

    /// Takes a ping; the range is the largest number without an echo.
    fn add(&mut self, bearing: Radians, range: f32, bumper: f32) {
        let (_, cosine) = sin_cos(bearing);
        if cosine <= PARALLEL {
            return;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a bearing within 90°; a cast saturates"
        )]
        let sector = (bearing.0 / SECTOR + 6.0) as usize;
        if let Some(nearest) = self.nearest.get_mut(sector) {
            *nearest = at_most(*nearest, range);
        }
        let least = if cosine > BESIDE { bumper } else { ASIDE * bumper };
        self.free = at_most(self.free, (range - least) / cosine);
    }

    /// Whether it has looked ahead.
    fn is_complete(&self) -> bool {
        self.nearest.get(AHEAD).is_some_and(|ahead| ahead.iter().all(|range| range.is_finite()))
    }

    /// The turn to the left to the heading with the most free travel, if there is enough anywhere.
    fn freest(&self, bumper: f32) -> Option<Radians> {
        let (mut best, mut turn) = (0.0, None);
        for heading in 0..SECTORS {
            // From the middle of the sector to straight ahead.
            let aside = count(heading) - 0.5 * (count(SECTORS) - 1.0);
            let free = self.free_along(heading, bumper);
            let worth = at_most(free, ENOUGH) - BY_SECTOR * aside.abs();
            if free > LEAST_FREE && worth > best {
                (best, turn) = (worth, Some(Radians(SECTOR * aside)));
            }
        }
        turn
    }

    /// The free travel along the middle of a sector, metres; none if it was not looked there.
    fn free_along(&self, heading: usize, bumper: f32) -> f32 {
        let mut free = f32::MAX;
        for (sector, range) in self.nearest.iter().enumerate() {
            let aside = sector.abs_diff(heading);
            let Some(per_cosine) = PER_COSINE.get(aside) else { continue };
            if range.is_finite() {
                let least = if aside < SECTORS_BESIDE { bumper } else { ASIDE * bumper };
                free = at_most(free, (range - least) * per_cosine);
            } else if aside <= KNOWN {
                return 0.0;
            }
        }
        free
    }
}

/// A number of sectors as `f32`.
fn count(of: usize) -> f32 {
    #[expect(clippy::cast_precision_loss, reason = "at most 12")]
    let count = of as f32;
    count
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
        let before = self.is_leftward;
        // False for NaN, at the first ping.
        if step.abs() > 0.0 {
            self.is_leftward = Some(step > 0.0);
        }
        // What was heard in a turn is kept until its end.
        let left = match self.state {
            State::Turning(left) if !self.spins => left,
            _ => 0.0,
        };
        if left == 0.0 && before.is_some() && before != self.is_leftward {
            let [present, _] = self.sweeps;
            self.sweeps = [Sweep::EMPTY, present];
        }
        let bearing = Radians(bearing.0 - if self.was_left { left } else { -left });
        let [present, _] = &mut self.sweeps;
        present.add(bearing, range.map_or(f32::MAX, |range| range.0), self.bumper);
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
                self.stand();
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
        let Speeds { ahead, turn, spin } = self.speeds;
        let turn = if self.spins { spin } else { turn };
        match self.state {
            State::Sweeping | State::Done => Motion::default(),
            State::Driving => Motion { speed: ahead, ..Motion::default() },
            State::Turning(_) => {
                let turn = if self.was_left { turn.0 } else { -turn.0 };
                Motion { turn: RadiansPerSecond(turn), ..Motion::default() }
            }
        }
    }

    /// Drives once it has looked ahead, and turns where the free travel is used up.
    fn decide(&mut self) {
        let [present, before] = &self.sweeps;
        if self.state == State::Sweeping && present.least(before).is_complete() {
            self.state = State::Driving;
        }
        if self.state == State::Driving && at_most(present.free, before.free) <= 0.0 {
            self.turn();
        }
    }

    /// Begins a turn to where the most is free, or on to the same side if nothing was free where the last one has led.
    fn turn(&mut self) {
        let [present, before] = &self.sweeps;
        let freest = present.least(before).freest(self.bumper).filter(|_| self.has_driven);
        if let Some(turn) = freest {
            self.was_left = turn.0 > 0.0;
        }
        self.has_driven = false;
        self.state = State::Turning(freest.map_or(TURN, |turn| turn.0.abs()));
        self.sweeps = [Sweep::EMPTY; 2];
    }

    /// Stands until it has looked ahead, which it may have done in a turn. One that has turned once around stays there.
    fn stand(&mut self) {
        self.state = if self.spins { State::Done } else { State::Sweeping };
        self.turned = 0.0;
        self.blind = 0.0;
        self.decide();
    }

    /// Forgets the echoes: the robot stands until there are new ones.
    fn sweep_again(&mut self) {
        self.sweeps = [Sweep::EMPTY; 2];
        self.stand();
    }
}
