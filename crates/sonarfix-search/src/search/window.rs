//! The window: recent pings in the odometry frame, each from a place or in a direction from which
//! no other of them was sent.
//!
//! The frame's origin is the *reference*: where the robot was when the current cycle began. Its
//! axes keep the directions that they had when the search began.
//!
//! Odometry whose wheels are wrong bends the path. The stations are kept with the [`Bend`] of the
//! best hypothesis taken out, so that a wall that was passed is a straight line in this frame.
//!
//! # Non-finite policy
//! Travel and pings that are not finite are refused by [`super::Search`], so the window is finite.

use heapless::Vec;

use sonarfix::geometry::list::remove_at;
use sonarfix::geometry::pose::Heading;
use sonarfix::geometry::units::Radians;
use sonarfix::geometry::vector::Vector;

/// A ping is novel if no ping of the window was sent from within this distance, metres, in the same direction.
const NOVEL_DISTANCE: f32 = 0.2;
/// Echoes from within this distance, metres, of each other are of one place.
const SAME_ECHO: f32 = 0.2;
/// The bits of a range that hold the weight of its ping: without them it is smaller by less than 1 in 32,000.
const WEIGHT: u32 = 255;
/// The whole weight, a multiple of 1 to 6.
const WHOLE: u32 = 240;
/// The sign of a range: there is no echo.
const NO_ECHO: u32 = 1 << 31;

/// How the heading by odometry departs from the true one: by wheels of unequal size, and by an error
/// of the track width.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Bend {
    /// Radians per metre of travel.
    pub drift: f32,
    /// Radians per radian of turning.
    pub turn_scale: f32,
}

impl Bend {
    pub const NONE: Self = Self { drift: 0.0, turn_scale: 0.0 };

    pub fn minus(self, other: Self) -> Self {
        Self { drift: self.drift - other.drift, turn_scale: self.turn_scale - other.turn_scale }
    }

    /// The heading error at a station, relative to that at the reference.
    pub fn at(self, station: &Station) -> Radians {
        Radians(self.drift * station.travelled + self.turn_scale * station.turned)
    }
}

/// A place on the path by odometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Station {
    /// Position of the robot's axle, or of the sonar of a ping.
    pub at: Vector,
    /// Distance travelled since the reference, metres; negative before it.
    pub travelled: f32,
    /// Angle turned since the reference by the encoders, radians, positive to the left, not wrapped.
    pub turned: f32,
}

impl Station {
    /// The same place seen from another reference.
    fn seen_from(&self, reference: &Self) -> Self {
        Self {
            at: self.at.minus(reference.at),
            travelled: self.travelled - reference.travelled,
            turned: self.turned - reference.turned,
        }
    }
}

/// A ping of the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ping {
    /// Where the sonar was.
    pub station: Station,
    /// Unit vector along the beam.
    pub axis: Vector,
    /// The bits of the range in metres, negative without an echo; the last ones, [`WEIGHT`], are the weight in parts of [`WHOLE`].
    echo: u32,
}

impl Ping {
    /// Metres; `None` without an echo.
    pub fn range(&self) -> Option<f32> {
        (self.echo < NO_ECHO).then_some(f32::from_bits(self.echo & !WEIGHT))
    }

    /// The point on the axis at the range.
    #[inline(never)]
    pub fn point(&self) -> Option<Vector> {
        Some(self.station.at.plus(self.axis.times(self.range()?)))
    }

    /// How much the ping tells: of echoes of one place from several stations the first tells all, the others 1/2, 1/3, and so on. An object
    /// that is not in the map, or a wall that is elsewhere, misleads from each station in the same way.
    #[expect(clippy::cast_precision_loss, reason = "at most 255")]
    pub fn weight(&self) -> f32 {
        (self.echo & WEIGHT) as f32 * (1.0 / WHOLE as f32)
    }
}

/// Recent novel pings and the robot's pose by odometry.
#[derive(Debug, Clone)]
pub(super) struct Window<const PINGS: usize> {
    pings: Vec<Ping, PINGS>,
    /// Where the sonar is in the robot frame.
    mount: Vector,
    path: Path,
}

/// The robot's path by odometry.
#[derive(Debug, Clone, Default)]
struct Path {
    robot: Station,
    /// Where the search began, with the bends that were taken out since, and the distance since.
    start: Vector,
    since_start: f32,
    heading: f32,
    /// Heading at the reference.
    reference_heading: f32,
    bend: Bend,
    /// Novel pings since the search began, and those of them before the reference; wrapping.
    taken: u16,
    referred: u16,
}

impl<const PINGS: usize> Window<PINGS> {
    pub fn new(mount: Vector) -> Self {
        Self { pings: Vec::new(), mount, path: Path::default() }
    }

