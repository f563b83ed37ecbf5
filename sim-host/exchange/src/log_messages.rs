//! The records of a log as messages: one topic for each kind, with the fields of `docs/formats.md`.

use serde_json::{Value, json};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise};
use sonarfix_replay::log::Record;
use sonarfix_search::navigator::Mode;
use sonarfix_sim::STATES;

use crate::row::{DEVIATIONS, Kind};
use crate::scene;
use crate::schema::{self, Schema};

const REAL: Kind = Kind::Real;
const STATE_FIELDS: [&str; 7] = [
    "x_m",
    "y_m",
    "heading_rad",
    "scale_right",
    "scale_left",
    "track_width_error_m",
    "range_scale",
];
/// The names of the state and of its deviations.
fn state_fields() -> impl Iterator<Item = &'static str> {
    STATE_FIELDS.into_iter().chain(DEVIATIONS)
}

const POSE_FIELDS: [(&str, Kind); 6] = [
    ("time_s", REAL),
    ("x_m", REAL),
    ("y_m", REAL),
    ("heading_rad", REAL),
    ("sigma_position_m", REAL),
    ("sigma_heading_rad", REAL),
];

const ABSOLUTE_FIELDS: [(&str, Kind); 12] = [
    ("time_s", REAL),
    ("age_s", REAL),
    ("kind", Kind::Text),
    ("x_m", REAL),
    ("y_m", REAL),
    ("heading_rad", REAL),
    ("variance_x_m2", REAL),
    ("covariance_xy_m2", REAL),
    ("variance_y_m2", REAL),
    ("covariance_x_heading_m_rad", REAL),
    ("covariance_y_heading_m_rad", REAL),
    ("variance_heading_rad2", REAL),
];

/// The kind of a measurement, its values x, y and heading, and the triangle of its covariance; nothing for what was not
/// measured.
fn numbers(
    measurement: &AbsoluteMeasurement,
) -> (&'static str, [Option<f64>; 3], [Option<f64>; 6]) {
    let of = |value: f32| Some(f64::from(value));
    match *measurement {
        AbsoluteMeasurement::Heading { angle, deviation } => {
            let variance = f64::from(deviation.0).powi(2);
            ("heading", [None, None, of(angle.0)], [None, None, None, None, None, Some(variance)])
        }
        AbsoluteMeasurement::Position { point, noise } => {
            let variances = [of(noise.xx), of(noise.xy), of(noise.yy), None, None, None];
            ("position", [of(point.x.0), of(point.y.0), None], variances)
        }
        AbsoluteMeasurement::Pose { pose, noise } => {
            let PoseNoise { position, xh, yh, hh } = noise;
            let value = [of(pose.x.0), of(pose.y.0), of(pose.heading.radians().0)];
            let variances =
                [of(position.xx), of(position.xy), of(position.yy), of(xh), of(yh), of(hh)];
            ("pose", value, variances)
        }
    }
}

/// The topics and their schemas.
pub fn topics() -> Vec<(&'static str, Schema)> {
    let whole = Kind::Whole;
    let states =
        || std::iter::once(("time_s", REAL)).chain(state_fields().map(|name| (name, REAL)));
    let ticks = [("time_s", REAL), ("right", whole), ("left", whole)];
    let wheels = [("time_s", REAL), ("right_m", REAL), ("left_m", REAL)];
    let turn = [("time_s", REAL), ("angle", whole), ("breaks", whole)];
    let range = [
        ("time_s", REAL),
        ("bearing_rad", REAL),
        ("range_m", REAL),
        ("wall", whole),
        ("ranger", whole),
    ];
    let mode = states().chain([("mode", Kind::Text)]);
    vec![
        ("/log/ticks", schema::columns("sonarfix.Ticks", ticks.into_iter())),
        ("/log/wheels", schema::columns("sonarfix.Wheels", wheels.into_iter())),
        ("/log/turn", schema::columns("sonarfix.Turn", turn.into_iter())),
        ("/log/range", schema::columns("sonarfix.Range", range.into_iter())),
        ("/log/absolute", schema::columns("sonarfix.Absolute", ABSOLUTE_FIELDS.into_iter())),
        ("/log/skip", schema::columns("sonarfix.Skip", [("time_s", REAL)].into_iter())),
        ("/log/scan", schema::laser_scan()),
        ("/log/start", schema::columns("sonarfix.Start", POSE_FIELDS.into_iter())),
        ("/log/pose", schema::columns("sonarfix.Pose", POSE_FIELDS.into_iter())),
        ("/log/mode", schema::columns("sonarfix.Mode", mode)),
        ("/log/resume", schema::columns("sonarfix.Resume", states())),
    ]
}

