//! Pages in headless Chromium.

#![expect(clippy::unwrap_used, reason = "all of this file is a test helper")]

use std::process::Command;

use crate::skipped;

/// Virtual time, so that the page's five seconds pass at once.
const FIVE_SECONDS: &str = "--virtual-time-budget=5000";

/// The page at an address after its scripts ran, with further flags; `None`, with a message, without a browser.
pub fn opened(url: &str, flags: &[&str]) -> Option<String> {
    let Some(browser) = sonarfix_chromium::headless() else {
        skipped::because(&format!("none of {:?} is on the path", sonarfix_chromium::NAMES));
        return None;
    };
    Some(output_of(browser, url, &[&["--dump-dom"], flags].concat()))
}

/// The page after its scripts ran and showed all of the texts. Virtual time goes on while the body of an answer arrives,
/// so that a page on a busy machine may end before the last event is drawn; it is then opened again, at most 20 times.
pub fn opened_until(url: &str, flags: &[&str], texts: &[&str]) -> Option<String> {
    let mut dom = opened(url, flags)?;
    for _ in 1..20 {
        if texts.iter().all(|text| dom.contains(text)) {
            break;
        }
        dom = opened(url, flags)?;
    }
    Some(dom)
}

/// Takes pictures of a page, light and dark, into the folder of `SONARFIX_PICTURES`, if it is set.
pub fn picture(url: &str, name: &str, flags: &[&str]) {
    let Ok(folder) = std::env::var("SONARFIX_PICTURES") else { return };
    let size = flags.concat().replace(|c: char| !c.is_ascii_digit() && c != ',', "");
    for (scheme, setting) in [("light", "1"), ("dark", "0")] {
        let Some(browser) = sonarfix_chromium::headless() else { return };
        let file = format!("--screenshot={folder}/{name}-{size}-{scheme}.png");
        let setting = format!("--blink-settings=preferredColorScheme={setting}");
        output_of(browser, url, &[&[file.as_str(), &setting], flags].concat());
    }
}

fn output_of(mut browser: Command, url: &str, flags: &[&str]) -> String {
    let profile = tempfile::tempdir().unwrap();
    let output = browser
        .arg(FIVE_SECONDS)
        .args(flags)
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(url)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The opening tag of the page.
pub fn root(dom: &str) -> &str {
    let from = dom.find("<html").unwrap();
    dom.get(from..from + dom.get(from..).unwrap().find('>').unwrap()).unwrap()
}

/// The player has drawn, and no script has failed.
pub fn assert_ready(dom: &str) {
    assert!(root(dom).contains("data-ready=\"true\""), "{}", root(dom));
    assert!(!root(dom).contains("data-error"), "{}", root(dom));
}
