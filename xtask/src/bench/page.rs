//! The page `docs/benchmarks.md`.

use std::fmt::Write as _;

use anyhow::Context;

use super::{Figures, OnTarget, Subject};
use crate::emulator::Cost;

const HEAD: &str = "\
# What the filter costs, and what its peers cost

`cargo xtask bench` measures and writes this page; `cargo xtask budgets` holds what ships against
`budgets.toml` in CI, and `cargo xtask bless` rewrites that file when a change is wanted.

## The same work

Six states in `f32` (x, y, heading, mean and difference of the wheels' scale errors, track-width error).
A *predict* is one step of the wheels: state, Jacobian, P ← F P Fᵀ + Q with a diagonal Q; sine and cosine of
the mid-heading are passed in. An *update* is one scalar range with H = [a b 0 0 0 0]. Every filter
takes the same drive of 200 steps and 20 ranges (`bench/workload/src/drive.rs`) and
`bench/host/tests/agreement.rs` holds each, after every step, to the state and covariance of an independent filter in `f64`
(0.01 σ, and 0.1 % of P): no row does less work.

";

const NOTES: &str = "
Instructions are the mean over the drive, in brackets those of the worst call where it is another. *10 + 1* is
ten predicts and one update: a second of a robot that ticks ten times a second and looks once.

## What is counted, and how

- **Cortex-M4F, M3, M0+**: a program for each filter (`bench/mcu`), opt-level 3, fat LTO, one codegen unit, under QEMU
  with `-icount shift=7`, by SysTick; the calls' own cost is measured on an empty function and taken off. These are
  *instructions*, not cycles: on an M4F a division takes 14 cycles and a load often 2. M3 and M0+ compute in soft
  float. QEMU has no M0+ with enough memory, so an M3 runs the program built for the M0+, whose instructions are a
  subset of its own.
- **`s`**: the Cortex-M4F at opt-level `s`.
- **Code**: bytes of all functions that can be reached from predict and update in the linked program for the
  Cortex-M4F, library routines included, constants not.
- **Stack**: of the worst call on the Cortex-M4F; the memory below was painted before it.
- **x86-64**: `valgrind --tool=callgrind`, opt-level 3, the optimiser's vectorisers off
  (`-C no-vectorize-loops -C no-vectorize-slp`), because no microcontroller has what they need.
- **Time**: criterion's median of ten predicts and one update on the machine that wrote this page, vectorisers
  on, as a multiple of ours: times alone say nothing about another machine.

## What to make of it

- A peer's figure depends on what the compiler can see. A filter whose matrices are arrays, inlined into the
  place where its Jacobian is written, has the multiplications by the Jacobian's ones folded and those by its zeros
  shared; behind a box or a function pointer none. That is the whole difference between the two rows of minikalman,
  of which the boxed one is how the examples of its documentation build it. At `s` the difference is gone.
- multicalc differentiates the model itself; sine and cosine of its own are computed in `f64`, which a Cortex-M4F
  does in software. With them passed in (continued to first order, which gives the same derivatives) what is
  left is the cost of the differentiation.
- A plain or symmetrised form costs less than Joseph's and loses positive variances with a wide prior and a
  sharp range. The rows are not of equal worth; the form says which are.
- numeris links an allocator and does not use it here.

## The commands

```sh
cargo xtask bench                      # all of it, ten minutes: writes this page
cargo xtask peers                      # every filter does the same work
cargo xtask budgets                    # what ships, against budgets.toml
cargo xtask panics                     # no panic in the linked programs
```

## Budgets

`budgets.toml` holds what the shipped crate costs, seven states, sine and cosine included: instructions and stack of
the worst call over a drive of 200 steps and 20 ranges through a room of 8 walls (`bench/probe`), bytes of all functions that the calls reach, bytes
of the objects. *core* is predict, the expected range, the gate and update; *localizer* is odometry, aim (the
informative policy) and fix. A figure more than 2 % from the committed one fails, with both, to either side: what
got worse must be wanted, and what got better must be kept. `cargo xtask bless` measures again and rewrites the
file; the change of it is reviewed like code. Some bars no commit can move; they are in `xtask/src/budgets.rs`, with their reasons.
The stack is that of the calls made, not of every path there is.
";

/// The page. The first row is ours.
pub fn written(mut rows: Vec<(Subject, Figures)>, tools: &[String]) -> anyhow::Result<String> {
    let (_, ours) = rows.first().context("no row is ours")?;
    let (our_cost, our_time) = (ours.m4f.ten_and_one(), ours.nanoseconds);
    rows.sort_by(|(_, a), (_, b)| a.m4f.ten_and_one().total_cmp(&b.m4f.ten_and_one()));

    let mut page = HEAD.to_owned();
    writeln!(page, "Measured with {}.\n", tools.join("; "))?;
    page += "\
| | form | M4F predict | M4F update | M4F 10 + 1 | ÷ ours | at `s` | M3 10 + 1 | M0+ 10 + 1 | code, bytes | stack, bytes | x86-64 10 + 1 | time ÷ ours |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
";
    for (subject, figures) in &rows {
        let m4f = &figures.m4f;
        let cells = [
            format!("{} {}", subject.label, figures.version),
            subject.form.to_owned(),
            call(&m4f.predict),
            call(&m4f.update),
            grouped(m4f.ten_and_one()),
            format!("{:.1}", m4f.ten_and_one() / our_cost),
            cost(&figures.m4f_small),
            cost(&figures.m3),
            cost(&figures.m0plus),
            grouped_bytes(m4f.text),
            m4f.predict.most_stack.max(m4f.update.most_stack).to_string(),
            grouped(figures.x86),
            format!("{:.1}", figures.nanoseconds / our_time),
        ];
        writeln!(page, "| {} |", cells.join(" | "))?;
    }
    page += NOTES;
    Ok(page)
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
