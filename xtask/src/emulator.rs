//! Runs a program for an emulated board under QEMU and reads its report.

use std::collections::BTreeMap;
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo;
use crate::program::Target;
use crate::workspace::Workspace;

/// Seconds after which a program is killed; the longest takes three.
const TIME_OUT: &str = "120";

/// The cost of all calls of one kind, without the overhead of the call itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Number of calls.
    pub calls: u32,
    /// Instructions of all calls.
    pub instructions: u32,
    /// Instructions of the most expensive call.
    pub most_instructions: u32,
    /// Bytes of stack of the deepest call.
    pub most_stack: u32,
}

impl Cost {
    /// Instructions of a call, on average.
    pub fn mean(&self) -> f64 {
        f64::from(self.instructions) / f64::from(self.calls)
    }
}

/// A program's report: numbers by key.
#[derive(Debug)]
pub struct Report(BTreeMap<String, Vec<u32>>);

impl Report {
    /// The cost of the calls of this kind.
    pub fn cost(&self, key: &str) -> anyhow::Result<Cost> {
        let &[calls, instructions, most_instructions, most_stack] = self.numbers(key)? else {
            anyhow::bail!("the program's line `{key}` is not a cost");
        };
        ensure!(calls > 0, "the program measured no call of `{key}`");
        Ok(Cost { calls, instructions, most_instructions, most_stack })
    }

    /// A single number.
    pub fn number(&self, key: &str) -> anyhow::Result<u32> {
        let &[number] = self.numbers(key)? else {
            anyhow::bail!("the program's line `{key}` is not one number");
        };
        Ok(number)
    }

    fn numbers(&self, key: &str) -> anyhow::Result<&[u32]> {
        Ok(self.0.get(key).with_context(|| format!("the program reported no `{key}`"))?)
    }
}

/// Runs a built program to its end.
pub fn run(target: &Target, workspace: Workspace, name: &str) -> anyhow::Result<Report> {
    let mut command = Command::new("timeout");
    command.args([TIME_OUT, "qemu-system-arm", "-machine", target.board]);
    // 2⁷ ns pass with every instruction.
    command.args(["-icount", "shift=7", "-display", "none", "-monitor", "none", "-serial", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]);
    command.arg(target.program(workspace, name));
    let text = cargo::output(command).with_context(|| {
        format!("{name} on {}: is `qemu-system-arm` installed? (124 is a time-out)", target.name)
    })?;
    parse(&text).with_context(|| format!("{name} on {}", target.name))
}

fn parse(text: &str) -> anyhow::Result<Report> {
    let mut report = BTreeMap::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        let numbers: Result<Vec<u32>, _> = words.map(str::parse).collect();
        let numbers = numbers.with_context(|| format!("cannot read `{line}`"))?;
        report.insert(key.to_owned(), numbers);
    }
    Ok(Report(report))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_line_by_line() {
        let report = parse("predict 200 80000 412 96\nobject 180\n").unwrap();
        let cost = report.cost("predict").unwrap();
        assert_eq!((cost.calls, cost.most_instructions, cost.most_stack), (200, 412, 96));
        assert!((cost.mean() - 400.0).abs() < 1e-9);
        assert_eq!(report.number("object").unwrap(), 180);
    }

    #[test]
    fn other_output_is_refused() {
        assert!(parse("panicked\n").unwrap().number("panicked").is_err());
        assert!(parse("qemu: no such machine\n").is_err());
        assert!(parse("predict 0 0 0 0\n").unwrap().cost("predict").is_err());
        assert!(parse("").unwrap().cost("predict").is_err());
    }
}
