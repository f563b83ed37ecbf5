//! Which runs a file holds.

use std::fmt::{self, Write};
use std::str::FromStr;

use anyhow::{Context, bail, ensure};
use sonarfix_files::Checksum;
use sonarfix_map::Scenario;
use sonarfix_sim::row::Row;

/// The rows of a file, in the order of their seeds.
pub type Rows = Box<dyn Iterator<Item = anyhow::Result<Row>>>;

/// A part of all runs: the `index`-th of `of`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `of`.
    pub index: u32,
    /// Number of shards.
    pub of: u32,
}

impl Shard {
    /// All runs in one.
    pub const ALL: Self = Self { index: 1, of: 1 };
}

impl FromStr for Shard {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let parts = text.split_once('/').context("a shard is I/M, like 3/8")?;
        let number = |part: &str| part.parse().context("a shard is I/M, like 3/8");
        let shard = Self { index: number(parts.0)?, of: number(parts.1)? };
        ensure!(
            (1..=shard.of).contains(&shard.index),
            "the shards of {text} count from 1 to {}",
            shard.of
        );
        Ok(shard)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// The runs of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Checksum of the scenario and of the version of this package: rows of different ones are not merged.
    pub scenario: u64,
    /// Seed of the first run of all shards.
    pub seed: u64,
    /// Number of runs of all shards.
    pub runs: u32,
    /// The shard in this file.
    pub shard: Shard,
}

/// The start of the first line of a file.
const MAGIC: &str = "# sonarfix rows, format 2";

impl Plan {
    /// The plan of a shard of a scenario's runs.
    #[must_use]
    pub fn new(scenario: &Scenario, seed: u64, runs: u32, shard: Shard) -> Self {
        Self { scenario: checksum(scenario), seed, runs, shard }
    }

    /// The number of the first run of the shard, and the number of its runs.
    #[must_use]
    pub fn part(&self) -> (u32, u32) {
        let Shard { index, of } = self.shard;
        let end = |shards: u32| {
            let share = u64::from(self.runs) * u64::from(shards) / u64::from(of.max(1));
            u32::try_from(share).unwrap_or(self.runs)
        };
        let first = end(index.saturating_sub(1));
        (first, end(index) - first)
    }

    /// The seed of a run of the shard, counted from 0.
    #[must_use]
    pub fn seed_of(&self, run: u32) -> u64 {
        let (first, _) = self.part();
        self.seed.wrapping_add(u64::from(first)).wrapping_add(run.into())
    }

    /// The plan of all shards.
    #[must_use]
    pub fn whole(self) -> Self {
        Self { shard: Shard::ALL, ..self }
    }

    /// The plan as the first line of a file, without the end of the line.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { scenario, seed, runs, shard } = self;
        format!("{MAGIC}, scenario {scenario:016x}, seed {seed}, runs {runs}, shard {shard}")
    }

    /// Reads [`Self::line`].
    ///
    /// # Errors
    /// If it is another line.
    pub fn parse(line: &str) -> anyhow::Result<Self> {
        let Some(rest) = line.strip_prefix(MAGIC) else {
            bail!("the first line is not \"{MAGIC}, …\"");
        };
        let value = |key: &str| {
            let value = rest.split(", ").find_map(|part| part.strip_prefix(key)?.strip_prefix(' '));
            value.with_context(|| format!("the first line has no {key}"))
        };
        Ok(Self {
            scenario: u64::from_str_radix(value("scenario")?, 16).context("scenario")?,
            seed: value("seed")?.parse().context("seed")?,
            runs: value("runs")?.parse().context("runs")?,
            shard: value("shard")?.parse()?,
        })
    }
}

/// Everything that the runs depend on besides their seeds; not the number of runs that the scenario suggests.
fn checksum(scenario: &Scenario) -> u64 {
    let mut sum = Checksum::default();
    let Scenario { fidelity, floor, robot, path, follow, start, truth, .. } = scenario;
    let Scenario { upsets, hardware, surroundings, faults, .. } = scenario;
    let version = env!("CARGO_PKG_VERSION");
    let all = (
        (version, fidelity, floor, robot, path, follow),
        (start, truth, upsets, hardware, surroundings, faults),
    );
    // The sum takes every text; a number is written with all of its digits.
    let _ = write!(sum, "{all:?}");
    sum.0
}
