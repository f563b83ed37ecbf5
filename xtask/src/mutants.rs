//! `cargo xtask mutants`: mutation tests of the core and of the application by cargo-mutants; `.cargo/mutants.toml` has the
//! settings, `docs/mutation.md` the results.

use crate::cargo;

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Only the mutants of these files, as globs.
    #[arg(long)]
    file: Vec<String>,
    /// Cases of each property test. Few find most mutants quickly; survivors are then tested with more.
    #[arg(long, default_value_t = 8)]
    cases: u32,
    /// Only the mutants that survived the last run of these files.
    #[arg(long)]
    survivors: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut command = cargo::command("mutants --package sonarfix --package sonarfix-app");
    for file in &args.file {
        command.args(["--file", file]);
    }
    if args.survivors {
        command.arg("--iterate");
    }
    command.arg("--output").arg(cargo::target_folder());
    command.env("PROPTEST_CASES", args.cases.to_string());
    // A failure needs no smallest example.
    command.env("PROPTEST_MAX_SHRINK_ITERS", "0");
    // Without recordings, whose tests take longer.
    command.env_remove("SONARFIX_DATA");
    cargo::check(command)
}
