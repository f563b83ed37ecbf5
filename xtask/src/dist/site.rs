//! The archive of the site.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::ensure;

use super::{firmware, licences, program};
use crate::workspace::Workspace;
use crate::{cargo, flash_page, site};

/// What the site has beside the pages and the libraries of the programs in them.
const BOOK: &str = "The book has scripts, style sheets and fonts of mdBook, https://github.com/rust-lang/mdBook, under the Mozilla Public \
                    License 2.0; the licences of its fonts are in the folder `fonts`.\n\n";

/// Builds the site from the sources in `root` and writes its archive into a folder; returns the archive.
pub fn archive(out: &Path, root: &Path) -> anyhow::Result<PathBuf> {
    let name = format!("sonarfix-{}-site", env!("CARGO_PKG_VERSION"));
    let folder = out.join(&name);
    let programs = cargo::target_folder().join("site-firmware");
    firmware::for_pages(root, &programs)?;
    site::build(root, &folder, Some(&programs))?;
    for file in ["LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(root.join(file), folder.join(file))?;
    }
    let packages = "--package sonarfix-playground --target wasm32-unknown-unknown";
    let licences = licences::of(Workspace::Main, packages)?;
    let of_flashing = flash_page::licences(&flash_page::prepare(root)?)?;
    fs::write(folder.join("LICENSES.txt"), [BOOK, &licences, "\n", &of_flashing].concat())?;
    let licences = licences::of(Workspace::Firmware, "--workspace --target all")?;
    fs::write(folder.join("LICENSES-firmware.txt"), licences)?;
    let packed = out.join(format!("{name}.tar.gz"));
    program::pack(out, &name, &packed)?;
    eprintln!("{}: {} bytes", packed.display(), fs::metadata(&packed)?.len());
    Ok(packed)
}

/// Checks the archive: its pages in a browser, and that a build of the same sources in another folder has the same bytes.
pub fn check(archive: &Path, copy: &Path) -> anyhow::Result<()> {
    site::check(&archive.with_extension("").with_extension(""))?;
    let again = cargo::target_folder().join("another site");
    fs::create_dir_all(&again)?;
    let second = self::archive(&again, copy)?;
    ensure!(fs::read(archive)? == fs::read(second)?, "the site of another folder has other bytes");
    Ok(fs::remove_dir_all(again)?)
}
