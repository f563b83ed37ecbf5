//! Pings at walls that stand alone, for what the sonar measures there: the axis and 15° to either side meet the wall first, the foot of its
//! perpendicular is on it, and no other reflector of the map is as near within 70° of the axis. What they return does not matter.

use nalgebra::Vector2;

use crate::constants::Name;
use crate::echoes::{AtWall, Echoes, Limits};
use crate::fit::Fit;
use crate::reflector::Reflector;
use crate::wall::{Wall, sonar};

/// Angle to either side of the axis in which nothing but the wall may be, radians: 15°.
const BESIDE: f64 = 0.262;
/// Angle off the axis up to which another reflector could return the echo, radians: 70°.
const ASIDE: f64 = 1.22;
/// How much farther another reflector must be than the wall on the axis, metres.
const FARTHER: f64 = 0.15;
/// Distance of the foot from the ends of the wall, metres.
const FROM_END: f64 = 0.15;
/// Angle between axis and normal up to which a wall is square to the sonar if its cone is not known, radians: 8°.
const SQUARE: f64 = 0.14;
/// The same as a part of the half-angle of the cone.
const INSIDE: f64 = 0.6;

impl Fit<'_> {
    /// What the recording says of the sonar's echoes, with the half-angle of its cone if it is known, radians.
    pub(crate) fn echoes(&self, half_cone: Option<f64>) -> Echoes {
        let limits = Limits {
            square: half_cone.map_or(SQUARE, |half| INSIDE * half),
            sure_within: self.nominal.sure_within,
            farthest: self.nominal.reach[1],
        };
        Echoes::of(&self.at_walls(), &limits)
    }

    /// The pings at walls that stand alone.
    fn at_walls(&self) -> Vec<AtWall> {
        let (problem, constants) = (&self.problem, &self.state.constants);
        let walls: Vec<&Wall> = problem.reflectors.iter().filter_map(Reflector::wall).collect();
        let [nearest, farthest] = self.nominal.reach;
        let pings = problem.chain.pings.iter().filter_map(|event| {
            let ping = problem.recording.pings.get(event.index)?;
            let (pose, ..) = problem.pose_at(&self.state, event);
            let (at, direction) = sonar(&pose, ping.bearing, constants);
            let (index, ahead) = first_met(&walls, at, direction)?;
            let beside = [direction - BESIDE, direction + BESIDE];
            let is_wide = |ray| first_met(&walls, at, ray).is_some_and(|(other, _)| other == index);
            let wall = *walls.get(index)?;
            let foot = wall.foot(at, direction);
            let distance = foot.signed.abs();
            let is_in_reach = distance > nearest + 0.05 && ahead < 0.8 * farthest;
            let is_inside = foot.along > FROM_END && foot.along < wall.length() - FROM_END;
            let is_alone = problem.reflectors.iter().all(|other| {
                let view = other.view(at, direction);
                other.wall().is_some_and(|other| std::ptr::eq(other, wall))
                    || !view.answers
                    || view.off_axis.abs() > ASIDE
                    || view.distance > ahead + FARTHER
            });
            let is_clear = is_in_reach && is_inside && is_alone && beside.into_iter().all(is_wide);
            let stretch = 1.0 + constants.get(Name::RangeScale);
            let range =
                ping.range.map(|range| (range - constants.get(Name::RangeOffset)) / stretch);
            is_clear.then(|| AtWall {
                distance,
                angle: foot.off_axis.abs(),
                range,
                bias: constants.get(Name::OffAxis),
                noise: problem.noise.of_range(distance),
            })
        });
        pings.collect()
    }
}

/// The first wall that a ray meets, and its distance along the ray, metres.
fn first_met(walls: &[&Wall], from: Vector2<f64>, direction: f64) -> Option<(usize, f64)> {
    let met =
        walls.iter().enumerate().filter_map(|(k, wall)| Some((k, wall.met(from, direction)?)));
    met.min_by(|one, other| one.1.total_cmp(&other.1))
}
