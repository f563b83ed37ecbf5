//! The firmware of the further boards, whose chips QEMU does not emulate: it is linted, built, measured and searched for
//! panics.

use std::fs;
use std::path::Path;

use object::{Object, ObjectSection, SectionKind};

use super::{build, memory, panics};
use crate::cargo;
use crate::workspace::Workspace;
use sonarfix_boards::Board;

/// The board that is examined in detail, and emulated.
const REFERENCE: &str = "stm32f405";

/// Lints and builds the firmware of each further board, and checks the linked files; prints the size of all boards.
pub fn check(reference: &[u8]) -> anyhow::Result<()> {
    let firmware = Workspace::Firmware;
    let mut rows = Vec::new();
    for board in &sonarfix_boards::all()? {
        if board.name == REFERENCE {
            rows.push(row(board, reference)?);
            continue;
        }
        let package = format!("--release --package {} --target {}", board.package, board.target);
        cargo::check(firmware.cargo(&format!("clippy {package} -- -D warnings")))?;
        cargo::check(firmware.cargo(&format!("build {package}")))?;
        let folder = firmware.target_folder().join(&board.target).join("release");
        let program = build::read(&folder.join(&board.package))?;
        panics::others(&program)?;
        rows.push(row(board, &program)?);
    }
    println!(
        "\n| board | flash, bytes | variables in RAM, bytes | lines of its own: code, comments | of its build files |"
    );
    println!("|---|---|---|---|---|\n{}", rows.join("\n"));
    Ok(())
}

fn row(board: &Board, program: &[u8]) -> anyhow::Result<String> {
    let file = object::File::parse(program)?;
    let in_flash =
        |kind| matches!(kind, SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::Data);
    let allocated = file.sections().filter(|section| section.address() > 0);
    let flash: u64 = allocated.filter(|s| in_flash(s.kind())).map(|section| section.size()).sum();
    let variables: u64 = memory::variables_of(&file).map(|section| section.size()).sum();
    let folder = Workspace::Firmware.folder().join(board.package.trim_start_matches("sonarfix-"));
    let (mut code, mut comments) = (0, 0);
    // A board that takes the source of another has no folder for it.
    for entry in fs::read_dir(folder.join("src")).into_iter().flatten() {
        let lines = lines(&entry?.path())?;
        code += lines.0;
        comments += lines.1;
    }
    let mut build = 0;
    let beside = ["Cargo.toml", "build.rs", "partitions.csv"].map(|name| folder.join(name));
    for file in beside.into_iter().chain([cargo::root().join(&board.memory)]) {
        if file.exists() {
            build += lines(&file)?.0;
        }
    }
    Ok(format!("| {} | {flash} | {variables} | {code}, {comments} | {build} |", board.title))
}

/// Lines of code and of comments in a file: Rust, TOML, a linker script, or the language of state machines.
fn lines(file: &Path) -> anyhow::Result<(usize, usize)> {
    let text = fs::read_to_string(file)?;
    let (mut code, mut comments) = (0, 0);
    let mut is_inside = false;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let is_block = line.starts_with("/*");
        let is_comment = is_inside
            || is_block
            || line.starts_with("//")
            || line.starts_with(';')
            || (line.starts_with('#') && !line.starts_with("#[") && !line.starts_with("#!["));
        is_inside = (is_inside || is_block) && !line.ends_with("*/");
        *(if is_comment { &mut comments } else { &mut code }) += 1;
    }
    Ok((code, comments))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_of_all_languages_are_not_counted_as_code() {
        let text = "/* two\n   lines */\nA : B\n  /* one */\n#[attribute]\n# toml\n// rust\n\n; pio\nx = 1\n";
        let file = std::env::temp_dir().join(format!("sonarfix-lines-{}", std::process::id()));
        fs::write(&file, text).unwrap();
        let counted = lines(&file);
        fs::remove_file(&file).unwrap();
        assert_eq!(counted.unwrap(), (3, 6));
    }
}
