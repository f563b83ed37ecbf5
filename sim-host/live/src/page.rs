//! The page: it holds no data, and loads none but the events of its server.

use std::borrow::Cow;

const TEMPLATE: &str = include_str!("live.html");
const STYLE: &str = include_str!("live.css");
const SCRIPTS: &str = concat!(include_str!("curves.js"), include_str!("live.js"));

/// The page.
#[must_use]
pub fn html() -> String {
    let values: [(&str, Cow<'_, str>); 5] = [
        ("palette", sonarfix_report::palette_css().into()),
        ("style", STYLE.into()),
        ("view", sonarfix_report::VIEW.into()),
        ("drawing", sonarfix_report::DRAWING.into()),
        ("script", SCRIPTS.into()),
    ];
    sonarfix_report::fill(TEMPLATE, &values)
}
