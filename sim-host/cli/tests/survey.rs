//! `sonarfix survey` on a simulated drive around a room.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::path::Path;
use std::process::{Command, Output};

use sonarfix_map::MapFile;
use sonarfix_studies::surveys::{self, Place};

fn sonarfix(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.current_dir(folder).args(arguments).output().unwrap()
}

/// The walls of a map file: length and the coordinates of the first end, metres.
fn walls(file: &Path) -> Vec<[f64; 3]> {
    let floor = MapFile::read(file, None).unwrap().floor;
    let of = |wall: &sonarfix_map::NamedWall| {
        let ([x, y], to) = (wall.from(), wall.to());
        [(to[0] - x).hypot(to[1] - y), x, y]
    };
    floor.named_walls().iter().map(of).collect()
}

#[test]
fn a_measured_wall_scales_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    surveys::record(Place::Room, 20_000, &folder.join("drive")).unwrap();
    let survey =
        |options: &[&str]| sonarfix(&[&["survey", "drive/log.csv"], options].concat(), folder);
    let output = survey(&["--out", "map.toml"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let plain = walls(&folder.join("map.toml"));
    assert_eq!(plain.len(), 4);

    let output = survey(&["--compare", "drive/true-map.toml"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("4 of 4 walls of the map are found, 0 other walls"), "{text}");

    let output = survey(&["--out", "scaled.toml", "--measured", "wall 2 = 660 cm"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let scaled = walls(&folder.join("scaled.toml"));
    assert!((scaled[1][0] - 6.6).abs() < 1e-3, "{scaled:?}");
    let scale = 6.6 / plain[1][0];
    for (one, other) in plain.iter().flatten().zip(scaled.iter().flatten()) {
        assert!((scale * one - other).abs() < 1e-3, "{plain:?} {scaled:?}");
    }

    for (measured, reason) in [
        ("wall 2", "must be a wall and its length with a unit"),
        ("wall 2=6.6", "must be a wall and its length with a unit"),
        ("wall 2=-1 m", "the length must be positive"),
        ("wall 9=6.6 m", "the map has no \"wall 9\"; its walls are wall 1 to wall 4"),
    ] {
        let output = survey(&["--measured", measured]);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && errors.contains(reason), "{measured}: {errors}");
    }
}
