//! Archives of the command for a PC without Rust: a static program, completions, manual pages, scenarios, licences.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, ensure};

use sonarfix_boards::uf2;

use crate::workspace::Workspace;
use crate::{cargo, symbols};

/// Where the program is built and checked.
pub const HOST: &str = "x86_64-unknown-linux-musl";
/// The targets: static programs, linked without a C compiler.
pub const TARGETS: [&str; 2] = [HOST, "aarch64-unknown-linux-musl"];
/// The most bytes of an archive and of a program.
const MOST_ARCHIVE: u64 = 25_000_000;
const MOST_PROGRAM: u64 = 11_000_000;
const SHELLS: [&str; 4] = ["bash", "zsh", "fish", "powershell"];

/// Writes an archive for each target into a folder, with the programs of the boards.
pub fn archives(out: &Path, firmware: &[PathBuf]) -> anyhow::Result<()> {
    // Completions and manual pages are those of the program of this PC.
    let host = build(&COMMAND, HOST, cargo::root())?;
    TARGETS.iter().try_for_each(|target| archive(target, &host, out, firmware))
}

fn archive(target: &str, host: &Path, out: &Path, firmware: &[PathBuf]) -> anyhow::Result<()> {
    let program =
        if target == HOST { host.to_owned() } else { build(&COMMAND, target, cargo::root())? };
    let name = format!("sonarfix-{}-{target}", env!("CARGO_PKG_VERSION"));
    let folder = out.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    for part in ["completions", "man/man1", "scenarios"] {
        fs::create_dir_all(folder.join(part))?;
    }
    fs::copy(&program, folder.join("sonarfix")).context("cannot copy the program")?;
    for file in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(cargo::root().join(file), folder.join(file)).context(file)?;
    }
    for scenario in ["paper.toml", "classroom.toml"] {
        let from = cargo::root().join("crates/sonarfix-map/scenarios").join(scenario);
        fs::copy(from, folder.join("scenarios").join(scenario)).context(scenario)?;
    }
    for shell in SHELLS {
        let mut completions = Command::new(host);
        completions.args(["completions", shell]);
        let text = cargo::printed(completions)?;
        fs::write(folder.join("completions").join(format!("sonarfix.{shell}")), text)?;
    }
    let mut pages = Command::new(host);
    pages.args(["man", "--out"]).arg(folder.join("man/man1"));
    cargo::check(pages)?;
    let packages = format!("--package sonarfix-cli --target {target}");
    fs::write(folder.join("LICENSES.txt"), super::licences::of(Workspace::Main, &packages)?)?;
    for file in firmware {
        let name = file.strip_prefix(out)?;
        fs::create_dir_all(folder.join(name.parent().unwrap_or(name)))?;
        fs::copy(file, folder.join(name))?;
    }
    let packed = out.join(format!("{name}.tar.gz"));
    pack(out, &name, &packed)?;
    bounded(&folder.join("sonarfix"), MOST_PROGRAM)?;
    bounded(&packed, MOST_ARCHIVE)
}

/// Prints the size of a file, and fails if it is larger than that.
fn bounded(file: &Path, most: u64) -> anyhow::Result<()> {
    let bytes = fs::metadata(file)?.len();
    eprintln!("{}: {bytes} bytes", file.display());
    ensure!(bytes <= most, "{} has more than {most} bytes", file.display());
    Ok(())
}

/// A static program of a release.
pub struct Program {
    pub workspace: Workspace,
    /// The package, and its profile.
    pub package: &'static str,
    pub profile: &'static str,
    pub file: &'static str,
    /// Further flags of the compiler.
    pub flags: &'static [&'static str],
}

const COMMAND: Program = Program {
    workspace: Workspace::Main,
    package: "sonarfix-cli",
    profile: "dist",
    file: "sonarfix",
    // A panic ends the program (Cargo.toml), and a backtrace without symbols has no use.
    flags: &["-Cforce-unwind-tables=no"],
};

/// Builds a program from the sources in `root`.
pub fn build(program: &Program, target: &str, root: &Path) -> anyhow::Result<PathBuf> {
    let Program { workspace, package, profile, file, flags } = program;
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", target]);
    cargo::check(rustup)?;
    let folder = cargo::target_folder().join("static");
    let mut command = cargo::command(&format!(
        "build --locked --package {package} --profile {profile} --target {target}"
    ));
    command.current_dir(root.join(workspace.path())).env("CARGO_TARGET_DIR", &folder);
    cargo::reproducible(&mut command, root, flags)?;
    symbols::same_in_every_folder(&mut command, root)?;
    // The linker of Rust, which knows every processor.
    let linker = format!("CARGO_TARGET_{}_LINKER", target.replace('-', "_").to_uppercase());
    command.env(linker, "rust-lld");
    cargo::check(command)?;
    Ok(folder.join(target).join(profile).join(file))
}

/// Packs a folder; the archive has the same bytes for the same files.
pub fn pack(parent: &Path, name: &str, packed: &Path) -> anyhow::Result<()> {
    let mut tar = Command::new("tar");
    tar.args(["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner"]);
    tar.args(["--mode=go=rX,u+rw", "--use-compress-program=gzip --no-name --best"]);
    tar.arg("--create").arg("--file").arg(packed).arg("--directory").arg(parent).arg(name);
    cargo::check(tar)
}

/// Runs a program in a root that has nothing but a folder.
pub fn alone(folder: &Path, program: &str, arguments: &[&str]) -> anyhow::Result<()> {
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "chroot"]).arg(folder).arg(program).args(arguments);
    command.stdin(Stdio::null());
    cargo::check(command)
}

/// Checks the archive of this PC: the program runs in a root that has nothing else, and a build of the same sources in another
/// folder has the same bytes.
pub fn check(out: &Path, copy: &Path) -> anyhow::Result<()> {
    let folder = out.join(format!("sonarfix-{}-{HOST}", env!("CARGO_PKG_VERSION")));
    let alone = |arguments: &[&str]| alone(&folder, "/sonarfix", arguments);
    alone(&["paper", "--out", "/report"])?;
    ensure!(folder.join("report/report.html").is_file(), "`sonarfix paper` wrote no report");
    alone(&["init", "/robot", "--board", "pico"])?;
    alone(&["flash", "/robot", "--board", "pico", "--out", "/robot/pico.uf2", "--dry-run"])?;
    ensure!(!folder.join("robot/pico.uf2").exists(), "`--dry-run` wrote a file");
    alone(&["flash", "/robot", "--board", "pico", "--out", "/robot/pico.uf2"])?;
    let (image, _) = uf2::read(&fs::read(folder.join("robot/pico.uf2"))?)?;
    ensure!(image.parts().count() > 1, "`sonarfix flash` wrote no program");
    for made in ["report", "robot"] {
        fs::remove_dir_all(folder.join(made))?;
    }
    let first = fs::read(folder.join("sonarfix"))?;
    let second = fs::read(build(&COMMAND, HOST, copy)?)?;
    ensure!(first == second, "the program of another folder has other bytes");
    Ok(())
}
