//! Converts recordings of other formats to a folder for `sonarfix replay`: `log.csv`, `reference.csv`,
//! `map.toml`, `robot.toml` (`docs/formats.md`).

pub mod arc;
pub mod carmen;
pub mod given;
pub mod lego;
pub mod nxt;
pub mod robot_file;

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;
use serde::Serialize;
use sonarfix_files::Output;
use sonarfix_map::NamedWall;
use sonarfix_sim::trace::Pose;

use crate::log::HEADER;
use crate::reference::HEADER as REFERENCE_HEADER;
use crate::scan::Scan;

/// Why a conversion failed.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// A file is missing or cannot be read.
    #[error("{}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A file cannot be written.
    #[error("{} cannot be written: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The content of a file or folder is incomplete or wrong.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// The defect.
        message: String,
    },
}

impl ConvertError {
    /// That a file cannot be read.
    pub fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::Read { path: path.into(), error }
    }

    /// That a file cannot be written.
    pub fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::Write { path: path.into(), error }
    }

    /// That the content of a file or folder is wrong.
    pub fn content(path: &Path, message: impl Into<String>) -> Self {
        Self::Content { path: path.into(), message: message.into() }
    }
}

/// The result of a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Converted {
    /// Encoder records written.
    pub encoders: u64,
    /// Single ranges written.
    pub ranges: u64,
    /// Scans written.
    pub scans: u64,
    /// Rows of the reference written.
    pub reference: u64,
    /// Encoder records left out because they repeat the one before.
    pub repeated: u64,
    /// Lines left out because they could not be read, or went back in time.
    pub skipped: u64,
    /// Records with a repaired time stamp.
    pub restamped: u64,
    /// Steps of implausible or corrected odometry, replaced by the speed before them.
    pub bridged: u64,
}

/// Most bytes that are unpacked of a recording.
const MOST_UNPACKED: u64 = 256 << 20;

/// Unpacks a recording up to [`MOST_UNPACKED`].
struct Unpacked(io::Take<MultiGzDecoder<BufReader<File>>>);

impl Read for Unpacked {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(to)?;
        if count == 0 && self.0.limit() == 0 && !to.is_empty() {
            let reason = format!(
                "it is unpacked to more than {} MiB: unpack it with gunzip, and convert that file",
                MOST_UNPACKED >> 20
            );
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
        }
        Ok(count)
    }
}

/// Opens a recording; a file whose name ends in `.gz` is unpacked, up to 256 MiB.
///
/// # Errors
/// [`ConvertError::Read`].
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, ConvertError> {
    let file = BufReader::new(File::open(path).map_err(ConvertError::read(path))?);
    let packed = path.extension().is_some_and(|extension| extension == "gz");
    if !packed {
        return Ok(Box::new(file));
    }
    let unpacked = MultiGzDecoder::new(file).take(MOST_UNPACKED);
    Ok(Box::new(BufReader::new(Unpacked(unpacked))))
}

/// A file being written.
struct Out {
    path: PathBuf,
    file: Output,
}

impl Out {
    fn create(path: PathBuf) -> Result<Self, ConvertError> {
        let file = Output::create(&path).map_err(ConvertError::write(&path))?;
        Ok(Self { path, file })
    }

    fn line(&mut self, line: impl std::fmt::Display) -> Result<(), ConvertError> {
        writeln!(self.file, "{line}").map_err(ConvertError::write(&self.path))
    }

    fn close(self) -> Result<(), ConvertError> {
        self.file.finish().map_err(ConvertError::write(&self.path))
    }
}

/// The log being written.
pub struct Log(Out);

impl Log {
    /// Begins `log.csv` in a folder.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn create(dir: &Path) -> Result<Self, ConvertError> {
        let mut out = Out::create(dir.join("log.csv"))?;
        out.line(HEADER)?;
        Ok(Self(out))
    }

    /// A comment.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn comment(&mut self, comment: &str) -> Result<(), ConvertError> {
        self.0.line(format_args!("# {comment}"))
    }

    /// The initial estimate: seconds, pose, deviations in metres and radians.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn start(&mut self, time: f64, pose: &Pose, sigmas: [f64; 2]) -> Result<(), ConvertError> {
        let Pose { x, y, heading } = pose;
        let [position, turn] = sigmas;
        self.0.line(format_args!("start,{time:.6},{x:.6},{y:.6},{heading:.6},{position},{turn}"))
    }

    fn ticks(&mut self, time: f64, [right, left]: [i64; 2]) -> Result<(), ConvertError> {
        self.0.line(format_args!("ticks,{time:.6},{right},{left}"))
    }

    /// Travel of the right and the left wheel up to a time, metres.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn wheels(&mut self, time: f64, [right, left]: [f64; 2]) -> Result<(), ConvertError> {
        self.0.line(format_args!("wheels,{time:.6},{right:.6},{left:.6}"))
    }

    fn range(&mut self, time: f64, bearing: f64, range: Option<f64>) -> Result<(), ConvertError> {
        let range = range.map_or_else(String::new, |range| format!("{range:.3}"));
        self.0.line(format_args!("range,{time:.6},{bearing:.6},{range}"))
    }

    /// A scan.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn scan(&mut self, time: f64, scan: &Scan) -> Result<(), ConvertError> {
        let mut ranges = String::new();
        for range in &scan.ranges {
            if !ranges.is_empty() {
                ranges.push(' ');
            }
            if *range > 0.0 {
                // Writing to a string cannot fail.
                _ = write!(ranges, "{range:.3}");
            } else {
                ranges.push('-');
            }
        }
        self.0.line(format_args!("scan,{time:.6},{:.9},{:.12},{ranges}", scan.first, scan.step))
    }

    /// A range of one of several rangers: bearing in radians, range in metres with all its digits.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn range_of(
        &mut self,
        ranger: u8,
        time: f64,
        bearing: f64,
        range: Option<f32>,
    ) -> Result<(), ConvertError> {
        let range = range.map_or_else(String::new, |range| range.to_string());
        let ranger = if ranger == 0 { String::new() } else { format!(",,{ranger}") };
        self.0.line(format_args!("range,{time:.6},{bearing:.6},{range}{ranger}"))
    }

    /// Ends the log.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn close(self) -> Result<(), ConvertError> {
        self.0.close()
    }
}

