//! The pages of the repository in a folder for mdBook, each at its own place.
//!
//! A link from page to page stays. A link to another file of the repository leads to the repository on the web.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail, ensure};
use regex::{Captures, Regex};

/// Where files of the repository are on the web.
const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");

/// Files of the book beside its pages; their folder is `xtask/site`.
const OWN: [&str; 3] = ["book.toml", "site.css", "site.js"];

/// Pages of the site that are not of the book.
const APART: [&str; 4] =
    ["playground/index.html", "new-robot/index.html", "flash/index.html", "live/index.html"];

/// Writes the source of the book of the sources in `root` into a folder, which is emptied first.
pub fn write(root: &Path, folder: &Path) -> anyhow::Result<()> {
    if folder.exists() {
        std::fs::remove_dir_all(folder)?;
    }
    let own = root.join("xtask/site");
    let summary = std::fs::read_to_string(own.join("SUMMARY.md"))?;
    let source = Source { root, pages: pages(&summary)? };
    source.has_all_docs()?;
    for name in OWN {
        copy(&own.join(name), &folder.join(name))?;
    }
    put(&folder.join("src/SUMMARY.md"), &summary)?;
    for page in &source.pages {
        let (text, images) = source.page(page)?;
        put(&folder.join("src").join(page), &text)?;
        for image in images {
            copy(&source.root.join(&image), &folder.join("src").join(&image))?;
        }
    }
    Ok(())
}

/// Copies a page that is not of the book, with what it shows on the site only.
pub fn own_page(from: &Path, to: &Path) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(from).with_context(|| from.display().to_string())?;
    put(to, &shown_on_the_site(&text)?)
}

/// The pages of the table of contents.
fn pages(summary: &str) -> anyhow::Result<BTreeSet<PathBuf>> {
    let link = Regex::new(r"\]\(([^)]+)\)")?;
    Ok(link.captures_iter(summary).map(|found| PathBuf::from(&found[1])).collect())
}

/// The repository, and which of its files are pages of the book.
struct Source<'a> {
    root: &'a Path,
    pages: BTreeSet<PathBuf>,
}

impl Source<'_> {
    /// Fails if a page of `docs` is not in the table of contents.
    fn has_all_docs(&self) -> anyhow::Result<()> {
        for entry in std::fs::read_dir(self.root.join("docs"))? {
            let page = Path::new("docs").join(entry?.file_name());
            let is_page = page.extension().is_some_and(|it| it == "md");
            let is_known = !is_page || self.pages.contains(&page);
            ensure!(is_known, "{} is missing in xtask/site/SUMMARY.md", page.display());
        }
        Ok(())
    }

    /// The text of a page for the book, and the images that it shows.
    fn page(&self, page: &Path) -> anyhow::Result<(String, Vec<PathBuf>)> {
        let path = self.root.join(page);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        self.converted(page, &shown_on_the_site(&text)?)
    }

    fn converted(&self, page: &Path, text: &str) -> anyhow::Result<(String, Vec<PathBuf>)> {
        let link = Regex::new(r"(!?)\[([^\]\n]*)\]\(([^) \n]+)\)")?;
        let (mut images, mut mistakes) = (Vec::new(), Vec::new());
        let text = link.replace_all(text, |found: &Captures<'_>| {
            let [label, target] = [&found[2], &found[3]];
            let link = match self.target(page, target) {
                Ok(Target::Kept) => target.to_owned(),
                Ok(Target::Other(address)) => address,
                Ok(Target::Image(path)) => {
                    images.push(path);
                    target.to_owned()
                }
                Err(error) => {
                    mistakes.push(format!("{}: {error:#}", page.display()));
                    String::new()
                }
            };
            format!("{}[{label}]({link})", &found[1])
        });
        ensure!(mistakes.is_empty(), "{}", mistakes.join("\n"));
        Ok((text.into_owned(), images))
    }

    fn target(&self, page: &Path, target: &str) -> anyhow::Result<Target> {
        let (file, _anchor) = target.split_once('#').unwrap_or((target, ""));
        // A link to another host, within this page, or to a page of the site that is not in the book.
        let is_apart = APART.iter().any(|page| file.ends_with(page));
        if file.contains(':') || file.is_empty() || is_apart {
            return Ok(Target::Kept);
        }
        let path = resolved(page, file)?;
        if self.pages.contains(&path) {
            // mdBook gives README.md this name, and leaves the links to it.
            return Ok(Target::Other(target.replace("README.md", "index.md")));
        }
        let (on_disk, shown) = (self.root.join(&path), path.display());
        ensure!(on_disk.exists(), "the link {target} leads to no file");
        if path.extension().is_some_and(|it| it == "svg" || it == "png") {
            return Ok(Target::Image(path));
        }
        let kind = if on_disk.is_dir() { "tree" } else { "blob" };
        Ok(Target::Other(format!("{REPOSITORY}/{kind}/main/{shown}")))
    }
}

