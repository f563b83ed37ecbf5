//! The `[drive]` table of a robot file: wheels and encoders.

use sonarfix::geometry::units::Metres;
use sonarfix_hal::config::{RobotConfig, WheelConfig};

use super::common_parts::usual;
use crate::document::Node;
use crate::keys::{Key, Section, Value, depends, number, optional};
use crate::quantity::{LENGTH, LENGTH_WALK, NUMBER, SCALE_WALK, SPEED, TIME};

#[rustfmt::skip]
pub(crate) static DRIVE: Section<RobotConfig> = Section { name: "drive", usual, keys: &[
    number("track_width", &LENGTH, ("1 cm", "10 m"), |c| &mut c.localizer.drive.track_width.0,
        "distance between the wheels' points of contact, as measured"),
    number("wheel_noise", &LENGTH_WALK, ("0.001 mm/sqrt(m)", "1 m/sqrt(m)"), |c| &mut c.localizer.drive.wheel_noise.0.0,
        "white noise of each wheel's travel: 0.5 mm/√m on a hard floor, up to 20 on a bad one. While the ranges show more, up to four times as much [is used](model.md#adaptation-of-the-noise)"),
    number("scale_walk", &SCALE_WALK, ("0 /sqrt(m)", "1 /sqrt(m)"), |c| &mut c.localizer.drive.scale_walk.0, "random walk of each wheel's scale error"),
    number("track_width_walk", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |c| &mut c.localizer.drive.track_width_walk.0.0,
        "random walk of the track width"),
    number("max_wheel_speed", &SPEED, ("1 mm/s", "100 m/s"), |c| &mut c.localizer.max_wheel_speed.0,
        "upper limit of the speed of a wheel. A reading above it is treated as an encoder fault"),
    number("encoder_period", &TIME, ("1 ms", "1 s"), |c| &mut c.encoder_period, "period of the encoder samples"),
    Key::new("right_wheel", Value::Own("a table", |node, c| c.right_wheel = read_wheel(node), |c| Some(wheel_text(c.right_wheel))),
        "the right wheel and its encoder"),
    Key::new("left_wheel", Value::Own("a table", |node, c| c.left_wheel = read_wheel(node), |c| Some(wheel_text(c.left_wheel))),
        "the left wheel and its encoder"),
] };

#[rustfmt::skip]
pub(crate) static WHEEL: Section<Wheel> = Section { name: "wheel", usual: Wheel::default, keys: &[
    depends(number("diameter", &LENGTH, ("1 mm", "10 m"), |w| &mut w.diameter, "diameter of the wheel")),
    depends(number("edges_per_revolution", &NUMBER, ("1", "10000000"), |w| &mut w.edges,
        "encoder counts per revolution of the wheel, with all edges of both channels")),
    depends(number("travel_per_edge", &LENGTH, ("0.00001 mm", "1 m"), |w| &mut w.travel,
        "instead of both: the travel per edge. Drive a long distance, and divide it by the number of edges")),
    optional(Key::new("mirrored", Value::Flag(|w| &mut w.is_mirrored), "whether the encoder counts down when the robot drives forwards")),
] };

/// A wheel as its table describes it; lengths in metres.
#[derive(Clone, Copy, Default)]
pub(crate) struct Wheel {
    pub diameter: Option<f32>,
    pub edges: Option<f32>,
    pub travel: Option<f32>,
    pub is_mirrored: bool,
}

/// A wheel: by its diameter and the edges per revolution of its encoder, or by its travel per edge.
pub(crate) fn read_wheel(node: Node<'_>) -> WheelConfig {
    let table = node.table(&WHEEL.names());
    let Wheel { diameter, edges, travel, is_mirrored } = WHEEL.read_from(&table, Wheel::default());
    let wheel = if let Some(travel) = travel {
        if let Some(other) = table.get("diameter").or(table.get("edges_per_revolution")) {
            other.report("contradicts travel_per_edge: remove one of them");
        }
        WheelConfig { travel_per_edge: Metres(travel), is_mirrored: false }
    } else {
        table.require("edges_per_revolution");
        table.require("diameter");
        WheelConfig::of_diameter(Metres(diameter.unwrap_or(1.0)), edges.unwrap_or(1.0))
    };
    if is_mirrored { wheel.mirrored() } else { wheel }
}

fn wheel_text(wheel: WheelConfig) -> String {
    let WheelConfig { travel_per_edge, is_mirrored } = wheel;
    WHEEL.inline(&Wheel { travel: Some(travel_per_edge.0), is_mirrored, ..Wheel::default() })
}
