//! `sonarfix floor-plans`: two policies in floor plans that nobody drew.

use std::path::PathBuf;

use crate::floor_plan::{FloorPlan, compare};

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
    /// Draws the plan with this seed instead.
    #[arg(long, value_name = "SEED")]
    draw: Option<u64>,
    /// Where the drawing goes.
    #[arg(long, value_name = "FILE.svg", requires = "draw")]
    out: Option<PathBuf>,
    /// Where its scenario goes, for `sonarfix run` and `sonarfix plan`.
    #[arg(long, value_name = "FILE.toml", requires = "draw")]
    toml: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if let Some(seed) = args.draw {
        let plan = FloorPlan::new(seed);
        println!("{}", plan.toml);
        plan.scenario()?;
        return Ok(());
    }
    let results = compare::run(args.seed, args.plans, args.runs)?;
    for r in &results {
        let i = r.ratio();
        println!(
            "{} {} rooms {} walls {} {:.0} m: nearest {:.1} mm lost {}, informative {:.1} mm lost {}: {:.3} ({:.3}..{:.3})",
            r.plan.seed, r.plan.kind.name(), r.plan.rooms, r.walls, r.length,
            1e3 * r.rms(compare::nearest), r.lost(compare::nearest),
            1e3 * r.rms(compare::informative), r.lost(compare::informative),
            i.value, i.from, i.to
        );
    }
    let m = compare::median_ratio(&results);
    println!("median {:.3} ({:.3}..{:.3})", m.value, m.from, m.to);
    Ok(())
}
