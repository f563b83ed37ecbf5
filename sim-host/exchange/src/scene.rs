//! The messages for a picture: poses, the map, the robot's ellipse, the beam.

use serde_json::{Value, json};
use sonarfix_sim::trace::Wall;

use crate::row::Row;

/// The frame of the map.
pub const MAP: &str = "map";
/// The frame of the robot: the midpoint between its wheels, x ahead.
pub const ROBOT: &str = "robot";
/// Half-axes of the ellipse in standard deviations: 95 % of the probability in two dimensions.
const ELLIPSE: f64 = 2.447_746_830_680_816;

/// Nanoseconds as a time of Foxglove.
pub fn stamp(nanoseconds: u64) -> Value {
    json!({ "sec": nanoseconds / 1_000_000_000, "nsec": nanoseconds % 1_000_000_000 })
}

fn point(x: f64, y: f64) -> Value {
    json!({ "x": x, "y": y, "z": 0.0 })
}

fn turned(heading: f64) -> Value {
    let (sin, cos) = (heading / 2.0).sin_cos();
    json!({ "x": 0.0, "y": 0.0, "z": sin, "w": cos })
}

/// A pose in the plane.
pub fn pose([x, y, heading]: [f64; 3]) -> Value {
    json!({ "position": point(x, y), "orientation": turned(heading) })
}

/// `foxglove.PoseInFrame` in the frame of the map.
pub fn pose_in_frame(time: u64, at: [f64; 3]) -> Value {
    json!({ "timestamp": stamp(time), "frame_id": MAP, "pose": pose(at) })
}

/// `foxglove.FrameTransform` from the map to the robot.
pub fn transform(time: u64, [x, y, heading]: [f64; 3]) -> Value {
    json!({
        "timestamp": stamp(time),
        "parent_frame_id": MAP,
        "child_frame_id": ROBOT,
        "translation": point(x, y),
        "rotation": turned(heading),
    })
}

/// `foxglove.Odometry`: the pose with the variances of x, y and heading and the covariance of x and y. The covariances
/// with the heading are not in a trace: they are zero, which the schema defines as unknown.
pub fn with_covariance(time: u64, at: [f64; 3], sigma: [f64; 3], xy: f64) -> Value {
    let [x, y, heading] = sigma.map(|sigma| sigma * sigma);
    let mut covariance = [0.0; 36];
    for (index, value) in [(0, x), (1, xy), (6, xy), (7, y), (35, heading)] {
        if let Some(entry) = covariance.get_mut(index) {
            *entry = value;
        }
    }
    json!({
        "timestamp": stamp(time),
        "frame_id": MAP,
        "child_frame_id": ROBOT,
        "pose": pose(at),
        "pose_covariance": covariance.as_slice(),
    })
}

fn colour([r, g, b, a]: [f64; 4]) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}

fn update(time: u64, id: &str, lines: &[Value], spheres: &[Value]) -> Value {
    let none: [Value; 0] = [];
    json!({
        "deletions": none,
        "entities": [{
            "timestamp": stamp(time),
            "frame_id": MAP,
            "id": id,
            "lifetime": stamp(0),
            "frame_locked": true,
            "metadata": none,
            "arrows": none,
            "cubes": none,
            "spheres": spheres,
            "cylinders": none,
            "lines": lines,
            "triangles": none,
            "texts": none,
            "models": none,
        }],
    })
}

fn lines(points: &[Value], thickness: f64, of: [f64; 4]) -> Value {
    let none: [Value; 0] = [];
    json!({
        "type": 2,
        "pose": pose([0.0; 3]),
        "thickness": thickness,
        "scale_invariant": true,
        "points": points,
        "color": colour(of),
        "colors": none,
        "indices": none,
    })
}

/// The walls of the map.
pub fn map(time: u64, walls: &[Wall]) -> Value {
    let ends = walls.iter().flat_map(|wall| [wall.from, wall.to]);
    let points: Vec<Value> = ends.map(|[x, y]| point(x, y)).collect();
    update(time, "map", &[lines(&points, 3.0, [0.5, 0.5, 0.5, 1.0])], &[])
}

/// The 95 % ellipse of the position.
pub fn ellipse(time: u64, [x, y, _]: [f64; 3], sigma: [f64; 3], xy: f64) -> Value {
    let [sx, sy, _] = sigma.map(|sigma| sigma * sigma);
    let mean = f64::midpoint(sx, sy);
    let half = ((sx - sy) / 2.0).hypot(xy);
    let axis = |variance: f64| 2.0 * ELLIPSE * variance.max(0.0).sqrt();
    let direction = (2.0 * xy).atan2(sx - sy) / 2.0;
    let sphere = json!({
        "pose": pose([x, y, direction]),
        "size": { "x": axis(mean + half), "y": axis(mean - half), "z": 0.001 },
        "color": colour([0.1, 0.4, 0.8, 0.4]),
    });
    update(time, "ellipse", &[], &[sphere])
}

/// The beam of a measurement cycle up to its echo; `None` if there was no echo.
pub fn beam(time: u64, row: &Row) -> Option<Value> {
    let real = |column| row.real(column);
    let (x, y) = (real("fix_sonar_x_m")?, real("fix_sonar_y_m")?);
    let (range, direction) = (real("fix_range_m")?, real("fix_direction_rad")?);
    let (sin, cos) = direction.sin_cos();
    let of = match row.text("fix_outcome")? {
        "accepted" => [0.1, 0.6, 0.2, 1.0],
        "downweighted" => [0.9, 0.6, 0.0, 1.0],
        _ => [0.8, 0.2, 0.2, 1.0],
    };
    let points = [point(x, y), point(x + range * cos, y + range * sin)];
    Some(update(time, "beam", &[lines(&points, 2.0, of)], &[]))
}
