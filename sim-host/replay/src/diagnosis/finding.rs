//! One thing that is wrong.

use serde::Serialize;

/// The most gaps or jumps that are reported one by one.
pub const SHOWN: usize = 3;

/// Something that is wrong, with its remedy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// A name that stays the same between versions.
    pub cause: &'static str,
    /// The line of the log, from 1, if the fault is at one place.
    pub line: Option<u64>,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub remedy: String,
    /// The share of the echoes that are explained if this is corrected; `None` for a fault that is seen in the records.
    pub explained: Option<f64>,
}

impl Finding {
    pub(super) fn new(cause: &'static str, message: String, remedy: String) -> Self {
        Self { cause, line: None, message, remedy, explained: None }
    }

    pub(super) fn at(line: u64, cause: &'static str, message: String, remedy: String) -> Self {
        Self { line: Some(line), ..Self::new(cause, message, remedy) }
    }
}
