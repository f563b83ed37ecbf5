//! Exceptions: the classes of `sonarfix.errors`, with the text of the command.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use sonarfix_map::FileError;
use sonarfix_replay::fault::ReplayError;
use sonarfix_sim::simulate::SimulationError;

/// A class of `sonarfix.errors`.
macro_rules! class {
    ($py:expr, $name:literal) => {{
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        CLASS.import($py, "sonarfix.errors", $name)
    }};
}

fn raise(class: PyResult<&Bound<'_, PyType>>, text: String) -> PyErr {
    match class {
        Ok(class) => PyErr::from_type(class.clone(), (text,)),
        Err(error) => error,
    }
}

/// An argument that is not accepted.
pub fn input(text: impl Into<String>) -> PyErr {
    Python::attach(|py| raise(class!(py, "InputError"), text.into()))
}

/// A mistake in a file: the exception lists all of them.
pub fn file(error: &FileError) -> PyErr {
    Python::attach(|py| {
        let mistakes: Vec<_> = error
            .mistakes()
            .map(|m| (m.file().to_owned(), m.line(), m.key().to_owned(), m.message().to_owned()))
            .collect();
        match class!(py, "FileError") {
            Ok(class) => PyErr::from_type(class.clone(), (error.to_string(), mistakes)),
            Err(error) => error,
        }
    })
}

/// A run that failed.
pub fn simulation(error: &SimulationError) -> PyErr {
    Python::attach(|py| raise(class!(py, "SimulationError"), error.to_string()))
}

/// Any error of a command, with its causes.
pub fn any(error: &anyhow::Error) -> PyErr {
    if let Some(error) = error.downcast_ref::<FileError>() {
        return file(error);
    }
    if let Some(error) = error.downcast_ref::<SimulationError>() {
        return simulation(error);
    }
    let text = format!("{error:#}");
    if error.chain().any(<dyn std::error::Error>::is::<ReplayError>) {
        return recording(text);
    }
    Python::attach(|py| raise(class!(py, "InputError"), text))
}

/// A recording that cannot be used.
pub fn recording(text: impl Into<String>) -> PyErr {
    Python::attach(|py| raise(class!(py, "RecordingError"), text.into()))
}

/// Work that has ended without a result.
pub fn internal(text: impl Into<String>) -> PyErr {
    Python::attach(|py| raise(class!(py, "SonarfixError"), text.into()))
}

/// A file that cannot be read.
pub fn unreadable(file: &str, text: String, message: String) -> PyErr {
    Python::attach(|py| {
        let mistakes = vec![(file.to_owned(), None::<usize>, String::new(), message)];
        match class!(py, "FileError") {
            Ok(class) => PyErr::from_type(class.clone(), (text, mistakes)),
            Err(error) => error,
        }
    })
}

/// An error of work with a recording.
pub fn recorded(error: &anyhow::Error) -> PyErr {
    if error.is::<FileError>() { any(error) } else { recording(format!("{error:#}")) }
}

/// A robot that does not answer, or refuses.
pub fn connection(error: &anyhow::Error) -> PyErr {
    Python::attach(|py| raise(class!(py, "ConnectionFailed"), format!("{error:#}")))
}
