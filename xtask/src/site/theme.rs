//! Changes of mdBook's pages that its options and style sheets cannot make.

use std::path::Path;

use anyhow::{Context, ensure};
use regex::Regex;

use super::links::html_files;

/// Text as a regular expression, which a page has once, and what replaces it.
type Change = (&'static str, &'static str);

/// Of each page but the next one.
const CHANGES: [Change; 6] = [
    // A label is no button: it has no name and cannot be reached by the keyboard. `site.js` passes its click on.
    (
        r#"(?s)<label (id="mdbook-sidebar-toggle" class="icon-button") for="mdbook-sidebar-toggle-anchor"(.*?)</label>"#,
        r#"<button $1 type="button"$2</button>"#,
    ),
    // Landmarks: every part of a page belongs to one.
    (r#"<div id="mdbook-menu-bar""#, r#"<div id="mdbook-menu-bar" role="banner""#),
    (r#"<div id="mdbook-search-wrapper""#, r#"<div id="mdbook-search-wrapper" role="search""#),
    (r#"id="mdbook-searchbar""#, r#"id="mdbook-searchbar" aria-label="Search""#),
    // The page has its own heading.
    (r#"<h1 class="menu-title">Sonarfix</h1>"#, r#"<div class="menu-title">Sonarfix</div>"#),
    // One light scheme and one dark one, which are checked.
    (
        THEMES,
        r#"<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-navy">Dark</button></li>"#,
    ),
];

/// The corner of a table, which is the header of nothing.
const CORNER: &str = r#"<th(?: style="[^"]*")?></th>"#;

const THEMES: &str =
    r#"(?s)<li role="none"><button [^>]*id="mdbook-theme-rust">.*?>Ayu</button></li>"#;

/// The table of contents for browsers without scripts.
const CONTENTS: &str = "toc.html";

/// Of this page: a title, a heading and a landmark.
const CHANGES_OF_CONTENTS: [Change; 2] = [
    (r#"<meta charset="UTF-8">"#, r#"<meta charset="UTF-8"><title>Contents - Sonarfix</title>"#),
    (
        r#"(?s)<body class="sidebar-iframe-inner">(.*)</body>"#,
        r#"<body class="sidebar-iframe-inner"><main><h1>Contents</h1>$1</main></body>"#,
    ),
];

/// Changes all pages of a book. Fails where a text is missing, as with another version of mdBook.
pub fn change(site: &Path) -> anyhow::Result<()> {
    for path in html_files(site)? {
        let changes = if path.ends_with(CONTENTS) { &CHANGES_OF_CONTENTS[..] } else { &CHANGES };
        let shown = path.display().to_string();
        let text = std::fs::read_to_string(&path).with_context(|| shown.clone())?;
        let text = changed(text, changes).with_context(|| shown.clone())?;
        std::fs::write(&path, text).context(shown)?;
    }
    Ok(())
}

fn changed(mut text: String, changes: &[Change]) -> anyhow::Result<String> {
    for (from, to) in changes {
        let from = Regex::new(from)?;
        let count = from.find_iter(&text).count();
        ensure!(count == 1, "mdBook's page has {count} times and not once: {from}");
        text = from.replace(&text, *to).into_owned();
    }
    Ok(Regex::new(CORNER)?.replace_all(&text, "<td></td>").into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = r#"<label id="mdbook-sidebar-toggle" class="icon-button" for="mdbook-sidebar-toggle-anchor" title="a">
<svg></svg></label> <label>b</label> <div id="mdbook-menu-bar" class="c"> <div id="mdbook-search-wrapper"> <input id="mdbook-searchbar">
<h1 class="menu-title">Sonarfix</h1>
<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-light">Light</button></li>
<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-rust">Rust</button></li>
<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-ayu">Ayu</button></li>
<th style="text-align: right"></th><th>d</th>"#;

    #[test]
    fn a_page_is_changed() {
        let expected = r#"<button id="mdbook-sidebar-toggle" class="icon-button" type="button" title="a">
<svg></svg></button> <label>b</label> <div id="mdbook-menu-bar" role="banner" class="c"> <div id="mdbook-search-wrapper" role="search"> <input id="mdbook-searchbar" aria-label="Search">
<div class="menu-title">Sonarfix</div>
<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-light">Light</button></li>
<li role="none"><button role="menuitem" class="theme" id="mdbook-theme-navy">Dark</button></li>
<td></td><th>d</th>"#;
        assert_eq!(changed(PAGE.to_owned(), &CHANGES).unwrap(), expected);
    }

    #[test]
    fn the_contents_get_a_title_and_a_landmark() {
        let page = r#"<meta charset="UTF-8"><body class="sidebar-iframe-inner">a</body>"#;
        let expected = r#"<meta charset="UTF-8"><title>Contents - Sonarfix</title><body class="sidebar-iframe-inner"><main><h1>Contents</h1>a</main></body>"#;
        assert_eq!(changed(page.to_owned(), &CHANGES_OF_CONTENTS).unwrap(), expected);
    }

    /// A page of another version of mdBook.
    #[test]
    fn a_page_without_the_expected_text_is_an_error() {
        let page = PAGE.replace("menu-title", "title");
        assert!(changed(page, &CHANGES).unwrap_err().to_string().contains("menu-title"));
    }
}