    /// Removes all pings and moves the origin to the robot.
    pub fn restart(&mut self, mount: Vector) {
        self.pings.clear();
        self.mount = mount;
        self.path = Path::default();
    }

    /// The pings before the reference, the oldest first: those that the current cycle works with.
    pub fn pings(&self) -> &[Ping] {
        let later = usize::from(self.path.taken.wrapping_sub(self.path.referred));
        let count = self.pings.len().saturating_sub(later);
        self.pings.get(..count).unwrap_or_default()
    }

    /// How many pings the window holds.
    pub fn count(&self) -> usize {
        self.pings.len()
    }

    pub fn taken(&self) -> u16 {
        self.path.taken
    }

    /// So many pings, for tests.
    #[cfg(test)]
    pub fn set_taken(&mut self, taken: u16) {
        self.path.taken = taken;
    }

    pub fn robot(&self) -> &Station {
        &self.path.robot
    }

    /// Where the search began.
    pub fn start(&self) -> Vector {
        self.path.start
    }

    /// Distance travelled since the search began, metres.
    pub fn since_start(&self) -> f32 {
        self.path.since_start
    }

    /// What is taken out of the odometry.
    pub fn bend(&self) -> Bend {
        self.path.bend
    }

    /// Heading of the robot in the odometry frame, radians.
    pub fn heading(&self) -> f32 {
        self.path.heading
    }

    /// Moves the robot by a distance and a turn by the encoders, both finite.
    #[inline(never)]
    pub fn drive(&mut self, advance: f32, turn: f32) {
        let travelled = advance.abs();
        let bent = self.path.bend.drift * travelled + self.path.bend.turn_scale * turn;
        let heading = self.path.heading + turn + bent;
        let middle = Vector::of_angle(0.5 * (self.path.heading + heading));
        self.path.robot.at = self.path.robot.at.plus(middle.times(advance));
        self.path.robot.travelled += travelled;
        self.path.since_start += travelled;
        self.path.robot.turned += turn;
        self.path.heading = Heading::new(Radians(heading)).radians().0;
    }

    /// Takes a ping, if it is novel.
    ///
    /// `novel` is the angle within which a ping from the same place is not novel: before the robot
    /// has left the first place, and after.
    #[inline(never)]
    pub fn ping(&mut self, bearing: f32, range: Option<f32>, novel: [Radians; 2]) -> bool {
        let mut station = self.path.robot;
        station.at = station.at.plus(self.mount.turned(Vector::of_angle(self.path.heading)));
        let axis = Vector::of_angle(self.path.heading + bearing);
        let [at_rest, driving] = novel;
        let first = self.pings.first().map_or(station.travelled, |ping| ping.station.travelled);
        let novel = if station.travelled - first > NOVEL_DISTANCE { driving } else { at_rest };
        let novel_cosine = Vector::of_angle(novel.0).x;
        let is_known = self.pings.iter().any(|ping| {
            ping.axis.dot(axis) > novel_cosine
                && ping.station.at.minus(station.at).length_squared()
                    < NOVEL_DISTANCE * NOVEL_DISTANCE
        });
        if is_known {
            return false;
        }
        if self.pings.is_full() {
            // The oldest; a shift of less than 4 KiB, once per novel ping.
            remove_at(&mut self.pings, 0);
        }
        // There is room now, unless there is room for none.
        self.path.taken = self.path.taken.wrapping_add(1);
        let echo = range.map_or(NO_ECHO, f32::to_bits) & !WEIGHT | WHOLE;
        self.pings.push(Ping { station, axis, echo }).is_ok()
    }

    /// Weighs a ping by how many echoes of older pings are of the same place and were heard from other stations. A weight never grows: what
    /// has left the window has told of the place all the same.
    pub fn weigh(&mut self, number: usize) {
        let Some((older, [ping, ..])) = self.pings.split_at_mut_checked(number) else { return };
        let Some(point) = ping.point() else { return };
        let here = ping.station.at;
        let between = |one: Vector, other: Vector| one.minus(other).length_squared();
        let is_repeated = |other: &&Ping| {
            other.point().is_some_and(|at| between(at, point) < SAME_ECHO * SAME_ECHO)
                && between(other.station.at, here) > NOVEL_DISTANCE * NOVEL_DISTANCE
        };
        let repeats = u32::try_from(older.iter().filter(is_repeated).count()).unwrap_or(WHOLE);
        let weight = WHOLE / (1 + repeats);
        ping.echo = ping.echo & !WEIGHT | weight.min(ping.echo & WEIGHT);
    }

    /// Makes the robot's present place the reference and returns it in the old frame.
    #[inline(never)]
    pub fn rebase(&mut self) -> Station {
        let reference = self.path.robot;
        for ping in &mut self.pings {
            ping.station = ping.station.seen_from(&reference);
        }
        self.path.start = self.path.start.minus(reference.at);
        self.path.robot = Station::default();
        self.path.reference_heading = self.path.heading;
        self.path.referred = self.path.taken;
        reference
    }

