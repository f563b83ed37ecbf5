//! `cargo xtask fuzz`: runs every target of `fuzz/` on its corpus and on seeded random bytes, then searches
//! with libFuzzer for a bounded time.
//!
//! The instrumentation uses flags of the stable compiler, so the search needs a C++ compiler, but neither a nightly
//! toolchain nor cargo-fuzz.

use std::process::Command;

use anyhow::Context;

use crate::cargo;
use crate::workspace::Workspace;

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Seconds of search for each target.
    #[arg(long, default_value_t = 10)]
    seconds: u32,
    /// Seed of the search; a failure is found again with the same seed.
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Targets; all if none is given.
    targets: Vec<String>,
}

impl Args {
    /// What CI runs.
    pub fn short() -> Self {
        Self { seconds: 5, seed: 1, targets: Vec::new() }
    }
}

const ALL: [&str; 8] = [
    "localizer",
    "baked_map",
    "map_file",
    "scenario_file",
    "robot_file",
    "replay_log",
    "link",
    "c_interface",
];

/// The instrumentation that guides libFuzzer: coverage counters and comparisons.
const INSTRUMENTED: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares \
    -Ccodegen-units=1 --cfg=fuzzing";

pub fn run(args: &Args) -> anyhow::Result<()> {
    let fuzz = Workspace::Fuzz;
    let target_folder = fuzz.target_folder();
    cargo::check(fuzz.cargo("fmt --check"))?;
    cargo::check(fuzz.cargo("clippy --no-default-features --all-targets -- -D warnings"))?;
    cargo::check(fuzz.cargo("test --release --no-default-features"))?;

    // A target of its own keeps the flags away from build scripts and macros.
    let host = host()?;
    let mut build = fuzz.cargo(&format!("build --release --bins --target {host}"));
    build.env("RUSTFLAGS", INSTRUMENTED);
    cargo::check(build)?;
    let chosen: Vec<&str> = if args.targets.is_empty() {
        ALL.to_vec()
    } else {
        args.targets.iter().map(String::as_str).collect()
    };
    for name in chosen {
        // New inputs go to a folder of their own, so that the committed corpus stays small.
        let found = target_folder.join("found").join(name);
        std::fs::create_dir_all(&found)
            .with_context(|| format!("cannot create {}", found.display()))?;
        let mut search = Command::new(target_folder.join(&host).join("release").join(name));
        search.arg(&found).arg(fuzz.folder().join("corpus").join(name));
        search.arg(format!("-max_total_time={}", args.seconds));
        search.arg(format!("-seed={}", args.seed));
        search.args(["-timeout=10", "-print_final_stats=1", "-verbosity=0"]);
        search.current_dir(&found);
        cargo::check(search)?;
    }
    Ok(())
}

/// Writes the inputs of the target `link` again, which a change of a message makes old.
pub fn bless() -> anyhow::Result<()> {
    let write = "test --release --no-default-features --test link_corpus -- --ignored";
    cargo::check(Workspace::Fuzz.cargo(write))
}

fn host() -> anyhow::Result<String> {
    let output = Command::new("rustc").arg("-vV").output().context("cannot start `rustc -vV`")?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("`rustc -vV` does not name its host")?.to_owned())
}