/// The time of a record, seconds on the log's clock.
pub fn time(record: &Record) -> f64 {
    match record {
        Record::Ticks { time, .. }
        | Record::Wheels { time, .. }
        | Record::Turn { time, .. }
        | Record::Range { time, .. }
        | Record::Absolute { time, .. }
        | Record::Skip { time }
        | Record::Scan { time, .. }
        | Record::Start { time, .. }
        | Record::Pose { time, .. }
        | Record::Mode { time, .. }
        | Record::Resume { time, .. } => *time,
    }
}

/// The topic and the message of a record. `mount` is the place of the sonar on the robot.
pub fn message(record: &Record, stamp: u64, mount: [f64; 2]) -> (&'static str, Value) {
    match record {
        Record::Ticks { time, right, left } => {
            ("/log/ticks", json!({ "time_s": time, "right": right, "left": left }))
        }
        Record::Wheels { time, right, left } => {
            ("/log/wheels", json!({ "time_s": time, "right_m": right, "left_m": left }))
        }
        Record::Turn { time, angle, breaks } => {
            ("/log/turn", json!({ "time_s": time, "angle": angle, "breaks": breaks }))
        }
        Record::Range { time, bearing, range, wall, ranger } => {
            let ranger = ranger.0;
            (
                "/log/range",
                json!({ "time_s": time, "bearing_rad": bearing, "range_m": range, "wall": wall, "ranger": ranger }),
            )
        }
        Record::Absolute { time, age, measurement } => {
            let (kind, value, variances) = numbers(measurement);
            let [x, y, heading] = value;
            let [xx, xy, yy, xh, yh, hh] = variances;
            (
                "/log/absolute",
                json!({
                    "time_s": time, "age_s": age, "kind": kind,
                    "x_m": x, "y_m": y, "heading_rad": heading,
                    "variance_x_m2": xx, "covariance_xy_m2": xy, "variance_y_m2": yy,
                    "covariance_x_heading_m_rad": xh, "covariance_y_heading_m_rad": yh,
                    "variance_heading_rad2": hh,
                }),
            )
        }
        Record::Skip { time } => ("/log/skip", json!({ "time_s": time })),
        Record::Scan { scan, .. } => {
            // Beams are counted in `u32`: a line of a log is shorter.
            let steps = u32::try_from(scan.ranges.len().saturating_sub(1)).unwrap_or(u32::MAX);
            let none: [f64; 0] = [];
            let [x, y] = mount;
            let message = json!({
                "timestamp": scene::stamp(stamp),
                "frame_id": scene::ROBOT,
                "pose": scene::pose([x, y, 0.0]),
                "start_angle": scan.first,
                "end_angle": scan.first + f64::from(steps) * scan.step,
                "ranges": scan.ranges,
                "intensities": none,
            });
            ("/log/scan", message)
        }
        Record::Start { time, pose, position_deviation, heading_deviation } => {
            let pose = [pose.x, pose.y, pose.heading];
            ("/log/start", start(*time, pose, *position_deviation, *heading_deviation))
        }
        Record::Pose { time, pose, position_deviation, heading_deviation } => {
            let pose = [pose.x, pose.y, pose.heading];
            ("/log/pose", start(*time, pose, *position_deviation, *heading_deviation))
        }
        Record::Mode { time, mode, state, deviation } => {
            let mut message = states(*time, state, deviation);
            let mode = match mode {
                Mode::Tracking => "tracking",
                Mode::Searching => "searching",
                Mode::Provisional => "provisional",
            };
            if let Some(fields) = message.as_object_mut() {
                fields.insert("mode".to_owned(), mode.into());
            }
            ("/log/mode", message)
        }
        Record::Resume { time, state, deviation } => {
            ("/log/resume", states(*time, state, deviation))
        }
    }
}

fn start(time: f64, [x, y, heading]: [f64; 3], position: f64, deviation: f64) -> Value {
    json!({
        "time_s": time,
        "x_m": x,
        "y_m": y,
        "heading_rad": heading,
        "sigma_position_m": position,
        "sigma_heading_rad": deviation,
    })
}

fn states(time: f64, state: &[f64; STATES.len()], deviation: &[f64; STATES.len()]) -> Value {
    let fields = state_fields().zip(state.iter().chain(deviation));
    let fields = fields.map(|(name, value)| (name.to_owned(), json!(value)));
    std::iter::once(("time_s".to_owned(), json!(time))).chain(fields).collect()
}
