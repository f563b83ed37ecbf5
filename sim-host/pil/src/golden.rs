//! Golden traces: requests and every bit of the answers, as text in git.
//!
//! ```text
//! # comment
//! request answer          postcard, in hexadecimal
//! ```
//!
//! A machine that reproduces the answers computes the same bits as the one that recorded them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use sonarfix_pil::{Answer, Begin, Request, Session, SessionKind, Wires, line};

use super::difference::difference;
use super::exchange::Exchange;
use super::pair::Pair;

/// Writes a trace, with a comment line first.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, words: &str, exchanges: &[Exchange]) -> anyhow::Result<()> {
    let mut text = format!("# {words}\n");
    for Exchange { request, answer } in exchanges {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{} {}", hex(request), hex(answer));
    }
    sonarfix_files::write(path, text)
}

/// Reads a trace.
///
/// # Errors
/// If it cannot be read; with file and line.
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

/// Replays all requests of a trace; every answer must be equal.
///
/// # Errors
/// At the first difference, or if it is not a trace.
pub fn replay(exchanges: &[Exchange], pair: &mut Pair) -> anyhow::Result<()> {
    ensure!(!exchanges.is_empty(), "the trace is empty");
    let mut rest = exchanges;
    while let [first, more @ ..] = rest {
        let Some(Request::Begin(begin, map)) = line::decode_request(&first.request) else {
            bail!("a session of the trace does not start with a begin request");
        };
        let length = more.iter().take_while(|exchange| !is_begin(exchange)).count();
        let (asked, next) = more.split_at(length);
        let began = line::decode_answer(&first.answer).context("an answer cannot be decoded")?;
        session(&begin, map, &began, asked, pair)?;
        rest = next;
    }
    Ok(pair.end()?)
}

fn is_begin(exchange: &Exchange) -> bool {
    matches!(line::decode_request(&exchange.request), Some(Request::Begin(..)))
}

fn session(
    begin: &Begin,
    map: &[u8],
    began: &Answer,
    asked: &[Exchange],
    pair: &mut Pair,
) -> anyhow::Result<()> {
    let wires = Wires::default();
    let mut session: Session = if begin.kind == SessionKind::Loop {
        let (session, actuators) = pair.begin_loop(begin, map, &wires)?;
        ensure!(*began == Answer::Started(actuators), "the first answer of the session differs");
        session
    } else {
        pair.begin_localizer(begin, map)?
    };
    for (number, Exchange { request, answer }) in asked.iter().enumerate() {
        let request = line::decode_request(request).context("a request cannot be decoded")?;
        let own = pair.execute(&mut session, &request)?;
        let mut space = [0; line::ANSWER_MAX];
        let bytes = line::encode(&own, &mut space).context("an answer is too long")?;
        if bytes != answer {
            let was = line::decode_answer(answer);
            let what = difference(&own, was.as_ref());
            bail!("exchange {number}, {request:?}: differs from the trace (there): {what}");
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
