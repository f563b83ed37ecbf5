//! Golden traces: what was asked, and every bit of what was answered, as text in git.
//!
//! ```text
//! # words
//! request answer          postcard, in hexadecimal
//! ```
//!
//! Whoever computes the same answers again computes what was computed when the trace was made.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use sonarfix_pil::{Answer, Begin, Device, Request, Wires, line};

use super::difference::difference;
use super::pair::Pair;

/// A question and its answer, as postcard writes them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exchange {
    /// The question.
    pub request: Vec<u8>,
    /// The answer.
    pub answer: Vec<u8>,
}

/// Writes a trace, with a line of words before it.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, words: &str, exchanges: &[Exchange]) -> anyhow::Result<()> {
    let mut text = format!("# {words}\n");
    for Exchange { request, answer } in exchanges {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{} {}", hex(request), hex(answer));
    }
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}

/// Reads a trace.
///
/// # Errors
/// With file and line, if it cannot be read.
pub fn read(path: &Path) -> anyhow::Result<Vec<Exchange>> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.starts_with('#'));
    let exchange = |(number, line): (u32, &str)| {
        let parts = line.split_once(' ').and_then(|(request, answer)| {
            Some(Exchange { request: bytes(request)?, answer: bytes(answer)? })
        });
        parts.with_context(|| format!("{}, line {number}: no exchange", path.display()))
    };
    lines.map(exchange).collect()
}

/// Asks all of a trace again; every answer must be what it was.
///
/// # Errors
/// At the first answer that is not, or at a trace that is none.
pub fn replay(exchanges: &[Exchange], pair: &mut Pair) -> anyhow::Result<()> {
    ensure!(!exchanges.is_empty(), "the trace is empty");
    let mut rest = exchanges;
    while let [first, more @ ..] = rest {
        let Some(Request::Begin(begin, map)) = line::request(&first.request) else {
            bail!("a session of the trace does not begin as one");
        };
        let length = more.iter().take_while(|exchange| !is_begin(exchange)).count();
        let (asked, next) = more.split_at(length);
        let began = line::answer(&first.answer).context("an answer cannot be read")?;
        session(&begin, map, &began, asked, pair)?;
        rest = next;
    }
    Ok(pair.end()?)
}

fn is_begin(exchange: &Exchange) -> bool {
    matches!(line::request(&exchange.request), Some(Request::Begin(..)))
}

fn session(
    begin: &Begin,
    map: &[u8],
    began: &Answer,
    asked: &[Exchange],
    pair: &mut Pair,
) -> anyhow::Result<()> {
    let wires = Wires::default();
    let mut device: Device = if begin.board.is_some() {
        let (device, actuators) = pair.begin_loop(begin, map, &wires)?;
        ensure!(*began == Answer::Began(actuators), "the session begins otherwise");
        device
    } else {
        pair.begin_localizer(begin, map)?
    };
    for (number, Exchange { request, answer }) in asked.iter().enumerate() {
        let request = line::request(request).context("a request cannot be read")?;
        let own = pair.ask(&mut device, &request)?;
        let mut space = [0; line::ANSWER_MAX];
        let bytes = line::bytes(&own, &mut space).context("an answer is too long")?;
        if bytes != answer {
            let was = line::answer(answer);
            let what = difference(&own, was.as_ref());
            bail!("exchange {number}, {request:?}: not what it was (there): {what}");
        }
    }
    Ok(())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn bytes(hex: &str) -> Option<Vec<u8>> {
    let digits = hex.as_bytes().chunks(2);
    digits.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()).collect()
}
