//! The faults after which a robot does not know where it is, with a robot that searches for its pose.

use std::path::Path;

use rayon::prelude::*;
use sonarfix_hal::config::StartPose;
use sonarfix_map::{CLASSROOM, Fault, FaultKind, Scenario, Wheel};
use sonarfix_sim::simulate::Simulation;

use crate::fault_table::{FROM, Row, TO, TableError};

/// A cabinet in a corner, in the map: without it the room is itself when it is rotated by 180°, and a lost robot cannot
/// tell the two poses apart.
const CABINET: &str = r#"
    { name = "cabinet front", from = [0, 7], to = [0.9, 7] },
    { name = "cabinet side", from = [0.9, 7], to = [0.9, 8] },
]"#;

const CASES: [(&str, FaultKind); 4] = [
    ("an encoder channel dead", FaultKind::DeadEncoder(Wheel::Right)),
    ("an encoder's channels swapped", FaultKind::ReversedEncoder(Wheel::Right)),
    ("a tenth of an encoder's edges missed", FaultKind::MissingTicks(Wheel::Right, 0.1)),
    ("brown-out and restart", FaultKind::BrownOut),
];

/// Runs the faults with the seeds 0 to `runs` − 1.
///
/// # Errors
/// The [`TableError`] of the first run that fails.
pub fn rows(runs: u64) -> Result<Vec<Row>, TableError> {
    CASES
        .into_iter()
        .map(|(name, kind)| {
            let simulation = Simulation::new(scenario(kind)?);
            let results = (0..runs).into_par_iter().map(|seed| simulation.run(seed, &mut ()));
            Ok(Row { name, results: results.collect::<Result<_, _>>()? })
        })
        .collect()
}

fn scenario(kind: FaultKind) -> Result<Scenario, TableError> {
    let text = CLASSROOM.replacen("\n]", CABINET, 1);
    let mut scenario = Scenario::parse(&text, "classroom.toml", Path::new(""))?;
    scenario.robot.start = StartPose::Unknown { region: None };
    scenario.faults = vec![Fault { kind, from: FROM, to: TO }];
    Ok(scenario)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_room_has_the_cabinet() {
        let scenario = scenario(FaultKind::BrownOut).unwrap();
        assert_eq!(scenario.floor.named_walls().len(), 6);
    }
}