/// The reference being written.
pub struct ReferenceFile(Out);

impl ReferenceFile {
    /// Begins `reference.csv` in a folder.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn create(dir: &Path) -> Result<Self, ConvertError> {
        let mut out = Out::create(dir.join("reference.csv"))?;
        out.line(REFERENCE_HEADER)?;
        Ok(Self(out))
    }

    /// A true pose.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn row(&mut self, time: f64, pose: &Pose) -> Result<(), ConvertError> {
        let Pose { x, y, heading } = pose;
        self.0.line(format_args!("{time:.6},{x:.6},{y:.6},{heading:.6}"))
    }

    /// Ends the reference.
    ///
    /// # Errors
    /// [`ConvertError::Write`].
    pub fn close(self) -> Result<(), ConvertError> {
        self.0.close()
    }
}

/// Makes a folder.
///
/// # Errors
/// [`ConvertError::Write`].
pub fn make_dir(dir: &Path) -> Result<(), ConvertError> {
    std::fs::create_dir_all(dir).map_err(ConvertError::write(dir))
}

/// Writes `map.toml`.
///
/// # Errors
/// [`ConvertError::Write`].
pub fn write_map(dir: &Path, comment: &str, walls: &[NamedWall]) -> Result<(), ConvertError> {
    let mut out = Out::create(dir.join("map.toml"))?;
    out.line(format_args!("# {comment}\nformat = 1\n\n[map]\nunit = \"m\"\nwall = ["))?;
    for wall in walls {
        let ([x1, y1], [x2, y2]) = (wall.from(), wall.to());
        out.line(format_args!(
            "    {{ name = \"{}\", from = [{x1:.4}, {y1:.4}], to = [{x2:.4}, {y2:.4}] }},",
            wall.name()
        ))?;
    }
    out.line("]")?;
    out.close()
}

/// Reads walls from a CSV file: the columns x1, y1, x2, y2 in one unit, and an optional name.
///
/// # Errors
/// [`ConvertError`], if it cannot be read or is no such file.
pub fn read_walls(path: &Path, metres: f64) -> Result<Vec<NamedWall>, ConvertError> {
    let content = |message: String| ConvertError::content(path, message);
    let mut csv = csv::Reader::from_path(path).map_err(|error| content(error.to_string()))?;
    let columns = csv.headers().map_err(|error| content(error.to_string()))?.clone();
    let column = |name: &str| columns.iter().position(|c| c.split('_').next() == Some(name));
    let [Some(x1), Some(y1), Some(x2), Some(y2)] = ["x1", "y1", "x2", "y2"].map(column) else {
        return Err(content("the columns must be named x1, y1, x2, y2".to_owned()));
    };
    let name = column("name");
    let mut walls = Vec::new();
    for (number, record) in (1_u32..).zip(csv.records()) {
        let record = record.map_err(|error| content(error.to_string()))?;
        let wrong = |what: &str| content(format!("wall {number}: {what}"));
        let coordinate = |column: usize| -> Option<f64> {
            Some(record.get(column)?.trim().parse::<f64>().ok()? * metres)
        };
        let [Some(x1), Some(y1), Some(x2), Some(y2)] = [x1, y1, x2, y2].map(coordinate) else {
            return Err(wrong("a coordinate is not a number"));
        };
        let named = name.and_then(|name| record.get(name)).filter(|name| is_plain(name));
        let name = named.map_or_else(|| format!("wall {number}"), str::to_owned);
        let wall = NamedWall::new(name, [x1, y1], [x2, y2]);
        walls.push(wall.map_err(|error| wrong(&error.to_string()))?);
    }
    Ok(walls)
}

/// Whether a name can be quoted without escapes.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || " -_.".contains(c))
}
