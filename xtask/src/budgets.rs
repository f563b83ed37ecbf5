//! What the shipped crate costs a microcontroller, against the committed table `budgets.toml` and
//! against bars that no table may be moved past.
//!
//! A figure that differs from the committed one by more than 2 % fails, to either side: what got
//! worse must be wanted, and what got better must be kept. Both are said by committing what
//! [`bless`] writes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::elf::Program;
use crate::program::{M0PLUS, M4F, M4F_SMALL, Target};
use crate::{cargo, emulator};

/// How much a figure may differ from the committed one, as a share of it.
const TOLERANCE: f64 = 0.02;

/// Figures by section and key.
type Table = BTreeMap<String, BTreeMap<String, u32>>;

/// What is measured for each, under the name of its section.
const TARGETS: [(&str, Target); 3] =
    [("cortex-m4f", M4F), ("cortex-m4f-small", M4F_SMALL), ("cortex-m0plus", M0PLUS)];

/// The most that a figure may be, whatever is committed.
struct Bar {
    section: &'static str,
    key: &'static str,
    most: u32,
    why: &'static str,
}

const BARS: [Bar; 6] = [
    Bar {
        section: "cortex-m4f",
        key: "six_states_instructions",
        most: 2600,
        why: "a sixth of what dense matrices cost at the same work",
    },
    Bar {
        section: "cortex-m4f",
        key: "predict_instructions",
        most: 400,
        why: "a tick of the encoders at 1 kHz should take less than 1 % of a 48 MHz core",
    },
    Bar {
        section: "cortex-m4f",
        key: "update_instructions",
        most: 400,
        why: "an update should cost no more than a predict",
    },
    Bar {
        section: "cortex-m4f",
        key: "core_text_bytes",
        most: 4096,
        why: "predict, expected range, gate, update and sine belong in an eighth of a 32 KiB flash",
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
        most: 200,
        why: "a filter should be copied as a value",
    },
];

/// Optimised for size a call may take so many times the instructions of one optimised for speed.
const SMALL_PER_FAST: f64 = 1.5;

const HEADER: &str = "\
# What the shipped crate costs: `cargo xtask bless` writes this file, `cargo xtask budgets` compares.
# Review a change of it like one of the code. `docs/benchmarks.md` says how each figure is measured.
# Instructions and stack: of the worst call on an emulated board, without what calling costs.
# Six states: ten predicts and one update of the work that `docs/benchmarks.md` compares.
# Text: all functions that can be reached from the calls, in a linked program.
";

/// Measures and compares.
pub fn check() -> anyhow::Result<()> {
    let measured = measure()?;
    let text = fs::read_to_string(path()).with_context(|| path().display().to_string())?;
    let committed: Table = toml::from_str(&text).context("cannot read budgets.toml")?;
    let mut faults = differences(&committed, &measured);
    faults.extend(broken_bars(&measured));
    if !faults.is_empty() {
        bail!(
            "{} past budget:\n  {}\nIf that is wanted, run `cargo xtask bless` and commit budgets.toml.",
            if faults.len() == 1 { "one figure" } else { "figures" },
            faults.join("\n  ")
        );
    }
    eprintln!("within budget");
    Ok(())
}

/// Measures and commits to it, as far as the bars allow.
pub fn bless() -> anyhow::Result<()> {
    let measured = measure()?;
    fs::write(path(), format!("{HEADER}{}", written(&measured)))?;
    let broken = broken_bars(&measured);
    if !broken.is_empty() {
        bail!(
            "budgets.toml is written, but no commit makes this right:\n  {}",
            broken.join("\n  ")
        );
    }
    Ok(())
}

fn path() -> PathBuf {
    cargo::root().join("budgets.toml")
}

fn measure() -> anyhow::Result<Table> {
    let mut table = Table::new();
    for (section, target) in TARGETS {
        target.build("bench-probe", "")?;
        target.build("bench-ours", "")?;
        table.insert(section.to_owned(), measure_on(&target)?);
    }
    Ok(table)
}

