//! What a range finder with a cone would measure in a map: the nearest point of any wall in the cone, as beam models of particle filters
//! take it.

use sonarfix_sim::angle;

/// A wall from end to end, metres.
pub type Segment = [[f64; 2]; 2];

/// The nearest point of the walls in a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Metres from the sonar.
    pub distance: f64,
    /// The angle from the axis if it is the foot of a perpendicular or an end of a wall, radians; `None`: elsewhere a wall reflects the
    /// sound away.
    pub off_axis: Option<f64>,
}

/// A cone around a beam.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    /// Where the sonar is, metres, map frame.
    pub from: [f64; 2],
    /// Direction of the axis, radians, map frame.
    pub axis: f64,
    /// Half of the angle, radians.
    pub half: f64,
    /// Metres beyond which nothing is measured.
    pub reach: f64,
}

impl Cone {
    /// The nearest point of the walls in the cone; nothing hides it, because a wall before it would be nearer.
    #[must_use]
    pub fn nearest(&self, walls: &[Segment]) -> Option<Nearest> {
        let near = walls.iter().filter_map(|wall| self.of_wall(wall));
        near.min_by(|one, other| one.distance.total_cmp(&other.distance))
    }

    fn of_wall(&self, [start, end]: &Segment) -> Option<Nearest> {
        let [to_start, to_end] = [start, end].map(|[x, y]| [x - self.from[0], y - self.from[1]]);
        let along = [to_end[0] - to_start[0], to_end[1] - to_start[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let at = -(to_start[0] * along[0] + to_start[1] * along[1]) / squared;
        let closest = point(to_start, along, at.clamp(0.0, 1.0));
        if length(closest) > self.reach {
            return None;
        }
        let off_axis = angle::wrap(closest[1].atan2(closest[0]) - self.axis).abs();
        if off_axis <= self.half {
            return Some(Nearest { distance: length(closest), off_axis: Some(off_axis) });
        }
        let edges = [-self.half, self.half].map(|by| meet(self.axis + by, to_start, along));
        let distance = edges.into_iter().flatten().min_by(f64::total_cmp)?;
        (distance <= self.reach).then_some(Nearest { distance, off_axis: None })
    }
}

fn point(start: [f64; 2], along: [f64; 2], at: f64) -> [f64; 2] {
    [start[0] + at * along[0], start[1] + at * along[1]]
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Distance at which a ray from the origin meets a segment.
fn meet(direction: f64, start: [f64; 2], along: [f64; 2]) -> Option<f64> {
    let (sin, cos) = direction.sin_cos();
    let across = cos * along[1] - sin * along[0];
    let distance = (start[0] * along[1] - start[1] * along[0]) / across;
    let at = (start[0] * sin - start[1] * cos) / across;
    // False for NaN, of parallels.
    (distance > 0.0 && (0.0..=1.0).contains(&at)).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of rays in the cone meets nothing nearer than the nearest point, and one of them comes as near.
    #[test]
    fn a_fan_of_rays_finds_the_same_point() {
        let corners = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [2.0, 3.0], [2.0, 4.0], [0.0, 4.0]];
        let side = |at: usize| [corners[at], corners[(at + 1) % corners.len()]];
        let walls: Vec<Segment> = (0..corners.len()).map(side).collect();
        let mut square = 0;
        for number in 0..200_u32 {
            let turn = f64::from(number);
            let from = [0.3 + (turn * 0.618).fract() * 4.4, 0.3 + (turn * 0.414).fract() * 2.4];
            let cone = Cone { from, axis: turn * 0.377, half: 0.2, reach: 10.0 };
            let nearest = cone.nearest(&walls).unwrap();
            square += u32::from(nearest.off_axis.is_some());
            let rays = (-2_000..=2_000).filter_map(|part| {
                let direction = cone.axis + cone.half * f64::from(part) / 2_000.0;
                let to = |[x, y]: [f64; 2]| [x - from[0], y - from[1]];
                let met = walls.iter().filter_map(|&[start, end]| {
                    let (start, end) = (to(start), to(end));
                    meet(direction, start, [end[0] - start[0], end[1] - start[1]])
                });
                met.min_by(f64::total_cmp)
            });
            let by_rays = rays.min_by(f64::total_cmp).unwrap();
            assert!((by_rays - nearest.distance).abs() < 1e-3, "{cone:?} {nearest:?} {by_rays}");
        }
        assert!((20..180).contains(&square), "{square}");
    }
}
