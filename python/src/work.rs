//! Long work: in threads of its own, without the GIL, ended by Ctrl-C within a second.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use sonarfix_sim::progress::Progress;

use crate::errors;

/// Time between two looks at the signals.
const LOOK: Duration = Duration::from_millis(50);
/// Most threads of one call.
const MOST_WORKERS: usize = 1_024;

/// What the work and the caller share.
#[derive(Debug, Default)]
pub struct Shared {
    finished: AtomicU64,
    is_interrupted: AtomicBool,
}

/// Counts finished runs.
#[derive(Debug, Clone, Default)]
pub struct Counter(Arc<Shared>);

impl Progress for Counter {
    fn finished(&self) {
        self.0.finished.fetch_add(1, Ordering::Relaxed);
    }

    fn is_interrupted(&self) -> bool {
        self.0.is_interrupted.load(Ordering::Relaxed)
    }
}

/// Does work on so many threads (by default one per core). `progress` is called with the number of runs that were finished
/// since its last call, as `tqdm.update` is. After a signal or an error of `progress` the work is left: it begins no further
/// run, and its result is dropped.
///
/// The threads are those of this call: a process that was forked has none of an earlier one.
pub fn done<T: Send + 'static>(
    py: Python<'_>,
    workers: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Counter) -> T + Send + 'static,
) -> PyResult<T> {
    let workers = workers.unwrap_or(0);
    if workers > MOST_WORKERS {
        return Err(errors::input(format!("workers must be at most {MOST_WORKERS}")));
    }
    let counter = Counter::default();
    let (sender, receiver) = channel();
    // A receiver is not shared between threads, and `detach` takes only what is.
    let receiver = Mutex::new(receiver);
    let of_work = counter.clone();
    let spawned = thread::Builder::new().spawn(move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(workers).build();
        let result = pool.map(|pool| pool.install(|| work(&of_work)));
        // Nobody waits for the result of work that was left.
        let _ = sender.send(result);
    });
    spawned.map_err(|error| errors::internal(format!("no thread can be started: {error}")))?;
    let mut reported = 0;
    let mut report = || {
        let finished = counter.0.finished.load(Ordering::Relaxed);
        if let Some(progress) = progress.filter(|_| finished > reported) {
            progress.call1((finished - reported,))?;
            reported = finished;
        }
        py.check_signals()
    };
    loop {
        let received = py.detach(|| next(&receiver));
        let is_over = !matches!(received, Err(RecvTimeoutError::Timeout));
        if let Err(error) = report() {
            counter.0.is_interrupted.store(true, Ordering::Relaxed);
            return Err(error);
        }
        if !is_over {
            continue;
        }
        return match received {
            Ok(Ok(result)) => Ok(result),
            Ok(Err(error)) => Err(errors::internal(format!("no threads: {error}"))),
            Err(_) => Err(errors::internal("the work ended without a result")),
        };
    }
}

/// The result, or that the work has not ended.
fn next<T>(receiver: &Mutex<Receiver<T>>) -> Result<T, RecvTimeoutError> {
    match receiver.lock() {
        Ok(receiver) => receiver.recv_timeout(LOOK),
        Err(_) => Err(RecvTimeoutError::Disconnected),
    }
}
