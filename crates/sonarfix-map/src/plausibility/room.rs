//! The rules for walls, and for a path and a robot among them.

use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::units::Metres;

use super::facts::{Fact, Facts};
use super::outline::{
    CHANGES, MOST_WALLS, Room, SAMPLES, WIDEST_GAP, bounds, ends, intention, nearest,
};
use super::rule::short;
use crate::error::Mistake;
use crate::flaws::{Flaw, TOLERANCE, flaws};
use crate::floor::Floor;
use crate::geometry::{Point, Segment, distance};
use crate::scenario::Scenario;
use crate::scenario::surroundings::Outline;

/// The usual length of the longer side of a place, metres: a table top to a large hall.
const USUAL_SIZE: (f64, f64) = (0.5, 300.0);
/// The shortest usual run, seconds.
const SHORTEST_RUN: f64 = 5.0;
/// Share of the instants of a path at which a robot has to measure a wall.
const LEAST_SEEN: f64 = 0.02;

/// The warnings about the walls of a map.
pub(super) fn of_map(facts: &Facts, floor: &Floor) -> Vec<Mistake> {
    of_walls(facts, floor, &Config::for_track_width(Metres(0.16)).rangers.first)
}

/// The warnings about walls that this sonar is to measure.
fn of_walls(facts: &Facts, floor: &Floor, sonar: &RangerParameters) -> Vec<Mistake> {
    let room = Room::new(floor);
    let mut warnings: Vec<_> = size(facts, &room).into_iter().collect();
    if room.walls.len() <= MOST_WALLS {
        warnings.extend(outliers(facts, &room));
        warnings.extend(gaps(facts, &room));
        warnings.extend(contradictions(facts, floor, sonar));
    }
    warnings
}

/// The warnings about a scenario: its walls, and its path and objects among them.
pub(super) fn of_scenario(facts: &Facts, scenario: &Scenario) -> Vec<Mistake> {
    let sonar = &scenario.robot.localizer.rangers.first;
    let mut warnings = of_walls(facts, &scenario.floor, sonar);
    let room = Room::new(&scenario.floor);
    warnings.extend(start(facts, scenario, &room));
    warnings.extend(duration(facts, scenario));
    warnings.extend(objects(facts, scenario, &room));
    if warnings.is_empty() {
        warnings.extend(reach(facts, scenario, &room));
    }
    warnings
}

fn size(facts: &Facts, room: &Room) -> Option<Mistake> {
    let (least, most) = USUAL_SIZE;
    let size = room.size();
    let fact = facts.with("map.unit").next().or_else(|| facts.wall(0))?;
    if (least..=most).contains(&size) || !fact.report() {
        return None;
    }
    let [width, height] = room.sides().map(short);
    let units = [("m", 1.0), ("cm", 0.01), ("mm", 0.001)];
    let now = units.iter().find(|(name, _)| *name == fact.text).map_or(1.0, |(_, unit)| *unit);
    let is_usual = |unit: f64| (1.0..=100.0).contains(&(size * unit / now));
    let meant = units.iter().find(|(_, unit)| is_usual(*unit));
    let advice = meant.map_or_else(
        || "check the unit".to_owned(),
        |(name, _)| format!("did you mean unit = \"{name}\"?"),
    );
    Some(fact.warn(format!(
        "the walls measure {width} m x {height} m; usual are {least} m to {most} m: {advice}"
    )))
}

/// A wall that reaches far beyond all others, by a wrong digit or a lost decimal point.
fn outliers(facts: &Facts, room: &Room) -> Vec<Mistake> {
    let is_far = |wall: usize| {
        let others = room.walls.iter().enumerate().filter(|(other, _)| *other != wall);
        let (least, most) = bounds(others.map(|(_, other)| *other));
        let size = (most[0] - least[0]).max(most[1] - least[1]);
        let beyond =
            |[x, y]: Point| (least[0] - x).max(x - most[0]).max(least[1] - y).max(y - most[1]);
        room.walls.len() > 3 && ends(&room.walls, wall).any(|end| beyond(end) > 2.0 * size)
    };
    let far = (0..room.walls.len()).filter(|wall| is_far(*wall));
    let facts_of = far.filter_map(|wall| facts.wall(wall)).filter(|fact| fact.report());
    facts_of
        .map(|fact| {
            fact.warn(
                "the wall reaches far beyond all others: check its coordinates, for example for a \
                 lost decimal point"
                    .to_owned(),
            )
        })
        .collect()
}

