//! A CSV of rows that grows as runs finish. After the end of the process, whatever its cause, it is resumed.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::Path;

use anyhow::{Context, ensure};
use sonarfix_sim::row::Row;

use crate::csv;
use crate::plan::Plan;

/// A growing file.
#[derive(Debug)]
pub struct Journal {
    file: File,
    plan: Plan,
    done: u32,
}

impl Journal {
    /// Opens the file of a plan, or creates it. A last line that is torn is removed: its run is computed again.
    ///
    /// # Errors
    /// If the file cannot be read or written, is that of another plan, or another program writes it.
    pub fn open(path: &Path, plan: &Plan) -> anyhow::Result<Self> {
        Self::opened(path, plan).with_context(|| format!("the rows {}", path.display()))
    }

    fn opened(path: &Path, plan: &Plan) -> anyhow::Result<Self> {
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        sonarfix_files::lock(&file)?;
        let head = format!("{}\n{}\n", plan.line(), csv::names());
        let (done, length) = finished(&file, plan, &head)?;
        file.set_len(length)?;
        file.seek(SeekFrom::End(0))?;
        if length == 0 {
            file.write_all(head.as_bytes())?;
        }
        Ok(Self { file, plan: *plan, done })
    }

    /// Number of rows in the file.
    #[must_use]
    pub fn done(&self) -> u32 {
        self.done
    }

    /// Number of rows that are missing.
    #[must_use]
    pub fn left(&self) -> u32 {
        self.plan.part().1.saturating_sub(self.done)
    }

    /// Seed of the next row.
    #[must_use]
    pub fn next_seed(&self) -> u64 {
        self.plan.seed_of(self.done)
    }

    /// Appends the next rows, and waits until they are on the disk.
    ///
    /// # Errors
    /// If the file cannot be written, or a row is not the next one.
    pub fn append(&mut self, rows: &[Row]) -> anyhow::Result<()> {
        let mut text = String::new();
        for row in rows {
            ensure!(row.seed == self.next_seed(), "the row of seed {} is not the next", row.seed);
            text.push_str(&csv::line(row));
            self.done += 1;
        }
        self.file.write_all(text.as_bytes())?;
        // A device has nothing to wait for.
        let _ = self.file.sync_data();
        Ok(())
    }
}

/// The number of whole rows, and the length of the file up to their end; zero if the head is not whole.
fn finished(file: &File, plan: &Plan, head: &str) -> anyhow::Result<(u32, u64)> {
    let mut lines = BufReader::new(file);
    let start = csv::read_line(&mut lines)? + &csv::read_line(&mut lines)?;
    if start != head {
        let is_cut_short = head.starts_with(&start);
        ensure!(
            is_cut_short,
            "it holds other runs: another scenario, seed, number of runs or shard"
        );
        return Ok((0, 0));
    }
    let (mut done, mut length) = (0, head.len() as u64);
    loop {
        let line = csv::read_line(&mut lines)?;
        let row = match csv::parse(&line) {
            Ok(row) => row,
            // The last line, which a loss of power may also leave with its end.
            Err(_) if lines.fill_buf()?.is_empty() => return Ok((done, length)),
            Err(error) => return Err(error.context(format!("row {}", u64::from(done) + 1))),
        };
        let is_next = row.seed == plan.seed_of(done) && done < plan.part().1;
        ensure!(is_next, "row {} has another seed", u64::from(done) + 1);
        done += 1;
        length += line.len() as u64;
    }
}
