//! Measures the figures that README and pages quote, and writes them between their markers.
//!
//! `docs/figures.toml` lists the figures: the page, the commands that measure them, and the rows of the table. A page has the
//! place of a figure between `<!-- figures: NAME -->` and `<!-- end -->`; nobody edits what is in between.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use anyhow::{Context, ensure};
use serde::Deserialize;
use serde_json::Value;

use crate::cargo;

/// The list of all figures.
const LIST: &str = "docs/figures.toml";
const BEGIN: &str = "<!-- figures: ";
const END: &str = "<!-- end -->";

/// Which figures are measured.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Compares the exact figures with the pages and writes nothing.
    #[arg(long, conflicts_with = "long")]
    check: bool,
    /// Renews the figures that need long statistics, too (hours).
    #[arg(long)]
    long: bool,
    /// Only the figures with these names.
    names: Vec<String>,
}

impl Args {
    /// The comparison of CI.
    pub const CHECK: Self = Self { check: true, long: false, names: Vec::new() };

    fn includes(&self, name: &str, figure: &Figure) -> bool {
        (self.long || !figure.long)
            && (self.names.is_empty() || self.names.iter().any(|n| n == name))
    }
}

/// A figure of the list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    /// The page, from the root of the repository.
    page: String,
    /// The commands print the page; the block at its end states them.
    #[serde(default)]
    whole: bool,
    /// Needs long statistics: not compared, and written with commit and date.
    #[serde(default)]
    long: bool,
    /// The head of the table.
    #[serde(default)]
    head: String,
    /// The row of each part, with `{label}` for that of the part.
    row: Option<String>,
    part: Vec<Part>,
}

/// A command and what the figure takes of its output.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    /// A command line, in which `$NAME` is a variable of the environment; or a TOML file of the repository.
    run: String,
    #[serde(default)]
    label: String,
    /// Rows of the table, filled from JSON or TOML by [`filled`].
    #[serde(default)]
    rows: Vec<String>,
}

/// Measures the figures and writes or compares them.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let list = fs::read_to_string(cargo::root().join(LIST))?;
    let figures: BTreeMap<String, Figure> = toml::from_str(&list).context(LIST)?;
    let mut faults = Vec::new();
    for (name, figure) in figures.iter().filter(|(name, figure)| args.includes(name, figure)) {
        if let Err(error) = figure.renew(name, args.check) {
            faults.push(format!("{name} in {}: {error:#}", figure.page));
        }
    }
    ensure!(faults.is_empty(), "figures:\n  {}", faults.join("\n  "));
    Ok(())
}

impl Figure {
    /// Writes the figure into its page, or compares it with the page.
    fn renew(&self, name: &str, check: bool) -> anyhow::Result<()> {
        let path = cargo::root().join(&self.page);
        let page = fs::read_to_string(&path)?;
        let renewed = self.renewed(name, &page)?;
        if renewed != page {
            ensure!(!check, "is not what the commands give: run `cargo xtask figures {name}`");
            fs::write(&path, renewed)?;
            println!("written: {name} in {}", self.page);
        }
        Ok(())
    }

    /// The page with the figure as it is now.
    fn renewed(&self, name: &str, page: &str) -> anyhow::Result<String> {
        let mut table = String::new();
        if !self.head.is_empty() {
            let columns = self.head.matches('|').count() - 1;
            writeln!(table, "{}\n|{}", self.head, "---|".repeat(columns))?;
        }
        let mut page = page.to_owned();
        for part in &self.part {
            let output = part.output()?;
            let own = self.row.as_ref().map(|row| row.replace("{label}", &part.label));
            let rows: Vec<_> = part.rows.iter().cloned().chain(own).collect();
            if self.whole {
                page = format!("{}\n\n{BEGIN}{name} -->\n{END}\n", output.trim_end());
            } else if rows.is_empty() {
                table += &tables(&output);
            } else {
                let value = part.value(&output)?;
                for row in rows {
                    writeln!(table, "{}", filled(&row, &value)?)?;
                }
            }
        }
        let source = self.source()?;
        let gap = if table.is_empty() { "" } else { "\n" };
        replaced(&page, name, &format!("{table}{gap}{source}"))
    }

    /// The commands as a block; of long statistics with commit and date.
    fn source(&self) -> anyhow::Result<String> {
        let mut source = String::new();
        if self.long {
            let mut git = Command::new("git");
            git.current_dir(cargo::root()).args(["log", "-1", "--format=Commit %h, %cs:"]);
            writeln!(source, "{}\n", cargo::printed(git)?.trim())?;
        }
        if let [part] = self.part.as_slice()
            && part.is_file()
        {
            return Ok(format!("From `{}`.\n", part.run));
        }
        let commands: Vec<&str> = self.part.iter().map(|part| part.run.as_str()).collect();
        writeln!(source, "```sh\n{}\n```", commands.join("\n"))?;
        Ok(source)
    }
}

impl Part {
    /// What the command prints, or the text of the file.
    fn output(&self) -> anyhow::Result<String> {
        let words = self.run.split_whitespace().map(|word| match word.strip_prefix('$') {
            Some(variable) => std::env::var(variable).with_context(|| format!("{word} is not set")),
            None => Ok(word.to_owned()),
        });
        let words: Vec<String> = words.collect::<anyhow::Result<_>>()?;
        let (program, arguments) = words.split_first().context("an empty command")?;
        if self.is_file() {
            return Ok(fs::read_to_string(cargo::root().join(program))?);
        }
        let mut command = match program.as_str() {
            "sonarfix" | "sonarfix-studies" => {
                cargo::command(&format!("run --quiet --release --bin {program} --"))
            }
            _ => Command::new(program),
        };
        command.current_dir(cargo::root()).args(arguments);
        cargo::printed(command)
    }

