//! Whether every link of the site leads to a file of it, and to a place in that file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use regex::Regex;

/// What a page offers to links, its own links, and what it loads from other hosts.
struct Page {
    anchors: BTreeSet<String>,
    links: Vec<String>,
    foreign: Vec<String>,
}

/// Fails with the links that lead nowhere, and with what a page loads from another host. Links to other hosts are not followed.
pub fn check(site: &Path) -> anyhow::Result<()> {
    let mut pages = BTreeMap::new();
    for path in html_files(site)? {
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        pages.insert(path, Page::read(&text)?);
    }
    let mut mistakes = Vec::new();
    let mut count = 0;
    for (path, page) in &pages {
        count += page.links.len();
        let broken =
            page.links.iter().filter_map(|link| Some((link, mistake(&pages, path, link)?)));
        let foreign = page.foreign.iter().map(|address| (address, "is loaded from another host"));
        let shown = path.strip_prefix(site).unwrap_or(path).display();
        mistakes.extend(broken.chain(foreign).map(|(link, why)| format!("{shown}: {link}: {why}")));
    }
    println!("{} pages, {count} links", pages.len());
    ensure!(mistakes.is_empty(), "{} broken links\n{}", mistakes.len(), mistakes.join("\n"));
    Ok(())
}

/// All files `*.html` in a folder and those below it.
pub fn html_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(html_files(&path)?);
        } else if path.extension().is_some_and(|it| it == "html") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

impl Page {
    fn read(text: &str) -> anyhow::Result<Self> {
        let anchor = Regex::new(r#"[ \n]id="([^"]+)""#)?;
        let link = Regex::new(r#"[ \n](href|src)="([^"]*)""#)?;
        let loaded = Regex::new(
            r#"<(?:link|script|img|iframe|source)[ \n](?:[^>]*[ \n])?(?:src|href)="((?:https?:)?//[^"]*)""#,
        )?;
        // Scripts contain text that looks like markup.
        let script = Regex::new(r"(?s)(<script[^>]*>).*?</script>")?;
        let text = script.replace_all(text, "$1");
        let anchors = anchor.captures_iter(&text).map(|it| unescaped(&it[1])).collect();
        let links = link.captures_iter(&text).map(|it| unescaped(&it[2])).collect();
        let foreign = loaded.captures_iter(&text).map(|it| unescaped(&it[1])).collect();
        Ok(Self { anchors, links, foreign })
    }
}

fn unescaped(text: &str) -> String {
    text.replace("&#x27;", "'").replace("&quot;", "\"").replace("&amp;", "&")
}

fn mistake(pages: &BTreeMap<PathBuf, Page>, from: &Path, link: &str) -> Option<&'static str> {
    if link.contains(':') {
        return None;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target =
        if file.is_empty() { from.to_path_buf() } else { plain(&from.with_file_name(file)) };
    match pages.get(&target) {
        Some(page) => {
            let is_there = anchor.is_empty() || page.anchors.contains(anchor);
            (!is_there).then_some("the page has no such anchor")
        }
        None => (!target.is_file()).then_some("there is no such file"),
    }
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        if part == std::path::Component::ParentDir {
            plain.pop();
        } else {
            plain.push(part);
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_links_and_anchors_are_found() {
        let site = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            std::fs::create_dir_all(site.path().join("docs")).unwrap();
            std::fs::write(site.path().join(name), text).unwrap();
        };
        write(
            "index.html",
            r#"<h1 id="top">a</h1><a href="docs/b.html#c">b</a><a href="https://x.org/">x</a>"#,
        );
        write(
            "docs/b.html",
            r##"<h1 id="c">b</h1><a href="../index.html">a</a><a href="#c">c</a><script>' href="none"'</script>"##,
        );
        check(site.path()).unwrap();
        for broken in ["docs/b.html#d", "docs/c.html", "../b.html", "#e"] {
            write("index.html", &format!(r#"<a href="{broken}">b</a>"#));
            let error = check(site.path()).unwrap_err().to_string();
            assert!(error.contains(&format!("index.html: {broken}")), "{error}");
        }
        write("index.html", r#"<img src="a.png">"#);
        assert!(check(site.path()).is_err());
        for foreign in [r#"<img src="https://x.org/a.png">"#, r#"<link href="//x.org/a.css">"#] {
            write("index.html", foreign);
            assert!(check(site.path()).unwrap_err().to_string().contains("another host"));
        }
    }
}
