//! Compares the cost of the shipped crate on a microcontroller with the committed table `budgets.toml` and with fixed limits.
//!
//! A figure that differs from the committed one by more than 2 % fails, in either direction: an increase must be intended,
//! and a decrease must not be lost again. [`bless`] writes the new table, which is then committed. A limit that the
//! committed table meets must stay met.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::elf::Program;
use crate::program::{M0PLUS, M4F, M4F_SMALL, Target};
use crate::workspace::Workspace;
use crate::{cargo, emulator};

/// Largest relative difference of a figure from the committed one.
const TOLERANCE: f64 = 0.02;

/// Figures by section and key.
type Table = BTreeMap<String, BTreeMap<String, u32>>;

/// The targets, with the names of their sections.
const TARGETS: [(&str, Target); 3] =
    [("cortex-m4f", M4F), ("cortex-m4f-small", M4F_SMALL), ("cortex-m0plus", M0PLUS)];

/// A limit of a figure, whatever is committed.
struct Bar {
    section: &'static str,
    key: &'static str,
    most: u32,
    why: &'static str,
}

const BARS: [Bar; 11] = [
    Bar {
        section: "cortex-m4f",
        key: "predict_instructions",
        most: 460,
        why: "state and P of a tick of the encoders at 1 kHz should take about 1 % of a 48 MHz core: 450, and 10 to ask for a mount",
    },
    Bar {
        section: "cortex-m4f",
        key: "update_instructions",
        most: 420,
        why: "an update should cost no more than a predict",
    },
    Bar {
        section: "cortex-m4f",
        key: "fix_instructions",
        most: 2_200,
        why: "a fix, its explanation and the health together should take 2,000 instructions, and 200 with a mount",
    },
    Bar {
        section: "cortex-m4f",
        key: "core_text_bytes",
        most: 8192,
        why: "predict, gate, update and sine belong in a quarter of a 32 KiB flash",
    },
    Bar {
        section: "cortex-m4f-small",
        key: "core_text_bytes",
        most: 3072,
        why: "the same where flash is short",
    },
    Bar {
        section: "cortex-m4f",
        key: "filter_bytes",
        most: 248,
        why: "a filter should be copied as a value: 184 bytes, and 64 for a mount",
    },
    Bar {
        section: "cortex-m4f",
        key: "slice_instructions",
        most: 5_000,
        why: "two evaluations of the search should delay a poll by less than a millisecond at 16 MHz",
    },
    Bar {
        section: "cortex-m4f",
        key: "search_bytes",
        most: 4_096,
        why: "the search should fit into the RAM of a small controller",
    },
    Bar {
        section: "cortex-m4f",
        key: "search_text_bytes",
        most: 16_384,
        why: "the search belongs in a quarter of a 64 KiB flash",
    },
    Bar {
        section: "cortex-m0plus",
        key: "fix_instructions",
        most: 45_000,
        why: "a fix in software should take less than a hundredth of a period of 100 ms at 48 MHz",
    },
    Bar {
        section: BUILDING,
        key: "aim_1000_walls_instructions",
        most: 20_000,
        why: "an aim must fit between two ticks of the encoders",
    },
];

/// The section of the aims in buildings.
const BUILDING: &str = "cortex-m4f-building";
/// Largest ratio of the instructions of an aim among 100,000 walls to those among 100.
const LARGE_PER_SMALL: f64 = 1.2;
/// Largest ratio of the instructions of a call optimised for size to those optimised for speed.
const SMALL_PER_FAST: f64 = 1.5;

const HEADER: &str = "\
# The cost of the shipped crate: `cargo xtask bless` writes this file, `cargo xtask budgets` compares.
# Its changes are reviewed like code. `docs/benchmarks.md` describes the measurement.
# Instructions and stack: of the worst call on an emulated board, without the overhead of the call.
# Text: all functions that can be reached from the calls, in a linked program.
";

/// Measures and compares.
pub fn check() -> anyhow::Result<()> {
    let measured = measure()?;
    let committed = committed()?;
    let mut faults = differences(&committed, &measured);
    faults.extend(lost_bars(&committed, &measured));
    if !faults.is_empty() {
        bail!(
            "{} past budget:\n  {}\nIf that is intended, run `cargo xtask bless` and commit budgets.toml.",
            if faults.len() == 1 { "one figure" } else { "figures" },
            faults.join("\n  ")
        );
    }
    print_not_reached(&measured);
    eprintln!("within budget");
    Ok(())
}

/// Measures and writes the table, unless a limit would be lost that the committed table meets.
pub fn bless() -> anyhow::Result<()> {
    let measured = measure()?;
    let lost = lost_bars(&committed().unwrap_or_default(), &measured);
    if !lost.is_empty() {
        bail!(
            "budgets.toml is not written, because these limits are no longer met:\n  {}",
            lost.join("\n  ")
        );
    }
    fs::write(path(), format!("{HEADER}{}", written(&measured)))?;
    print_not_reached(&measured);
    Ok(())
}

