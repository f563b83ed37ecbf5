//! A log in the project's own format, with reference and walls as CSV and no robot file: the rest of a folder for
//! `sonarfix replay`.

use std::io;
use std::path::Path;

use super::carmen::robot;
use super::{ConvertError, Out, make_dir, open, read_walls, write_map};
use crate::lines::Lines;
use crate::log::{self, HEADER, Record};

/// Whether a file is a log, by its first line.
///
/// # Errors
/// [`ConvertError`], if it cannot be read.
pub fn is_log(path: &Path) -> Result<bool, ConvertError> {
    let mut lines = Lines::of(open(path)?);
    let first = lines.next().map_err(ConvertError::read(path))?;
    Ok(matches!(first, Some(Ok(line)) if line.trim() == HEADER))
}

/// A log with what is beside it.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a> {
    /// The log, packed (`.gz`) or not.
    pub log: &'a Path,
    /// The true poses.
    pub reference: &'a Path,
    /// The walls: x1, y1, x2, y2 in metres.
    pub walls: &'a Path,
    /// The folder to write.
    pub to: &'a Path,
}

impl Given<'_> {
    /// Writes the folder: the log and the reference unpacked, the map, and the robot file of a CARMEN log, whose field of view is
    /// that of the first scan.
    ///
    /// # Errors
    /// [`ConvertError`], if a file is missing, is no log or cannot be written.
    pub fn prepare(&self) -> Result<(), ConvertError> {
        if !is_log(self.log)? {
            return Err(ConvertError::content(self.log, format!("does not start with `{HEADER}`")));
        }
        let walls = read_walls(self.walls, 1.0)?;
        let field_of_view = field_of_view(self.log)?;
        make_dir(self.to)?;
        for (from, name) in [(self.log, "log.csv"), (self.reference, "reference.csv")] {
            let mut out = Out::create(self.to.join(name))?;
            io::copy(&mut open(from)?, &mut out.file).map_err(ConvertError::read(from))?;
            out.close()?;
        }
        write_map(self.to, "Walls as given; furniture is not in them", &walls)?;
        robot::write(self.to, [0.0, 0.0], field_of_view)
    }
}

/// Bearings of the first and the last beam of the first scan; the half turn ahead of a log without scans.
fn field_of_view(path: &Path) -> Result<[f64; 2], ConvertError> {
    let mut lines = Lines::of(open(path)?);
    while let Some(line) = lines.next().map_err(ConvertError::read(path))? {
        if let Ok(Ok(Some(Record::Scan { scan, .. }))) = line.map(log::parse) {
            return Ok(scan.field_of_view());
        }
    }
    Ok([-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2])
}
