//! The site: the docs as a book, and the playground; static files that open from a disk and from any web server.

mod flash;
mod form;
mod links;
mod live;
mod reports;
mod stage;
mod theme;

use std::path::Path;
use std::process::Command;

use anyhow::Context;

use crate::{cargo, ci, playground};

/// The version of mdBook: `theme` changes its pages, so that another version may need other changes.
const MDBOOK: &str = "0.5.4";
/// The rules of accessibility, and what drives Chromium; packages of npm.
const PACKAGES: [&str; 2] = ["axe-core@4.14.1", "playwright-core@1.65.1"];

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Opens each page in Chromium, too: rules of accessibility, errors of scripts, width of a phone, dark mode.
    #[arg(long)]
    check: bool,
}

impl Args {
    pub const CHECK: Self = Self { check: true };
}

/// Writes the site into `target/site`, and checks its links.
pub fn run(args: Args) -> anyhow::Result<()> {
    let site = cargo::target_folder().join("site");
    build(cargo::root(), &site, None)?;
    println!("{}", site.join("index.html").display());
    if args.check { check(&site) } else { Ok(()) }
}

/// Writes the site of the sources in `root` into a folder, which is emptied first, and checks its links. `firmware` is a folder with
/// released programs for the pages.
pub fn build(root: &Path, site: &Path, firmware: Option<&Path>) -> anyhow::Result<()> {
    cargo::install("mdbook", MDBOOK)?;
    let source = cargo::target_folder().join("site-source");
    stage::write(root, &source)?;
    if site.exists() {
        std::fs::remove_dir_all(site)?;
    }
    let mut mdbook = Command::new("mdbook");
    mdbook.arg("build").arg(&source).arg("--dest-dir").arg(site);
    mdbook.env("MDBOOK_OUTPUT__HTML__GIT_REPOSITORY_URL", env!("CARGO_PKG_REPOSITORY"));
    cargo::check(mdbook)?;
    theme::change(site)?;
    let pages = playground::build(root, firmware)?;
    for (from, to) in playground::PAGES.iter().zip(["playground", "new-robot", "flash", "live"]) {
        stage::own_page(&pages.join(from), &site.join(to).join("index.html"))?;
    }
    links::check(site)
}

/// Opens each page in Chromium.
pub fn check(site: &Path) -> anyhow::Result<()> {
    let Some(browser) = sonarfix_chromium::headless() else {
        ci::skip(&format!(
            "the site in a browser: none of {:?} is there",
            sonarfix_chromium::NAMES
        ));
        return Ok(());
    };
    let tools = cargo::target_folder().join("site-check");
    std::fs::create_dir_all(&tools)?;
    let mut install = Command::new("npm");
    install.args(["install", "--no-save", "--no-audit", "--no-fund", "--silent"]);
    install.args(PACKAGES).arg("--prefix").arg(&tools);
    cargo::check(install).context("cannot install the rules of accessibility")?;
    form::prepare(&tools)?;
    live::prepare(&tools)?;
    flash::prepare(&tools)?;
    reports::prepare(&tools)?;
    let mut node = Command::new("node");
    node.arg(cargo::root().join("xtask/site/check.mjs")).arg(&tools).arg(site);
    node.arg(browser.get_program());
    node.args(browser.get_args().filter(|flag| *flag != "--headless"));
    cargo::check(node)?;
    form::check(&tools)
}
