//! Runs with a file of rows: computed in parts, resumed, summed up in constant memory.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use cpu_time::ProcessTime;
use sonarfix_report::Table;
use sonarfix_rows::journal::Journal;
use sonarfix_rows::{Plan, Rows, Shard};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::row::Row;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::{Summary, Totals};

use crate::table::Measured;
use sonarfix_terminal::progress::Runs;

/// Runs between two writes of the file: what a killed process loses at most.
const CHUNK: u32 = 256;

#[derive(Debug, clap::Args)]
pub struct RowsArgs {
    /// Writes a row per run into this file (docs/formats.md). If it holds some of the rows already, the others are
    /// computed.
    #[arg(long, value_name = "FILE.csv|FILE.parquet")]
    pub rows: Option<PathBuf>,
    /// Computes only a part of the runs, for example 3/8; `sonarfix merge` joins the parts.
    #[arg(long, value_name = "I/M", requires = "rows")]
    pub shard: Option<Shard>,
    /// Lists the seeds with the largest position errors along the path.
    #[arg(long, value_name = "K")]
    pub worst: Option<usize>,
    /// Writes the traces of these seeds into this folder.
    #[arg(long, value_name = "DIR", requires = "worst")]
    pub traces: Option<PathBuf>,
}

/// The statistics of rows, and the runs with the largest errors.
#[derive(Debug)]
pub struct Counted {
    pub measured: Measured,
    pub worst: Vec<Row>,
}

/// The runs with the largest position errors so far, the largest first.
pub struct Worst {
    most: usize,
    rows: Vec<Row>,
}

impl Worst {
    pub fn new(most: usize) -> Self {
        Self { most, rows: Vec::new() }
    }

    pub fn add(&mut self, row: &Row) {
        let at = self.rows.partition_point(|held| held.worst() >= row.worst());
        if at < self.most {
            self.rows.insert(at, *row);
            self.rows.truncate(self.most);
        }
    }

    pub fn rows(self) -> Vec<Row> {
        self.rows
    }
}

/// The statistics of the rows that `open` returns; they are read twice, and never all in memory.
pub fn summary(
    open: impl Fn() -> anyhow::Result<Rows>,
    most: usize,
) -> anyhow::Result<(Summary, Vec<Row>)> {
    let (mut totals, mut worst) = (Totals::default(), Worst::new(most));
    for row in open()? {
        let row = row?;
        totals.add(&row);
        worst.add(&row);
    }
    ensure!(totals.runs() > 0, "there are no rows");
    let mut deviations = totals.deviations();
    for row in open()? {
        deviations.add(&row?);
    }
    Ok((deviations.summary(), worst.rows()))
}

/// Computes the runs that the file lacks; returns the statistics of all of its rows.
pub fn compute(
    simulation: &Simulation,
    plan: &Plan,
    file: &Path,
    most: usize,
) -> anyhow::Result<Counted> {
    let start = ProcessTime::now();
    let file = filled(simulation, plan, file)?;
    let (summary, worst) = summary(|| Ok(sonarfix_rows::open(&file)?.1), most)?;
    let measured = Measured { summary, cpu_seconds: start.elapsed().as_secs_f64() };
    Ok(Counted { measured, worst })
}

/// Computes the missing rows; returns the file with the rows, which is not the requested one if an interruption came before
/// Parquet could be written.
fn filled(simulation: &Simulation, plan: &Plan, file: &Path) -> anyhow::Result<PathBuf> {
    if !sonarfix_rows::is_parquet(file) {
        append(simulation, &mut Journal::open(file, plan)?)?;
        return Ok(file.to_owned());
    }
    if file.exists() {
        let (held, _) = sonarfix_rows::open(file)?;
        ensure!(
            held == *plan,
            "{} holds other runs: delete it, or name another file",
            file.display()
        );
        return Ok(file.to_owned());
    }
    // Parquet is written at once. Until then the rows are in a CSV beside it.
    let growing = with_ending(file, "csv");
    let mut journal = Journal::open(&growing, plan)?;
    append(simulation, &mut journal)?;
    if journal.left() > 0 {
        return Ok(growing);
    }
    sonarfix_rows::write(file, plan, sonarfix_rows::open(&growing)?.1)?;
    std::fs::remove_file(&growing)?;
    Ok(file.to_owned())
}

fn append(simulation: &Simulation, journal: &mut Journal) -> anyhow::Result<()> {
    if journal.left() == 0 {
        return Ok(());
    }
    if journal.done() > 0 {
        eprintln!("resumed after {} runs", journal.done());
    }
    let runs = Runs::new(journal.left());
    let appended = chunks(simulation, journal, &runs);
    runs.end()?;
    appended
}

fn chunks(simulation: &Simulation, journal: &mut Journal, runs: &Runs) -> anyhow::Result<()> {
    while journal.left() > 0 {
        let wanted = journal.left().min(CHUNK);
        let first = journal.next_seed();
        let mut rows = monte_carlo::rows(simulation, first, wanted, runs)?;
        // After an interruption some runs are missing: those before the first of them are kept.
        let is_next = |(row, run): (&Row, u64)| row.seed == first.wrapping_add(run);
        rows.truncate(rows.iter().zip(0..).take_while(|&pair| is_next(pair)).count());
        journal.append(&rows)?;
        if rows.len() < wanted as usize {
            break;
        }
    }
    Ok(())
}

/// The file with a further ending.
fn with_ending(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    name.into()
}

/// The runs with the largest errors.
pub fn worst_table(worst: &[Row]) -> Table {
    let row = |row: &Row| {
        let [x, y, heading, ..] = row.reals;
        vec![
            row.seed.to_string(),
            format!("{:.1}", 1e3 * row.worst()),
            format!("{:.1}", 1e3 * x.hypot(y)),
            format!("{:.2}", heading.to_degrees()),
        ]
    };
    Table {
        title: "Largest position errors along the path".to_owned(),
        note: String::new(),
        columns: ["seed", "largest (mm)", "at the end (mm)", "heading at the end (°)"]
            .map(str::to_owned)
            .to_vec(),
        rows: worst.iter().map(row).collect(),
    }
}
