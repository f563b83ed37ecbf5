//! Simulated robots without a start pose.

use serde_json::Value;

use crate::endings::studies;

#[test]
fn a_search_in_a_scenario_finds_a_robot_in_a_room_without_symmetry() {
    let dir = tempfile::tempdir().unwrap();
    let plan = dir.path().join("plan.toml");
    let plan = plan.to_str().unwrap();
    // A home of 15 walls.
    let drawn = studies(&["floor-plans", "--draw", "5017", "--toml", plan]).status().unwrap();
    assert!(drawn.success());
    let found = studies(&["find", plan, "--runs", "2", "--seconds", "60", "--json"]).output();
    let found: Value = serde_json::from_slice(&found.unwrap().stdout).unwrap();
    assert_eq!(found["summary"]["found"]["wrong"].as_f64(), Some(0.0));
    assert!(found["summary"]["best_is_right"].as_f64().unwrap() > 0.9, "{found}");
}
