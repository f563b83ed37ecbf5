//! `cargo xtask mutants`: mutation tests of the core and of the application with the mutants of cargo-mutants.
//! `docs/mutation.md` has the results.
//!
//! cargo-mutants builds once for each mutant. This builds once for all: in a copy of the repository each mutant has a
//! condition that a variable of the environment makes true. A mutant is then tried with the tests that reach it, the
//! shortest first.

mod copy;
mod edits;
mod mutant;
mod reasons;
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;

use crate::cargo;
use mutant::Mutant;
use reasons::Reasons;
use tests::{Effort, End, Program, Test};

/// Tests up to this time run before all others, in one process.
const SHORT: Duration = Duration::from_millis(300);

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Only the mutants of these files, as globs.
    #[arg(long)]
    file: Vec<String>,
    /// Cases of each property test. Few find most mutants quickly.
    #[arg(long)]
    cases: Option<u32>,
    /// Tests that take longer, in seconds, are left out.
    #[arg(long)]
    longest: Option<u64>,
    /// Only the mutants that survived before, with more cases and with the tests that take long.
    #[arg(long)]
    survivors: bool,
    /// Only the tests whose name contains one of these: for the survivors of the others, after new tests.
    #[arg(long)]
    tests: Vec<String>,
    /// Also those that have a result.
    #[arg(long)]
    again: bool,
    /// Only prints the results.
    #[arg(long)]
    results: bool,
}

/// The result of a mutant, in one word, and what follows.
type Results = BTreeMap<String, String>;

pub fn run(args: &Args) -> anyhow::Result<()> {
    // All are built, so that another choice of files needs no other build.
    let mutants: Vec<(u32, Mutant)> = (1..).zip(mutant::list(None)?).collect();
    let mut results = read_results();
    if !args.results {
        measure(args, &mutants, &mut results)?;
    }
    print!("{}", table(&mutants, &results, &reasons::read()?)?);
    Ok(())
}

fn measure(args: &Args, mutants: &[(u32, Mutant)], results: &mut Results) -> anyhow::Result<()> {
    let built = copy::make(mutants)?;
    let programs = tests::build()?;
    let (cases, sequences, longest) = if args.survivors { (64, 4_000, 20) } else { (8, 200, 2) };
    let effort = Effort {
        cases: args.cases.unwrap_or(cases),
        sequences,
        longest: Duration::from_secs(args.longest.unwrap_or(longest)),
    };
    let mut tests = Vec::new();
    for (index, program) in programs.iter().enumerate() {
        tests.extend(program.tests(index, &args.tests, effort)?);
    }
    tests.sort_by_key(|test| test.time);
    eprintln!("{} mutants, {} built, {} tests", mutants.len(), built.len(), tests.len());
    for (number, mutant) in chosen(args, mutants)? {
        let known = results.get(&mutant.key);
        let is_survivor = known.is_some_and(|result| result.starts_with("survived"));
        if if args.survivors { !is_survivor } else { known.is_some() && !args.again } {
            continue;
        }
        let result = if built.contains(&number) {
            result(number, &programs, &tests, effort)?
        } else {
            "unbuilt".to_owned()
        };
        eprintln!("{result}: {}", mutant.name);
        record(&mutant.key, &result)?;
        results.insert(mutant.key.clone(), result);
    }
    Ok(())
}

/// The mutants of the chosen files, in the order of these.
fn chosen<'a>(args: &Args, mutants: &'a [(u32, Mutant)]) -> anyhow::Result<Vec<(u32, &'a Mutant)>> {
    let mut chosen = Vec::new();
    for file in &args.file {
        let names: BTreeSet<String> =
            mutant::list(Some(file.as_str()))?.into_iter().map(|it| it.key).collect();
        chosen.extend(mutants.iter().filter(|(_, mutant)| names.contains(&mutant.key)));
    }
    if args.file.is_empty() {
        chosen.extend(mutants);
    }
    Ok(chosen.into_iter().map(|(number, mutant)| (*number, mutant)).collect())
}

