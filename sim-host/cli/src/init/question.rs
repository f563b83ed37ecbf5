//! A question to the user.

use std::io::{IsTerminal, Write, stderr, stdin};

use anyhow::bail;

/// A question with its option and its default.
pub struct Question<'a> {
    option: &'a str,
    what: &'a str,
    /// The possible answers; any other if there are none.
    known: &'a [&'a str],
    default: &'a str,
}

impl<'a> Question<'a> {
    pub fn new(option: &'a str, what: &'a str, known: &'a [&'a str], default: &'a str) -> Self {
        Self { option, what, known, default }
    }

    /// The value of the option. If it is not given: the answer on a terminal, which may be empty for the default; without a
    /// terminal the default, at once.
    ///
    /// # Errors
    /// If the answer is not among the known ones or has a character that no value has.
    pub fn ask(&self, given: Option<&str>) -> anyhow::Result<String> {
        let answer = match given {
            Some(given) => given.to_owned(),
            None => self.answer()?,
        };
        let answer = answer.trim();
        let list = self.known.join(", ");
        if !self.known.is_empty() && !self.known.contains(&answer) {
            bail!("{}: \"{answer}\" is not one of {list}", self.option);
        }
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || " ._-".contains(letter);
        if !answer.chars().all(is_plain) {
            bail!(
                "{}: \"{answer}\" is no value; write, for example, {}",
                self.option,
                self.default
            );
        }
        Ok(answer.to_owned())
    }

    fn answer(&self) -> anyhow::Result<String> {
        let Self { option, what, known, default } = self;
        let mut answer = String::new();
        if stdin().is_terminal() && stderr().is_terminal() {
            let list =
                if known.is_empty() { String::new() } else { format!(" ({})", known.join(", ")) };
            let mut out = stderr().lock();
            write!(out, "{what}{list} [{default}]: ")?;
            out.flush()?;
            stdin().read_line(&mut answer)?;
        } else {
            eprintln!("{what}: {default} ({option} is not given)");
        }
        let answer = answer.trim();
        Ok(if answer.is_empty() { (*default).to_owned() } else { answer.to_owned() })
    }
}