/// Ends that nearly meet.
fn gaps(facts: &Facts, room: &Room) -> Vec<Mistake> {
    let walls = &room.walls;
    let all = || (0..walls.len()).flat_map(|wall| ends(walls, wall).map(move |end| (wall, end)));
    let is_surveyed = |wall: usize| facts.in_table("map.wall.accuracy", wall).is_some();
    let is_loose = |&(wall, end): &(usize, Point)| nearest(walls, wall, end) > TOLERANCE;
    let loose: Vec<_> = all().filter(is_loose).filter(|(wall, _)| !is_surveyed(*wall)).collect();
    let widest = if loose.len() <= 2 { 5.0 * WIDEST_GAP } else { WIDEST_GAP };
    let widest = widest.min(0.2 * room.size());
    let mut found = Vec::new();
    for (index, &(wall, end)) in loose.iter().enumerate() {
        let later = loose.iter().skip(index + 1).filter(|(other, _)| *other != wall);
        let partner = later
            .map(|&(other, there)| (other, distance(end, there)))
            .filter(|&(other, gap)| {
                gap < WIDEST_GAP.min(widest)
                    || (gap < widest && !is_doorway(walls, wall, other, end))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let is_beside =
            |other: &Segment| other.distance_to(end) < WIDEST_GAP && is_across(walls, wall, *other);
        let beside =
            walls.iter().enumerate().find(|(other, segment)| *other != wall && is_beside(segment));
        let beside = beside.map(|(other, segment)| (other, segment.distance_to(end)));
        if let Some((other, gap)) = partner.or(beside)
            && let Some(fact) = facts.wall(wall)
            && fact.report()
        {
            let name = facts.wall(other).map_or_else(String::new, Fact::quoted);
            let [x, y] = end.map(short);
            found.push(fact.warn(format!(
                "the wall ends at ({x}, {y}) m, {} cm from the wall {name}: the corner does not close; let both \
                 walls end at the same point",
                short(100.0 * gap)
            )));
        }
    }
    found
}

/// Whether another wall is not parallel to this one, so that their ends may meet in a corner.
fn is_across(walls: &[Segment], wall: usize, other: Segment) -> bool {
    let Some(wall) = walls.get(wall) else { return false };
    let ([ax, ay], [bx, by]) = (wall.tangent(), other.tangent());
    (ax * by - ay * bx).abs() > 0.3
}

/// Whether the gap from the end of a wall to another one is along the wall, as a door is.
fn is_doorway(walls: &[Segment], wall: usize, other: usize, end: Point) -> bool {
    let place = |wall: usize, point: Point| walls.get(wall).map(|wall| wall.place(point)[1].abs());
    let other_end = walls.get(other).map(|wall| {
        if distance(wall.from, end) < distance(wall.to, end) { wall.from } else { wall.to }
    });
    let is_along = |offset: Option<f64>| offset.is_some_and(|offset| offset < 0.05);
    other_end.is_some_and(|there| is_along(place(wall, there)) || is_along(place(other, end)))
}

/// Walls that contradict each other.
fn contradictions(facts: &Facts, floor: &Floor, sonar: &RangerParameters) -> Vec<Mistake> {
    let found = flaws(floor, sonar).unwrap_or_default().into_iter();
    let is_wrong = |flaw: &Flaw| {
        matches!(flaw, Flaw::Duplicate { .. } | Flaw::Overlap { .. } | Flaw::Crossing { .. })
    };
    let found = found.filter(|finding| is_wrong(&finding.flaw));
    let warning = found.filter_map(|finding| {
        let fact = facts.wall(finding.wall)?;
        let other = finding.other().and_then(|other| facts.wall(other)).map(Fact::quoted);
        let message = format!("with the wall {}: {}", other.unwrap_or_default(), finding.flaw);
        fact.report().then(|| fact.warn(message))
    });
    warning.collect()
}

fn start(facts: &Facts, scenario: &Scenario, room: &Room) -> Option<Mistake> {
    let plan = scenario.path.plan();
    let fact = facts.with("path.start[0]").next()?;
    if room.has_inside(plan.start) || !fact.report() {
        return None;
    }
    let [x, y] = plan.start.map(short);
    let advice = intention(&scenario.floor, plan, 0.0)
        .unwrap_or_else(|| ": check start, corners and unit, and the unit of the map".to_owned());
    let ([x0, y0], [x1, y1]) = (room.least.map(short), room.most.map(short));
    Some(fact.warn(format!(
        "the start ({x}, {y}) m is outside of the room, whose walls are from ({x0}, {y0}) to ({x1}, {y1}) m{advice}"
    )))
}

fn duration(facts: &Facts, scenario: &Scenario) -> Option<Mistake> {
    let (seconds, length) = (scenario.path.duration(), scenario.path.length());
    let fact = facts.with("path.speed").next()?;
    (seconds < SHORTEST_RUN && fact.report()).then(|| {
        fact.warn(format!(
            "the whole path of {} m takes {} s, too short for a robot to localize: check the unit of the path, the speed and the laps",
            short(length),
            short(seconds)
        ))
    })
}

/// Objects outside of the map, and in the way.
fn objects(facts: &Facts, scenario: &Scenario, room: &Room) -> Vec<Mistake> {
    let plan = scenario.path.plan();
    let starts = std::iter::once(plan.start).chain(plan.corners.iter().copied());
    let legs: Vec<_> =
        starts.zip(&plan.corners).map(|(from, to)| Segment { from, to: *to }).collect();
    let warning = |(index, obstacle): (usize, &crate::scenario::surroundings::Obstacle)| {
        let (key, at, ahead) = match obstacle.outline {
            Outline::Circle { centre, radius } => {
                let is_ahead = |leg: &Segment| leg.distance_to(centre) < radius;
                ("world.obstacle.centre[0]", centre, legs.iter().any(is_ahead))
            }
            Outline::Face { from, to } => {
                let face = Segment { from, to };
                let is_ahead = |leg: &Segment| leg.distance(face) <= 0.0;
                ("world.obstacle.from[0]", from, legs.iter().any(is_ahead))
            }
        };
        let fact = facts.in_table(key, index)?;
        let [x, y] = at.map(short);
        let message = if !room.bounds(at) {
            let change = CHANGES.iter().find(|change| room.bounds((change.undo)(at)));
            let advice =
                change.map_or_else(String::new, |change| format!(": is it that {}?", change.why));
            format!("the obstacle at ({x}, {y}) m is outside of the map{advice}")
        } else if ahead && obstacle.walk.is_none() {
            format!(
                "the path leads through the obstacle at ({x}, {y}) m: check its place and its radius"
            )
        } else {
            return None;
        };
        fact.report().then(|| fact.warn(message))
    };
    scenario.surroundings.obstacles.iter().enumerate().filter_map(warning).collect()
}

/// A ranger with which the robot measures no wall from its path.
fn reach(facts: &Facts, scenario: &Scenario, room: &Room) -> Option<Mistake> {
    let count = |sees: &dyn Fn(&RangerParameters, f64, f64) -> bool| {
        let seen = (0..SAMPLES).filter(|index| {
            let share = f64::from(*index) / f64::from(SAMPLES);
            let pose = scenario.path.pose_at(share * scenario.path.duration());
            let rangers = scenario.robot.localizer.rangers;
            let hits = |wall: &Segment| {
                let [along, aside] = wall.place([pose.x, pose.y]);
                let [tx, ty] = wall.tangent();
                let (nx, ny) = (aside.signum() * ty, -aside.signum() * tx);
                let bearing = crate::geometry::wrap(libm::atan2(ny, nx) - pose.heading);
                let faces = along >= 0.0 && along <= wall.length();
                faces && rangers.iter().any(|(_, ranger)| sees(ranger, aside.abs(), bearing))
            };
            room.walls.iter().any(hits)
        });
        let share = f64::from(u16::try_from(seen.count()).unwrap_or(SAMPLES)) / f64::from(SAMPLES);
        share >= LEAST_SEEN
    };
    let is_near =
        |ranger: &RangerParameters, range: f64| range <= f64::from(ranger.max_range.0) + 0.3;
    let is_far = |ranger: &RangerParameters, range: f64| range >= f64::from(ranger.min_range.0);
    let is_ahead = |ranger: &RangerParameters, bearing: f64| {
        let (right, left) = ranger.servo;
        let cone = f64::from(ranger.cone.0);
        let (right, left) = (f64::from(right.0) - cone, f64::from(left.0) + cone);
        (-1..=1).any(|turn| {
            let bearing = bearing + f64::from(turn) * std::f64::consts::TAU;
            bearing >= right && bearing <= left
        })
    };
    let message = |key: &str, text: &str| {
        let fact = facts.with(key).next()?;
        fact.report().then(|| fact.warn(format!("{} {text}", fact.quoted())))
    };
    if !count(&|ranger, range, _| is_near(ranger, range)) {
        return message(
            "sonar.max_range",
            "never reaches a wall from the path: check the unit of max_range, of the map and of the path",
        );
    }
    if !count(&|ranger, range, _| is_near(ranger, range) && is_far(ranger, range)) {
        return message(
            "sonar.min_range",
            "is farther than every wall from the path: check the unit of min_range",
        );
    }
    if !count(&|ranger, range, bearing| {
        is_near(ranger, range) && is_far(ranger, range) && is_ahead(ranger, bearing)
    }) {
        let key = if facts.with("sonar.bearing").next().is_some() {
            "sonar.bearing"
        } else {
            "sonar.servo[0]"
        };
        return message(
            key,
            "points to no wall from the path: a bearing is 0 ahead and positive to the left",
        );
    }
    None
}
