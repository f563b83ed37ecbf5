//! `sonarfix merge`: joins the rows of shards.

use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use cpu_time::ProcessTime;
use sonarfix_rows::{Plan, Rows};

use crate::rows;
use crate::table::{self, Beside, Measured};
use sonarfix_terminal::output::check_file;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The files of all shards, in any order.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Writes the rows of all shards into this file; its format follows from its name.
    #[arg(long, value_name = "FILE.csv|FILE.parquet")]
    rows: Option<PathBuf>,
    /// Lists the seeds with the largest position errors along the path.
    #[arg(long, value_name = "K", default_value_t = 0)]
    worst: usize,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let start = ProcessTime::now();
    if let Some(file) = &args.rows {
        check_file("--rows", file)?;
    }
    let (plan, files) = in_order(&args.files)?;
    let open = || Ok(all(files.clone()));
    if let Some(file) = &args.rows {
        ensure!(!files.contains(file), "--rows {}: this is one of the shards", file.display());
        sonarfix_rows::write(file, &plan, all(files.clone()))?;
    }
    let (summary, worst) = rows::summary(open, args.worst)?;
    let measured = Measured { summary, cpu_seconds: start.elapsed().as_secs_f64() };
    if args.json {
        return sonarfix_terminal::json::print(&measured);
    }
    // The truth is in the scenario: the table shows the errors.
    let errors = Beside { truth: [0.0; 7], paper: false };
    println!("{}", table::states(&measured, &errors).text());
    if !worst.is_empty() {
        println!("\n{}", rows::worst_table(&worst).text());
    }
    Ok(())
}

/// The plan of all runs, and the files in the order of their shards.
fn in_order(files: &[PathBuf]) -> anyhow::Result<(Plan, Vec<PathBuf>)> {
    let mut shards = Vec::new();
    for file in files {
        let (plan, rows) = sonarfix_rows::open(file)?;
        let (mut count, (_, expected)) = (0_u32, plan.part());
        let name = format!("shard {}, the rows {}", plan.shard, file.display());
        for row in rows {
            row.with_context(|| name.clone())?;
            count += 1;
        }
        ensure!(count == expected, "{name}: {count} of {expected} rows; run its command again");
        shards.push((plan, file.clone()));
    }
    shards.sort_by_key(|(plan, _)| plan.shard.index);
    let Some(whole) = shards.first().map(|(plan, _)| plan.whole()) else {
        bail!("there is no file");
    };
    for (plan, file) in &shards {
        let is_same = plan.whole() == whole;
        ensure!(is_same, "{}: another scenario, seed or number of runs", file.display());
    }
    let indices: Vec<u32> = shards.iter().map(|(plan, _)| plan.shard.index).collect();
    for (plan, file) in &shards {
        let all: Vec<u32> = (1..=plan.shard.of).collect();
        let name = file.display();
        ensure!(indices == all, "{name} is shard {}, and the files are {indices:?}", plan.shard);
    }
    Ok((whole, shards.into_iter().map(|(_, file)| file).collect()))
}

/// The rows of the files, one after the other.
fn all(files: Vec<PathBuf>) -> Rows {
    let opened = files.into_iter().flat_map(|file| match sonarfix_rows::open(&file) {
        Ok((_, rows)) => rows,
        Err(error) => Box::new(std::iter::once(Err(error))) as Rows,
    });
    Box::new(opened)
}
