//! The C library: its header, its programs on this computer and on emulated cores, its size.
//!
//! | module | |
//! |---|---|
//! | `header` | the generated header, and what its comments must say |
//! | `programs` | compilers, and the programs of `c/` |
//! | `size` | code of a linked program, and that it contains no panic |

mod header;
mod programs;
mod size;

use std::path::PathBuf;

use anyhow::Context;

use crate::cargo;
use crate::workspace::Workspace;
use programs::{CORES, Core, Host};

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Writes the header instead of comparing it.
    #[arg(long)]
    write: bool,
    /// Random calls of the test of abuse.
    #[arg(long, default_value_t = 300_000)]
    calls: u64,
    /// Their seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Args {
    /// Those of CI.
    pub const CHECK: Self = Self { write: false, calls: 300_000, seed: 1 };
}

/// The golden traces whose devices a C program can have.
const TRACES: [&str; 5] = ["localizer", "loop", "search", "gyro", "absolute"];

pub fn run(args: &Args) -> anyhow::Result<()> {
    header::run(args.write)?;
    cargo::check(Workspace::C.cargo("fmt --check"))?;
    cargo::check(Workspace::C.cargo("clippy --release -- -D warnings"))?;
    let traces = traces()?;
    on_this_computer(args, &traces)?;
    let portable = portable()?;
    for trace in &traces {
        programs::replay_portably(&portable, trace)?;
    }
    for core in &CORES {
        for library in [core.build("full")?, core.compile_portable(&portable)?] {
            for trace in &traces {
                core.replay(&library, trace)?;
            }
        }
    }
    if let ([core, ..], [trace, ..]) = (&CORES, traces.as_slice()) {
        for library in [core.build("full")?, core.compile_portable(&portable)?] {
            core.print_cost(&library, trace)?;
        }
    }
    size::check(&CORES)
}

/// The portable source of all parts.
fn portable() -> anyhow::Result<PathBuf> {
    let file = Workspace::C.target_folder().join("portable.c");
    let mut command =
        Workspace::C.cargo("run --quiet --package sonarfix-dist -- portable --features full --out");
    command.arg(&file);
    cargo::check(command).map(|()| file)
}

/// The traces in the form that the C programs read, as files.
fn traces() -> anyhow::Result<Vec<PathBuf>> {
    let folder = Workspace::C.target_folder();
    std::fs::create_dir_all(&folder).context("cannot create the folder of the C programs")?;
    let convert = |name: &&str| {
        let file = folder.join(format!("{name}.trace"));
        let mut command =
            cargo::command("run --quiet --package sonarfix-pil-host --example golden_in_c --");
        command.arg(cargo::root().join(format!("tests/golden/{name}.golden"))).arg(&file);
        cargo::check(command).map(|()| file)
    };
    TRACES.iter().map(convert).collect()
}

/// The programs in C and C++, the traces, and the hostile calls, with sanitizers.
fn on_this_computer(args: &Args, traces: &[PathBuf]) -> anyhow::Result<()> {
    for composition in ["small", "full"] {
        let host = Host::build("release", composition)?;
        host.run_example()?;
    }
    let host = Host::build("release", "full")?;
    host.turn_while_searching()?;
    for trace in traces {
        host.replay(trace)?;
    }
    host.replay_in_cpp(traces.first().context("there is no trace")?)?;
    Host::build("checked", "full")?.call_hostilely(args.calls, args.seed)
}
