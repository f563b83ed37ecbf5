//! What is in the packages.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};

use crate::header;
use crate::library::{self, COMPOSITIONS};
use crate::package::Package;
use crate::portable;
use crate::target::{HOST, TARGETS, Target};

/// The packages, and where they are unpacked.
#[derive(Debug)]
pub struct Packages {
    /// The library for Arduino and PlatformIO.
    pub arduino: PathBuf,
    /// Header, libraries and portable source for everything else: CMake, pkg-config, ESP-IDF, Zephyr, Pico SDK.
    pub c: PathBuf,
}

/// Makes all packages in the folder `out`, from the workspace `c/`: archives, the same unpacked, and checksums.
///
/// # Errors
/// If a tool is missing or fails, or a file cannot be written.
pub fn make(workspace: &Path, out: &Path) -> Result<Packages> {
    let version = version(workspace)?;
    let (mut arduino, mut c) = (Package::default(), Package::default());
    common(workspace, &mut arduino, "src/")?;
    common(workspace, &mut c, "include/")?;
    portable_sources(workspace, &mut arduino, &mut c)?;
    libraries(workspace, &mut arduino, &mut c)?;
    arduino.add_folder("", &workspace.join("arduino"))?;
    examples(workspace, &mut arduino)?;
    c.add_folder("", &workspace.join("package"))?;
    c.add_folder("examples/", &workspace.join("examples"))?;
    for package in [&mut arduino, &mut c] {
        package.replace("@VERSION@", &version);
    }
    let root = format!("sonarfix-c-{version}");
    let archives = [
        (format!("Sonarfix-{version}.zip"), arduino.zip("Sonarfix")?),
        (format!("{root}.tar.gz"), c.tar_gz(&root)?),
    ];
    std::fs::create_dir_all(out)?;
    for (name, content) in archives {
        std::fs::write(out.join(name), content)?;
    }
    let packages = Packages { arduino: out.join("Sonarfix"), c: out.join(root) };
    for (package, folder) in [(&arduino, &packages.arduino), (&c, &packages.c)] {
        if folder.exists() {
            std::fs::remove_dir_all(folder)?;
        }
        package.unpack(folder)?;
    }
    Ok(packages)
}

/// The version of the library.
fn version(workspace: &Path) -> Result<String> {
    let manifest = std::fs::read_to_string(workspace.join("Cargo.toml"))?;
    let line = manifest.lines().find_map(|line| line.strip_prefix("version = "));
    Ok(line.context("no version in c/Cargo.toml")?.trim_matches('"').to_owned())
}

/// Headers and licences.
fn common(workspace: &Path, package: &mut Package, headers: &str) -> Result<()> {
    package.add_folder(headers, &workspace.join("include"))?;
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        package.add_file(licence, &workspace.join("..").join(licence))?;
    }
    Ok(())
}

/// The portable source of each composition. Arduino compiles every source that it finds, so that its package has the full one alone.
fn portable_sources(workspace: &Path, arduino: &mut Package, c: &mut Package) -> Result<()> {
    let header = std::fs::read_to_string(workspace.join("include/sonarfix.h"))?;
    let prototypes = header::prototypes(&header)?;
    for (composition, suffix) in COMPOSITIONS {
        eprintln!("portable source, {composition}");
        let source = portable::source(workspace, composition, &prototypes)?;
        let name = format!("sonarfix{suffix}.c");
        if suffix.is_empty() {
            arduino.add(format!("src/{name}"), source.as_str());
        }
        c.add(format!("src/{name}"), source);
    }
    Ok(())
}

/// The compiled libraries. Two are built at a time: the last step of each has one thread.
fn libraries(workspace: &Path, arduino: &mut Package, c: &mut Package) -> Result<()> {
    let (one, other) = TARGETS.split_at(TARGETS.len() / 2);
    let build = |targets: &'static [Target]| -> Result<()> {
        targets.iter().try_for_each(|target| build_all(workspace, target))
    };
    std::thread::scope(|scope| {
        let beside = scope.spawn(|| build(one));
        build(other)?;
        beside.join().map_err(|_| anyhow!("a build has panicked"))?
    })?;
    for (composition, suffix) in COMPOSITIONS {
        let name = format!("libsonarfix{suffix}.a");
        for target in &TARGETS {
            let file = library::file(workspace, target.triple, target.rustflags, composition);
            if suffix.is_empty() {
                arduino.add_file(format!("src/{}/{name}", target.folder), &file)?;
            }
            c.add_file(format!("lib/{}/{name}", target.name()), &file)?;
        }
        let file = library::build(workspace, HOST, "", "", composition)?;
        c.add_file(format!("lib/{HOST}/{name}"), &file)?;
    }
    Ok(())
}

/// Builds all compositions for a target.
fn build_all(workspace: &Path, target: &Target) -> Result<()> {
    let Target { folder, triple, rustflags, compiler, .. } = target;
    for (composition, _) in COMPOSITIONS {
        eprintln!("library for {folder}, {composition}");
        library::build(workspace, triple, rustflags, compiler, composition)?;
    }
    Ok(())
}

/// The examples for Arduino, each with the description of their common robot.
fn examples(workspace: &Path, arduino: &mut Package) -> Result<()> {
    let folder = workspace.join("arduino/examples");
    for entry in std::fs::read_dir(&folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            let name = entry.file_name().to_string_lossy().into_owned();
            arduino.add_file(format!("examples/{name}/robot.h"), &folder.join("robot.h"))?;
        }
    }
    Ok(())
}
