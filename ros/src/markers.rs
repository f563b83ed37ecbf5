//! Walls, pings and the ellipse of the pose as markers of `RViz`.

use std::f64::consts::PI;

use sonarfix::localizer::Fix;
use sonarfix::map::Wall;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{ColorRGBA, Duration, Marker, MarkerArray, Point};

use crate::motion::{Planar, moved};
use crate::view::{Frames, View, header};

/// Types of markers.
const CYLINDER: i32 = 3;
const LINE_LIST: i32 = 5;
/// Widths of lines, metres.
const WALL_WIDTH: f64 = 0.02;
const PING_WIDTH: f64 = 0.01;

/// A ping on the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// The sonar and the direction of its beam in the map.
    pub from: Planar,
    /// The range, metres.
    pub range: f64,
    /// What became of it.
    pub fix: Option<Fix>,
}

impl Drawn {
    /// A ping of a robot at this pose, whose ranger is mounted there (metres), along a bearing (radians).
    #[must_use]
    pub fn new(
        robot: Planar,
        [x, y]: [f64; 2],
        bearing: f64,
        range: f64,
        fix: Option<Fix>,
    ) -> Self {
        Self { from: moved(robot, [x, y, bearing]), range, fix }
    }

    fn colour(&self) -> ColorRGBA {
        let [r, g, b] = match self.fix {
            Some(Fix::Accepted(_)) => [0.1, 0.7, 0.1],
            Some(Fix::Downweighted(_)) => [0.9, 0.7, 0.0],
            Some(Fix::Gated(_)) => [0.9, 0.1, 0.1],
            _ => [0.5, 0.5, 0.5],
        };
        ColorRGBA { r, g, b, a: 1.0 }
    }
}

/// The markers of an estimate.
#[must_use]
pub fn markers(view: &View, walls: &[Wall], pings: &[Drawn], frames: &Frames) -> MarkerArray {
    let mut markers = vec![walls_marker(view, walls, frames), pings_marker(view, pings, frames)];
    if view.has_pose() {
        markers.push(ellipse(view, frames));
    }
    MarkerArray { markers }
}

fn marker(view: &View, frames: &Frames, name: &str, kind: i32) -> Marker {
    Marker {
        header: header(view.at, &frames.map),
        ns: name.to_owned(),
        r#type: kind,
        pose: geometry::pose([0.0; 3]),
        lifetime: Duration { sec: 0, nanosec: 0 },
        ..Marker::default()
    }
}

fn point(x: f64, y: f64) -> Point {
    Point { x, y, z: 0.0 }
}

fn walls_marker(view: &View, walls: &[Wall], frames: &Frames) -> Marker {
    let ends = |wall: &Wall| {
        [wall.from(), wall.to()].map(|end| point(f64::from(end.x.0), f64::from(end.y.0)))
    };
    Marker {
        points: walls.iter().flat_map(ends).collect(),
        scale: geometry::vector(WALL_WIDTH, 0.0),
        color: ColorRGBA { r: 0.2, g: 0.2, b: 0.2, a: 1.0 },
        ..marker(view, frames, "walls", LINE_LIST)
    }
}

fn pings_marker(view: &View, pings: &[Drawn], frames: &Frames) -> Marker {
    let ends = |ping: &Drawn| {
        let [x, y, _] = ping.from;
        let [far_x, far_y, _] = moved(ping.from, [ping.range, 0.0, 0.0]);
        [point(x, y), point(far_x, far_y)]
    };
    let colours = |ping: &Drawn| [ping.colour(), ping.colour()];
    Marker {
        points: pings.iter().flat_map(ends).collect(),
        colors: pings.iter().flat_map(colours).collect(),
        scale: geometry::vector(PING_WIDTH, 0.0),
        color: ColorRGBA { r: 0.0, g: 0.0, b: 0.0, a: 1.0 },
        ..marker(view, frames, "pings", LINE_LIST)
    }
}

/// The ellipse of three standard deviations of the position.
fn ellipse(view: &View, frames: &Frames) -> Marker {
    let [[xx, xy, _], [_, yy, _], _] = view.covariance;
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = half.hypot(xy);
    let axes = [middle + radius, middle - radius].map(|variance| 6.0 * variance.max(0.0).sqrt());
    let [x, y, _] = view.pose;
    let mut scale = geometry::vector(axes[0], axes[1]);
    scale.z = 0.01;
    Marker {
        pose: geometry::pose([x, y, (0.5 * xy.atan2(half)).rem_euclid(PI)]),
        scale,
        color: ColorRGBA { r: 0.2, g: 0.4, b: 1.0, a: 0.4 },
        ..marker(view, frames, "ellipse", CYLINDER)
    }
}
