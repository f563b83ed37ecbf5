//! A trace as a CSV file: one line per instant, every column named with its unit
//! (`docs/formats.md`).

use std::io::Write;

use sonarfix::health::Verdict;
use sonarfix_sim::trace::{FixRecord, Outcome, Tick, Trace};

const COLUMNS: [&str; 45] = [
    "time_s",
    "true_x_m",
    "true_y_m",
    "true_heading_rad",
    "true_scale_right",
    "true_scale_left",
    "true_track_width_m",
    "true_range_scale",
    "x_m",
    "y_m",
    "heading_rad",
    "scale_right",
    "scale_left",
    "track_width_m",
    "range_scale",
    "sigma_x_m",
    "sigma_y_m",
    "sigma_heading_rad",
    "sigma_scale_right",
    "sigma_scale_left",
    "sigma_track_width_m",
    "sigma_range_scale",
    "covariance_xy_m2",
    "verdict",
    "inflations",
    "bound_x_m",
    "bound_y_m",
    "bound_heading_rad",
    "odometry_x_m",
    "odometry_y_m",
    "odometry_heading_rad",
    "fix_time_s",
    "fix_wall",
    "fix_bearing_rad",
    "fix_direction_rad",
    "fix_range_m",
    "fix_gain_m2",
    "fix_success",
    "fix_seconds",
    "fix_candidates",
    "fix_outcome",
    "fix_association",
    "fix_reason",
    "fix_innovation_m",
    "fix_innovation_variance_m2",
];

/// Number of the columns that belong to a measurement cycle.
const FIX_COLUMNS: usize = 14;

/// Writes a trace. The first line is the start, if it is known. A measurement cycle is in the line of the first tick at or after it; several
/// cycles before one tick have a line each, with the same state. Unknown values are empty cells.
///
/// # Errors
/// Errors of the writer.
pub fn write(trace: &Trace, out: impl Write) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(COLUMNS)?;
    let mut fixes = trace.fixes.iter().peekable();
    for tick in trace.start.iter().chain(&trace.ticks) {
        let state = state_cells(tick);
        let mut written = false;
        while let Some(fix) = fixes.next_if(|fix| fix.time <= tick.time) {
            csv.write_record(state.iter().chain(&fix_cells(fix, trace)))?;
            written = true;
        }
        if !written {
            csv.write_record(state.iter().chain(&vec![String::new(); FIX_COLUMNS]))?;
        }
    }
    csv.flush()?;
    Ok(())
}

fn state_cells(tick: &Tick) -> Vec<String> {
    let truth = tick.truth.map(|truth| truth.pose);
    let calibration = tick.truth.and_then(|truth| truth.calibration);
    let estimate = &tick.estimate;
    let mut cells = vec![cell(tick.time)];
    cells.extend([truth.map(|p| p.x), truth.map(|p| p.y), truth.map(|p| p.heading)].map(optional));
    cells.extend(
        [
            calibration.map(|c| c.scale_right),
            calibration.map(|c| c.scale_left),
            calibration.map(|c| c.track_width),
            calibration.map(|c| c.range_scale),
        ]
        .map(optional),
    );
    let (pose, c) = (estimate.pose, estimate.calibration);
    cells.extend([pose.x, pose.y, pose.heading].map(cell));
    cells.extend([c.scale_right, c.scale_left, c.track_width, c.range_scale].map(cell));
    cells.extend(estimate.deviation.map(cell));
    cells.push(cell(estimate.covariance_xy));
    cells.extend([verdict(estimate.verdict).to_owned(), estimate.inflations.to_string()]);
    let bound = tick.bound.map_or([None; 3], |[x, y, heading, ..]| [x, y, heading].map(Some));
    cells.extend(bound.map(optional));
    cells.extend([tick.odometry.x, tick.odometry.y, tick.odometry.heading].map(cell));
    cells
}

fn fix_cells(fix: &FixRecord, trace: &Trace) -> [String; FIX_COLUMNS] {
    let wall = fix.wall.and_then(|wall| trace.walls.get(wall));
    let outcome = match fix.outcome {
        Outcome::Accepted => "accepted",
        Outcome::Downweighted => "downweighted",
        Outcome::Gated => "gated",
        Outcome::Refused => "refused",
    };
    [
        cell(fix.time),
        wall.map_or_else(String::new, |wall| wall.name.clone()),
        cell(fix.bearing),
        cell(fix.direction),
        optional(fix.range),
        optional(fix.why.map(|why| why.gain)),
        optional(fix.why.map(|why| why.success)),
        optional(fix.why.map(|why| why.seconds)),
        optional(fix.why.map(|why| why.candidates.into())),
        outcome.to_owned(),
        optional(fix.association),
        fix.reason.clone(),
        optional(fix.innovation),
        optional(fix.innovation_variance),
    ]
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Tracking => "tracking",
        Verdict::Degraded => "degraded",
        Verdict::Lost => "lost",
    }
}

fn cell(value: f64) -> String {
    // Nine digits identify any f32.
    let text = format!("{value:.9}");
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if value != 0.0 && value.abs() < 1e-4 { format!("{value:.8e}") } else { trimmed.to_owned() }
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, cell)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_sim::trace::{Estimate, Pose, Why};

    fn tick(time: f64) -> Tick {
        Tick {
            time,
            truth: None,
            estimate: Estimate::default(),
            bound: None,
            odometry: Pose::default(),
        }
    }

    fn fix(time: f64) -> FixRecord {
        FixRecord {
            time,
            wall: None,
            sonar: [0.0, 0.0],
            direction: 0.0,
            bearing: 0.5,
            range: Some(1.25),
            source: None,
            why: Some(Why { gain: 2e-6, success: 0.75, seconds: 0.25, candidates: 3 }),
            outcome: Outcome::Downweighted,
            association: Some(0.25),
            reason: "no wall, \"none\"".to_owned(),
            innovation: None,
            innovation_variance: None,
        }
    }

    #[test]
    fn every_tick_and_every_fix_has_its_line() {
        let trace = Trace {
            start: Some(tick(0.0)),
            ticks: [0.1, 0.2, 0.3].map(tick).to_vec(),
            searches: Vec::new(),
            fixes: [0.15, 0.2, 0.3].map(fix).to_vec(),
            ..Trace::default()
        };
        let mut out = Vec::new();
        write(&trace, &mut out).unwrap();
        let mut reader = csv::Reader::from_reader(out.as_slice());
        assert_eq!(reader.headers().unwrap(), &COLUMNS[..]);
        let lines: Vec<_> = reader.records().map(Result::unwrap).collect();
        let times: Vec<_> = lines.iter().map(|l| (l[0].to_owned(), l[31].to_owned())).collect();
        let expected = [("0", ""), ("0.1", ""), ("0.2", "0.15"), ("0.2", "0.2"), ("0.3", "0.3")];
        assert_eq!(times, expected.map(|(t, f)| (t.to_owned(), f.to_owned())));
        assert_eq!([&lines[2][23], &lines[2][24]], ["tracking", "0"]);
        assert_eq!(
            [40, 41, 42].map(|c| &lines[2][c]),
            ["downweighted", "0.25", "no wall, \"none\""]
        );
        let why = [36, 37, 38, 39].map(|column| &lines[2][column]);
        assert_eq!(why, ["2.00000000e-6", "0.75", "0.25", "3"]);
    }

    #[test]
    fn cells_have_nine_significant_digits() {
        assert_eq!([0.0, -20.0, 0.5, 2e-4].map(cell), ["0", "-20", "0.5", "0.0002"]);
        assert_eq!(cell(5.6e-5), "5.60000000e-5");
    }
}
