//! `sonarfix-studies floor-plans`: two measurement policies on random floor plans.

use std::path::{Path, PathBuf};

use sonarfix_report::heat_map::HeatMap;
use sonarfix_studies::floor_plan::{FloorPlan, compare, page};
use sonarfix_terminal::output::{check_file, check_folder};
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of plans.
    #[arg(long, default_value_t = 200)]
    plans: u32,
    /// Number of runs per plan and policy.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first plan; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for the drawings of the worst plan.
    #[arg(long, value_name = "DIR", conflicts_with = "draw")]
    images: Option<PathBuf>,
    /// Draws the plan with this seed instead.
    #[arg(long, value_name = "SEED")]
    draw: Option<u64>,
    /// The drawing to write.
    #[arg(long, value_name = "FILE.svg", requires = "draw")]
    out: Option<PathBuf>,
    /// The scenario of the plan to write, for `sonarfix run` and `sonarfix plan`.
    #[arg(long, value_name = "FILE.toml", requires = "draw")]
    toml: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(seed) = args.draw {
        return draw(seed, args);
    }
    anyhow::ensure!(args.plans > 0, "--plans must be at least 1");
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    if let Some(dir) = &args.images {
        check_folder("--images", dir)?;
    }
    let runs = Runs::weighted(args.plans.saturating_mul(args.runs).saturating_mul(2), 2);
    let (results, errors) = compare::run(args.seed, args.plans, args.runs, &runs);
    runs.end()?;
    for error in &errors {
        eprintln!("error: {error}");
    }
    anyhow::ensure!(!results.is_empty(), "all floor plans failed");
    let (text, pictures) = page::markdown(&results)?;
    print!("{text}");
    if let Some(dir) = &args.images {
        for (name, map) in page::PICTURES.into_iter().zip(&pictures) {
            write(&dir.join(name), &map.svg())?;
        }
    }
    anyhow::ensure!(errors.is_empty(), "{} of the floor plans failed", errors.len());
    Ok(())
}

fn draw(seed: u64, args: &Args) -> anyhow::Result<()> {
    let both = [&args.out, &args.toml];
    let somewhere = both.iter().any(|file| file.is_some());
    anyhow::ensure!(somewhere, "--draw needs --out FILE.svg or --toml FILE.toml or both");
    for (option, file) in ["--out", "--toml"].into_iter().zip(both) {
        if let Some(file) = file {
            check_file(option, file)?;
        }
    }
    let plan = FloorPlan::new(seed);
    if let Some(file) = &args.out {
        write(file, &HeatMap::of(&plan.scenario()?).svg())?;
    }
    if let Some(file) = &args.toml {
        write(file, &plan.toml)?;
    }
    Ok(())
}

fn write(file: &Path, text: &str) -> anyhow::Result<()> {
    sonarfix_files::write(file, text)
}
