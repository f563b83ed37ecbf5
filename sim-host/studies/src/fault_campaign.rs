//! The fault campaign: random sequences of commands, faults of each part, power cuts, hostile frames and clock faults, over
//! robots of all compositions. Rules hold in every poll, whatever happens:
//!
//! - nothing panics;
//! - the motors are off while the loop does not run, without odometry, and, where the configuration says so, without a link or
//!   while the robot is lost;
//! - a robot without odometry, or for a minute without ranges, is not `Tracking`; each failure that a driver reports is counted;
//! - encoders are sampled and the status of the loop is sent, whatever the clock says;
//! - when all parts work again, a robot that is given its pose starts, and tracks; a part that dies then and returns takes
//!   nothing along: [`BACK_WITHIN`](sequence::BACK_WITHIN) later the robot is `Tracking` within [`RIGHT`](sequence::RIGHT).
//!
//! | module | content |
//! |---|---|
//! | [`case`](mod@case) | a case as data, drawn from a seed |
//! | [`sequence`] | plays a case |
//! | `robot` | the shipped application on simulated parts, and the rules of every poll |
//! | `parts`, `flash`, `room` | the parts, and what they measure |

pub mod case;
mod flash;
mod parts;
mod robot;
mod room;
pub mod sequence;

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::{Deserialize, Serialize};
use sonarfix_sim::progress::Progress;

use case::Case;

/// A case that breaks a rule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// The rule.
    pub rule: String,
    /// The case.
    pub case: Case,
}

/// Plays a case.
///
/// # Errors
/// The rule that is broken.
pub fn play(case: &Case) -> Result<(), String> {
    let played = catch_unwind(AssertUnwindSafe(|| sequence::play(case)));
    match played {
        Ok(result) => result.map_err(|error| format!("{error:#}")),
        Err(_) => Err("a panic".to_owned()),
    }
}

/// Plays the cases of the seeds from `first` on, as many as there are before an interruption; returns how many, and those that
/// break a rule, each minimised.
pub fn campaign(first: u64, count: u32, progress: &impl Progress) -> (usize, Vec<Failure>) {
    let play_one = |number: u32| {
        if progress.is_interrupted() {
            return None;
        }
        let case = Case::of(first.wrapping_add(number.into()));
        let failure = play(&case).err().map(|rule| minimised(Failure { rule, case }));
        progress.finished();
        Some(failure)
    };
    let played: Vec<Option<Failure>> = (0..count).into_par_iter().filter_map(play_one).collect();
    (played.len(), played.into_iter().flatten().collect())
}

/// The failure with as few actions as break a rule.
#[must_use]
pub fn minimised(failure: Failure) -> Failure {
    let mut failure = failure;
    let mut size = failure.case.actions.len().div_ceil(2).max(1);
    loop {
        let mut at = 0;
        while at < failure.case.actions.len() {
            let mut case = failure.case.clone();
            case.actions.drain(at..(at + size).min(case.actions.len()));
            match play(&case) {
                Err(rule) => failure = Failure { rule, case },
                Ok(()) => at += size,
            }
        }
        if size == 1 {
            return failure;
        }
        size = size.div_ceil(2);
    }
}
