//! `sonarfix-studies rooms`: consistency of the filter, and verdicts, in generated rooms.

use std::path::PathBuf;

use anyhow::Context;
use sonarfix_studies::rooms::{self, Cell, Family, Objects, Robot, Sensor, page};

use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of rooms of each cell, with one run of ten minutes each.
    #[arg(long, default_value_t = 25)]
    runs: u32,
    /// Seed of the first room of each cell; the others count up from it. Parameters are chosen on seeds below 500000.
    #[arg(long, default_value_t = 500_000)]
    seed: u64,
    /// Only this family of rooms, by its name in the table; repeatable.
    #[arg(long)]
    family: Vec<String>,
    /// Only these objects; repeatable.
    #[arg(long)]
    objects: Vec<String>,
    /// Only this sensor; repeatable.
    #[arg(long)]
    sensor: Vec<String>,
    /// Only this robot; repeatable. Without it, robots with a wrong file drive with an HC-SR04 in empty rooms only.
    #[arg(long)]
    robot: Vec<String>,
    /// Prints a row for each cell instead of the page.
    #[arg(long)]
    cells: bool,
    /// The picture of all cells to write, as SVG.
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// Writes the scenario of the first cell and seed, and runs nothing.
    #[arg(long, value_name = "FILE.toml")]
    toml: Option<PathBuf>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    if let Some(file) = &args.figure {
        check_file("--figure", file)?;
    }
    let cells = cells(args)?;
    if let Some(file) = &args.toml {
        let cell = cells.first().context("no cell")?;
        return sonarfix_files::write(file, cell.toml(args.seed));
    }
    let count = u32::try_from(cells.len())?;
    let progress = Runs::new(args.runs.saturating_mul(count));
    let results = rooms::run(&cells, args.seed, args.runs, &progress)?;
    progress.end()?;
    if let Some(file) = &args.figure {
        sonarfix_files::write(file, rooms::svg(&results))?;
    }
    if args.cells {
        print!("{}", page::cells(&results));
    } else {
        print!("{}{}", page::markdown(&results), page::command(args.seed, args.runs));
    }
    Ok(())
}

/// All combinations of what the arguments permit.
fn cells(args: &Args) -> anyhow::Result<Vec<Cell>> {
    let families = chosen(&args.family, &Family::ALL, Family::name)?;
    let objects = chosen(&args.objects, &Objects::ALL, Objects::name)?;
    let sensors = chosen(&args.sensor, &Sensor::ALL, Sensor::name)?;
    let robots = chosen(&args.robot, &Robot::all(), Robot::name)?;
    let mut cells = Vec::new();
    for robot in robots {
        for &sensor in &sensors {
            for &family in &families {
                for &objects in &objects {
                    cells.push(Cell { family, objects, sensor, robot });
                }
            }
        }
    }
    if args.robot.is_empty() {
        cells.retain(Cell::is_of_page);
    }
    Ok(cells)
}

/// Those of these names; all without names.
fn chosen<T: Copy>(
    names: &[String],
    all: &[T],
    name: fn(T) -> &'static str,
) -> anyhow::Result<Vec<T>> {
    if names.is_empty() {
        return Ok(all.to_vec());
    }
    names.iter().map(|wanted| named(wanted, all, name)).collect()
}

/// The one of this name, in which hyphens may stand for blanks.
pub fn named<T: Copy>(wanted: &str, all: &[T], name: fn(T) -> &'static str) -> anyhow::Result<T> {
    let is_wanted = |of: &str| {
        of.eq_ignore_ascii_case(wanted) || of.replace(' ', "-").eq_ignore_ascii_case(wanted)
    };
    let found = all.iter().copied().find(|one| is_wanted(name(*one)));
    found.with_context(|| {
        let known: Vec<&str> = all.iter().map(|one| name(*one)).collect();
        format!("there is no \"{wanted}\": choose one of {}", known.join(", "))
    })
}