    /// Takes this bend out of the odometry instead of the one before, from here on; returns what does the same for the
    /// pings so far. To be called at the reference.
    pub fn begin_straightening(&mut self, bend: Bend) -> Straightening {
        let before = self.path.bend;
        self.path.bend = bend;
        Straightening { before, done: 0, chain: Chain::new(Vector::default()) }
    }

    /// Takes the bend out of a few pings, the newest first; returns whether there are more.
    #[inline(never)]
    pub fn straighten(&mut self, straightening: &mut Straightening) -> bool {
        let difference = self.path.bend.minus(straightening.before);
        for _ in 0..STRAIGHTENED_AT_ONCE {
            // A ping that arrives meanwhile lies after the reference and may replace the oldest: counted from the newest,
            // the others keep their numbers.
            let before_reference = self.pings().len();
            let at = before_reference.checked_sub(1 + usize::from(straightening.done));
            let Some((at, ping)) = at.and_then(|at| Some((at, self.pings.get(at)?))) else {
                return false;
            };
            let link = self.link_of(ping, straightening.before, difference);
            straightening.chain.add(&link);
            let (place, axis) = (straightening.chain.sonar(&link), ping.axis.turned(link.bent));
            if let Some(ping) = self.pings.get_mut(at) {
                ping.station.at = place;
                ping.axis = axis;
            }
            straightening.done += 1;
        }
        true
    }

    /// The `k`-th ping before the reference, the newest first.
    pub fn newest(&self, k: usize) -> Option<&Ping> {
        self.pings().iter().nth_back(k)
    }

    /// A ping as a link of a chain that has another bend taken out.
    pub fn link(&self, ping: &Ping, difference: Bend) -> Link {
        self.link_of(ping, self.path.bend, difference)
    }

    /// The same of a ping that has the bend `taken` taken out.
    fn link_of(&self, ping: &Ping, taken: Bend, difference: Bend) -> Link {
        let station = &ping.station;
        let turned = self.path.reference_heading + station.turned + taken.at(station).0;
        let arm = self.mount.turned(Vector::of_angle(turned));
        Link {
            axle: station.at.minus(arm),
            arm,
            travelled: station.travelled,
            turned: station.turned,
            bent: Vector::of_angle(difference.at(station).0),
        }
    }
}

/// Pings from which one slice takes the bend.
const STRAIGHTENED_AT_ONCE: u8 = 8;

/// How far the bend of the odometry was taken out of the pings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Straightening {
    /// What was taken out before.
    before: Bend,
    /// Pings that are done.
    done: u16,
    chain: Chain,
}

/// A place of the path for a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Link {
    axle: Vector,
    /// From the axle to the sonar.
    arm: Vector,
    travelled: f32,
    turned: f32,
    /// Cosine and sine of the bend.
    pub bent: Vector,
}

/// The path from the reference backwards with another bend than that of the window, station by
/// station: each step of it is turned by the mean of the bends at its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chain {
    last: Link,
    /// Where the robot's axle was.
    at: Vector,
    /// Derivatives of `at` by drift and by turn scale.
    pub by_drift: Vector,
    pub by_turn_scale: Vector,
}

impl Chain {
    /// A chain that begins at the reference, which lies at `at`.
    pub fn new(at: Vector) -> Self {
        let last = Link {
            axle: Vector::default(),
            arm: Vector::default(),
            travelled: 0.0,
            turned: 0.0,
            bent: Vector::new(1.0, 0.0),
        };
        Self { last, at, by_drift: Vector::default(), by_turn_scale: Vector::default() }
    }

    // ===== Eqs. (32) and (33): P_i, ∂P_i/∂κ and ∂P_i/∂τ =====
    /// Goes on to the next place.
    pub fn add(&mut self, link: &Link) {
        let middle = self.last.bent.plus(link.bent).times(0.5);
        let step = link.axle.minus(self.last.axle).turned(middle);
        let travelled = 0.5 * (self.last.travelled + link.travelled);
        let turned = 0.5 * (self.last.turned + link.turned);
        self.at = self.at.plus(step);
        self.by_drift = self.by_drift.plus(step.left().times(travelled));
        self.by_turn_scale = self.by_turn_scale.plus(step.left().times(turned));
        self.last = *link;
    }

    /// The last place.
    pub fn last(&self) -> &Link {
        &self.last
    }

    /// Where the sonar was at the last place.
    pub fn sonar(&self, link: &Link) -> Vector {
        self.at.plus(link.arm.turned(link.bent))
    }
}

#[cfg(test)]
mod tests;
