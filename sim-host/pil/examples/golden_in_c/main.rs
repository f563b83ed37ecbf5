//! Writes a golden trace as a file that the C program `c/tests/replay.c` replays: `golden_in_c TRACE FILE`.
//!
//! ```text
//! has_loop u8 | config u32 length, bytes | map u32 length, bytes | at u64 | start 5 f32
//! frames of commands: u32 number, each u32 length, bytes       what starts a loop
//! records: operation u8, its numbers                           `requests`
//! 0 | hash u64                                                 of all answers of the trace: `answers`
//! ```
//!
//! Numbers are little-endian. A trace with a ranger that is read by registers is refused: a C program reports ranges.

mod answers;
mod requests;

use std::path::Path;

use anyhow::{Context, bail, ensure};
use sonarfix_c::config::sonarfix_config_t;
use sonarfix_link::{Command, Sender, SessionCommand, baked, frame};
use sonarfix_pil::{Begin, Request, SessionKind, line};
use sonarfix_pil_host::{Exchange, golden};

use answers::Hash;
use requests::Records;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [trace, file] = arguments.as_slice() else { bail!("usage: golden_in_c TRACE FILE") };
    let exchanges = golden::read(Path::new(trace))?;
    sonarfix_files::write(Path::new(file), converted(&exchanges)?)
}

fn converted(exchanges: &[Exchange]) -> anyhow::Result<Vec<u8>> {
    let [first, rest @ ..] = exchanges else { bail!("the trace is empty") };
    let Some(Request::Begin(begin, map)) = line::decode_request(&first.request) else {
        bail!("the trace does not start with a begin request");
    };
    let mut bytes = Vec::new();
    bytes.push(u8::from(begin.kind == SessionKind::Loop));
    block(&mut bytes, &configuration(&begin)?);
    block(&mut bytes, map);
    bytes.extend(begin.at.ticks().to_le_bytes());
    for number in requests::start(begin.start.as_ref()) {
        bytes.extend(number.to_le_bytes());
    }
    let commands = commands(&begin);
    bytes.extend(u32::try_from(commands.len())?.to_le_bytes());
    for frame in &commands {
        block(&mut bytes, frame);
    }
    let mut records = Records::new(&begin.config)?;
    let mut hash = Hash::default();
    for Exchange { request, answer } in rest {
        let request = line::decode_request(request).context("a request cannot be decoded")?;
        let answer = line::decode_answer(answer).context("an answer cannot be decoded")?;
        ensure!(!matches!(request, Request::Begin(..)), "the trace has several sessions");
        if records.add(&request)? {
            hash.add(&answer)?;
        }
    }
    bytes.extend(records.bytes);
    bytes.push(0);
    bytes.extend(hash.value().to_le_bytes());
    Ok(bytes)
}

/// The configuration: of a loop its image; of a localizer alone, whose drivers have none, its structure.
fn configuration(begin: &Begin) -> anyhow::Result<Vec<u8>> {
    if begin.kind == SessionKind::Loop {
        let mut buffer = [0; baked::LENGTH_MAX];
        return Ok(baked::write(&begin.config, &mut buffer)?.to_vec());
    }
    let config = sonarfix_config_t::from(&begin.config.localizer);
    // SAFETY: the structure consists of words without padding, and any bits are valid bytes.
    #[expect(unsafe_code, reason = "the bytes of a structure of C")]
    let bytes: [u8; size_of::<sonarfix_config_t>()] = unsafe { std::mem::transmute(config) };
    Ok(bytes.to_vec())
}

fn block(to: &mut Vec<u8>, bytes: &[u8]) {
    let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    to.extend(length.to_le_bytes());
    to.extend(bytes);
}

/// The frames of the commands with which the recorded session of a loop began.
fn commands(begin: &Begin) -> Vec<Vec<u8>> {
    if begin.kind == SessionKind::Localizer {
        return Vec::new();
    }
    let [t0, t1, t2, t3, t4, t5, t6, t7] = begin.at.ticks().to_le_bytes();
    // The first run of a robot whose store is empty.
    let session = [1, 0, 0, 0, t0, t1, t2, t3, t4, t5, t6, t7];
    let session = sonarfix::map::image::checksum(&session);
    let set_pose = begin.start.map(Command::SetPose);
    let commands = set_pose.into_iter().chain([Command::Start]);
    let commands = commands.map(|command| SessionCommand { session, command });
    let open = SessionCommand { session: 0, command: Command::OpenSession };
    let mut buffer = frame::EMPTY;
    (0..)
        .zip(std::iter::once(open).chain(commands))
        .map(|(sequence, command)| {
            Sender::starting_at(sequence).frame(&command, &mut buffer).to_vec()
        })
        .collect()
}
