//! Tables of results, for terminal and report.

use serde::Serialize;
use sonarfix_report::Table;
use sonarfix_sim::statistics::{StateSummary, Summary};

/// Statistics of runs, and their cost.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    #[serde(flatten)]
    pub summary: Summary,
    /// Processor time of the runs, all cores together.
    pub cpu_seconds: f64,
}

/// A row of the paper's Table 1: mean and deviation of a state, in the paper's unit.
#[derive(Debug, Clone, Copy)]
pub struct PaperRow {
    mean: &'static str,
    deviation: &'static str,
}

/// Table 1 of the paper, in the order of the states.
const TABLE_1: [PaperRow; 6] = [
    PaperRow { mean: "0.2", deviation: "3.5" },
    PaperRow { mean: "-0.02", deviation: "0.2" },
    PaperRow { mean: "-0.2", deviation: "0.25" },
    PaperRow { mean: "-0.0065", deviation: "1.75e-4" },
    PaperRow { mean: "7.9e-4", deviation: "1.95e-4" },
    PaperRow { mean: "349", deviation: "0.7" },
];

/// The presentation of a state: label with unit, and number of these units per SI unit.
struct Shown {
    label: &'static str,
    per_si: f64,
    scientific: bool,
}

const SHOWN: [Shown; 7] = [
    Shown { label: "X error (mm)", per_si: 1e3, scientific: false },
    Shown { label: "Y error (mm)", per_si: 1e3, scientific: false },
    Shown { label: "heading error (deg)", per_si: 180.0 / std::f64::consts::PI, scientific: false },
    Shown { label: "S_R", per_si: 1.0, scientific: true },
    Shown { label: "S_L", per_si: 1.0, scientific: true },
    Shown { label: "track width (mm)", per_si: 1e3, scientific: false },
    Shown { label: "range scale", per_si: 1.0, scientific: true },
];

/// Further columns of a table of estimates: the true values at the end and, for the paper's scenario,
/// the paper's values.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    /// The true value of each row, SI: zero for the errors of the pose, the true value of a
    /// systematic error, the whole track width.
    pub truth: [f64; 7],
    /// Whether to show the paper's columns.
    pub paper: bool,
}

/// The table of estimated states: mean, deviation, bound, and ratio of RMS to bound.
#[must_use]
pub fn states(measured: &Measured, beside: &Beside) -> Table {
    let summary = &measured.summary;
    let mut columns = vec!["state", "true", "mean", "deviation", "bound", "RMS/bound"];
    if beside.paper {
        columns.extend(["paper's mean", "paper's deviation"]);
    }
    let rows = summary.states.iter().zip(&SHOWN).zip(beside.truth).enumerate();
    let rows = rows
        .filter(|(_, ((state, _), _))| state.rms_over_bound.is_some())
        .map(|(i, ((state, shown), truth))| {
            let mut row = state_row(state, shown, truth);
            if beside.paper {
                let paper = TABLE_1.get(i);
                row.push(paper.map_or("", |p| p.mean).to_owned());
                row.push(paper.map_or("", |p| p.deviation).to_owned());
            }
            row
        })
        .collect();
    Table {
        title: "Estimates at the end of the run".to_owned(),
        note: note(measured),
        columns: columns.into_iter().map(str::to_owned).collect(),
        rows,
    }
}

fn state_row(state: &StateSummary, shown: &Shown, truth: f64) -> Vec<String> {
    let in_unit = |si: f64| {
        let value = si * shown.per_si;
        if shown.scientific { format!("{value:.3e}") } else { format!("{value:.3}") }
    };
    let mut row = vec![shown.label.to_owned(), in_unit(truth), in_unit(truth + state.mean_error)];
    row.extend([state.std_error, state.bound].map(in_unit));
    row.push(state.rms_over_bound.map_or_else(String::new, |ratio| format!("{ratio:.3}")));
    row
}

fn note(Measured { summary: s, cpu_seconds }: &Measured) -> String {
    let path = &s.rms_path;
    let runs = f64::from(u32::try_from(s.runs).unwrap_or(u32::MAX));
    let nis = if s.nis_mean.is_nan() { "–".to_owned() } else { format!("{:.3}", s.nis_mean) };
    format!(
        "{} runs, {:.0} % sampling error on a deviation; NEES/{} {:.3}, NIS {nis}; \
         RMS along the path x {:.1} mm, y {:.1} mm, heading {:.2}°; \
         ranges accepted {}, gated {}, refused {}; runs lost {}; {cpu_seconds:.2} s of CPU time",
        s.runs,
        100.0 / (2.0 * (runs - 1.0).max(1.0)).sqrt(),
        s.nees_states,
        s.nees_mean / f64::from(u32::try_from(s.nees_states).unwrap_or(u32::MAX)),
        path.x * 1e3,
        path.y * 1e3,
        path.heading.to_degrees(),
        s.fixes.accepted,
        s.fixes.gated,
        s.fixes.refused,
        s.lost_runs,
    )
}
