//! All recordings of a folder, replayed with both policies and one robot file per robot, as a page of the documentation.
//!
//! | module | what |
//! |---|---|
//! | [`discover`] | the recordings in a folder, by their formats |
//! | `replays` | conversion and replay of one recording |
//! | [`page`] | the page |

pub mod discover;
pub mod page;
mod replays;

use std::io;
use std::path::Path;

use discover::Recording;
use rayon::prelude::*;

use crate::recordings;

pub use replays::Row;
pub(crate) use replays::replay_converted;

/// The result of the study.
#[derive(Debug)]
pub struct Findings {
    /// A row for each recording, robot file and policy, in the order of the names.
    pub rows: Vec<Row>,
    /// A row for each recording with a robot file of its own.
    pub own: Vec<recordings::Row>,
    /// What conversions reported, with the name of the recording.
    pub reports: Vec<(String, Vec<String>)>,
    /// The most ranges that were taken of a scan while the pose was known.
    pub pings_per_scan: u32,
    /// Files that contain no recording that can be replayed, and why.
    pub others: Vec<(String, &'static str)>,
}

/// Replays all recordings of a folder, with at most so many ranges of a scan while the pose is known. An error of one recording is a row.
///
/// # Errors
/// If the folder cannot be read, or no temporary folder can be created.
pub fn findings(data: &Path, pings_per_scan: u32) -> io::Result<Findings> {
    let found = discover::discover(data)?;
    let replay = |recording| replays::replay(recording, pings_per_scan);
    let replayed: Vec<(Vec<Row>, Vec<String>)> =
        found.recordings.par_iter().map(replay).collect::<io::Result<_>>()?;
    let name = |recording: &Recording| recording.name.clone();
    let reports = found.recordings.iter().map(name);
    let (rows, reports_of): (Vec<_>, Vec<_>) = replayed.into_iter().unzip();
    let reports = reports.zip(reports_of).filter(|(_, reports)| !reports.is_empty()).collect();
    let rows = rows.into_iter().flatten().collect();
    let own = recordings::rows(data, &[])?;
    Ok(Findings { rows, own, reports, pings_per_scan, others: found.others })
}
