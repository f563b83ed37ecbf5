//! `cargo xtask fuzz`: every target of `fuzz/` over its corpus and seeded random bytes, and then a
//! search by libFuzzer for a bounded time. The search is instrumented by flags that a stable
//! compiler takes, so it needs neither a nightly toolchain nor cargo-fuzz, only a C++ compiler.

use std::path::Path;
use std::process::Command;

use anyhow::Context;

use crate::cargo;

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// How long to search, for each target.
    #[arg(long, default_value_t = 10)]
    seconds: u32,
    /// Where the search begins: the same finds the same, as far as it gets.
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// The targets; all if none is given.
    targets: Vec<String>,
}

impl Args {
    /// What CI runs.
    pub fn short() -> Self {
        Self { seconds: 5, seed: 1, targets: Vec::new() }
    }
}

const ALL: [&str; 7] =
    ["localizer", "baked_map", "map_file", "scenario_file", "robot_file", "replay_log", "link"];

/// The coverage that libFuzzer is guided by: counters and comparisons.
const INSTRUMENTED: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares \
    -Ccodegen-units=1 --cfg=fuzzing";

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz");
    let target_directory = cargo::target_directory().join("fuzz");
    let in_fuzz = |arguments: &str| {
        let mut command = cargo::command(arguments);
        command.current_dir(&folder).env("CARGO_TARGET_DIR", &target_directory);
        command
    };
    cargo::check(in_fuzz("fmt --check"))?;
    cargo::check(in_fuzz("clippy --no-default-features --all-targets -- -D warnings"))?;
    cargo::check(in_fuzz("test --release --no-default-features"))?;

    // A target of its own keeps the flags away from build scripts and macros.
    let host = host()?;
    let mut build = in_fuzz(&format!("build --release --bins --target {host}"));
    build.env("RUSTFLAGS", INSTRUMENTED);
    cargo::check(build)?;
    let chosen: Vec<&str> = if args.targets.is_empty() {
        ALL.to_vec()
    } else {
        args.targets.iter().map(String::as_str).collect()
    };
    for name in chosen {
        // What is found goes elsewhere: the corpus that is kept is small.
        let found = target_directory.join("found").join(name);
        std::fs::create_dir_all(&found)
            .with_context(|| format!("cannot make {}", found.display()))?;
        let mut search = Command::new(target_directory.join(&host).join("release").join(name));
        search.arg(&found).arg(folder.join("corpus").join(name));
        search.arg(format!("-max_total_time={}", args.seconds));
        search.arg(format!("-seed={}", args.seed));
        search.args(["-timeout=10", "-print_final_stats=1", "-verbosity=0"]);
        search.current_dir(&found);
        cargo::check(search)?;
    }
    Ok(())
}

fn host() -> anyhow::Result<String> {
    let output = Command::new("rustc").arg("-vV").output().context("cannot start `rustc -vV`")?;
    let said = String::from_utf8_lossy(&output.stdout);
    let line = said.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("`rustc -vV` does not name its host")?.to_owned())
}
