//! Why mutants that survive change no behaviour: `docs/mutation.toml`.

use std::collections::BTreeMap;

use anyhow::Context;
use serde::Deserialize;

use crate::cargo;

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    reason: Vec<Reason>,
}

/// A reason, and the mutants that it holds for.
#[derive(Deserialize)]
struct Reason {
    text: String,
    mutants: Vec<String>,
}

/// The reason of each mutant, by its key.
pub type Reasons = BTreeMap<String, String>;

/// Reads the file.
pub fn read() -> anyhow::Result<Reasons> {
    let path = cargo::root().join("docs/mutation.toml");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    parse(&text).with_context(|| path.display().to_string())
}

fn parse(text: &str) -> anyhow::Result<Reasons> {
    let file: File = toml::from_str(text)?;
    let mut reasons = Reasons::new();
    for Reason { text, mutants } in file.reason {
        for mutant in mutants {
            let before = reasons.insert(mutant.clone(), text.clone());
            anyhow::ensure!(before.is_none(), "two reasons for `{mutant}`");
        }
    }
    Ok(reasons)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mutant_has_one_reason() {
        let text = |mutants: &str| format!("[[reason]]\ntext = \"equal\"\nmutants = [{mutants}]\n");
        let reasons = parse(&text(r#""a.rs: replace < with <= in f (1)", "b""#)).unwrap();
        assert_eq!(reasons.get("b").map(String::as_str), Some("equal"));
        assert_eq!(reasons.len(), 2);
        assert!(parse(&(text("\"b\"") + &text("\"b\""))).is_err());
        assert!(parse("").unwrap().is_empty());
    }
}
