//! The page `docs/benchmarks.md`.

use std::fmt::Write as _;

use anyhow::Context;

use super::subjects::{Figures, OnTarget, Subject};
use crate::emulator::Cost;

const HEAD: &str = "\
# Cost of the filter and of its peers

`cargo xtask bench` measures and writes this page. `cargo xtask budgets` compares the shipped crate with `budgets.toml` in CI, and
`cargo xtask bless` rewrites that file for an intended change.

## The task

Six states in `f32` (x, y, heading, mean and difference of the wheels' scale errors, track-width error).
A *predict* processes one wheel travel: state, Jacobian, P ← F P Fᵀ + Q with a diagonal Q; sine and cosine of
the mid-heading are arguments. An *update* processes one scalar range with H = [a b 0 0 0 0]. Every filter
processes the same drive of 200 travels and 20 ranges (`bench/workload/src/drive.rs`).
`bench/host/tests/agreement.rs` compares each, after every call, with the state and covariance of an independent filter in `f64`
(0.01 σ, and 0.1 % of P), so that every peer does the same work.

The peers are libraries, and code *derived by sympy*: the equations multiplied out stage by stage, each common subexpression
computed once, P as its upper triangle (`bench/workload/generate/generate.py` writes `bench/workload/src/filters/derived/code.rs`).
This is little arithmetic for this task without a change of the method. The row *Crazyflie's form* is the filter of that robot (`kalman_core.c`) with these six states: dense
P ← A P Aᵀ by `arm_mat_mult_f32` and `arm_mat_trans_f32` of CMSIS-DSP, Joseph's form for a range, then P made symmetric and limited
(`bench/workload/src/filters/crazyflie.rs`). The C source is that of the package `cmsisdsp` of PyPI, which the command downloads
(`bench/cmsis/requirements.txt`); GCC compiles it at the same level of optimisation, its loops unrolled as the library's own build does.

*Fused multiply-add* rounds a product and a sum once. No row uses it in any column but one: Sonarfix because it computes the same bits on every
processor, the other Rust filters because stable Rust has no such operation without a system library, CMSIS-DSP because the option is turned off. In the
column *fused* every row uses it: rustc gets `-C llvm-args=-fp-contract=fast`, GCC `-ffp-contract=fast`, which is GCC's default, and
products with a sum become `vfma`. It hardly changes the figures of Rust, because without it LLVM
computes both by `vmla`, one instruction as well, which rounds twice and has the bits of the separate operations.

Sonarfix has two rows:

- *As it ships* does more than the peers: seven states, its own sine and cosine, the full noise of each wheel, and the checks
  of the input. This is not a comparison of six states with six. The column *÷ shipped* refers to it.
- *Kernel alone* (`bench/ours/src/kernel.rs`) is closest to the peers' work: six states, with sine, cosine and Q as
  arguments. It omits sine and cosine, the range scale's row of the motion, and the checks with the copy
  for their rollback. Its update does more than the peers': it has all seven states, since no version for six exists, and
  adds motion and correction to the pose with compensation (Kahan). Its Q is the noise of each wheel, of which the peers' diagonal is a simpler form; the agreement test compares it with that Q.
  The column *÷ kernel* refers to it.

";

const NOTES: &str = "
Instructions are the mean over the drive, with the worst call in brackets if it differs. *10 + 1* is ten predicts and one update: one
second of a robot with ten encoder samples and one ping per second.

## Method

- **Cortex-M4F, M3, M0+**: one program per filter (`bench/mcu`), opt-level 3, fat LTO, one codegen unit, under QEMU
  with `-icount shift=7`, counted by SysTick; the overhead of a call is measured on an empty function and subtracted. The figures are
  *instructions*, not cycles: on an M4F a division takes 14 cycles and a load often 2. M3 and M0+ compute in soft
  float: on the M3 by the compiler's library, on the M0+ every row, ours and the peers', by products and sums of `sonarfix-soft-float`, which
  `emulated-board` links. QEMU has no M0+ with enough memory; an M3 runs the program built for the M0+, whose instruction set it contains.
- **`s`**: the Cortex-M4F at opt-level `s`.
- **Code**: bytes of all functions that can be reached from predict and update in the linked program for the
  Cortex-M4F, with library routines, without constants.
- **Stack**: of the deepest call on the Cortex-M4F, by painting the memory below.
- **x86-64**: `valgrind --tool=callgrind`, opt-level 3, without vectorisation (`-C no-vectorize-loops -C no-vectorize-slp`), because
  these microcontrollers have no vector instructions.
- **Time**: criterion's median of ten predicts and one update on the machine that wrote this page, with vectorisation, relative to the shipped
  filter: absolute times do not transfer to another machine.

## Discussion

- A peer's figure depends on what the compiler can inline. If the matrices are arrays and the filter is inlined where its Jacobian is
  defined, multiplications by the Jacobian's ones and zeros are folded; behind a box or a function pointer they are not. This explains the
  two rows of minikalman; the boxed one follows the examples of its documentation. At `s` most of the difference vanishes.
- multicalc differentiates the model itself; its sine and cosine are computed in `f64`, which a Cortex-M4F
  does in software. With sine and cosine as arguments (continued to first order, which gives the same derivatives) the cost of the
  differentiation remains.
- A plain or symmetrised form costs less than Joseph's, and its variances become negative with a wide prior and a
  precise range. The rows are not equivalent; they are distinguished by the column *form*.
- The rows *derived by sympy* show what the equations cost without a library. The kernel needs fewer instructions because it applies ten motions to P
  at once. Its update computes seven states, and stays positive definite where the plain form does not: it adds Joseph's second pass where the innovation
  variance exceeds 256 times the noise, which no range of this drive does.
- `libm`'s `sqrtf`, which the deviations in the telemetry need seven times a tick, takes 76 instructions on the Cortex-M4F: it is integer arithmetic on every
  target. `vsqrt` would have the same bits, because IEEE 754 prescribes the rounding of a root. Stable Rust reaches it in a crate without a standard library
  only by inline assembly or by a declaration of C's `sqrtf`, both of which are unsafe code, which these crates forbid. It would save some 500
  instructions of 8,000 in a poll with a tick.
- The Crazyflie's form is dense: it multiplies by the Jacobian's ones and zeros, in functions of a library which the compiler cannot see through.
- numeris links an allocator and does not use it here.

### The fix on a Cortex-M0+

`cargo xtask parts --fix` attributes every instruction of the worst fix, and counts the routines that compute in software:

@FIX@
Most is arithmetic in software. The core has no product of 64 bits and does not count leading zeros. Products, sums and differences are those of
`sonarfix-soft-float`, which have the same bits as the compiler's library (`compiler-builtins`) and take half of its instructions: without
`use sonarfix_soft_float as _;` in `firmware/emulated/board/src/arm.rs` a product takes 103, a sum 93 and a difference 113, and the fix 85,830.

## The worst poll of the loop, by part

`cargo xtask parts`: the longest poll of 60 s of `classroom` on an emulated Cortex-M4F, at opt-level `s` as the firmware is built, without the polls that
start the loop. A function belongs to the part that its path names, a library routine to its caller.

@POLL@
## Memory by crate

`cargo xtask size`: the firmware of the STM32F405, in bytes; *bar* is the limit of core, loop and drivers, with its reasons in
`xtask/src/firmware/size.rs`.

@MEMORY@
## Commands

```sh
cargo xtask bench                      # all of it, ten minutes: writes this page; needs pip, gcc-arm-none-eabi, libnewlib-arm-none-eabi, qemu, valgrind
cargo xtask peers                      # every filter does the same work; needs pip and a C compiler
pip install sympy==1.14.0              # for the code derived by sympy
python bench/workload/generate/generate.py --check
cargo xtask budgets                    # the shipped crate, against budgets.toml
cargo xtask bless --budgets            # writes budgets.toml
cargo xtask parts                      # the worst poll of the loop by part; --fix: the worst fix on a Cortex-M0+, and its arithmetic
cargo xtask size                       # flash and RAM of the firmware by crate
cargo xtask panics                     # no panic in the linked programs
```

## A time-of-flight ranger

`sonarfix pil paper --policy informative --seconds 60` prints the instructions of predict, aim and fix of a Cortex-M4F with a sonar, with `--light` those with a time-of-flight
ranger; `budgets.toml` has the worst ones (*light_aim*, *light_fix*). The aim of such a ranger compares 18 bearings, whatever the map, and costs three to four times that of a sonar.

## Budgets

`budgets.toml` contains the cost of the shipped crate, with seven states, sine and cosine: instructions and stack of
the worst call over a drive of 200 travels and 20 ranges through a room of 8 walls (`firmware/emulated/probe`), bytes of all functions that can
be reached from the calls, bytes of the objects. *core* is predict, gate and update, with their sine and cosine; *core_and_expect* adds the
expected range; *localizer* is odometry, aim (the informative policy) and fix; *light_aim* and *light_fix* are those of a time-of-flight ranger, *pair_aim* the aims of two rotating sonars, of which one is chosen, and *pair_fix* its fix
(*rangers_bytes* is the same localizer); *turn* and *turn_fix* are odometry and fix with a gyro, *gyro_bytes* the
integral of its samples; *heading* and *pose* come from outside. *building* is the worst aim over 640 poses in
a building of rooms of 4 m × 5 m, with a baked map and a reach of the sonar of 4 m.

A figure that differs by more than 2 % from the committed one fails, in either direction: an increase must be intended, and a decrease must not be
lost again. `cargo xtask bless` measures and rewrites the file; its change is reviewed like code. The stack is that of the measured calls, not
of every possible path.

There are also limits (`xtask/src/budgets.rs`, with their reasons). A limit that the committed table meets cannot be exceeded by a new
table; one that it does not meet is reported by `budgets` and by `bless` each time:

";

/// The tables of other commands.
pub struct Tables {
    /// The worst poll by part.
    pub poll: String,
    /// The worst fix on a Cortex-M0+ by part.
    pub fix: String,
    /// Flash and variables by crate.
    pub memory: String,
    /// The limits.
    pub bars: String,
}

impl Tables {
    /// The notes, with the tables in their places.
    fn notes(&self) -> String {
        let notes = NOTES.replace("@FIX@", &self.fix).replace("@POLL@", &self.poll);
        notes.replace("@MEMORY@", &self.memory) + &self.bars
    }
}

/// The page. The first row is ours.
pub fn written(
    mut rows: Vec<(Subject, Figures)>,
    tools: &[String],
    tables: &Tables,
) -> anyhow::Result<String> {
    let (_, ours) = rows.first().context("no row is ours")?;
    let (our_cost, our_time) = (ours.m4f.ten_and_one(), ours.nanoseconds);
    let kernel = rows.iter().find(|(subject, _)| subject.name == "kernel");
    let kernel_cost = kernel.context("no row is the kernel's")?.1.m4f.ten_and_one();
    rows.sort_by(|(_, a), (_, b)| a.m4f.ten_and_one().total_cmp(&b.m4f.ten_and_one()));

    let mut page = HEAD.to_owned();
    writeln!(page, "Measured with {}.\n", tools.join("; "))?;
    page += "\
| | form | M4F predict | M4F update | M4F 10 + 1 | ÷ shipped | ÷ kernel | fused | at `s` | M3 10 + 1 | M0+ 10 + 1 | code, bytes | stack, bytes | x86-64 10 + 1 | time ÷ shipped |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
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
        writeln!(page, "| {} |", cells.join(" | "))?;
    }
    page += &tables.notes();
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
