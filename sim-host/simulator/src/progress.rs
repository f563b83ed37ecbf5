//! Progress of many runs, and an early end.

/// Receives the progress of many runs, and may end them early. A function that is called after each run is one that never
/// does.
pub trait Progress: Sync {
    /// A run is finished.
    fn finished(&self);

    /// Whether no further run should begin. Runs that have begun are finished, so that long ones are not missing in the
    /// results.
    fn is_interrupted(&self) -> bool {
        false
    }
}

impl<F: Fn() + Sync> Progress for F {
    fn finished(&self) {
        self();
    }
}
