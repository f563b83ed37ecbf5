//! The simulator, the form of a new robot, the page that flashes a board and the live page of a robot on a serial port as static web
//! pages, and their check in a headless browser.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::cargo;
use crate::ci;
use crate::flash_page;

/// Simulated seconds of each run that browser and computer compare.
const SECONDS: u32 = 60;
/// Limit of a page, compressed with gzip, bytes.
const MOST_BYTES: usize = 2_000_000;
/// The pages in the folder of [`build`], and the scripts in `sim-host/playground/tests` that use them.
pub const PAGES: [&str; 4] = ["index.html", "new-robot.html", "flash.html", "live.html"];
const CHECKS: [&str; 4] = ["check.js", "check_new_robot.js", "check_flash.js", "check_live.js"];

/// Builds the pages, and checks their size and, in a browser, their use, and that the simulator computes the same bits as this computer.
pub fn build_and_check() -> anyhow::Result<()> {
    let folder = build(cargo::root(), None)?;
    let pages = PAGES.map(|name| folder.join(name));
    for page in &pages {
        let bytes = compressed(page)?;
        println!("{}: {bytes} bytes compressed with gzip", page.display());
        ensure!(bytes <= MOST_BYTES, "the limit is {MOST_BYTES} bytes");
    }
    let native = digests()?;
    for (page, script) in pages.iter().zip(CHECKS) {
        let Some(browser) = sonarfix_chromium::headless() else {
            ci::skip(&format!(
                "the pages in a browser: none of {:?} is there",
                sonarfix_chromium::NAMES
            ));
            return Ok(());
        };
        let root = opened(browser, page, script)?;
        ensure!(attribute(&root, "data-error").is_none(), "a script failed: {root}");
        ensure!(attribute(&root, "data-checked").is_some(), "{script} has not ended: {root}");
        if let Some(computed) = attribute(&root, "data-digests") {
            let time = attribute(&root, "data-milliseconds").unwrap_or("?");
            println!("{native}: {} runs of {SECONDS} s in {time} ms", native.split(' ').count());
            ensure!(computed == native, "the browser computed {computed}, this computer {native}");
        }
    }
    Ok(())
}

/// Builds the simulator of the sources in `root` for WebAssembly, and the pages with it: the same bytes in every folder.
/// Returns their folder. `firmware` is a folder with released programs for the pages.
pub fn build(root: &Path, firmware: Option<&Path>) -> anyhow::Result<PathBuf> {
    let target = cargo::target_folder();
    let mut simulator = cargo::command(
        "build --package sonarfix-playground --lib --target wasm32-unknown-unknown --profile playground",
    );
    simulator.current_dir(root).env("CARGO_TARGET_DIR", &target);
    cargo::reproducible(&mut simulator, root, &[])?;
    cargo::check(simulator)?;
    let program = target.join("wasm32-unknown-unknown/playground/sonarfix_playground.wasm");
    let folder = target.join("playground");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut command = cargo::command("run --package sonarfix-playground -- pages");
    command
        .current_dir(root)
        .env("CARGO_TARGET_DIR", &target)
        .args([&program, &folder, &flash_page::prepare(root)?])
        .args(firmware);
    cargo::check(command)?;
    Ok(folder)
}

fn compressed(page: &Path) -> anyhow::Result<usize> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&std::fs::read(page)?)?;
    Ok(encoder.finish()?.len())
}

/// The hashes of the runs on this computer.
fn digests() -> anyhow::Result<String> {
    let command = format!("run --package sonarfix-playground -- digests {SECONDS}");
    Ok(cargo::printed(cargo::command(&command))?.trim().to_owned())
}

/// The opening tag of a page with a script that uses it, after its scripts ran.
fn opened(mut browser: Command, page: &Path, script: &str) -> anyhow::Result<String> {
    let (profile, checked) = (page.with_file_name("profile"), page.with_file_name("check.html"));
    let path = cargo::root().join("sim-host/playground/tests").join(script);
    let script = std::fs::read_to_string(path).context(script.to_owned())?;
    let text = std::fs::read_to_string(page)?
        .replacen("<html", &format!("<html data-seconds=\"{SECONDS}\""), 1)
        .replace("</body>", &format!("<script>\n{script}</script>\n</body>"));
    std::fs::write(&checked, text)?;
    browser.arg("--dump-dom").arg(format!("--user-data-dir={}", profile.display()));
    browser.arg(format!("file://{}", checked.display()));
    let output = browser.output().context("cannot start the browser")?;
    std::fs::remove_dir_all(&profile)?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "the browser failed: {errors}");
    let dom = String::from_utf8_lossy(&output.stdout);
    let from = dom.find("<html").context("the browser printed no page")?;
    let tag = dom.get(from..).and_then(|rest| rest.split('>').next());
    Ok(tag.unwrap_or_default().to_owned())
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    tag.split_once(&format!("{name}=\""))?.1.split('"').next()
}
