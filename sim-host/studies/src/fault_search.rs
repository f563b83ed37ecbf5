//! The faults after which a robot does not know where it is, with a robot that searches for its pose.

use std::path::Path;

use sonarfix_hal::config::StartPose;
use sonarfix_map::{CLASSROOM, FaultKind, Scenario, Wheel};
use sonarfix_sim::progress::Progress;

use crate::fault_table::{self, ALL_DEAD, Kinds, Row, TableError, UNREADABLE, faults};

/// A cabinet in a corner, in the map: without it the room is itself when it is rotated by 180°, and a lost robot cannot
/// tell the two poses apart.
const CABINET: &str = r#"
    { name = "cabinet front", from = [0, 7], to = [0.9, 7] },
    { name = "cabinet side", from = [0.9, 7], to = [0.9, 8] },
]"#;

const KINDS: [(&str, Kinds); 6] = [
    ("an encoder channel dead", &[FaultKind::DeadEncoder(Wheel::Right)]),
    ("an encoder's channels swapped", &[FaultKind::ReversedEncoder(Wheel::Right)]),
    ("a tenth of an encoder's edges missed", &[FaultKind::MissingTicks(Wheel::Right, 0.1)]),
    UNREADABLE,
    ("brown-out and restart", &[FaultKind::BrownOut]),
    ALL_DEAD,
];

/// Number of rows.
#[expect(clippy::cast_possible_truncation, reason = "a dozen")]
pub const CASES: u32 = KINDS.len() as u32;

/// Runs the faults with the seeds 0 to `runs` − 1. After an interruption, rows without a finished run are missing.
///
/// # Errors
/// The [`TableError`] of the first run that fails.
pub fn rows(runs: u32, progress: &impl Progress) -> Result<Vec<Row>, TableError> {
    let scenarios = KINDS.into_iter().map(|(name, kinds)| Ok((name, scenario(kinds)?)));
    fault_table::finished(scenarios, runs, progress)
}

fn scenario(kinds: Kinds) -> Result<Scenario, TableError> {
    let text = CLASSROOM.replacen("\n]", CABINET, 1);
    let mut scenario = Scenario::parse(&text, "classroom.toml", Path::new(""))?;
    scenario.robot.start = StartPose::Unknown { region: None };
    scenario.faults = faults(kinds);
    Ok(scenario)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_room_has_the_cabinet() {
        let scenario = scenario(&[FaultKind::BrownOut]).unwrap();
        assert_eq!(scenario.floor.named_walls().len(), 6);
    }
}
