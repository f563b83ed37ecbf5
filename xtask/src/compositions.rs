//! What a robot links: flash, memory and instructions of each composition of the localizer, `docs/compositions.md`.

use std::fmt::Write as _;
use std::fs;

use anyhow::{Context, bail};

use crate::cargo;
use crate::elf::Program;
use crate::emulator;
use crate::program::{M0PLUS_SMALL, M4F_SMALL, Target};
use crate::workspace::Workspace;

/// Options of `cargo xtask compositions`.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Compares with the page and the limits, and writes nothing.
    #[arg(long)]
    pub check: bool,
}

/// A composition, and the flash that it may take.
struct Composition {
    name: &'static str,
    contents: &'static str,
    program: &'static str,
    features: &'static str,
    probes: &'static [&'static str],
    /// Largest text on a Cortex-M4F, bytes.
    most: u64,
}

const LOCALIZER: &[&str] =
    &["probe_odometry", "probe_aim", "probe_fix", "probe_start", "probe_rest"];
const DRIVING: &[&str] =
    &["probe_odometry", "probe_aim", "probe_fix", "probe_start", "probe_rest", "probe_drive"];
const SEARCHING: &[&str] =
    &["probe_odometry", "probe_aim", "probe_fix", "probe_start", "probe_rest", "probe_search"];

const COMPOSITIONS: [Composition; 6] = [
    Composition {
        name: "paper robot",
        contents: "`Ekf`, nearest wall, gate: the example `paper_robot`",
        program: "paper_robot",
        features: "",
        probes: &["probe_odometry", "probe_aim", "probe_fix"],
        most: 6_144,
    },
    Composition {
        name: "sonar robot",
        contents: "`Localizer` with one sonar: `informative`",
        program: "composition",
        features: "informative",
        probes: LOCALIZER,
        most: 26_624,
    },
    Composition {
        name: "sonar robot that searches",
        contents: "the same with `sonarfix-search`",
        program: "composition",
        features: "informative,search",
        probes: SEARCHING,
        most: 49_152,
    },
    Composition {
        name: "sonar robot that drives",
        contents: "the sonar robot with `sonarfix-drive`: a route, objects on it, the speeds of two wheels",
        program: "composition",
        features: "informative,drive",
        probes: DRIVING,
        most: 32_768,
    },
    Composition {
        name: "without search",
        contents: "all features of `sonarfix`",
        program: "composition",
        features: "informative,mount,reflectors,rangers,gyro,light,absolute",
        probes: LOCALIZER,
        most: 49_152,
    },
    Composition {
        name: "everything",
        contents: "all features and `sonarfix-search`: the released firmware",
        program: "composition",
        features: "informative,mount,reflectors,rangers,gyro,light,absolute,search",
        probes: SEARCHING,
        most: 67_584,
    },
];

const TARGETS: [Target; 2] = [M4F_SMALL, M0PLUS_SMALL];
/// Largest relative difference of a figure from that of the page.
const TOLERANCE: f64 = 0.02;

const HEAD: &str = "\
# Compositions

A robot links what it has. Each part of the localizer is a feature of the crate `sonarfix`; where a feature is off, the parameters
of that part have no value, and the compiler removes every branch that depends on them. A configuration that asks for a part that
is not linked is refused by name when the robot starts.

`cargo xtask compositions` measures this table and writes this page. *Text* is the code that the calls of the localizer reach, *RAM*
the localizer with its search and its controllers. *Tick*, *aim* and *fix* are the instructions of the most expensive call in a drive through a room
of eight walls. All is built with `opt-level = \"s\"`, as the firmware of the boards.

";

const CHOOSING: &str = "\
## How to choose

