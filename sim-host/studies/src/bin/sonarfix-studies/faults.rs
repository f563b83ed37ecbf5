//! `sonarfix-studies faults`: the effects of hardware faults; `faults campaign`: random sequences of faults against rules.

use anyhow::Context;
use sonarfix_studies::{fault_campaign, fault_rangers, fault_search, fault_table};

use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    /// Number of runs per fault.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Plays random sequences of commands, faults of parts, power cuts, hostile frames and clock faults on robots of all
    /// compositions. Prints each sequence that breaks a rule, minimised, as a line of JSON.
    Campaign(Campaign),
}

#[derive(Debug, clap::Args)]
struct Campaign {
    /// Number of sequences.
    #[arg(long, default_value_t = 10_000)]
    sequences: u32,
    /// Seed of the first sequence; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(Command::Campaign(campaign)) = &args.command {
        return execute_campaign(campaign);
    }
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let runs = Runs::new(
        args.runs.saturating_mul(fault_table::CASES + fault_search::CASES + fault_rangers::CASES),
    );
    let rows = fault_table::rows(args.runs, &runs)?;
    let searching = fault_search::rows(args.runs, &runs)?;
    let with_gyro = fault_table::gyro_rows(args.runs, &runs)?;
    let rangers = fault_rangers::markdown(&fault_rangers::rows(args.runs, &runs)?);
    runs.end()?;
    print!("{}", fault_table::markdown(&rows, &searching, &with_gyro, &rangers));
    Ok(())
}

fn execute_campaign(args: &Campaign) -> anyhow::Result<()> {
    let progress = Runs::new(args.sequences);
    let (played, failures) = fault_campaign::campaign(args.seed, args.sequences, &progress);
    progress.end()?;
    for failure in &failures {
        let text = serde_json::to_string(failure).context("a sequence as JSON")?;
        println!("{text}");
    }
    println!("{played} sequences from seed {}, {} break a rule", args.seed, failures.len());
    anyhow::ensure!(failures.is_empty(), "sequences break rules");
    Ok(())
}
