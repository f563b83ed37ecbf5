//! A package: files in memory, in the order of their names, and the archives made of them. Times and owners are left out, so that the
//! same files give the same bytes.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::write::GzEncoder;
use zip::write::SimpleFileOptions;

/// Files by their path in the package, with `/`.
#[derive(Debug, Default)]
pub struct Package(BTreeMap<String, Vec<u8>>);

impl Package {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<String>, content: impl Into<Vec<u8>>) {
        self.0.insert(path.into(), content.into());
    }

    /// Adds a file of the disk.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn add_file(&mut self, path: impl Into<String>, file: &Path) -> Result<()> {
        self.add(path, std::fs::read(file).with_context(|| file.display().to_string())?);
        Ok(())
    }

    /// Adds a folder of the disk with all below it; `prefix` is empty or ends with `/`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn add_folder(&mut self, prefix: &str, folder: &Path) -> Result<()> {
        for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
            let entry = entry?;
            let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                self.add_folder(&format!("{path}/"), &entry.path())?;
            } else {
                self.add_file(path, &entry.path())?;
            }
        }
        Ok(())
    }

    /// Replaces a mark in all texts.
    pub fn replace(&mut self, mark: &str, by: &str) {
        for content in self.0.values_mut() {
            if let Ok(text) = std::str::from_utf8(content)
                && text.contains(mark)
            {
                *content = text.replace(mark, by).into_bytes();
            }
        }
    }

    /// Writes the files into a folder, which is made.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn unpack(&self, folder: &Path) -> Result<()> {
        for (path, content) in &self.0 {
            let file = folder.join(path);
            std::fs::create_dir_all(file.parent().context("a file without a folder")?)?;
            std::fs::write(file, content)?;
        }
        Ok(())
    }

    /// A compressed tape archive with all files in the folder `root`.
    ///
    /// # Errors
    /// If a path is too long.
    pub fn tar_gz(&self, root: &str) -> Result<Vec<u8>> {
        let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::best()));
        for (path, content) in &self.0 {
            let mut header = tar::Header::new_gnu();
            header.set_size(u64::try_from(content.len())?);
            header.set_mode(0o644);
            header.set_cksum();
            archive.append_data(&mut header, format!("{root}/{path}"), content.as_slice())?;
        }
        Ok(archive.into_inner()?.finish()?)
    }

    /// A zip archive with all files in the folder `root`, as Arduino's library manager wants it.
    ///
    /// # Errors
    /// If it is too large.
    pub fn zip(&self, root: &str) -> Result<Vec<u8>> {
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for (path, content) in &self.0 {
            archive.start_file(format!("{root}/{path}"), SimpleFileOptions::default())?;
            archive.write_all(content)?;
        }
        Ok(archive.finish()?.into_inner())
    }
}
