//! The Python package `sonarfix`: simulator, localizer and tools of a PC, as an extension module.
//!
//! | module | what |
//! |---|---|
//! | `scenario`, `run` | scenarios and their runs |
//! | `guest` | estimators and policies of Python in the loop of the simulator |
//! | `localizer`, `search` | localizer, search and navigator, step by step |
//! | `robot`, `floor` | robots and maps |
//! | `offline` | forecast, replay, calibration, survey, search in a recording |
//! | `live` | telemetry and commands of a robot |
//! | `table`, `columns` | tables: numpy and Arrow |
//! | `work` | long work without the GIL |
//! | `values`, `errors` | values and exceptions of Python |

mod columns;
mod errors;
mod floor;
mod guest;
mod live;
mod localizer;
mod offline;
mod robot;
mod run;
mod scenario;
mod search;
mod table;
mod values;
mod work;

/// The extension module; the package `sonarfix` exports its classes and functions.
#[pyo3::pymodule(name = "_sonarfix")]
mod module {
    #[pymodule_export]
    use crate::columns::summary;
    #[pymodule_export]
    use crate::floor::Map;
    #[pymodule_export]
    use crate::guest::{Setup, View};
    #[pymodule_export]
    use crate::live::Monitor;
    #[pymodule_export]
    use crate::localizer::{Aim, Fix, Localizer};
    #[pymodule_export]
    use crate::offline::{bound, calibrate, find, plan, replay, survey};
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::run::Run;
    #[pymodule_export]
    use crate::scenario::Scenario;
    #[pymodule_export]
    use crate::search::{Navigator, Search};
    #[pymodule_export]
    use crate::table::Table;
}
