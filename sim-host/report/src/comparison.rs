//! The page of two runs side by side: both maps at one time, curves of both, and tables of their differences.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use sonarfix_sim::trace::Trace;

use super::escape::escape;
use super::table::Table;
use super::{CURVES, CURVES_STYLE, DRAWING, PLAYER, ReportError, page, playback, style, write};

/// The name of the page's file.
const FILE: &str = "comparison.html";

const BODY: &str = include_str!("comparison.html");
const SIDE: &str = include_str!("side.html");
const STYLE: &str = include_str!("comparison.css");
const SCRIPT: &str = include_str!("comparison.js");
const ORDINALS: [&str; 2] = ["First", "Second"];

/// Two runs side by side.
#[derive(Debug, Clone)]
pub struct Comparison<'a> {
    /// The title of the page.
    pub title: String,
    /// A line under the title.
    pub subtitle: String,
    /// The name of each run.
    pub names: [String; 2],
    /// The runs.
    pub runs: [&'a Trace; 2],
    /// How they differ, shown after the maps and curves.
    pub tables: Vec<Table>,
    /// Where it comes from, shown last: version, command, hashes of files.
    pub provenance: Table,
}

impl Comparison<'_> {
    /// The page.
    ///
    /// # Errors
    /// [`ReportError::Data`], or [`ReportError::Empty`] for a run without ticks.
    pub fn html(&self) -> Result<String, ReportError> {
        if let Some(empty) = self.runs.iter().position(|run| run.ticks.is_empty()) {
            let name = self.names.get(empty).cloned().unwrap_or_default();
            return Err(ReportError::Empty { name });
        }
        let [first, second] = self.runs.map(sonarfix_player::json);
        let parts = [
            ("sides", self.sides().into()),
            ("playback", playback().into()),
            ("legend", super::LEGEND.into()),
            ("tables", page::tables(&self.tables).into()),
        ];
        let page = page::Page {
            title: &self.title,
            subtitle: &self.subtitle,
            style: &(style() + CURVES_STYLE + STYLE),
            body: &page::fill(BODY, &parts),
            provenance: &self.provenance,
            without_scripts: "Maps and curves need JavaScript; the tables do not.",
            data: &format!("[{},{}]", first?, second?),
            scripts: &[DRAWING, PLAYER, CURVES, SCRIPT],
        };
        Ok(page.html())
    }

    /// Writes `comparison.html` into a directory, which is created if missing. Returns the path of the page.
    ///
    /// # Errors
    /// As [`Comparison::html`], before anything is written; and [`ReportError::Write`].
    pub fn write(&self, dir: &Path) -> Result<PathBuf, ReportError> {
        let page = self.html()?;
        fs::create_dir_all(dir)
            .map_err(|source| ReportError::Write { path: dir.into(), source })?;
        write(dir.join(FILE), &page)
    }

    fn sides(&self) -> String {
        let side = |(number, (name, ordinal)): (usize, (&String, &str))| {
            let values: [(&str, Cow<'_, str>); 4] = [
                ("number", number.to_string().into()),
                ("name", format!("{ordinal}: {}", escape(name)).into()),
                ("ordinal", ordinal.into()),
                ("numbers", super::NUMBERS.into()),
            ];
            page::fill(SIDE, &values)
        };
        self.names.iter().zip(ORDINALS).enumerate().map(side).collect()
    }
}