fn committed() -> anyhow::Result<Table> {
    let text = fs::read_to_string(path()).with_context(|| path().display().to_string())?;
    toml::from_str(&text).context("cannot read budgets.toml")
}

fn figure(table: &Table, section: &str, key: &str) -> Option<u32> {
    table.get(section)?.get(key).copied()
}

/// The limits that the committed table meets and the figures exceed.
fn lost_bars(committed: &Table, measured: &Table) -> Vec<String> {
    let already = broken_bars(committed);
    let is_new = |name: &String| already.iter().all(|(other, _)| other != name);
    let broken = broken_bars(measured).into_iter();
    broken
        .filter(|(name, _)| is_new(name))
        .map(|(name, fault)| format!("{name}: {fault}"))
        .collect()
}

fn print_not_reached(measured: &Table) {
    for (name, fault) in broken_bars(measured) {
        eprintln!("not reached: {name}: {fault}");
    }
}

fn path() -> PathBuf {
    cargo::root().join("budgets.toml")
}

fn measure() -> anyhow::Result<Table> {
    let mut table = Table::new();
    for (section, target) in TARGETS {
        target.build(Workspace::Emulated, "emulated-probe")?;
        table.insert(section.to_owned(), measure_on(&target)?);
    }
    M4F.build(Workspace::Emulated, "emulated-building")?;
    let report = emulator::run(&M4F, Workspace::Emulated, "building")?;
    let figures = ["100", "1000", "10000", "100000"].into_iter().map(|walls| {
        let key = format!("aim_{walls}_walls");
        let most = report.cost(&key)?.most_instructions;
        Ok((format!("{key}_instructions"), most))
    });
    table.insert(BUILDING.to_owned(), figures.collect::<anyhow::Result<_>>()?);
    Ok(table)
}

fn measure_on(target: &Target) -> anyhow::Result<BTreeMap<String, u32>> {
    let mut figures = BTreeMap::new();
    let programs = [
        ("filter", "core_and_expect", &["predict", "expect", "gate", "update"][..]),
        ("localizer", "localizer", &["odometry", "aim", "fix"][..]),
        ("rangers", "rangers", &["light_aim", "light_fix", "pair_aim", "pair_fix"][..]),
        ("gyro", "gyro", &["turn", "turn_fix"][..]),
        ("absolute", "absolute", &["heading", "pose"][..]),
        ("search", "search", &["slice", "ping"][..]),
    ];
    for (name, code, calls) in programs {
        let report = emulator::run(target, Workspace::Emulated, name)?;
        for call in calls {
            let cost = report.cost(call)?;
            figures.insert(format!("{call}_instructions"), cost.most_instructions);
            figures.insert(format!("{call}_stack_bytes"), cost.most_stack);
        }
        figures.insert(format!("{name}_bytes"), report.number("object")?);
        if name == "search" {
            figures.insert("slice_mean_instructions".to_owned(), report.number("slice_mean")?);
        }
        let program = Program::read(&target.program(Workspace::Emulated, name))?;
        let mut text = |code: &str, calls: &[&str]| -> anyhow::Result<()> {
            let roots: Vec<String> = calls.iter().map(|call| format!("probe_{call}")).collect();
            let roots: Vec<&str> = roots.iter().map(String::as_str).collect();
            let bytes = u32::try_from(program.reach(&roots)?.bytes())?;
            figures.insert(format!("{code}_text_bytes"), bytes);
            Ok(())
        };
        text(code, calls)?;
        if name == "filter" {
            text("core", &["predict", "gate", "update"])?;
        }
    }
    Ok(figures)
}

/// The figures that differ by more than the tolerance or exist on one side only, one line each.
fn differences(committed: &Table, measured: &Table) -> Vec<String> {
    let keys = |table: &Table| -> Vec<(String, String)> {
        let key_of = |section: &String, key: &String| (section.clone(), key.clone());
        table.iter().flat_map(|(s, figures)| figures.keys().map(move |k| key_of(s, k))).collect()
    };
    let figure = |table: &Table, (section, key): &(String, String)| {
        table.get(section).and_then(|figures| figures.get(key)).copied()
    };
    let mut all = keys(committed);
    all.extend(keys(measured));
    all.sort();
    all.dedup();
    all.iter()
        .filter_map(|at| {
            let (section, key) = at;
            let fault = match (figure(committed, at), figure(measured, at)) {
                (Some(was), Some(is)) => difference(was, is)?,
                (Some(was), None) => format!("committed {was}, no longer measured"),
                (None, is) => format!("measured {}, not committed", is.unwrap_or_default()),
            };
            Some(format!("{section} {key}: {fault}"))
        })
        .collect()
}

fn difference(was: u32, is: u32) -> Option<String> {
    let share = (f64::from(is) - f64::from(was)) / f64::from(was.max(1));
    let verdict = if share > 0.0 { "worse" } else { "better, keep it" };
    (share.abs() > TOLERANCE)
        .then(|| format!("committed {was}, measured {is} ({:+.1} %: {verdict})", 100.0 * share))
}

