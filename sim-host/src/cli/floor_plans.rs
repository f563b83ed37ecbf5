//! `sonarfix floor-plans`: two policies in floor plans that nobody drew.

use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::floor_plan::{FloorPlan, compare, page, picture};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many plans.
    #[arg(long, default_value_t = 200)]
    plans: u32,
    /// How often each plan is driven under either policy.
    #[arg(long, default_value_t = 20)]
    runs: u32,
    /// Seed of the first plan; the others count up from it.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where the pictures of the worst plan go.
    #[arg(long, value_name = "DIR", conflicts_with = "draw")]
    images: Option<PathBuf>,
    /// Draws the plan with this seed instead.
    #[arg(long, value_name = "SEED")]
    draw: Option<u64>,
    /// Where the drawing goes.
    #[arg(long, value_name = "FILE.svg", requires = "draw")]
    out: Option<PathBuf>,
    /// Where the plan's scenario goes, for `sonarfix run` and `sonarfix plan`.
    #[arg(long, value_name = "FILE.toml", requires = "draw")]
    toml: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(seed) = args.draw {
        return draw(seed, args);
    }
    anyhow::ensure!(args.plans > 0, "--plans must be at least 1");
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    let results = compare::run(args.seed, args.plans, args.runs)?;
    let (text, pictures) = page::markdown(&results)?;
    print!("{text}");
    if let Some(dir) = &args.images {
        std::fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
        for (name, map) in page::PICTURES.into_iter().zip(&pictures) {
            write(&dir.join(name), &map.svg())?;
        }
    }
    Ok(())
}

fn draw(seed: u64, args: &Args) -> anyhow::Result<()> {
    let both = [&args.out, &args.toml];
    let somewhere = both.iter().any(|file| file.is_some());
    anyhow::ensure!(somewhere, "--draw wants --out FILE.svg or --toml FILE.toml or both");
    let plan = FloorPlan::new(seed);
    if let Some(file) = &args.out {
        write(file, &picture::place(&plan.scenario()?).svg())?;
    }
    if let Some(file) = &args.toml {
        write(file, &plan.toml)?;
    }
    Ok(())
}

fn write(file: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))
}
