//! The recorded sweeps of the data set `nxt_rotating_sonar`, described in its README.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use sonarfix_sim::world::segment::{Point, Segment};

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A table cannot be read.
    #[error("{}: {error}", .file.display())]
    Table {
        /// The file.
        file: PathBuf,
        /// The reason.
        error: csv::Error,
    },
    /// A sweep cannot be read.
    #[error("{}: {error}", .file.display())]
    Sweep {
        /// The file.
        file: PathBuf,
        /// The reason.
        error: std::io::Error,
    },
    /// A reading is not a number.
    #[error("{}: \"{reading}\" is not a range in centimetres", .file.display())]
    Reading {
        /// The file.
        file: PathBuf,
        /// Its text.
        reading: String,
    },
}

#[derive(Deserialize)]
struct WallRow {
    x1: f64,
    y1: f64,
    x2: f64,
    y2: f64,
}

#[derive(Deserialize)]
struct SweepRow {
    file: String,
    wp_x_cm: f64,
    wp_y_cm: f64,
    fit_dx_cm: f64,
    fit_dy_cm: f64,
    fit_start_deg: f64,
    fit_dir: f64,
    fit_bias_cm: f64,
    note: String,
}

/// Reading of the sensor without an echo, cm.
const NO_ECHO: f64 = 255.0;
/// Offset that one team added to every reading, cm, according to the table.
const ADDED: (&str, f64) = ("+12 cm", 12.0);

/// One sweep of a sonar at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Its position, metres.
    pub place: Point,
    start: f64,
    turn: f64,
    readings: Vec<Option<f64>>,
}

impl Sweep {
    /// The pings: direction of the beam, radians, and range, metres.
    #[expect(clippy::cast_precision_loss, reason = "a sweep has 360 pings")]
    pub fn pings(&self) -> impl Iterator<Item = (f64, Option<f64>)> {
        let step = self.turn / self.readings.len() as f64;
        let readings = self.readings.iter().enumerate();
        readings.map(move |(n, &reading)| (self.start + step * n as f64, reading))
    }
}

/// The room and all sweeps in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The walls.
    pub walls: Vec<Segment>,
    /// The sweeps.
    pub sweeps: Vec<Sweep>,
}

impl Recording {
    /// Reads the folder `nxt_rotating_sonar`.
    ///
    /// # Errors
    /// [`RecordingError`], with the first file that is missing or wrong.
    pub fn read(dir: &Path) -> Result<Self, RecordingError> {
        let metres = |x: f64, y: f64| [x / 100.0, y / 100.0];
        let wall = |row: WallRow| Segment::new(metres(row.x1, row.y1), metres(row.x2, row.y2));
        let walls = rows(&dir.join("walls_cm.csv"))?.into_iter().map(wall).collect();
        let sweeps: Vec<SweepRow> = rows(&dir.join("sweeps.csv"))?;
        let sweeps =
            sweeps.iter().map(|row| sweep(&dir.join("sweeps"), row)).collect::<Result<_, _>>()?;
        Ok(Self { walls, sweeps })
    }
}

fn rows<T: DeserializeOwned>(file: &Path) -> Result<Vec<T>, RecordingError> {
    let read = || csv::Reader::from_path(file)?.deserialize().collect::<csv::Result<Vec<T>>>();
    read().map_err(|error| RecordingError::Table { file: file.to_owned(), error })
}

fn sweep(dir: &Path, row: &SweepRow) -> Result<Sweep, RecordingError> {
    let file = dir.join(&row.file);
    let text = sonarfix_map::read_text(&file)
        .map_err(|error| RecordingError::Sweep { file: file.clone(), error })?;
    let added = if row.note.contains(ADDED.0) { ADDED.1 } else { 0.0 };
    let range = |reading: &str| {
        let centimetres: f64 = reading.parse().map_err(|_| RecordingError::Reading {
            file: file.clone(),
            reading: reading.to_owned(),
        })?;
        let heard = centimetres < NO_ECHO + added;
        // The mean error of each sweep was fitted together with its pose and is subtracted: the mount of
        // the sensor and its zero offset are not part of this comparison.
        Ok(heard.then_some((centimetres - row.fit_bias_cm) / 100.0))
    };
    Ok(Sweep {
        place: [(row.wp_x_cm + row.fit_dx_cm) / 100.0, (row.wp_y_cm + row.fit_dy_cm) / 100.0],
        start: row.fit_start_deg.to_radians(),
        turn: row.fit_dir * std::f64::consts::TAU,
        readings: text.split_whitespace().map(range).collect::<Result<_, _>>()?,
    })
}
