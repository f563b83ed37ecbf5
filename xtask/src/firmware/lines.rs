//! The source line and the crate that an instruction was compiled from.

use addr2line::gimli;
use anyhow::ensure;
use object::{Object, ObjectSection};

type Section<'a> = gimli::EndianSlice<'a, gimli::LittleEndian>;

/// The debug information of a program.
pub struct Lines<'a>(addr2line::Context<Section<'a>>);

impl<'a> Lines<'a> {
    /// Reads the debug information without applying relocations, since the file is linked.
    pub fn read(file: &object::File<'a>) -> anyhow::Result<Self> {
        let dwarf = gimli::Dwarf::load(|id| {
            let section = file.section_by_name(id.name()).and_then(|section| section.data().ok());
            Ok::<_, gimli::Error>(Section::new(section.unwrap_or_default(), gimli::LittleEndian))
        })?;
        Ok(Self(addr2line::Context::from_dwarf(dwarf)?))
    }

    /// The line at an address, `file:line`: of all inlined ones the innermost outside the standard library; none if all are
    /// inside it.
    pub fn at(&self, address: u64) -> anyhow::Result<Option<String>> {
        let mut frames = self.0.find_frames(address).skip_all_loads()?;
        let mut found = 0;
        while let Some(frame) = frames.next()? {
            let Some(location) = frame.location else { continue };
            let file = location.file.unwrap_or_default();
            found += 1;
            if !file.contains("/library/core/") {
                return Ok(Some(format!("{file}:{}", location.line.unwrap_or_default())));
            }
        }
        ensure!(found > 0, "the debug information has no line at {address:#x}");
        Ok(None)
    }

    /// The crate that the instruction at an address was compiled from. The standard library counts for its caller.
    pub fn owner(&self, address: u64) -> String {
        let line = self.at(address).ok().flatten();
        line.as_deref().map_or(OTHER, owner).to_owned()
    }
}

/// Code without a line, or with lines of the standard library only.
pub const OTHER: &str = "compiler, standard library";

/// The crate of a source line, without its version.
pub fn owner(line: &str) -> &str {
    let after = |mark: &str, skip: usize| {
        line.split_once(mark).and_then(|(_, path)| path.split('/').nth(skip))
    };
    let registry = after("/registry/src/", 1);
    registry
        .map(|folder| folder.rsplit_once('-').map_or(folder, |(name, _)| name))
        .or_else(|| after("/crates/", 0))
        .or_else(|| after("/firmware/", 0))
        .unwrap_or(OTHER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_belongs_to_the_crate_of_its_folder() {
        let registry = "/home/.cargo/registry/src/index.crates.io-1949cf8c6b5b557f";
        assert_eq!(owner(&format!("{registry}/defmt-rtt-1.3.1/src/lib.rs:7")), "defmt-rtt");
        assert_eq!(owner("/project/crates/sonarfix-app/src/app.rs:1"), "sonarfix-app");
        assert_eq!(owner("/project/firmware/stm32f405/src/main.rs:1"), "stm32f405");
        assert_eq!(owner("/rustc/1/library/compiler-builtins/src/mem.rs:1"), OTHER);
    }
}