fn measure_on(target: &Target) -> anyhow::Result<BTreeMap<String, u32>> {
    let mut figures = BTreeMap::new();
    let programs = [
        ("filter", "core", &["predict", "expect", "gate", "update"][..]),
        ("localizer", "localizer", &["odometry", "aim", "fix"][..]),
    ];
    for (name, code, calls) in programs {
        let report = emulator::run(target, name)?;
        for call in calls {
            let cost = report.cost(call)?;
            figures.insert(format!("{call}_instructions"), cost.most_instructions);
            figures.insert(format!("{call}_stack_bytes"), cost.most_stack);
        }
        figures.insert(format!("{name}_bytes"), report.number("object")?);
        let text = Program::read(&target.program(name))?.reach("probe_")?.bytes();
        figures.insert(format!("{code}_text_bytes"), u32::try_from(text)?);
    }
    // The work that peers are compared at: ten predicts and one update of the six states.
    let six = emulator::run(target, "ours")?;
    let (predict, update) = (six.cost("predict")?, six.cost("update")?);
    figures.insert(
        "six_states_instructions".to_owned(),
        10 * predict.most_instructions + update.most_instructions,
    );
    Ok(figures)
}

/// What differs by more than the tolerance, or is on one side only, one line each.
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

/// The bars that the figures break, one line each.
fn broken_bars(measured: &Table) -> Vec<String> {
    let figure = |section: &str, key: &str| measured.get(section)?.get(key).copied();
    let mut broken = Vec::new();
    for Bar { section, key, most, why } in BARS {
        match figure(section, key) {
            Some(is) if is <= most => {}
            Some(is) => broken.push(format!("{section} {key}: measured {is}, bar {most}: {why}")),
            None => broken.push(format!("{section} {key}: not measured, bar {most}")),
        }
    }
    for call in ["predict", "update"] {
        let key = format!("{call}_instructions");
        let (fast, small) = (figure("cortex-m4f", &key), figure("cortex-m4f-small", &key));
        let (Some(fast), Some(small)) = (fast, small) else { continue };
        let ratio = f64::from(small) / f64::from(fast);
        if ratio > SMALL_PER_FAST {
            broken.push(format!(
                "{call}: {small} instructions at `s`, {fast} at 3: {ratio:.2} times, bar \
                 {SMALL_PER_FAST}: the optimiser should have little to do"
            ));
        }
    }
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
    fn what_grew_from_nothing_fails() {
        assert!(difference(0, 8).is_some() && difference(0, 0).is_none());
    }

    #[test]
    fn what_is_written_is_read_again() {
        let table = table("cortex-m4f", &[("a", 1), ("b", 2)]);
        let text = format!("{HEADER}{}", written(&table));
        assert_eq!(toml::from_str::<Table>(&text).unwrap(), table);
    }

    #[test]
    fn a_bar_cannot_be_blessed_away() {
        let mut good = Table::new();
        for Bar { section, key, most, .. } in BARS {
            good.entry(section.to_owned()).or_default().insert(key.to_owned(), most);
        }
        assert!(broken_bars(&good).is_empty());
        for Bar { section, key, most, .. } in BARS {
            let mut bad = good.clone();
            bad.get_mut(section).unwrap().insert(key.to_owned(), most + 1);
            let [fault] = &broken_bars(&bad)[..] else { panic!("{key}") };
            assert!(fault.contains(&most.to_string()) && fault.contains(&(most + 1).to_string()));
            bad.get_mut(section).unwrap().remove(key);
            assert_eq!(broken_bars(&bad).len(), 1, "{key} gone");
        }
        let small = good.get_mut("cortex-m4f-small").unwrap();
        small.insert("predict_instructions".to_owned(), 601);
        assert_eq!(broken_bars(&good).len(), 1);
    }
}
