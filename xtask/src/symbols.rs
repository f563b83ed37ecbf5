//! The same symbols in every folder.
//!
//! The names of symbols have a hash of `-C metadata`, and the linker places functions by their names. Cargo makes this value of the folder of
//! a package that is outside of its workspace, as the crates are for the firmware. This program stands between cargo and rustc
//! (`RUSTC_WRAPPER`) and makes it of what the package is compiled to.

use std::env;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::Context;

/// Set for rustc: the folder of the sources.
const SOURCES: &str = "SONARFIX_SOURCES";

/// Gives packages in `root` the same symbols in every folder.
pub fn same_in_every_folder(build: &mut Command, root: &Path) -> anyhow::Result<()> {
    build.env("RUSTC_WRAPPER", env::current_exe()?).env(SOURCES, root);
    Ok(())
}

/// Runs rustc, if cargo has started this program in its place.
pub fn run_as_rustc() -> Option<anyhow::Result<ExitCode>> {
    let sources = env::var_os(SOURCES)?;
    Some(rustc(Path::new(&sources)))
}

fn rustc(sources: &Path) -> anyhow::Result<ExitCode> {
    let mut arguments = env::args().skip(1);
    let program = arguments.next().context("cargo gives the path of rustc")?;
    let arguments = renamed(arguments.collect(), sources);
    let status = Command::new(&program).args(arguments).status().context(program)?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The arguments of rustc, with metadata of their own for a package of the sources. Cargo compiles one in the workspace by a relative path.
fn renamed(mut arguments: Vec<String>, sources: &Path) -> Vec<String> {
    let is_own = arguments.iter().map(Path::new).any(|path| {
        let is_source = path.extension().is_some_and(|it| it == "rs");
        is_source && (path.is_relative() || path.starts_with(sources))
    });
    let metadata = format!("metadata={:016x}", hash_of(&arguments));
    let is_metadata = |argument: &&mut String| argument.starts_with("metadata=");
    if let Some(argument) = arguments.iter_mut().find(is_metadata).filter(|_| is_own) {
        *argument = metadata;
    }
    arguments
}

/// A hash of what distinguishes the results of a build.
fn hash_of(arguments: &[String]) -> u64 {
    const NAMES: [&str; 4] = ["--crate-name", "--crate-type", "--cfg", "--target"];
    let mut hasher = DefaultHasher::new();
    for pair in arguments.windows(2) {
        if let [name, value] = pair
            && NAMES.contains(&name.as_str())
        {
            (name, value).hash(&mut hasher);
        }
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(source: &str, cfg: &str, metadata: &str) -> Vec<String> {
        let fixed = ["--crate-name", "sonarfix_link", "--crate-type", "lib", "--cfg"];
        let words = fixed.iter().chain([&cfg, &source, &"-C", &metadata, &"-C", &"opt-level=s"]);
        words.map(ToString::to_string).collect()
    }

    fn metadata(source: &str, cfg: &str, sources: &str) -> String {
        let renamed = renamed(arguments(source, cfg, "metadata=12"), sources.as_ref());
        assert_eq!(renamed.len(), 11);
        renamed[8].clone()
    }

    #[test]
    fn a_package_has_the_same_metadata_in_every_folder_and_others_by_its_features() {
        let here = metadata("/a/crates/link/src/lib.rs", "feature=\"x\"", "/a");
        assert_ne!(here, "metadata=12");
        assert_eq!(here, metadata("/b c/crates/link/src/lib.rs", "feature=\"x\"", "/b c"));
        assert_eq!(here, metadata("pico/src/main.rs", "feature=\"x\"", "/a"));
        assert_ne!(here, metadata("/a/crates/link/src/lib.rs", "feature=\"y\"", "/a"));
        assert_eq!(metadata("/cargo/libm/src/lib.rs", "feature=\"x\"", "/a"), "metadata=12");
    }
}