    fn is_file(&self) -> bool {
        cargo::root().join(&self.run).is_file()
    }

    /// The output as a value, from TOML or JSON.
    fn value(&self, output: &str) -> anyhow::Result<Value> {
        if self.is_file() { Ok(toml::from_str(output)?) } else { Ok(serde_json::from_str(output)?) }
    }
}

/// The tables of a text in Markdown.
fn tables(text: &str) -> String {
    let mut tables = String::new();
    let mut is_inside = false;
    for line in text.lines() {
        if line.starts_with('|') {
            if !is_inside && !tables.is_empty() {
                tables.push('\n');
            }
            tables.push_str(line);
            tables.push('\n');
        }
        is_inside = line.starts_with('|');
    }
    tables
}

/// The page with another text between the markers of a figure.
fn replaced(page: &str, name: &str, text: &str) -> anyhow::Result<String> {
    let begin = format!("{BEGIN}{name} -->\n");
    let (before, rest) = page.split_once(&begin).with_context(|| format!("no line `{begin}`"))?;
    let (_, after) = rest.split_once(END).with_context(|| format!("no `{END}` after it"))?;
    Ok(format!("{before}{begin}{text}{END}{after}"))
}

/// A row with each `{PATH*FACTOR:FORMAT}` or `{PATH/DIVISOR:FORMAT}` replaced by a number of the value. The parts of the path
/// are separated by dots; factor and format may be missing.
fn filled(row: &str, value: &Value) -> anyhow::Result<String> {
    let mut text = String::new();
    let mut rest = row;
    while let Some((before, after)) = rest.split_once('{') {
        let (place, after) = after.split_once('}').context("no `}`")?;
        text += before;
        text += &number(place, value).with_context(|| format!("{{{place}}}"))?;
        rest = after;
    }
    Ok(text + rest)
}

fn number(place: &str, value: &Value) -> anyhow::Result<String> {
    let (place, format) = place.split_once(':').unwrap_or((place, "0"));
    let (path, factor) = match (place.split_once('*'), place.split_once('/')) {
        (Some((path, factor)), _) => (path, factor.parse()?),
        (_, Some((path, divisor))) => (path, 1.0 / divisor.parse::<f64>()?),
        _ => (place, 1.0),
    };
    let pointer = format!("/{}", path.replace('.', "/"));
    let number = value.pointer(&pointer).context("is not in the output")?;
    // JSON has no NaN: what is unknown is null.
    let Some(number) = number.as_f64() else { return Ok("–".to_owned()) };
    shown(number * factor, format)
}

/// A number with so many digits (`2`), with its thousands apart (`,`), or with an exponent (`e2`).
fn shown(number: f64, format: &str) -> anyhow::Result<String> {
    let size = number.abs();
    let text = match format.strip_prefix('e') {
        Some(digits) => format!("{size:.*e}", digits.parse()?),
        None if format == "," => thousands(&format!("{size:.0}")),
        None => format!("{size:.*}", format.parse()?),
    };
    // No negative zero.
    let is_negative = number < 0.0 && text.contains(|c| matches!(c, '1'..='9'));
    Ok(if is_negative { format!("−{text}") } else { text })
}

fn thousands(digits: &str) -> String {
    let gap = |i: usize| i > 0 && (digits.len() - i).is_multiple_of(3);
    let spaced = digits.chars().enumerate();
    spaced.flat_map(|(i, digit)| gap(i).then_some(',').into_iter().chain([digit])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_take_numbers_by_path_factor_and_format() {
        let value = serde_json::json!({ "a": [{ "rms": 0.01234 }], "n": 1_234_567, "x": null });
        let row = "| {a.0.rms*1000:1} | {n:,} | {a.0.rms:e1} | {x} | {n/-1e9:2} |";
        assert_eq!(filled(row, &value).unwrap(), "| 12.3 | 1,234,567 | 1.2e-2 | – | 0.00 |");
        assert_eq!(shown(-1.26, "1").unwrap(), "−1.3");
        assert!(filled("{missing}", &value).is_err());
    }

    #[test]
    fn only_the_text_between_the_markers_of_the_name_changes() {
        let page = "a\n<!-- figures: x -->\nold\n<!-- end -->\n<!-- figures: y -->\n<!-- end -->\n";
        let is = replaced(page, "x", "new\n").unwrap();
        assert_eq!(is, page.replace("old", "new"));
        assert!(replaced(page, "z", "").is_err());
    }

    #[test]
    fn tables_are_found_in_what_a_command_prints() {
        assert_eq!(tables("── run\n| a |\n|---|\n\ntext\n| b |\n"), "| a |\n|---|\n\n| b |\n");
    }

    /// A marker without a figure would never be renewed, and a figure without a marker fails after hours.
    #[test]
    fn pages_and_list_have_the_same_figures() {
        let root = cargo::root();
        let list = fs::read_to_string(root.join(LIST)).unwrap();
        let figures: BTreeMap<String, Figure> = toml::from_str(&list).unwrap();
        let listed: Vec<_> =
            figures.iter().map(|(name, figure)| (root.join(&figure.page), name.clone())).collect();
        let mut marked = Vec::new();
        let pages = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
        let pages = pages.filter(|path| path.extension().is_some_and(|end| end == "md"));
        for path in pages.chain([root.join("README.md")]) {
            let text = fs::read_to_string(&path).unwrap();
            for line in text.lines().filter_map(|line| line.strip_prefix(BEGIN)) {
                marked.push((path.clone(), line.trim_end_matches(" -->").to_owned()));
            }
        }
        marked.sort_by(|one, other| one.1.cmp(&other.1));
        assert_eq!(marked, listed);
    }
}
