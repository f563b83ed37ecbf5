//! Archives of the command for a PC without Rust: a static program, completions, manual pages, scenarios, licences.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo::{self, Dependency};

/// Where the program is built and checked.
const HOST: &str = "x86_64-unknown-linux-musl";
/// The targets: static programs, linked without a C compiler.
const TARGETS: [&str; 2] = [HOST, "aarch64-unknown-linux-musl"];
/// The most bytes of an archive and of a program.
const MOST_ARCHIVE: u64 = 25_000_000;
const MOST_PROGRAM: u64 = 11_000_000;
const SHELLS: [&str; 4] = ["bash", "zsh", "fish", "powershell"];

/// Writes an archive for each target into a folder; returns them.
pub fn archives(out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    // Completions and manual pages are those of the program of this PC.
    let host = build(HOST, cargo::root())?;
    TARGETS.iter().map(|target| archive(target, &host, out)).collect()
}

fn archive(target: &str, host: &Path, out: &Path) -> anyhow::Result<PathBuf> {
    let program = if target == HOST { host.to_owned() } else { build(target, cargo::root())? };
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
    fs::write(folder.join("LICENSES.txt"), licences(target)?)?;
    let packed = out.join(format!("{name}.tar.gz"));
    pack(out, &name, &packed)?;
    for (file, most) in [(&folder.join("sonarfix"), MOST_PROGRAM), (&packed, MOST_ARCHIVE)] {
        let bytes = fs::metadata(file)?.len();
        eprintln!("{}: {bytes} bytes", file.display());
        ensure!(bytes <= most, "{} has more than {most} bytes", file.display());
    }
    Ok(packed)
}

/// Builds the program from the sources in `root`. Neither the folder of the sources nor that of cargo is in it.
fn build(target: &str, root: &Path) -> anyhow::Result<PathBuf> {
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", target]);
    cargo::check(rustup)?;
    let home = cargo::home()?;
    let remap = |from: &Path, to| format!("--remap-path-prefix={}={to}", from.display());
    let flags = [remap(root, "/sonarfix"), remap(&home, "/cargo")].join("\u{1f}");
    let folder = cargo::target_folder().join("static");
    let mut command = cargo::command(&format!(
        "build --locked --package sonarfix-cli --profile dist --target {target}"
    ));
    command.current_dir(root).env("CARGO_TARGET_DIR", &folder);
    command.env("CARGO_ENCODED_RUSTFLAGS", flags);
    // The linker of Rust, which knows every processor.
    let linker = format!("CARGO_TARGET_{}_LINKER", target.replace('-', "_").to_uppercase());
    command.env(linker, "rust-lld");
    cargo::check(command)?;
    Ok(folder.join(target).join("dist/sonarfix"))
}

/// Packs a folder; the archive has the same bytes for the same files.
fn pack(parent: &Path, name: &str, packed: &Path) -> anyhow::Result<()> {
    let mut tar = Command::new("tar");
    tar.args(["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner"]);
    tar.args(["--mode=go=rX,u+rw", "--use-compress-program=gzip --no-name --best"]);
    tar.arg("--create").arg("--file").arg(packed).arg("--directory").arg(parent).arg(name);
    cargo::check(tar)
}

/// The licences of all that is linked: a list, and each text once.
fn licences(target: &str) -> anyhow::Result<String> {
    let tree = format!(
        "tree --locked --package sonarfix-cli --edges normal --target {target} --prefix none --format {{p}}"
    );
    let tree = cargo::printed(cargo::command(&tree))?;
    let linked: Vec<_> =
        tree.lines().filter_map(|line| line.split_once(" v")).map(|(name, _)| name).collect();
    let mut packages = cargo::dependencies()?;
    packages.retain(|it| linked.contains(&it.name.as_str()));
    packages.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    let mut list =
        "The program contains these libraries, under the licences behind them.\n\n".to_owned();
    let mut texts = BTreeMap::<String, Vec<String>>::new();
    for Dependency { name, version, license, manifest_path, .. } in &packages {
        let licence = license.as_deref().unwrap_or("see its text");
        writeln!(list, "{name} {version}: {licence}")?;
        let folder = manifest_path.parent().context("a package without a folder")?;
        let mut files: Vec<_> = fs::read_dir(folder)?.filter_map(Result::ok).collect();
        files.sort_by_key(fs::DirEntry::file_name);
        for file in files {
            let file_name = file.file_name().to_string_lossy().to_uppercase();
            let is_licence = ["LICENSE", "LICENCE", "COPYING", "NOTICE"];
            if is_licence.iter().any(|start| file_name.starts_with(start)) && file.path().is_file()
            {
                let text = fs::read_to_string(file.path()).unwrap_or_default();
                texts.entry(text.trim().to_owned()).or_default().push(format!("{name} {version}"));
            }
        }
    }
    for (text, names) in texts {
        write!(list, "\n{}\n{}\n\n{text}\n", "-".repeat(78), names.join(", "))?;
    }
    Ok(list)
}

/// The sums of the archives, as `sha256sum --check` reads them.
pub fn checksums(out: &Path, archives: &[PathBuf]) -> anyhow::Result<()> {
    let mut sums = Command::new("sha256sum");
    sums.current_dir(out).args(archives.iter().filter_map(|archive| archive.file_name()));
    Ok(fs::write(out.join("SHA256SUMS"), cargo::printed(sums)?)?)
}

/// Checks the archive of this PC: the program runs in a root that has nothing else, and a build of the same sources in another
/// folder has the same bytes.
pub fn check(out: &Path) -> anyhow::Result<()> {
    let folder = out.join(format!("sonarfix-{}-{HOST}", env!("CARGO_PKG_VERSION")));
    let mut paper = Command::new("unshare");
    paper.args(["--map-root-user", "chroot"]).arg(&folder);
    paper.args(["/sonarfix", "paper", "--out", "/report"]);
    cargo::check(paper)?;
    ensure!(folder.join("report/report.html").is_file(), "`sonarfix paper` wrote no report");
    fs::remove_dir_all(folder.join("report"))?;
    let copy = cargo::target_folder().join("another folder");
    if copy.exists() {
        fs::remove_dir_all(&copy)?;
    }
    let mut clone = Command::new("git");
    clone.args(["clone", "--quiet"]).arg(cargo::root()).arg(&copy);
    cargo::check(clone)?;
    let first = fs::read(folder.join("sonarfix"))?;
    let second = fs::read(build(HOST, &copy)?)?;
    ensure!(first == second, "the program of another folder has other bytes");
    Ok(fs::remove_dir_all(copy)?)
}
