//! The `[echo]` table of a robot file.

use sonarfix_hal::config::RobotConfig;

use super::common_parts::usual;
use crate::document::Node;
use crate::keys::{Key, Section, Value, number, optional};
use crate::quantity::{ANGLE, FRACTION, LENGTH};
use crate::sonar_model;

#[rustfmt::skip]
pub(crate) static ECHO: Section<RobotConfig> = Section { name: "echo", usual, keys: &[
    optional(Key::new("sensor", Value::Own("an echo model of the list above", |node, c| read_sensor(&node, c), |_| None),
        "default of the other keys. Only the NXT's is from recordings; `\"ideal\"`: no clutter, exact map")),
    optional(number("missed", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.missed,
        "probability that a wall within range and square to the beam returns no echo. Below 1 together with `short` and `long`")),
    optional(number("short", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.short, "probability of a spurious range that is shorter than the wall's")),
    optional(number("long", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.long, "probability of a spurious range that is longer")),
    optional(number("free_path", &LENGTH, ("0 m", "10000 m"), |c| &mut c.localizer.echo.free_path.0,
        "range at which every second beam meets an object that is not in the map. 0: there are no such objects")),
    optional(number("map_accuracy", &LENGTH, ("0 m", "10 m"), |c| &mut c.localizer.echo.map_accuracy.0,
        "standard deviation of the place of a wall without an `accuracy` of its own: 5 mm in a measured room, 60 mm in a SLAM map. It is common to ranges to \
        one wall from one place, so that repeated pings do not average it away. An NXT has 5 mm: so much of its bias at oblique walls is in no other key")),
    optional(number("late", &LENGTH, ("0 m", "1 m"), |c| &mut c.localizer.echo.late.0,
        "mean by which an echo from the normal is reported too far, by missed cycles and the threshold of the detector")),
    optional(number("late_per_radian", &LENGTH, ("0 m", "1 m"), |c| &mut c.localizer.echo.late_per_radian.0,
        "by how much more per radian between the axis of the sonar and the normal of the wall")),
    optional(number("half_angle", &ANGLE, ("0 deg", "90 deg"), |c| &mut c.localizer.echo.half_angle.0,
        "angle between the axis of the sonar and the normal of a wall at which it hears half of the echoes: it explains echoes, and `cone` chooses walls. \
        0: the `cone` is taken")),
    optional(number("rim", &ANGLE, ("0 deg", "90 deg"), |c| &mut c.localizer.echo.rim.0,
        "standard deviation of that angle from ping to ping")),
    optional(number("sure_within", &LENGTH, ("0 m", "10 m"), |c| &mut c.localizer.echo.sure_within.0,
        "range up to which hardly any echo is missed or spurious: 4 % of `missed`, `short` and `long`, which are those of longer ranges. 0: they are the \
        same at every range")),
] };

/// Reads `sensor` of `[echo]`: the usual parameters of its echoes.
fn read_sensor(node: &Node<'_>, config: &mut RobotConfig) {
    let echo = &mut config.localizer.echo;
    *echo = sonar_model::read(node, &[], *echo, |model| model.echo);
}
