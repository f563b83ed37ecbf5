//! The recordings in a folder and in those inside of it, by their formats.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sonarfix_replay::convert::{carmen, given};

use crate::recordings::is_recording;

/// How deep folders are searched.
const DEEPEST: usize = 6;

/// A recording, and what is beside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Its path in the folder, without the endings of its format.
    pub name: String,
    /// Its files.
    pub format: Format,
}

/// The files of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Format {
    /// A LEGO robot with a laser scanner.
    Lego {
        /// Its folder.
        folder: PathBuf,
    },
    /// A CARMEN log.
    Carmen {
        /// The log.
        log: PathBuf,
        /// Its walls; without them it cannot be replayed.
        walls: Option<PathBuf>,
    },
    /// A log of the project's own format.
    Given {
        /// The log.
        log: PathBuf,
        /// The true poses.
        reference: Option<PathBuf>,
        /// Its walls.
        walls: Option<PathBuf>,
    },
}

/// What a folder contains.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The recordings, in the order of their names.
    pub recordings: Vec<Recording>,
    /// Other data, and why it is not replayed.
    pub others: Vec<(String, &'static str)>,
}

/// Finds the recordings, but for those with a robot file of their own ([`crate::recordings`]).
///
/// # Errors
/// If the folder cannot be read. A file in it that cannot be read is no recording.
pub fn discover(data: &Path) -> io::Result<Found> {
    let mut found = Found::default();
    search(data, data, 0, &mut found)?;
    found.recordings.sort_by(|one, other| one.name.cmp(&other.name));
    found.others.sort();
    Ok(found)
}

fn search(data: &Path, folder: &Path, depth: usize, found: &mut Found) -> io::Result<()> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    let named = |path: &Path| path.strip_prefix(data).unwrap_or(path).display().to_string();
    let ends = |ending: &str| paths.iter().any(|path| name(path).ends_with(ending));
    let here = if folder == data { name(data) } else { named(folder) };
    if ends("_motors.txt") && ends("_scan.txt") {
        let format = Format::Lego { folder: folder.to_owned() };
        found.recordings.push(Recording { name: here, format });
    } else if ends("sweeps.csv") {
        found
            .others
            .push((here, "sweeps at known places, without odometry: for `find` and `sonar-model`"));
    } else if ends(".tuple") {
        found.others.push((here, "wheel speeds without ranges"));
    } else if ends("_metadata.csv") {
        found.others.push((here, "encoders and poses without ranges"));
    } else if !is_recording(folder) {
        for path in paths.iter().filter(|path| path.is_file()) {
            if let Some(format) = log(path, &paths) {
                found.recordings.push(Recording { name: stem(&named(path)).to_owned(), format });
            }
        }
    }
    for path in paths.iter().filter(|path| path.is_dir()) {
        if depth < DEEPEST {
            // A folder that cannot be read has no recordings.
            _ = search(data, path, depth + 1, found);
        }
    }
    Ok(())
}

/// The format of a file, if it is a log.
fn log(path: &Path, beside: &[PathBuf]) -> Option<Format> {
    let log = path.to_owned();
    let file = name(path);
    let stem = stem(&file);
    let sibling = |endings: &[&str]| {
        let names = endings.iter().map(|ending| format!("{stem}{ending}"));
        let mut names =
            names.chain(endings.iter().map(|ending| ending.trim_start_matches('_').to_owned()));
        names.find_map(|name_| beside.iter().find(|path| name(path) == name_).cloned())
    };
    let walls = sibling(&["_walls.csv", "_map.csv"]);
    if given::is_log(path).unwrap_or(false) {
        let reference = sibling(&["_reference.csv", "_reference.csv.gz"]);
        return Some(Format::Given { log, reference, walls });
    }
    carmen::is_log(path).unwrap_or(false).then_some(Format::Carmen { log, walls })
}

/// A name without its extensions and the kind of its content: `a/b_rawodo.txt.gz` is `a/b`.
fn stem(name: &str) -> &str {
    let folders = name.rfind('/').map_or(0, |slash| slash + 1);
    let (folder, file) = name.split_at(folders);
    let mut file = file.split_once('.').map_or(file, |(stem, _)| stem);
    for kind in ["_log", "_rawodo", "_corrected"] {
        file = file.strip_suffix(kind).unwrap_or(file);
    }
    name.get(..folder.len() + file.len()).unwrap_or(name)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_found_by_their_content_and_paired_by_their_names() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("README.md", "O my\nS no\n");
        write("carmen/lab_rawodo.txt", "# a log\nO 1 0 0 0\n");
        write("carmen/lab_walls.csv", "x1,y1,x2,y2\n");
        write("carmen/hall.log", "PARAM a b\nODOM 0 0 0 0 0 0 1 host 1\n");
        write("carmen/office_log.csv", "sonarfix-log,1\n");
        write("carmen/office_reference.csv", "time_s,x_m,y_m,heading_rad\n");
        write("carmen/office_map.csv", "x1_m,y1_m,x2_m,y2_m\n");
        write("arena/first/a_motors.txt", "M 1\n");
        write("arena/first/a_scan.txt", "S 1\n");
        write("sweeps/sweeps.csv", "team\n");
        // A recording with a robot file of its own.
        write("nxt/log.csv", "sonarfix-log,1\n");
        write("nxt/robot.toml", "");
        write("nxt/map.toml", "");
        let found = discover(dir.path()).unwrap();
        let at = |name: &str| dir.path().join(name);
        let expected = [
            ("arena/first", Format::Lego { folder: at("arena/first") }),
            ("carmen/hall", Format::Carmen { log: at("carmen/hall.log"), walls: None }),
            (
                "carmen/lab",
                Format::Carmen {
                    log: at("carmen/lab_rawodo.txt"),
                    walls: Some(at("carmen/lab_walls.csv")),
                },
            ),
            (
                "carmen/office",
                Format::Given {
                    log: at("carmen/office_log.csv"),
                    reference: Some(at("carmen/office_reference.csv")),
                    walls: Some(at("carmen/office_map.csv")),
                },
            ),
        ];
        let expected = expected.map(|(name, format)| Recording { name: name.to_owned(), format });
        assert_eq!(found.recordings, expected);
        assert_eq!(found.others.len(), 1);
        assert!(discover(&at("absent")).is_err());
    }
}
