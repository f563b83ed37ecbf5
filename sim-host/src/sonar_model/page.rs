//! The comparison as a page of the documentation.

use std::fmt::Write;

use super::Comparison;
use super::cells::{Cell, Cells, ROW};

/// The table in the recordings' README, over a larger set of which the recordings here are a
/// part (50 sweeps, 10,309 pings): row, and per column the shares that it gives.
const README: [(usize, [Option<[f64; 4]>; 3]); 7] = [
    (
        0,
        [
            Some([0.96, 0.0, 0.0, 0.04]),
            Some([0.99, 0.0, 0.0, 0.01]),
            Some([0.62, 0.04, 0.20, 0.14]),
        ],
    ),
    (
        2,
        [Some([0.96, 0.01, 0.0, 0.03]), Some([1.0, 0.0, 0.0, 0.0]), Some([0.58, 0.08, 0.20, 0.13])],
    ),
    (
        4,
        [
            Some([0.91, 0.07, 0.0, 0.03]),
            Some([0.89, 0.02, 0.07, 0.01]),
            Some([0.49, 0.08, 0.29, 0.14]),
        ],
    ),
    (
        5,
        [
            Some([0.81, 0.15, 0.0, 0.05]),
            Some([0.78, 0.10, 0.03, 0.08]),
            Some([0.31, 0.02, 0.38, 0.29]),
        ],
    ),
    (
        6,
        [
            Some([0.70, 0.22, 0.01, 0.07]),
            Some([0.33, 0.12, 0.12, 0.43]),
            Some([0.13, 0.02, 0.52, 0.33]),
        ],
    ),
    (8, [Some([0.43, 0.19, 0.03, 0.36]), Some([0.0, 0.0, 0.45, 0.55]), None]),
    (10, [Some([0.12, 0.09, 0.14, 0.65]), Some([0.0, 0.0, 0.43, 0.57]), None]),
];

const HEAD: &str = "\
# The NXT sonar, measured and simulated
Written by `sonarfix sonar-model --data DIR`; change the model, not this page.

`DIR` is the folder `nxt_rotating_sonar` of the shared data: sweeps of 360° by four student robots in a room of eight known
walls. It is not part of the project. Every recorded sweep is simulated 25 times from the same place with the same bearings,
and both are sorted alike: by the perpendicular distance of the wall on the beam's axis, by the angle between axis and
normal, and by what came back. In each cell: **perpendicular distance to 4 cm / distance along the axis to 4 cm / no echo /
something else**. *README* is the table beside the recordings, made from a larger set of which these are a part; where it
differs from *measured*, the sets do. A share measured in n pings has a sampling error of up to 0.5/√n, and the pings of one
sweep are not independent: neighbouring beams meet the same walls from the same place.

";

/// The page.
#[must_use]
pub fn markdown(comparison: &Comparison) -> String {
    let mut page = HEAD.to_owned();
    for (column, name) in ["below 0.6 m", "0.6 m to 1.1 m", "1.1 m and more"].iter().enumerate() {
        section(&mut page, comparison, column, name);
    }
    summary(&mut page, comparison);
    page
}

fn section(page: &mut String, comparison: &Comparison, column: usize, name: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(page, "## {name}");
    page.push_str(
        "| off normal | pings | README | measured | simulated | bias measured / simulated, cm |\n",
    );
    page.push_str("|---|---|---|---|---|---|\n");
    let rows = comparison.measured.rows().iter().zip(comparison.simulated.rows());
    for (row, (measured, simulated)) in rows.enumerate() {
        let (Some(measured), Some(simulated)) = (measured.get(column), simulated.get(column))
        else {
            continue;
        };
        if measured.pings() == 0 {
            continue;
        }
        let readme = README.iter().find(|(of, _)| *of == row);
        let readme = readme.and_then(|(_, shares)| shares.get(column).copied().flatten());
        let _ = writeln!(
            page,
            "| {}–{}° | {} | {} | {} | {} | {} / {} |",
            degrees(row),
            degrees(row + 1),
            measured.pings(),
            shares(readme),
            shares(measured.shares()),
            shares(simulated.shares()),
            centimetres(measured),
            centimetres(simulated),
        );
    }
    page.push('\n');
}

#[expect(clippy::cast_precision_loss, reason = "a dozen rows")]
fn degrees(row: usize) -> f64 {
    row as f64 * ROW
}

fn shares(shares: Option<[f64; 4]>) -> String {
    let text = |shares: [f64; 4]| shares.map(|share| format!("{share:.2}")).join(" / ");
    shares.map_or_else(String::new, text)
}

fn centimetres(cell: &Cell) -> String {
    cell.bias().map_or_else(|| "–".into(), |bias| format!("{:+.1}", 100.0 * bias))
}

fn summary(page: &mut String, comparison: &Comparison) {
    let pings = |cells: &Cells| cells.rows().iter().flatten().map(Cell::pings).sum::<u32>();
    let _ = writeln!(
        page,
        "Over the {} pings of {} sweeps that these cells hold, the shares differ by {:.3} on average (mean absolute \
         difference of the four shares, each cell weighted by its pings).",
        pings(&comparison.measured),
        comparison.sweeps,
        mean_difference(comparison),
    );
}

/// Mean absolute difference of the four shares, cells weighted by their pings.
#[must_use]
pub fn mean_difference(comparison: &Comparison) -> f64 {
    let measured = comparison.measured.rows().iter().flatten();
    let (mut sum, mut weight) = (0.0, 0.0);
    for (measured, simulated) in measured.zip(comparison.simulated.rows().iter().flatten()) {
        if let (Some(real), Some(ours)) = (measured.shares(), simulated.shares()) {
            let pings = f64::from(measured.pings());
            let apart: f64 = real.iter().zip(ours).map(|(r, o)| (r - o).abs()).sum();
            sum += pings * apart / 4.0;
            weight += pings;
        }
    }
    sum / weight
}
