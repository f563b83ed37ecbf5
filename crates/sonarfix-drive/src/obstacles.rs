//! Objects that are not on the map, by the pings of the localizer.
//!
//! A ping whose echo comes from nearer than every wall of the map in its cone has met an object. Its place is on the axis of
//! the cone, as far as the range. A later ping through this place, with an echo from behind it or none, removes the object.
//!
//! The localizer chooses the bearings of its pings by the walls. **An object that no ping meets is not known.**

use sonarfix::geometry::numeric::at_most;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::geometry::vector::Vector;
use sonarfix::map::{Map, Wall};

/// The most objects that are remembered.
const MOST: usize = 4;

/// What counts as an object, and as ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Half of the width of the strip ahead of the robot that is to be free.
    pub half_width: Metres,
    /// The longest range at which an echo counts as an object.
    pub reach: Metres,
    /// The least distance of an object from the nearest wall of the map in the cone: more than the errors of pose, map and range.
    pub margin: Metres,
    /// For how long an object is remembered after its echo.
    pub memory: Duration,
}

impl Settings {
    /// Those of a robot 20 cm wide in a mapped room.
    pub const SMALL: Self = Self {
        half_width: Metres(0.12),
        reach: Metres(1.0),
        margin: Metres(0.15),
        memory: Duration::from_ticks(60_000_000),
    };
}

/// A ping of a ranger.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ping {
    /// When it was sent.
    pub at: Instant,
    /// The pose at that time.
    pub pose: Pose,
    /// The ranger in the robot frame.
    pub mount: Point,
    /// The bearing of its axis.
    pub bearing: Radians,
    /// Half of the opening angle of its cone, less than a right angle.
    pub half_cone: Radians,
    /// The range of the echo; `None` for silence.
    pub range: Option<Metres>,
}

/// The objects that were met.
///
/// ```
/// use sonarfix::geometry::pose::{Point, Pose};
/// use sonarfix::geometry::units::{Instant, Metres, Radians};
/// use sonarfix::map::{Map, Wall};
/// use sonarfix_drive::obstacles::{Obstacles, Ping, Settings};
/// let walls = [Wall::new(Point::new(3.0, -1.0), Point::new(3.0, 1.0))?];
/// let mut obstacles = Obstacles::new(Settings::SMALL);
/// let pose = Pose::new(0.0, 0.0, Radians(0.0));
/// let at = Instant::from_ticks(0);
/// let (bearing, half_cone) = (Radians(0.0), Radians(0.2));
/// let ping = Ping { at, pose, mount: Point::new(0.1, 0.0), bearing, half_cone, range: Some(Metres(0.5)) };
/// obstacles.take(&Map::new(&walls), &ping);
/// let ahead = obstacles.ahead(at, pose).map_or(0.0, |ahead| ahead.0);
/// assert!((ahead - 0.6).abs() < 1e-5);
/// # Ok::<(), sonarfix::map::WallError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Obstacles {
    settings: Settings,
    objects: [Option<Object>; MOST],
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Object {
    place: Point,
    met: Instant,
}

impl Obstacles {
    /// None yet.
    #[must_use]
    pub const fn new(settings: Settings) -> Self {
        Self { settings, objects: [None; MOST] }
    }

    /// Takes a ping. One whose pose or bearing is not finite has no effect.
    pub fn take(&mut self, map: &Map, ping: &Ping) {
        if !(ping.pose.is_finite() && ping.bearing.is_finite() && ping.half_cone.is_finite()) {
            return;
        }
        let cone = Cone::of(ping);
        let Settings { margin, reach, .. } = self.settings;
        for object in &mut self.objects {
            object.take_if(|object| cone.is_through(object.place, ping.range, margin));
        }
        let Some(range) = ping.range.filter(|range| *range <= reach) else { return };
        // Also false for NaN.
        if range.0 >= 0.0 && !cone.has_wall(map, range + margin) {
            let place = cone.from.plus(cone.axis.times(range.0)).into();
            self.record(Object { place, met: ping.at });
        }
    }