/// Tries a mutant.
fn result(
    number: u32,
    programs: &[Program],
    tests: &[Test],
    effort: Effort,
) -> anyhow::Result<String> {
    let reaching = tests.iter().filter(|test| test.reached.contains(&number));
    let (short, long): (Vec<&Test>, Vec<&Test>) = reaching.partition(|test| test.time < SHORT);
    let mut batches: Vec<(usize, Vec<&Test>)> = (0..programs.len())
        .map(|index| (index, short.iter().copied().filter(|test| test.program == index).collect()))
        .collect();
    batches.extend(long.into_iter().map(|test| (test.program, vec![test])));
    let mut tried = 0;
    for (program, batch) in batches {
        let (Some(program), false) = (programs.get(program), batch.is_empty()) else { continue };
        tried += batch.len();
        match program.with_mutant(number, &batch, effort)? {
            End::Passed => {}
            End::Failed(name) => return Ok(format!("caught by {name}")),
            End::TimedOut => return Ok("caught, a test did not end".to_owned()),
        }
    }
    Ok(format!("survived {tried} tests"))
}

fn results_file() -> PathBuf {
    cargo::target_folder().join("mutants.txt")
}

/// The results of earlier runs; the last one of a mutant counts.
fn read_results() -> Results {
    let text = std::fs::read_to_string(results_file()).unwrap_or_default();
    let lines = text.lines().filter_map(|line| line.split_once('\t'));
    lines.map(|(name, result)| (name.to_owned(), result.to_owned())).collect()
}

fn record(name: &str, result: &str) -> anyhow::Result<()> {
    let file = std::fs::OpenOptions::new().append(true).create(true).open(results_file());
    writeln!(file.context("results")?, "{name}\t{result}")?;
    Ok(())
}

/// The numbers of mutants of a file, by result.
#[derive(Debug, Default)]
struct Counts {
    all: u32,
    caught: u32,
    unbuilt: u32,
    explained: u32,
    unexplained: u32,
}

impl Counts {
    fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.caught += other.caught;
        self.unbuilt += other.unbuilt;
        self.explained += other.explained;
        self.unexplained += other.unexplained;
    }

    fn row(&self, name: &str) -> String {
        let Self { all, caught, unbuilt, explained, unexplained } = self;
        let left = all - caught - unbuilt - explained - unexplained;
        format!(
            "| {name} | {all} | {caught} | {unbuilt} | {explained} | {unexplained} | {left} |\n"
        )
    }
}

/// The numbers of each file, the survivors without a reason, and the reasons that no survivor needs.
fn table(
    mutants: &[(u32, Mutant)],
    results: &Results,
    reasons: &Reasons,
) -> anyhow::Result<String> {
    let mut files: BTreeMap<&str, Counts> = BTreeMap::new();
    let mut unexplained = String::new();
    let mut unused: BTreeSet<&String> = reasons.keys().collect();
    for (_, mutant) in mutants {
        let counts = files.entry(&mutant.file).or_default();
        let result = results.get(&mutant.key).map_or("", String::as_str);
        counts.all += 1;
        counts.caught += u32::from(result.starts_with("caught"));
        counts.unbuilt += u32::from(result.starts_with("unbuilt"));
        if !result.starts_with("survived") {
            continue;
        }
        if reasons.contains_key(&mutant.key) {
            unused.remove(&mutant.key);
            counts.explained += 1;
        } else {
            counts.unexplained += 1;
            writeln!(unexplained, "- {} ({result})", mutant.name)?;
        }
    }
    let mut text = String::from(
        "| file | mutants | caught | unbuilt | explained | unexplained | not tried |\n\
         |---|---|---|---|---|---|---|\n",
    );
    let mut all = Counts::default();
    for (file, counts) in files {
        all.add(&counts);
        text.push_str(&counts.row(&format!("`{file}`")));
    }
    text.push_str(&all.row("**all**"));
    write!(text, "\nUnexplained: {}\n{unexplained}", all.unexplained)?;
    write!(text, "\nReasons without a survivor: {}\n", unused.len())?;
    for key in unused {
        writeln!(text, "- {key}")?;
    }
    Ok(text)
}
