//! Another estimator beside the localizer, and another policy: objects of Python in the loop of the simulator.
//!
//! The computer of a run is wrapped: the localizer gets its inputs as always, and the guest the same ones after it. The
//! recorder is wrapped, too: at each encoder tick the guest's pose is compared with the truth.

mod call;
mod computer;
mod judge;
mod view;

use std::cell::RefCell;

use pyo3::prelude::*;
use sonarfix_sim::row::Row;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Recorder;

use self::call::Guest;
use self::computer::Accompanied;
use self::judge::Judge;
use crate::table::Table;
use crate::{columns, errors};

pub use self::view::{Setup, View};

/// Who takes part in a run beside the localizer.
pub struct Invited {
    /// Called with a [`Setup`]; the result is another estimator.
    pub estimator: Option<Py<PyAny>>,
    /// Called with a [`View`]; chooses the wall or the bearing of the next ping.
    pub policy: Option<Py<PyAny>>,
}

/// Whose row, and the row.
type Rows = Vec<(String, Row)>;

impl Invited {
    /// Whether the localizer runs alone.
    pub fn is_nobody(&self) -> bool {
        self.estimator.is_none() && self.policy.is_none()
    }
}

/// Runs once; returns the row of the localizer and that of the guest, and the guest's poses at the ticks.
pub fn run(
    py: Python<'_>,
    simulation: &Simulation,
    seed: u64,
    invited: &Invited,
    recorder: &mut impl Recorder,
) -> PyResult<(Rows, Vec<[f64; 3]>)> {
    let guest = RefCell::new(Guest::new(
        py,
        simulation,
        invited.estimator.as_ref(),
        invited.policy.as_ref(),
    )?);
    let mut judge = Judge { inner: recorder, guest: &guest };
    let result = simulation.run_on(&mut Accompanied::new(simulation, &guest), seed, &mut judge);
    let mut guest = guest.into_inner();
    if let Some(error) = guest.error.take() {
        return Err(error);
    }
    let result = result.map_err(|error| errors::simulation(&error))?;
    let mut rows = vec![("sonarfix".to_owned(), Row::new(seed, &result))];
    if let Some(name) = guest.name() {
        rows.push((name, Row::new(seed, &guest.result(&result)?)));
    }
    Ok((rows, guest.score.poses))
}

/// Runs the seeds `first`, `first + 1`, … one after the other.
pub fn many(
    py: Python<'_>,
    simulation: &Simulation,
    first: u64,
    runs: u32,
    invited: &Invited,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Table> {
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    for run in 0..u64::from(runs) {
        let (of_run, _) = self::run(py, simulation, first.wrapping_add(run), invited, &mut ())?;
        for (name, row) in of_run {
            names.push(name);
            rows.push(row);
        }
        if let Some(progress) = progress {
            progress.call1((1,))?;
        }
        py.check_signals()?;
    }
    columns::of_rows(&rows, Some(&names))
}