    /// The distance of the nearest object ahead, from the midpoint between the wheels.
    #[must_use]
    pub fn ahead(&self, now: Instant, pose: Pose) -> Option<Metres> {
        let Settings { half_width, memory, .. } = self.settings;
        let ahead = Vector::of_angle(pose.heading.radians().0);
        let distances = self.objects.iter().flatten().filter_map(|object| {
            let age = now.checked_duration_since(object.met).unwrap_or(Duration::from_ticks(0));
            let offset = Vector::from(object.place).minus(pose.position().into());
            let (along, aside) = (ahead.dot(offset), ahead.left().dot(offset));
            let is_ahead = age <= memory && along > 0.0 && aside.abs() <= half_width.0;
            is_ahead.then_some(along)
        });
        distances.reduce(at_most).map(Metres)
    }

    /// In a free place, or in that of the oldest object.
    fn record(&mut self, object: Object) {
        let met = |object: &Option<Object>| object.map(|object| object.met);
        if let Some(place) = self.objects.iter_mut().min_by_key(|object| met(object)) {
            *place = Some(object);
        }
    }
}

/// The cone of a ping in the map frame.
struct Cone {
    from: Vector,
    axis: Vector,
    /// The directions of its right and left side.
    sides: [Vector; 2],
    cosine: f32,
}

impl Cone {
    fn of(ping: &Ping) -> Self {
        let Ping { pose, mount, bearing, half_cone, .. } = ping;
        let axis = Vector::of_angle(pose.heading.turned(*bearing).radians().0);
        let half = Vector::of_angle(half_cone.0);
        let sides = [axis.turned(Vector::new(half.x, -half.y)), axis.turned(half)];
        Self { from: pose.to_map(*mount).into(), axis, sides, cosine: half.x }
    }

    /// Whether the ping went through this place, with an echo from behind it or none.
    fn is_through(&self, place: Point, range: Option<Metres>, margin: Metres) -> bool {
        let offset = Vector::from(place).minus(self.from);
        let along = self.axis.dot(offset);
        let square = offset.length_squared();
        let is_inside = along > 0.0 && along * along >= self.cosine * self.cosine * square;
        let is_behind = range.is_none_or(|range| range.0 > along + margin.0);
        is_inside && is_behind
    }

    /// Whether a part of a wall of the map is in the cone and nearer than this.
    fn has_wall(&self, map: &Map, within: Metres) -> bool {
        map.near(self.from.into(), within).any(|(_, wall)| {
            self.clipped(&wall).is_some_and(|[from, to]| is_near(from, to, within.0))
        })
    }

    /// The ends of the part of a wall in the cone, relative to its apex.
    fn clipped(&self, wall: &Wall) -> Option<[Vector; 2]> {
        let from = Vector::from(wall.from()).minus(self.from);
        let to = Vector::from(wall.to()).minus(self.from);
        // Inside: to the left of the right side, and to the right of the left one.
        let [right, left] = self.sides;
        let normals = [right.left(), left.left().times(-1.0)];
        let (mut first, mut last) = (0.0, 1.0);
        for normal in normals {
            let (at_from, at_to) = (normal.dot(from), normal.dot(to));
            let crossing = at_from / (at_from - at_to);
            match (at_from >= 0.0, at_to >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (false, true) => first = if crossing > first { crossing } else { first },
                (true, false) => last = at_most(crossing, last),
            }
        }
        let along = to.minus(from);
        (first <= last).then(|| [from.plus(along.times(first)), from.plus(along.times(last))])
    }
}

/// Whether a segment has a point this near to the origin.
fn is_near(from: Vector, to: Vector, within: f32) -> bool {
    let along = to.minus(from);
    let square = along.length_squared();
    let share = if square > 0.0 { -from.dot(along) / square } else { 0.0 };
    let share = if share > 0.0 { at_most(share, 1.0) } else { 0.0 };
    from.plus(along.times(share)).length_squared() <= within * within
}
