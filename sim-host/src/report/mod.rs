//! stub
use crate::trace::Trace;
use std::path::*;
#[derive(Debug)]
pub struct Report<'a> {
    pub title: String,
    pub subtitle: String,
    pub tables: Vec<Table>,
    pub trace: &'a Trace,
}
#[derive(Debug)]
pub struct Table {
    pub title: String,
    pub note: String,
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}
impl Report<'_> {
    pub fn write(&self, d: &Path) -> Result<PathBuf, std::io::Error> {
        Ok(d.into())
    }
}
