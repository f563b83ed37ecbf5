//! Why a bag cannot be read or written.

use std::io;
use std::path::{Path, PathBuf};

use crate::definition::NoDefinition;
use crate::sqlite::SqlError;

/// Why a bag cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {why}", path.display())]
pub struct BagError {
    /// The file or folder.
    pub path: PathBuf,
    /// The defect.
    pub why: Defect,
}

/// What is wrong with a file of a bag.
#[derive(Debug, thiserror::Error)]
pub enum Defect {
    /// It cannot be read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is a damaged database.
    #[error(transparent)]
    Sql(#[from] SqlError),
    /// It is a damaged MCAP file.
    #[error("{0}; `mcap recover` saves what can be read")]
    Mcap(mcap::McapError),
    /// A definition in it cannot be read.
    #[error("the definition of {kind} cannot be read: {why}")]
    Definition {
        /// The type of the message.
        kind: String,
        /// The defect.
        why: NoDefinition,
    },
    /// What it contains cannot be used.
    #[error("{0}")]
    Content(String),
}

impl Defect {
    /// A defect with a message.
    pub fn content(message: impl Into<String>) -> Self {
        Self::Content(message.into())
    }

    /// This defect of a file.
    #[must_use]
    pub fn of(self, path: &Path) -> BagError {
        BagError { path: path.to_owned(), why: self }
    }
}

impl From<mcap::McapError> for Defect {
    fn from(error: mcap::McapError) -> Self {
        match error {
            mcap::McapError::Io(error) => Self::Io(error),
            error => Self::Mcap(error),
        }
    }
}
