//! Writes the page of the playground, or prints the hashes that it must compute.

use std::path::Path;

use anyhow::{Context, bail};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sonarfix_playground::request::Request;
use sonarfix_playground::run;
use sonarfix_report::{DRAWING, SCRIPT, fill, player, style};

/// The seeds that the page checks with `#check`.
const SEEDS: [u64; 3] = [0, 1, 2];

const USAGE: &str = "usage: sonarfix-playground page PROGRAM.wasm PAGE.html | digests SECONDS";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["page", program, page] => write(program.as_ref(), page.as_ref()),
        ["digests", seconds] => print(seconds.parse().context(USAGE)?),
        _ => bail!(USAGE),
    }
}

fn write(program: &Path, page: &Path) -> anyhow::Result<()> {
    let program = std::fs::read(program).with_context(|| program.display().to_string())?;
    let (style, player) = (style(), player());
    let program = STANDARD.encode(program);
    let values = [
        ("style", style.as_str()),
        ("own-style", include_str!("page.css")),
        ("player", &player),
        ("wasm", &program),
        ("drawing", DRAWING),
        ("player-script", SCRIPT),
        ("simulator", include_str!("simulator.js")),
        ("handles", include_str!("handles.js")),
        ("address", include_str!("address.js")),
        ("script", include_str!("playground.js")),
    ];
    let text = fill(include_str!("page.html"), &values.map(|(name, text)| (name, text.into())));
    sonarfix_files::write(page, text)
}

/// The hashes of runs of `classroom` on this computer, in one line.
fn print(seconds: f64) -> anyhow::Result<()> {
    let scenario: toml::Table = toml::from_str(sonarfix_map::CLASSROOM)?;
    let digest = |seed| {
        let request =
            Request { scenario: scenario.clone(), seed, seconds, moves: vec![], searches: false };
        anyhow::Ok(run(&request)?.0.digest)
    };
    let digests = SEEDS.into_iter().map(digest).collect::<anyhow::Result<Vec<_>>>()?;
    println!("{}", digests.join(" "));
    Ok(())
}
