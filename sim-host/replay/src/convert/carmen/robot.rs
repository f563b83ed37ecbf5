//! The robot file of a robot with a CARMEN log: its keys are those of an unknown robot of this kind, the same for
//! each log, except for the scanner's place and field of view, which are in the log.

use std::path::Path;

use crate::convert::ConvertError;
use crate::convert::robot_file::{self, Value};

use super::odometry::TRACK_WIDTH;

/// Writes `robot.toml`, with the scanner at `mount` and the bearings of its first and last beam.
pub fn write(dir: &Path, mount: [f64; 2], field: [f64; 2]) -> Result<(), ConvertError> {
    let [rightmost, leftmost] = field.map(f64::to_degrees);
    let cone = 15.0;
    let servo = format!("[\"{rightmost:.1} deg\", \"{leftmost:.1} deg\"]");
    let mount = format!("[\"{:.3} m\", \"{:.3} m\"]", mount[0], mount[1]);
    let wheel = "{ travel_per_edge = \"1 mm\" }";
    let text = Value::text;
    let tables = vec![
        (
            "drive",
            vec![
                (
                    "track_width",
                    text(
                        &format!("{TRACK_WIDTH} m"),
                        "assumed; the wheels were made from poses with it",
                    ),
                ),
                (
                    "wheel_noise",
                    text("8 mm/sqrt(m)", "hard floors, thresholds and turns in place: 0.5 to 20"),
                ),
                (
                    "scale_walk",
                    text("0.02 %/sqrt(m)", "wheels drift by 0.1 to 0.5 % within a recording"),
                ),
                ("track_width_walk", text("0.1 mm/sqrt(m)", "likewise")),
                ("max_wheel_speed", text("3 m/s", "above what such robots do")),
                ("encoder_period", text("250 ms", "about what such logs have")),
                ("right_wheel", Value(wheel.to_owned(), "made up: the log has no counts")),
                ("left_wheel", Value(wheel.to_owned(), "likewise")),
            ],
        ),
        (
            "sonar",
            [vec![
                ("mount", Value(mount, "where the log has the scanner; 0 in a corrected log")),
                (
                    "servo",
                    Value(
                        servo,
                        "the whole scan: half a cone at its ends, or the walls of a corridor would go unheard",
                    ),
                ),
                ("cone", text(&format!("{cone} deg"), "half of it: a sonar's")),
                ("min_range", text("10 cm", "the scanner's")),
                ("max_range", text("8 m", "a sonar's at its best")),
                ("noise", text("15 mm", "the scanner 10 mm, and its centimetres")),
                ("noise_per_metre", text("5 mm/m", "walls are straight to a few mm a metre")),
                ("fix_period", text("800 ms", "a slow sonar's")),
            ], robot_file::no_servo(rightmost, leftmost).into()].into_iter().flatten().collect(),
        ),
        (
            "prior",
            vec![
                ("scale_right", text("5 %", "odometry of unknown calibration: real ones are wrong by 3 to 5 %")),
                ("scale_left", text("5 %", "likewise")),
                ("scale_difference", text("1 %", "wheels of one type")),
                ("track_width", text("20 mm", "likewise")),
                ("range_scale", Value("0.0".to_owned(), "map and scanner share their metre")),
            ],
        ),
        (
            "gating",
            vec![
                (
                    "confidence",
                    Value(
                        "0.5".to_owned(),
                        "deviations; with more, few walls are left in a building",
                    ),
                ),
            ],
        ),
        (
            "echo",
            vec![
                ("free_path", text("7 m", "furniture and people that the map does not have")),
                ("map_accuracy", text("60 mm", "walls fitted to SLAM, and what stands along them: the robot is then least sensitive to the other values")),
            ],
        ),
        ("schedule", vec![("policy", text("informative", "the default"))]),
    ];
    robot_file::write(dir, "robot.toml", "A robot from a CARMEN log", tables)
}