/// The limits that the figures exceed, with the figures.
fn broken_bars(figures: &Table) -> Vec<(String, String)> {
    let mut broken = Vec::new();
    for Bar { section, key, most, why } in BARS {
        let name = format!("{section} {key}");
        match figure(figures, section, key) {
            Some(is) if is <= most => {}
            Some(is) => broken.push((name, format!("measured {is}, bar {most}: {why}"))),
            None => broken.push((name, format!("not measured, bar {most}"))),
        }
    }
    let at = |section: &str, key: &str| figure(figures, section, key).map(f64::from);
    let mut ratio = |name: &str, is: Option<f64>, than: Option<f64>, most: f64, why: &str| {
        let (Some(is), Some(than)) = (is, than) else { return };
        if is / than > most {
            let fault = format!("{is} to {than}: {:.2} times, bar {most}: {why}", is / than);
            broken.push((name.to_owned(), fault));
        }
    };
    for call in ["predict", "update"] {
        let key = format!("{call}_instructions");
        let (small, fast) = (at("cortex-m4f-small", &key), at("cortex-m4f", &key));
        let why = "the optimiser should have little to do";
        ratio(&format!("{call} at `s`"), small, fast, SMALL_PER_FAST, why);
    }
    let aim = |walls: u32| at(BUILDING, &format!("aim_{walls}_walls_instructions"));
    let why = "an aim should not cost more in a larger building";
    ratio("aim by walls", aim(100_000), aim(100), LARGE_PER_SMALL, why);
    broken
}

fn written(table: &Table) -> String {
    let mut text = String::new();
    for (section, figures) in table {
        // Writing to a string does not fail.
        let _ = writeln!(text, "\n[{section}]");
        for (key, figure) in figures {
            let _ = writeln!(text, "{key} = {figure}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(section: &str, figures: &[(&str, u32)]) -> Table {
        let figures = figures.iter().map(|&(key, figure)| (key.to_owned(), figure)).collect();
        Table::from([(section.to_owned(), figures)])
    }

    #[test]
    fn two_percent_pass_and_more_fails_with_both_figures() {
        let committed = table("m", &[("predict_instructions", 1000)]);
        for within in [980, 1000, 1020] {
            let measured = table("m", &[("predict_instructions", within)]);
            assert!(differences(&committed, &measured).is_empty(), "{within}");
        }
        for (past, share) in [(979, "-2.1 %"), (1021, "+2.1 %")] {
            let measured = table("m", &[("predict_instructions", past)]);
            let [fault] = &differences(&committed, &measured)[..] else { panic!("{past}") };
            for part in ["m predict_instructions", "1000", &past.to_string(), share] {
                assert!(fault.contains(part), "{fault}");
            }
        }
    }

    #[test]
    fn a_figure_on_one_side_only_fails() {
        let one = table("m", &[("a", 1)]);
        let none = table("m", &[]);
        assert_eq!(differences(&one, &none).len(), 1);
        assert_eq!(differences(&none, &one).len(), 1);
    }

    #[test]
    fn an_increase_from_zero_fails() {
        assert!(difference(0, 8).is_some() && difference(0, 0).is_none());
    }

    #[test]
    fn a_written_table_reads_back() {
        let table = table("cortex-m4f", &[("a", 1), ("b", 2)]);
        let text = format!("{HEADER}{}", written(&table));
        assert_eq!(toml::from_str::<Table>(&text).unwrap(), table);
    }

    /// A table that just meets every limit.
    fn on_the_bars() -> Table {
        let mut table = Table::new();
        for Bar { section, key, most, .. } in BARS {
            table.entry(section.to_owned()).or_default().insert(key.to_owned(), most);
        }
        table
    }

    fn set(table: &mut Table, section: &str, key: &str, is: u32) {
        table.entry(section.to_owned()).or_default().insert(key.to_owned(), is);
    }

    #[test]
    fn a_limit_once_met_stays_met() {
        let good = on_the_bars();
        assert!(broken_bars(&good).is_empty());
        for Bar { section, key, most, .. } in BARS {
            let mut bad = good.clone();
            set(&mut bad, section, key, most + 1);
            let [fault] = &lost_bars(&good, &bad)[..] else { panic!("{key}") };
            assert!(fault.contains(&most.to_string()) && fault.contains(&(most + 1).to_string()));
            assert!(lost_bars(&bad, &bad).is_empty(), "{key}, not reached before");
            bad.get_mut(section).unwrap().remove(key);
            assert_eq!(lost_bars(&good, &bad).len(), 1, "{key} missing");
        }
    }

    #[test]
    fn ratios_have_bars() {
        let good = on_the_bars();
        let mut bad = good.clone();
        set(&mut bad, "cortex-m4f-small", "predict_instructions", 691);
        assert_eq!(lost_bars(&good, &bad).len(), 1);
        let mut bad = good.clone();
        for (walls, is) in [(100, 1000), (100_000, 1201)] {
            set(&mut bad, BUILDING, &format!("aim_{walls}_walls_instructions"), is);
        }
        assert_eq!(lost_bars(&good, &bad).len(), 1);
    }
}
