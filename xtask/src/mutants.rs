//! `cargo xtask mutants`: mutation tests by cargo-mutants, as many mutants as there is time for (`docs/mutation.md`).

use anyhow::Context;

use crate::cargo;

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Only mutants in lines that have changed since this commit.
    #[arg(long, value_name = "COMMIT")]
    since: Option<String>,
    /// Only mutants in these files.
    #[arg(long, value_name = "GLOB")]
    file: Option<String>,
    /// How many mutants are tried at most.
    #[arg(long, default_value_t = 500)]
    most: usize,
    /// Of more mutants, which part is tried: the number of a night, for instance.
    #[arg(long, default_value_t = 0)]
    part: usize,
}

impl Args {
    /// What CI runs.
    pub fn short() -> Self {
        let file = Some("crates/sonarfix/src/geometry/numeric.rs".to_owned());
        Self { since: None, file, most: 3, part: 0 }
    }
}

/// Tries the mutants. One that survives is an error, unless `.cargo/mutants.toml` excludes it.
pub fn run(args: &Args) -> anyhow::Result<()> {
    cargo::install("cargo-mutants", "27.1.0")?;
    let mut chosen = Vec::new();
    if let Some(commit) = &args.since {
        let diff = cargo::target_folder().join("mutants.diff");
        let mut git = std::process::Command::new("git");
        git.args(["diff", commit, "--", "*.rs"]);
        std::fs::write(&diff, cargo::printed(git)?)?;
        chosen.push(format!("--in-diff={}", diff.display()));
    }
    chosen.extend(args.file.iter().map(|file| format!("--file={file}")));
    let mut list = cargo::command("mutants --list");
    list.args(&chosen);
    let parts = cargo::printed(list)?.lines().count().div_ceil(args.most);
    if parts == 0 {
        eprintln!("no mutant to try");
        return Ok(());
    }
    // The tests pass without a mutant: other checks run them.
    let mut mutants = cargo::command("mutants --baseline skip --timeout 120 --colors never");
    // A part is spread over all files, so that it is a sample of all.
    mutants.args(&chosen).arg("--sharding=round-robin");
    mutants.arg(format!("--shard={}/{parts}", args.part % parts));
    mutants.arg("--output").arg(cargo::target_folder());
    cargo::check(mutants).context("mutants survive: add a test, or a reason to .cargo/mutants.toml")
}