/// Where a link of the book leads.
#[derive(Debug, PartialEq, Eq)]
enum Target {
    /// As on the page.
    Kept,
    /// To this address: of a page of the book, or of another file in the repository on the web.
    Other(String),
    /// An image, which is copied into the book.
    Image(PathBuf),
}

/// The path of a link from the root of the repository.
fn resolved(page: &Path, link: &str) -> anyhow::Result<PathBuf> {
    let mut path = page.parent().map(Path::to_path_buf).unwrap_or_default();
    for part in Path::new(link).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => bail!("the link {link} leads out of the repository"),
        }
    }
    Ok(path)
}

/// What is in a comment `<!-- site: … -->` is text on the site only: it leads to the parts of the site that are not in the repository.
fn shown_on_the_site(text: &str) -> anyhow::Result<String> {
    let comment = Regex::new(r"(?s)<!-- site: (.*?) -->")?;
    Ok(comment.replace_all(text, "$1").into_owned())
}

fn put(path: &Path, text: &str) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    if let Some(folder) = to.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::copy(from, to).with_context(|| from.display().to_string())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repository() -> (tempfile::TempDir, BTreeSet<PathBuf>) {
        let root = tempfile::tempdir().unwrap();
        for name in ["README.md", "docs/a.md", "docs/images/a.svg", "firmware/robot.toml"] {
            put(&root.path().join(name), "text").unwrap();
        }
        (root, pages("[Home](README.md)\n- [A](docs/a.md)").unwrap())
    }

    fn converted(text: &str) -> anyhow::Result<(String, Vec<PathBuf>)> {
        let (root, pages) = repository();
        let source = Source { root: root.path(), pages };
        source.has_all_docs().unwrap();
        source.converted(Path::new("docs/a.md"), text)
    }

    #[test]
    fn links_to_pages_stay_and_others_lead_to_the_repository() {
        let text = "[1](a.md#x) [2](#y) [3](https://example.org/a) ![4](images/a.svg) \
                    [5](../new-robot/index.html)";
        assert_eq!(
            converted(text).unwrap(),
            (text.to_owned(), vec![PathBuf::from("docs/images/a.svg")])
        );
        assert_eq!(converted("[1](../README.md#x)").unwrap().0, "[1](../index.md#x)");
        let (text, _) = converted("[a](../firmware/robot.toml) [b](../firmware)").unwrap();
        let expected = format!(
            "[a]({REPOSITORY}/blob/main/firmware/robot.toml) [b]({REPOSITORY}/tree/main/firmware)"
        );
        assert_eq!(text, expected);
    }

    #[test]
    fn a_link_to_a_missing_file_is_a_mistake() {
        for text in ["[a](b.md)", "![a](images/b.svg)", "[a](../../x.md)"] {
            let error = converted(text).unwrap_err().to_string();
            assert!(error.starts_with("docs/a.md: the link "), "{error}");
        }
    }

    #[test]
    fn a_page_that_no_contents_names_is_a_mistake() {
        let (root, pages) = repository();
        put(&root.path().join("docs/new.md"), "text").unwrap();
        let source = Source { root: root.path(), pages };
        assert!(source.has_all_docs().unwrap_err().to_string().contains("docs/new.md"));
    }

    #[test]
    fn comments_for_the_site_are_shown() {
        let text = shown_on_the_site("a <!-- site: [b](c) --> d <!-- e -->").unwrap();
        assert_eq!(text, "a [b](c) d <!-- e -->");
    }
}
