//! The result of one run as a row of numbers, from which the statistics of any number of runs follow.

use crate::dense::Vector;
use crate::run_result::RunResult;

/// The real columns of a row, with their units.
pub const REALS: [&str; 21] = [
    "error_x_m",
    "error_y_m",
    "error_heading_rad",
    "error_scale_right",
    "error_scale_left",
    "error_track_width_m",
    "error_range_scale",
    "bound_variance_x_m2",
    "bound_variance_y_m2",
    "bound_variance_heading_rad2",
    "bound_variance_scale_right",
    "bound_variance_scale_left",
    "bound_variance_track_width_m2",
    "bound_variance_range_scale",
    "nees",
    "nis_sum",
    "path_squares_x_m2",
    "path_squares_y_m2",
    "path_squares_heading_rad2",
    "undetected_error_s",
    "worst_position_error_m",
];

/// The columns of a row that are counts.
pub const COUNTS: [&str; 9] = [
    "estimated_states",
    "nis_count",
    "path_ticks",
    "fixes_accepted",
    "fixes_gated",
    "fixes_refused",
    "lost",
    "called_lost",
    "false_alarms",
];

/// The places of the columns.
pub(crate) mod place {
    pub const ERROR: usize = 0;
    pub const BOUND_VARIANCE: usize = 7;
    pub const NEES: usize = 14;
    pub const NIS_SUM: usize = 15;
    pub const PATH_SQUARES: usize = 16;
    pub const UNDETECTED_ERROR: usize = 19;

    pub const ESTIMATED_STATES: usize = 0;
    pub const NIS_COUNT: usize = 1;
    pub const PATH_TICKS: usize = 2;
    pub const FIXES: usize = 3;
    pub const LOST: usize = 6;
    pub const CALLED_LOST: usize = 7;
    pub const FALSE_ALARMS: usize = 8;
}

/// The result of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The seed of the run.
    pub seed: u64,
    /// The numbers of [`REALS`].
    pub reals: [f64; REALS.len()],
    /// The numbers of [`COUNTS`].
    pub counts: [u64; COUNTS.len()],
}

impl Row {
    /// The row of a run with this seed.
    #[must_use]
    pub fn new(seed: u64, run: &RunResult) -> Self {
        let [x, y, heading, right, left, width, range] = numbers(&run.error);
        let bound = numbers(&run.bound_variance);
        let (nis_sum, nis_count) = run.nis.parts();
        let ([squares_x, squares_y, squares_heading], ticks) = run.path.parts();
        let mut reals = [0.0; REALS.len()];
        let pose = [x, y, heading, right, left, width, range];
        let rest = [
            run.nees,
            nis_sum,
            squares_x,
            squares_y,
            squares_heading,
            run.integrity.undetected_error(),
            run.integrity.worst(),
        ];
        for (to, from) in reals.iter_mut().zip(pose.into_iter().chain(bound).chain(rest)) {
            *to = from;
        }
        let counts = [
            run.estimated_states as u64,
            nis_count,
            ticks,
            run.fixes.accepted,
            run.fixes.gated,
            run.fixes.refused,
            run.lost.into(),
            run.integrity.called_lost().into(),
            run.integrity.false_alarms().into(),
        ];
        Self { seed, reals, counts }
    }

    /// The largest position error along the path, metres.
    #[must_use]
    pub fn worst(&self) -> f64 {
        let [.., worst] = self.reals;
        worst
    }
}

fn numbers(vector: &Vector) -> [f64; 7] {
    (*vector).into()
}
