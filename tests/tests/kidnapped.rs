//! A robot that is picked up and put down elsewhere must say that it is lost.

use sonarfix_sim::kidnapped::{self, WATCHED};

const TRIALS: u64 = 1_000;
/// "Within 15 fixes in 95 % of the trials."
const FIXES: usize = 15;
const SHARE: f64 = 0.95;

#[test]
fn a_robot_that_is_carried_off_says_so() {
    let outcomes = kidnapped::trials(TRIALS).unwrap();
    assert!(outcomes.iter().all(|o| o.tracked_before), "before it is picked up");
    let mut fixes: Vec<_> =
        outcomes.iter().map(|o| o.called_after.unwrap_or(WATCHED + 1)).collect();
    fixes.sort_unstable();
    let in_time = fixes.iter().filter(|&&n| n <= FIXES).count() as f64 / fixes.len() as f64;
    let sure = outcomes.iter().filter(|o| o.falsely_sure).count();
    println!(
        "median {}, 95 % {}, worst {}; within {FIXES}: {in_time}; sure of a wrong pose after \
         {WATCHED}: {sure}",
        fixes[500], fixes[949], fixes[999]
    );
    assert!(in_time >= SHARE, "{in_time}");
}
