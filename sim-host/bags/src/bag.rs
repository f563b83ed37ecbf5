//! A bag: its files, and the messages in them, whatever their storage.
//!
//! A bag is a folder with `metadata.yaml`, or a file of it. What a file is, is known by how it begins, not by its name: a database,
//! MCAP, or either packed by zstd.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{BagError, Defect};
use crate::message::Take;
use crate::{db3, mcap_file, packed};

/// The longest `metadata.yaml`, bytes.
const LONGEST_METADATA: u64 = 1 << 20;
/// The most files of a bag.
const MOST_FILES: usize = 10_000;

/// A bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bag {
    files: Vec<PathBuf>,
}

/// `metadata.yaml`, what is needed of it.
#[derive(Debug, Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Debug, Deserialize)]
struct Information {
    relative_file_paths: Vec<String>,
}

impl Bag {
    /// Finds the files of a bag: a folder or a file.
    ///
    /// # Errors
    /// [`BagError`], if it is missing, or is no bag.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let defect = |why: Defect| why.of(path);
        let data = std::fs::metadata(path).map_err(|error| defect(error.into()))?;
        if !data.is_dir() {
            return Ok(Self { files: vec![path.to_owned()] });
        }
        let metadata = path.join("metadata.yaml");
        let files = if metadata.exists() {
            listed(&metadata).map_err(|why| why.of(&metadata))?
        } else {
            found(path).map_err(defect)?
        };
        if files.is_empty() {
            let why = "has no metadata.yaml and no file .mcap or .db3: it is no bag of ROS 2";
            return Err(defect(Defect::content(why)));
        }
        if files.len() > MOST_FILES {
            let why = format!("has more than {MOST_FILES} files: convert parts of it");
            return Err(defect(Defect::content(why)));
        }
        // Some versions wrote the name of the folder before that of the file.
        let files = files.iter().filter_map(|file| Path::new(file).file_name());
        Ok(Self { files: files.map(|name| path.join(name)).collect() })
    }

    /// Passes the messages of all files to `take`, in the order in which they lie there.
    ///
    /// # Errors
    /// [`BagError`], if a file cannot be read, or `take` ends the reading.
    pub fn read(&self, take: &mut dyn Take) -> Result<(), BagError> {
        self.files.iter().try_for_each(|file| read(file, take).map_err(|why| why.of(file)))
    }
}

fn listed(metadata: &Path) -> Result<Vec<String>, Defect> {
    let mut text = String::new();
    let length = File::open(metadata)?.take(LONGEST_METADATA).read_to_string(&mut text)?;
    if length as u64 == LONGEST_METADATA {
        return Err(Defect::content("is longer than 1 MiB"));
    }
    let read: Metadata = serde_yaml::from_str(&text)
        .map_err(|error| Defect::content(format!("is no metadata of rosbag2: {error}")))?;
    Ok(read.rosbag2_bagfile_information.relative_file_paths)
}

/// The files of a folder without metadata, by their names.
fn found(folder: &Path) -> Result<Vec<String>, Defect> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)?.take(MOST_FILES) {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let name_unpacked = name.strip_suffix(".zstd").unwrap_or(&name);
        let ending = Path::new(name_unpacked).extension();
        if ending.is_some_and(|ending| ending == "mcap" || ending == "db3") {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn read(path: &Path, take: &mut dyn Take) -> Result<(), Defect> {
    let mut file = File::open(path)?;
    let mut start = beginning(&mut file)?;
    if packed::is_packed(&start) {
        file = packed::unpack_file(file)?;
        start = beginning(&mut file)?;
    }
    let bytes = BufReader::with_capacity(1 << 16, file);
    if start.starts_with(mcap::MAGIC) {
        mcap_file::read(bytes, path, take)
    } else if start.starts_with(b"SQLite") {
        db3::check_journal(path)?;
        db3::read(bytes, path, take)
    } else {
        let why = "is no file of a bag: it begins neither like MCAP nor like a database of SQLite";
        Err(Defect::content(why))
    }
}

/// The first bytes of a file, which is then read from its begin.
fn beginning(file: &mut File) -> Result<Vec<u8>, Defect> {
    let mut start = Vec::new();
    file.take(8).read_to_end(&mut start)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(start)
}
