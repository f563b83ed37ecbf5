//! The verdict of a kidnapped robot becomes `Lost`.

use sonarfix_studies::kidnapped::{self, WATCHED};

const TRIALS: u64 = 1_000;
/// "Within 15 cycles in 95 % of the trials."
const FIXES: usize = 15;
const SHARE: f64 = 0.95;

#[test]
fn a_kidnapped_robot_is_detected() {
    let outcomes = kidnapped::trials(0, TRIALS, &|| ()).unwrap();
    assert!(outcomes.iter().all(|o| o.tracked_before), "before the kidnapping");
    let mut cycles: Vec<_> =
        outcomes.iter().map(|o| o.called_after.unwrap_or(WATCHED + 1)).collect();
    cycles.sort_unstable();
    let in_time = cycles.iter().filter(|&&n| n <= FIXES).count() as f64 / cycles.len() as f64;
    let tracking_wrong = outcomes.iter().filter(|o| o.tracks_wrong_pose).count();
    println!(
        "median {}, 95 % {}, worst {}; within {FIXES}: {in_time}; tracking a wrong pose after \
         {WATCHED}: {tracking_wrong}",
        cycles[500], cycles[949], cycles[999]
    );
    assert!(in_time >= SHARE, "{in_time}");
}
