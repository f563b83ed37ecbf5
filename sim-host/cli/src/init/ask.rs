//! A question to the user.

use std::io::{IsTerminal, Write, stderr, stdin};

use sonarfix_new_robot::Question;

/// The answer on a terminal, which may be empty for the usual one of the board; without a terminal that one, at once.
pub fn ask(question: &Question, board: Option<&str>) -> anyhow::Result<String> {
    let Question { option, what, known, .. } = question;
    let default = question.usual(board);
    let mut answer = String::new();
    if stdin().is_terminal() && stderr().is_terminal() {
        let list =
            if known.is_empty() { String::new() } else { format!(" ({})", known.join(", ")) };
        let mut out = stderr().lock();
        write!(out, "{what}{list} [{default}]: ")?;
        out.flush()?;
        stdin().read_line(&mut answer)?;
    } else {
        eprintln!("{what}: {default} (--{option} is not given)");
    }
    let answer = answer.trim();
    Ok(if answer.is_empty() { default.to_owned() } else { answer.to_owned() })
}
