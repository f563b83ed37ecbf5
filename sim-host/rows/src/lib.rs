//! Files with one row per simulated run, as CSV or Parquet.
//!
//! A large number of runs is split into shards, which are computed anywhere and in any order; the merged rows are those of
//! one computation, to the bit. A CSV is written as the runs finish, so that an interrupted computation is resumed. All
//! files are read row by row: the memory does not grow with the number of runs.
//!
//! | module | what |
//! |---|---|
//! | [`plan`] | which runs a file holds: scenario, seeds, shard |
//! | [`journal`] | a CSV that grows |
//! | [`csv`] | the text of a row |
//! | [`columns`] | Parquet |
//! | this one | reading either format |

pub mod columns;
pub mod csv;
pub mod journal;
pub mod plan;

use std::path::Path;

use anyhow::Context;
use sonarfix_sim::row::Row;

pub use plan::{Plan, Rows, Shard};

/// Whether a file is Parquet, by its name; all others are CSV.
#[must_use]
pub fn is_parquet(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// Opens a file: its plan, and its rows.
///
/// # Errors
/// If the file cannot be read or is no file of rows.
pub fn open(file: &Path) -> anyhow::Result<(Plan, Rows)> {
    let opened = if is_parquet(file) { columns::open(file) } else { csv::open(file) };
    opened.with_context(|| format!("the rows {}", file.display()))
}

/// Writes rows into a new file in the format of its name.
///
/// # Errors
/// If the file cannot be written, or a row cannot be read.
pub fn write(
    file: &Path,
    plan: &Plan,
    rows: impl Iterator<Item = anyhow::Result<Row>>,
) -> anyhow::Result<()> {
    let written = if is_parquet(file) {
        columns::write(file, plan, rows)
    } else {
        csv::write(file, plan, rows)
    };
    written.with_context(|| format!("the rows {}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix_map::Scenario;
    use sonarfix_sim::row::{COUNTS, REALS};

    /// Rows with numbers that are hard to write.
    fn rows(plan: &Plan) -> Vec<Row> {
        let hard = [
            0.1 + 0.2,
            -0.0,
            f64::MIN_POSITIVE / 3.0,
            f64::MAX,
            f64::INFINITY,
            f64::NAN,
            1e300 / 7.0,
        ];
        let row = |run: u32| {
            let real = |column: usize| hard[(column + run as usize) % hard.len()];
            Row {
                seed: plan.seed_of(run),
                reals: std::array::from_fn(real),
                counts: [u64::from(run) << 40; COUNTS.len()],
            }
        };
        (0..plan.part().1).map(row).collect()
    }

    fn bits(row: &Row) -> (u64, [u64; REALS.len()], [u64; COUNTS.len()]) {
        (row.seed, row.reals.map(f64::to_bits), row.counts)
    }

    /// Both formats give back every bit, and the plan; also with seeds beyond those of a signed number.
    #[test]
    fn rows_are_read_back_to_the_bit() {
        let dir = tempfile::tempdir().unwrap();
        let shard: Shard = "2/3".parse().unwrap();
        let plan = Plan::new(&Scenario::paper().unwrap(), u64::MAX - 9_000, 27_000, shard);
        let rows = rows(&plan);
        assert_eq!(rows.len(), 9_000);
        for name in ["rows.csv", "rows.parquet"] {
            let file = dir.path().join(name);
            write(&file, &plan, rows.iter().copied().map(Ok)).unwrap();
            let (read_plan, read) = open(&file).unwrap();
            assert_eq!(read_plan, plan);
            let read: Vec<Row> = read.map(Result::unwrap).collect();
            assert_eq!(read.len(), rows.len(), "{name}");
            assert!(read.iter().map(bits).eq(rows.iter().map(bits)), "{name}");
        }
    }

    /// The shards of any number of runs follow each other and contain all runs.
    #[test]
    fn shards_are_a_partition() {
        let scenario = Scenario::paper().unwrap();
        for (runs, of) in [(10, 3), (7, 8), (1_000_000, 7), (u32::MAX, 1_000)] {
            let mut next = 0;
            for index in 1..=of {
                let (first, count) = Plan::new(&scenario, 0, runs, Shard { index, of }).part();
                assert_eq!(first, next);
                next += count;
            }
            assert_eq!(next, runs);
        }
        for wrong in ["0/8", "9/8", "3", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
