//! The robot file: what is in the bag, and values of an unknown robot for the rest.

use std::path::Path;

use sonarfix_replay::convert::ConvertError;
use sonarfix_replay::convert::robot_file::{self, Tables, Value};

use super::sensors::{self, Mounted, Sensors};
use super::wheels::Wheels;

/// Writes `robot.toml`.
pub fn write(to: &Path, wheels: &Wheels, sensors: &Sensors) -> Result<(), ConvertError> {
    let text = Value::text;
    let period = (1e3 * wheels.period()).clamp(1.0, 1000.0);
    let wheel = || {
        Value(
            "{ travel_per_edge = \"1 mm\" }".to_owned(),
            "made up: the log has travel, and no counts",
        )
    };
    let drive = vec![
        ("track_width", text(&format!("{} m", wheels.track_width), wheels.source)),
        (
            "wheel_noise",
            text("4 mm/sqrt(m)", "of an unknown robot: 0.5 on a hard floor, up to 20 on a bad one"),
        ),
        ("scale_walk", text("0.02 %/sqrt(m)", "likewise")),
        ("track_width_walk", text("0.1 mm/sqrt(m)", "likewise")),
        ("max_wheel_speed", text("3 m/s", "above what such robots do")),
        ("encoder_period", text(&format!("{period:.0} ms"), "that of the bag")),
        ("right_wheel", wheel()),
        ("left_wheel", wheel()),
    ];
    let mut tables: Tables = vec![("drive", drive)];
    // A robot has a ranger, also one whose bag has none.
    let none = Mounted {
        place: [0.0; 2],
        bearings: [0.0; 2],
        cone: 15.0,
        reach: [0.05, 4.0],
        is_light: false,
    };
    let rangers = if sensors.rangers.is_empty() { &[none] } else { sensors.rangers.as_slice() };
    let name = if rangers.len() > 1 { "[sonar]" } else { "sonar" };
    for (number, ranger) in rangers.iter().enumerate() {
        let mut keys = sonar(ranger);
        if number == 0 {
            let period = (1e3 * sensors::period(sensors)).clamp(10.0, 10_000.0);
            keys.push(("fix_period", text(&format!("{period:.0} ms"), "that of the bag")));
        }
        tables.push((name, keys));
    }
    tables.push((
        "prior",
        vec![
            ("scale_right", text("5 %", "odometry of unknown calibration")),
            ("scale_left", text("5 %", "likewise")),
            ("scale_difference", text("1 %", "wheels of one type")),
            ("track_width", text("20 mm", "likewise")),
            ("range_scale", text("1 %", "the speed of sound at an unknown temperature")),
        ],
    ));
    tables.push(("gating", vec![("confidence", Value("3.0".to_owned(), "deviations"))]));
    tables.push(("schedule", vec![("policy", text("informative", "the default"))]));
    robot_file::write(to, "robot.toml", "A robot from a bag of ROS 2", tables)
}

/// The keys of a ranger.
fn sonar(ranger: &Mounted) -> Vec<(&'static str, Value)> {
    let text = Value::text;
    let [ahead, left] = ranger.place;
    let [right, leftmost] = ranger.bearings.map(f64::to_degrees);
    let [nearest, farthest] = ranger.reach;
    let nearest = if (0.0..100.0).contains(&nearest) { nearest } else { 0.05 };
    let is_reach = farthest > nearest + 0.001 && farthest <= 1000.0;
    let farthest = if is_reach { farthest } else { nearest + 4.0 };
    let mount = format!("[\"{ahead:.4} m\", \"{left:.4} m\"]");
    let mut keys = vec![("mount", Value(mount, "where its frame is"))];
    if ranger.is_fixed() {
        // Within half a turn to either side.
        let bearing = (right + 180.0).rem_euclid(360.0) - 180.0;
        keys.push(("bearing", text(&format!("{bearing:.2} deg"), "likewise")));
        if !ranger.is_light {
            keys.push(("ranger", text("hc_sr04", "made up: no replay needs it")));
        }
    } else {
        let limits = [right, leftmost].map(|bearing| bearing.clamp(-180.0, 180.0));
        let servo = format!("[\"{:.1} deg\", \"{:.1} deg\"]", limits[0], limits[1]);
        keys.push(("servo", Value(servo, "as far as it turned")));
        let [pulses, timing, kind] = robot_file::no_servo(limits[0], limits[1]);
        keys.extend([pulses, timing]);
        if !ranger.is_light {
            keys.push(kind);
        }
    }
    if ranger.is_light {
        keys.push(("ranger", text("custom", "light, of an unknown driver")));
        let beam = "{ spot = \"2 deg\", pointing = \"1 deg\" }".to_owned();
        keys.push(("beam", Value(beam, "of an unknown ranger")));
        keys.push(("cycle", text("50 ms", "likewise")));
    }
    keys.extend([
        (
            "cone",
            text(
                &format!("{:.1} deg", ranger.cone),
                "half of the field of view; of light the angle of incidence",
            ),
        ),
        ("min_range", text(&format!("{nearest:.4} m"), "that of the messages")),
        ("max_range", text(&format!("{farthest:.4} m"), "likewise")),
        ("noise", text("10 mm", "of an unknown ranger")),
        ("noise_per_metre", text("5 mm/m", "likewise")),
    ]);
    keys
}
