//! The table of all filters in `docs/benchmarks.md`.

use std::fmt::Write as _;

use anyhow::Context;

use super::subjects::{Figures, OnTarget, Subject};
use crate::emulator::Cost;

/// The table. The first row is ours.
pub fn of(mut rows: Vec<(Subject, Figures)>) -> anyhow::Result<String> {
    let (_, ours) = rows.first().context("no row is ours")?;
    let (our_cost, our_time) = (ours.m4f.ten_and_one(), ours.nanoseconds);
    let kernel = rows.iter().find(|(subject, _)| subject.name == "kernel");
    let kernel_cost = kernel.context("no row is the kernel's")?.1.m4f.ten_and_one();
    rows.sort_by(|(_, a), (_, b)| a.m4f.ten_and_one().total_cmp(&b.m4f.ten_and_one()));

    let mut table = "\
| | form | M4F predict | M4F update | M4F 10 + 1 | ÷ shipped | ÷ kernel | fused | at `s` | M3 10 + 1 | M0+ 10 + 1 | code, bytes | stack, bytes | x86-64 10 + 1 | time ÷ shipped |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
"
    .to_owned();
    for (subject, figures) in &rows {
        let m4f = &figures.m4f;
        let cells = [
            format!("{} {}", subject.label, figures.version),
            subject.form.to_owned(),
            call(&m4f.predict),
            call(&m4f.update),
            grouped(m4f.ten_and_one()),
            format!("{:.1}", m4f.ten_and_one() / our_cost),
            format!("{:.1}", m4f.ten_and_one() / kernel_cost),
            cost(&figures.m4f_fused),
            cost(&figures.m4f_small),
            cost(&figures.m3),
            cost(&figures.m0plus),
            grouped_bytes(m4f.text),
            m4f.predict.most_stack.max(m4f.update.most_stack).to_string(),
            grouped(figures.x86),
            format!("{:.1}", figures.nanoseconds / our_time),
        ];
        writeln!(table, "| {} |", cells.join(" | "))?;
    }
    Ok(table)
}

fn cost(on: &OnTarget) -> String {
    grouped(on.ten_and_one())
}

fn call(cost: &Cost) -> String {
    let (mean, worst) = (grouped(cost.mean()), grouped(f64::from(cost.most_instructions)));
    if mean == worst { mean } else { format!("{mean} ({worst})") }
}

fn grouped_bytes(bytes: u64) -> String {
    grouped_digits(&bytes.to_string())
}

/// Rounded, its thousands apart.
fn grouped(number: f64) -> String {
    grouped_digits(&format!("{number:.0}"))
}

fn grouped_digits(digits: &str) -> String {
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_apart() {
        assert_eq!(
            ["0", "999", "1000", "1234567"].map(grouped_digits),
            ["0", "999", "1,000", "1,234,567"]
        );
        assert_eq!(grouped(2234.5 + 0.1), "2,235");
    }

    #[test]
    fn the_worst_call_is_named_where_it_is_another() {
        let cost = Cost { calls: 2, instructions: 3000, most_instructions: 1500, most_stack: 0 };
        assert_eq!(call(&cost), "1,500");
        assert_eq!(call(&Cost { most_instructions: 1600, ..cost }), "1,500 (1,600)");
    }
}
