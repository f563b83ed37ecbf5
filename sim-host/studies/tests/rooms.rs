//! Robots that differ from their file, in generated rooms.

use sonarfix_studies::rooms::{self, Cell, Family, Objects, Robot, Sensor};

/// Runs of a cell, with seeds that nothing was chosen on.
const RUNS: u32 = 4;
const FIRST: u64 = 9_000_000;

/// In how many of the runs each mismatch is named, for a robot that is called so.
fn named(robot: &str) -> Option<[u32; 3]> {
    let robot = Robot::all().into_iter().find(|of| of.name() == robot)?;
    let (objects, sensor) = (Objects::Nothing, Sensor::HcSr04);
    let families = [Family::ALL[0], Family::ALL[6]];
    let cells = families.map(|family| Cell { family, objects, sensor, robot });
    let results = rooms::run(&cells, FIRST, RUNS, &|| ()).ok()?;
    let all = results.iter().map(|(_, sums)| sums.named);
    Some(all.fold([0; 3], |[a, b, c], [noise, wheels, mount]| [a + noise, b + wheels, c + mount]))
}

/// Whatever differs from the file by more than it says has its own name, and a right file has none.
#[test]
fn a_mismatch_is_named_and_a_right_file_has_none() {
    let all = 2 * RUNS;
    assert_eq!(named("nominal"), Some([0; 3]));
    let [noise, wheels, mount] = named("noise a third").unwrap();
    assert!(noise + 1 >= all && wheels + mount == 0, "{noise} {wheels} {mount}");
    let [noise, wheels, mount] = named("wheels ±4 %").unwrap();
    assert!(wheels >= all / 2 && noise + mount == 0, "{noise} {wheels} {mount}");
    assert_eq!(named("mount 25 mm ahead"), Some([0, 0, all]));
}
