//! Improbable values, as the pages show them.

use serde::Serialize;
use sonarfix_map::Mistake;

/// An improbable value.
#[derive(Debug, Serialize)]
pub struct Warning {
    key: String,
    message: String,
}

impl From<&Mistake> for Warning {
    fn from(mistake: &Mistake) -> Self {
        Self { key: mistake.key().to_owned(), message: mistake.message().to_owned() }
    }
}
