//! The page: it holds no data, and draws the events of its connection.

use std::borrow::Cow;

const TEMPLATE: &str = include_str!("live.html");
const STYLE: &str = include_str!("live.css");
const SCRIPT: &str = include_str!("live.js");

/// What connects a page to what it shows.
#[derive(Debug, Clone, Copy)]
pub struct Connection<'a> {
    /// An element of the head: what the page may load. The server says so in its answer.
    pub policy: &'a str,
    /// Rules of its elements.
    pub style: &'a str,
    /// Its elements, above the map.
    pub controls: &'a str,
    /// A script that defines `Connection`, an object with two functions. `listen(take, say)` passes each event to `take`, and the state
    /// of the connection in words to `say`. `order(body, signal)` sends an order, and gives its answer.
    pub script: &'a str,
}

impl Connection<'static> {
    /// To the server that the page comes from.
    pub const SERVER: Self =
        Self { policy: "", style: "", controls: "", script: include_str!("server.js") };
}

/// The page with a connection.
#[must_use]
pub fn html(connection: &Connection<'_>) -> String {
    let values: [(&str, Cow<'_, str>); 11] = [
        ("policy", connection.policy.into()),
        ("palette", sonarfix_report::palette_css().into()),
        ("style", STYLE.into()),
        ("curves-style", sonarfix_report::CURVES_STYLE.into()),
        ("connection-style", connection.style.into()),
        ("controls", connection.controls.into()),
        ("view", sonarfix_report::VIEW.into()),
        ("drawing", sonarfix_report::DRAWING.into()),
        ("connection", connection.script.into()),
        ("curves", sonarfix_report::CURVES.into()),
        ("script", SCRIPT.into()),
    ];
    sonarfix_report::fill(TEMPLATE, &values)
}
