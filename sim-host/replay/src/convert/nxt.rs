//! Sweeps of a LEGO NXT's rotating sonar in a room of known walls (the data set
//! `nxt_rotating_sonar`): one folder a sweep.

use std::path::Path;

use sonarfix_map::NamedWall;
use sonarfix_sim::trace::Pose;

use super::robot_file::{self, Value};
use super::{ConvertError, Converted, Log, ReferenceFile, make_dir, read_walls, write_map};

/// The reading without an echo, cm.
const NO_ECHO: f64 = 255.0;
/// Offset that one team added to every reading, cm, by the remark in the table.
const ADDED: (&str, f64) = ("+12 cm", 12.0);
/// Time between two readings, seconds. Made up: the recordings have no times.
const PERIOD: f64 = 0.1;

/// The conversion of all sweeps of a folder.
#[derive(Debug, Clone, Copy)]
pub struct Nxt<'a> {
    /// The folder with `sweeps.csv`, `walls_cm.csv` and `sweeps/`.
    pub from: &'a Path,
    /// The folder to write: a folder in it for each sweep.
    pub to: &'a Path,
}

/// A row of `sweeps.csv`.
struct Row {
    file: String,
    place: [f64; 2],
    /// Direction of the first reading, degrees.
    start: f64,
    /// 1: counter-clockwise; −1: clockwise.
    direction: f64,
    added: f64,
}

impl Nxt<'_> {
    /// Converts all sweeps.
    ///
    /// # Errors
    /// [`ConvertError`], for a file that is missing or wrong.
    pub fn convert(&self) -> Result<Converted, ConvertError> {
        let walls = read_walls(&self.from.join("walls_cm.csv"), 0.01)?;
        let mut converted = Converted::default();
        for row in rows(&self.from.join("sweeps.csv"))? {
            let readings = readings(&self.from.join("sweeps").join(&row.file))?;
            let dir = self.to.join(row.file.trim_end_matches(".txt"));
            write(&dir, &row, &readings, &walls)?;
            converted.encoders += 2;
            converted.reference += 2;
        }
        Ok(converted)
    }
}

fn rows(path: &Path) -> Result<Vec<Row>, ConvertError> {
    let content = |message: String| ConvertError::content(path, message);
    let mut csv = csv::Reader::from_path(path).map_err(|error| content(error.to_string()))?;
    let columns = csv.headers().map_err(|error| content(error.to_string()))?.clone();
    let mut rows = Vec::new();
    for (number, record) in (1_u32..).zip(csv.records()) {
        let record = record.map_err(|error| content(error.to_string()))?;
        let text = |name: &str| {
            let column = columns.iter().position(|column| column == name);
            let text = column.and_then(|column| record.get(column));
            text.ok_or_else(|| content(format!("row {number} has no {name}")))
        };
        let value = |name: &str| -> Result<f64, ConvertError> {
            let text = text(name)?.trim();
            text.parse()
                .map_err(|_| content(format!("row {number}: {name} is `{text}`, no number")))
        };
        rows.push(Row {
            file: text("file")?.to_owned(),
            place: [
                0.01 * (value("wp_x_cm")? + value("fit_dx_cm")?),
                0.01 * (value("wp_y_cm")? + value("fit_dy_cm")?),
            ],
            start: value("fit_start_deg")?,
            direction: value("fit_dir")?,
            added: if text("note")?.contains(ADDED.0) { ADDED.1 } else { 0.0 },
        });
    }
    Ok(rows)
}

fn readings(path: &Path) -> Result<Vec<f64>, ConvertError> {
    let text = sonarfix_map::read_text(path).map_err(ConvertError::read(path))?;
    let reading = |word: &str| {
        word.parse().map_err(|_| {
            ConvertError::content(path, format!("`{word}` is not a range in centimetres"))
        })
    };
    text.split_whitespace().map(reading).collect()
}

#[expect(clippy::cast_precision_loss, reason = "a sweep has 360 readings")]
fn write(dir: &Path, row: &Row, readings: &[f64], walls: &[NamedWall]) -> Result<(), ConvertError> {
    make_dir(dir)?;
    write_map(dir, "Walls of the room of the NXT sweeps, of walls_cm.csv.", walls)?;
    write_robot(dir)?;
    let end = PERIOD * (readings.len() + 1) as f64;
    let mut log = Log::create(dir)?;
    log.comment("A sweep on the spot: the robot's heading is the direction of its first reading.")?;
    log.ticks(0.0, [0, 0])?;
    for (n, reading) in readings.iter().enumerate() {
        let share = n as f64 / readings.len() as f64;
        let bearing = row.direction * std::f64::consts::TAU * share;
        let bearing = sonarfix_sim::angle::wrap(bearing);
        let range = (*reading < NO_ECHO + row.added).then_some(0.01 * reading);
        log.range(PERIOD * (n + 1) as f64, bearing, range)?;
    }
    log.ticks(end, [0, 0])?;
    log.0.close()?;
    let [x, y] = row.place;
    let pose = Pose { x, y, heading: sonarfix_sim::angle::wrap(row.start.to_radians()) };
    let mut reference = ReferenceFile::create(dir)?;
    reference.row(0.0, &pose)?;
    reference.row(end, &pose)?;
    reference.0.close()
}

fn write_robot(dir: &Path) -> Result<(), ConvertError> {
    let text = Value::text;
    let wheel = "{ travel_per_edge = \"1 mm\" }";
    let made_up = "made up: the robot stands still";
    let drive = vec![
        ("track_width", text("150 mm", made_up)),
        ("wheel_noise", text("5 mm/sqrt(m)", made_up)),
        ("scale_walk", text("0.02 %/sqrt(m)", made_up)),
        ("track_width_walk", text("0.1 mm/sqrt(m)", made_up)),
        ("max_wheel_speed", text("1 m/s", made_up)),
        ("encoder_period", text("250 ms", made_up)),
        ("right_wheel", Value(wheel.to_owned(), made_up)),
        ("left_wheel", Value(wheel.to_owned(), made_up)),
    ];
    let mut sonar = vec![
        ("mount", Value("[\"0 m\", \"0 m\"]".to_owned(), "the sonar turns about the place")),
        ("servo", Value("[\"-180 deg\", \"180 deg\"]".to_owned(), "whole turns")),
        (
            "cone",
            text("30 deg", "half of it: where half of the echoes are left (docs/sonar-model.md)"),
        ),
        ("min_range", text("3 cm", "the sensor's")),
        (
            "max_range",
            text("1.5 m", "farther, most readings are something else (docs/sonar-model.md)"),
        ),
        ("noise", text("15 mm", "docs/sonar-model.md")),
        ("noise_per_metre", text("0 mm/m", "likewise")),
        ("fix_period", text("100 ms", "made up: the recordings have no times")),
    ];
    sonar.extend(robot_file::no_servo(-180.0, 180.0));
    let prior = vec![
        ("scale_right", text("1 %", made_up)),
        ("scale_left", text("1 %", made_up)),
        ("track_width", text("3 mm", made_up)),
        ("range_scale", text("1 %", "temperature unknown")),
    ];
    let gating = vec![("confidence", Value("2.0".to_owned(), "deviations"))];
    let schedule = vec![("policy", text("informative", "the default"))];
    let tables = vec![
        ("drive", drive),
        ("sonar", sonar),
        ("prior", prior),
        ("gating", gating),
        ("schedule", schedule),
    ];
    robot_file::write(dir, "robot.toml", "A LEGO NXT with a rotating sonar.", tables)
}
