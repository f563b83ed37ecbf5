//! Draws the wiring of each board from `firmware/boards.toml`: `cargo run --bin wiring` writes `docs/images/wiring-NAME.svg`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix_boards::Board;
use sonarfix_boards::wiring::{Rangers, drawing};

/// The folder of the drawings.
const IMAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images");

fn main() -> anyhow::Result<()> {
    for (file, svg) in drawings()? {
        fs::write(&file, svg).with_context(|| file.display().to_string())?;
        println!("{}", file.display());
    }
    Ok(())
}

fn drawings() -> anyhow::Result<Vec<(PathBuf, String)>> {
    let drawn = |board: &Board| {
        (
            Path::new(IMAGES).join(format!("wiring-{}.svg", board.name)),
            drawing(board, Rangers::USUAL),
        )
    };
    Ok(sonarfix_boards::all()?.iter().map(drawn).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The drawings in the docs are those of the table: `cargo run --bin wiring` writes them.
    #[test]
    fn the_drawings_are_those_of_the_table() {
        let drawings = drawings().unwrap_or_default();
        assert!(drawings.len() >= 4);
        for (file, svg) in drawings {
            let written = fs::read_to_string(&file).unwrap_or_default();
            assert!(written == svg, "{}: run `cargo run --bin wiring`", file.display());
        }
    }
}