| the robot has | features of `sonarfix` |
|---|---|
| one sonar | `informative`; without it the nearest wall is measured, as in the paper |
| a VL53L0X or VL53L1X | `light` |
| two or three rangers | `rangers` |
| a gyro | `gyro` |
| a compass, a beacon, a camera, or a person who taps on the map | `absolute` |
| a room with many corners and pillars | `reflectors`: they explain echoes that are not of the chosen wall |
| a mount that was measured with a ruler | `mount`; without it the mount is exact, and `prior.mount` must be zero |
| to find its pose by itself | the crate `sonarfix-search`; of `sonarfix-hal` and `sonarfix-app` the feature `search` |
| a PC that drives it | of `sonarfix-app` the feature `drive`, which is not a default: [link.md](link.md#driving) |
| a route that it drives by itself | the crate `sonarfix-drive`: [driving.md](driving.md) |

```toml
[dependencies]
sonarfix = { version = \"0.1\", default-features = false, features = [\"informative\"] }
```

All other features are on by default. The released firmware has all of those, so that one program serves every robot of a board.
";

/// The measured figures of a composition on a target.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Figures {
    text: u64,
    ram: u32,
    tick: u32,
    aim: u32,
    fix: u32,
}

/// Measures every composition; writes the page, or compares with it.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut table = String::new();
    let mut faults = Vec::new();
    for target in &TARGETS {
        let _ = writeln!(table, "## {}\n", target.name);
        table += "| composition | contents | text | RAM | tick | aim | fix |\n|---|---|---:|---:|---:|---:|---:|\n";
        for composition in &COMPOSITIONS {
            let figures = composition.measure(target)?;
            let Figures { text, ram, tick, aim, fix } = figures;
            let Composition { name, contents, most, .. } = composition;
            let row =
                format!("| {name} | {contents} | {text} | {ram} | {tick} | {aim} | {fix} |\n");
            eprint!("{row}");
            table += &row;
            if *target == M4F_SMALL && text > *most {
                faults.push(format!("{name}: {text} bytes of text, limit {most}"));
            }
        }
        table += "\n";
    }
    let page = format!("{HEAD}{table}{CHOOSING}");
    let path = cargo::root().join("docs/compositions.md");
    if args.check {
        let committed = fs::read_to_string(&path).context("docs/compositions.md")?;
        faults.extend(differences(&committed, &page));
    } else {
        fs::write(&path, page)?;
    }
    if faults.is_empty() {
        return Ok(());
    }
    bail!("{}\n`cargo xtask compositions` writes the page.", faults.join("\n"))
}

impl Composition {
    fn measure(&self, target: &Target) -> anyhow::Result<Figures> {
        let Target { triple, profile, .. } = target;
        let Self { program, features, .. } = self;
        let mut command = Workspace::Emulated.cargo(&format!(
            "build --quiet --package emulated-probe --bin {program} --target {triple} --profile {profile}"
        ));
        command.args(["--no-default-features", "--features", features]);
        cargo::check(command)?;
        let report = emulator::run(target, Workspace::Emulated, program)?;
        let most = |call: &str| report.cost(call).map(|cost| cost.most_instructions);
        let linked = Program::read(&target.program(Workspace::Emulated, program))?;
        Ok(Figures {
            text: linked.reach(self.probes)?.bytes(),
            ram: report.number("object")?,
            tick: most("odometry")?,
            aim: most("aim")?,
            fix: most("fix")?,
        })
    }
}

/// The lines of the page that differ from the measured ones by more than the tolerance.
fn differences(committed: &str, measured: &str) -> Vec<String> {
    let is_close = |one: &str, other: &str| match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) => (one - other).abs() <= TOLERANCE * one.abs(),
        _ => one == other,
    };
    let agree = |one: &str, other: &str| {
        let (one, other): (Vec<_>, Vec<_>) =
            (one.split_whitespace().collect(), other.split_whitespace().collect());
        one.len() == other.len() && one.iter().zip(&other).all(|(one, other)| is_close(one, other))
    };
    if committed.lines().count() != measured.lines().count() {
        return vec!["docs/compositions.md has other lines than the measured page".into()];
    }
    let pairs = committed.lines().zip(measured.lines());
    pairs
        .filter(|(one, other)| !agree(one, other))
        .map(|(one, other)| format!("committed {one}\n measured {other}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_may_differ_by_two_percent_and_a_word_not_at_all() {
        assert!(differences("| a | 1000 |\n", "| a | 1020 |\n").is_empty());
        assert_eq!(differences("| a | 1000 |\n", "| a | 1021 |\n").len(), 1);
        assert_eq!(differences("| a | 1000 |\n", "| b | 1000 |\n").len(), 1);
        assert_eq!(differences("| a |\n", "| a |\n| b |\n").len(), 1);
    }
}
