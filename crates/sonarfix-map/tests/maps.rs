//! Maps from any file, the flaws found in them, and the changes by simplification.

#![expect(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "a test should stop, and compares what it wrote"
)]

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::units::Metres;
use sonarfix_map::{
    Finding, Flaw, Floor, Limits, MapFile, NamedWall, PAPER, Severity, bake, flaws, simplify,
};

fn floor(walls: &[[f64; 4]]) -> Floor {
    let wall = |(n, &[x1, y1, x2, y2]): (usize, &[f64; 4])| {
        NamedWall::new(format!("wall {n}"), [x1, y1], [x2, y2]).unwrap()
    };
    Floor::new(walls.iter().enumerate().map(wall).collect())
}

/// A cone of 15° and 5 cm to the nearest range: a gap of 2·0.05·tan 15° = 26.8 mm fills it.
fn sonar() -> RangerParameters {
    Config::for_track_width(Metres(0.16)).rangers.first
}

fn findings(walls: &[[f64; 4]]) -> Vec<Finding> {
    flaws(&floor(walls), &sonar()).unwrap()
}

/// The only finding of the two walls.
fn flaw(first: [f64; 4], second: [f64; 4]) -> Option<Flaw> {
    let found = findings(&[first, second]);
    assert!(found.len() <= 1, "{found:?}");
    let finding = found.first()?;
    assert_eq!((finding.wall, finding.other()), (1, Some(0)));
    Some(finding.flaw)
}

const WALL: [f64; 4] = [0.0, 0.0, 4.0, 0.0];

#[test]
fn a_point_on_a_wall_is_an_error() {
    assert_eq!(flaw(WALL, WALL), Some(Flaw::Duplicate { of: 0 }));
    assert_eq!(flaw(WALL, [4.0, 0.0, 0.0, 0.000_5]), Some(Flaw::Duplicate { of: 0 }));
    for (second, expected) in [
        ([3.0, 0.0, 6.0, 0.0], 1.0),
        ([6.0, 0.0, 3.0, 0.0], 1.0),
        ([1.0, 0.0, 2.0, 0.000_5], 1.0),
        ([-1.0, 0.0, 5.0, 0.0], 4.0),
    ] {
        let Some(Flaw::Overlap { with: 0, length }) = flaw(WALL, second) else {
            panic!("{second:?}");
        };
        assert!((length - expected).abs() < 1e-6, "{second:?}: {length}");
    }
    let finding = Finding { wall: 1, flaw: Flaw::Duplicate { of: 0 } };
    assert_eq!(finding.severity(), Severity::Error);
}

#[test]
fn a_path_through_a_wall_is_refused_with_its_place() {
    let Some(Flaw::Crossing { with: 0, at: [x, y] }) = flaw(WALL, [1.0, -1.0, 3.0, 1.0]) else {
        panic!("no crossing");
    };
    assert!((x - 2.0).abs() < 1e-9 && y.abs() < 1e-9, "({x}, {y})");
    let fine = [
        ("a corner", [4.0, 0.0, 4.0, 3.0]),
        ("a T", [2.0, 0.0, 2.0, 3.0]),
        ("a T drawn half a millimetre too far", [2.0, -0.000_5, 2.0, 3.0]),
        ("beside it", [0.0, 1.0, 4.0, 1.0]),
        ("its line crosses", [5.0, -1.0, 5.0, 1.0]),
        ("the next in line, touching", [4.0, 0.0, 8.0, 0.0]),
    ];
    for (what, second) in fine {
        assert_eq!(flaw(WALL, second), None, "{what}");
    }
}

#[test]
fn a_gap_that_fills_less_than_the_cone_is_narrow() {
    for (gap, is_narrow) in [(0.005, true), (0.026, true), (0.028, false), (0.9, false)] {
        let found = flaw(WALL, [4.0 + gap, 0.0, 8.0, 0.0]);
        let width = match found {
            Some(Flaw::NarrowGap { width, .. }) => Some(width),
            _ => None,
        };
        assert_eq!(width.is_some(), is_narrow, "{gap}: {found:?}");
        assert!(width.is_none_or(|width| (width - gap).abs() < 1e-6));
    }
    // A gap that is filled by a third wall, or that contains the end of one, does not count.
    let filled = findings(&[WALL, [4.02, 0.0, 8.0, 0.0], [4.0, 0.0, 4.02, 0.0]]);
    assert_eq!(filled, []);
}

#[test]
fn a_wall_between_walls_is_unreachable() {
    let walls = |gap: f64| [[0.0, 0.0, 2.0, 0.0], [-0.1, gap, 2.1, gap], [-0.1, -gap, 2.1, -gap]];
    let found = findings(&walls(0.03));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(matches!(found[0], Finding { wall: 0, flaw: Flaw::Unreachable { .. } }));
    assert_eq!(found[0].severity(), Severity::Warning);
    // Beyond the shortest range there is free space.
    assert_eq!(findings(&walls(0.06)), []);
    // One free side is sufficient, and so is a hole in the wall before it.
    assert_eq!(findings(&walls(0.03)[..2]), []);
    let [wall, _, behind] = walls(0.03);
    let holed = [wall, [-0.1, 0.03, 0.8, 0.03], [1.0, 0.03, 2.1, 0.03], behind];
    assert_eq!(findings(&holed), []);
}

#[test]
fn a_room_has_no_flaw() {
    let paper = MapFile::read(&written("paper.toml", PAPER).1, None).unwrap();
    assert_eq!(flaws(&paper.floor, &paper.sonar().unwrap()).unwrap(), []);
}

/// A file in a temporary folder, which is removed with the returned value.
fn written(name: &str, text: impl AsRef<[u8]>) -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, text).unwrap();
    (dir, path)
}

fn read(name: &str, text: impl AsRef<[u8]>, unit: Option<&str>) -> Result<MapFile, String> {
    let (dir, path) = written(name, text);
    let shown = |error: sonarfix_map::FileError| {
        error.to_string().replace(&format!("{}/", dir.path().display()), "")
    };
    MapFile::read(&path, unit).map_err(shown)
}

#[test]
fn every_kind_of_file_gives_the_same_walls_with_their_lines() {
    let toml = "format = 1\n[map]\nunit = \"cm\"\nwall = [\n\
                { name = \"a\", from = [0, 0], to = [400, 0] },\n\n\
                { name = \"b, \\\"c\\\"\", from = [400, 0], to = [400, 250] },\n]\n";
    let csv = "name,x1_cm,y1_cm,x2_cm,y2_cm\na,0,0,400,0\n\n\"b, \"\"c\"\"\",400, 0,400,250\n";
    let bare = "x1,y1,x2,y2,name\n0,0,4000,0,a\n4000,0,4000,2500,\"b, \"\"c\"\"\"\n";
    let map = read("m.toml", toml, None).unwrap();
    assert_eq!((map.line(0), map.line(1)), (Some(5), Some(7)));
    assert_eq!(map.floor.named_walls()[1].to(), [4.0, 2.5]);
    assert!(map.place(1).ends_with("m.toml:7: \"b, \"c\"\""), "{}", map.place(1));
    let from_csv = read("m.CSV", csv, None).unwrap();
    assert_eq!(from_csv.floor, map.floor);
    assert_eq!((from_csv.line(0), from_csv.line(1)), (Some(2), Some(4)));
    assert_eq!(read("m.csv", bare, Some("mm")).unwrap().floor, map.floor);
    // A written file is read back, with the names.
    assert_eq!(read("m.toml", map.floor.to_toml(), None).unwrap().floor, map.floor);
    assert_eq!(read("m.csv", map.floor.to_csv(), None).unwrap().floor, map.floor);
    // A baked map has no names and no lines.
    let baked = read("m.bin", bake(&map.floor.walls()).unwrap(), None).unwrap();
    let ends = |map: &MapFile| -> Vec<_> {
        map.floor.named_walls().iter().map(|wall| (wall.from(), wall.to())).collect()
    };
    assert_eq!(ends(&baked), ends(&map));
    assert_eq!((baked.line(0), baked.floor.named_walls()[1].name()), (None, "wall 1"));
}

/// The accuracy of a wall survives writing and baking; a joined wall has the worst of its pieces.
#[test]
fn a_wall_may_have_an_accuracy() {
    let toml = "format = 1\n[map]\nunit = \"m\"\nwall = [\n\
                { name = \"a\", from = [0, 0], to = [4, 0], accuracy = \"12 mm\" },\n\
                { name = \"b\", from = [4, 0], to = [6, 0], accuracy = \"3 cm\" },\n\
                { name = \"c\", from = [6, 0], to = [6, 3] },\n]\n";
    let map = read("m.toml", toml, None).unwrap();
    let accuracies = |floor: &Floor| -> Vec<_> {
        let millimetres = |wall: &NamedWall| wall.accuracy().map(|metres| (1e3 * metres).round());
        floor.named_walls().iter().map(millimetres).collect()
    };
    let expected = [Some(12.0), Some(30.0), None];
    assert_eq!(accuracies(&map.floor), expected);
    assert_eq!(read("m.toml", map.floor.to_toml(), None).unwrap().floor, map.floor);
    let baked = read("m.bin", bake(&map.floor.walls()).unwrap(), None).unwrap();
    assert_eq!(accuracies(&baked.floor), expected);
    let simple = simplify(&map.floor, Limits { tolerance: 0.01, shortest: 0.1 }).unwrap();
    assert_eq!(accuracies(&simple.floor), [Some(30.0), None]);
    for wrong in ["0 mm", "-1 mm", "256 mm"] {
        let error = read("m.toml", toml.replace("12 mm", wrong), None).unwrap_err();
        assert!(error.contains("m.toml:5: ") && error.contains("from 0.1 mm to 255 mm"), "{error}");
    }
    let error = read("m.toml", toml.replace("\"12 mm\"", "12"), None).unwrap_err();
    assert!(error.contains("m.toml:5: "), "{error}");
}

/// A scenario has a robot, whose sonar is used for the check, and may name another file.
#[test]
fn a_scenario_gives_its_map_and_its_sonar() {
    let paper = read("paper.toml", PAPER, None).unwrap();
    assert!(paper.sonar().is_some_and(|sonar| sonar.max_range == Metres(10.0)));
    let line = 1 + PAPER.lines().position(|line| line.contains("\"outer west\"")).unwrap();
    assert_eq!(paper.line(2), Some(line));
}

#[test]
fn a_wrong_csv_is_refused_with_its_line() {
    let cases = [
        ("x1_m,y1_m,x2_m\n0,0,1\n", "m.csv:1: the columns must be named x1, y1, x2, y2"),
        ("x1_m,y1_m,x2_m,y2_cm\n0,0,1,1\n", "m.csv:1: the coordinates must all be in one unit"),
        ("x1,y1,x2,y2\n0,0,1,1\n", "m.csv:1: the unit is missing: name the columns x1_m"),
        ("x1_ft,y1_ft,x2_ft,y2_ft\n", "m.csv:1: the unit must be one of m, cm, mm"),
        ("x1_m,y1_m,x2_m,y2_m\n", "m.csv:1: there is no wall below the header"),
        ("x1_m,y1_m,x2_m,y2_m\n0,0,1,1\n0,0,1,x\n", "m.csv:3: y2: `x` is not a number"),
        ("x1_m,y1_m,x2_m,y2_m\n0,0,1,1\n5,5,5,5\n", "m.csv:3: the wall has no length"),
        ("x1_m,y1_m,x2_m,y2_m\n0,0,1,nan\n", "m.csv:2: both ends must be finite and within 8 km"),
        (
            "x1_m,y1_m,x2_m,y2_m\n0,0,1,200000\n",
            "m.csv:2: both ends must be finite and within 8 km",
        ),
        ("x1_m,y1_m,x2_m,y2_m\n0,0,1\n", "m.csv:2: cannot be read as CSV"),
        (
            "x1_m,y1_m,x2_m,y2_m,name\n0,0,1,1,a\n0,0,2,1,a\n",
            "m.csv:3: name: another wall is already called",
        ),
    ];
    for (text, message) in cases {
        let error = read("m.csv", text, None).unwrap_err();
        assert!(error.contains(message), "{text}: {error}");
    }
    let error = read("m.csv", "x1_m,y1_m,x2_m,y2_m\n0,0,1,1\n", Some("cm")).unwrap_err();
    assert!(error.contains("are in m, not in cm"), "{error}");
    let error = read("m.bin", b"SFXM and no more", None).unwrap_err();
    assert!(error.starts_with("m.bin: the map has format"), "{error}");
    assert!(MapFile::read(Path::new("nowhere.csv"), None).is_err());
}

fn limits(tolerance: f64, shortest: f64) -> Limits {
    Limits { tolerance, shortest }
}

#[test]
fn pieces_in_line_become_one() {
    let pieces = floor(&[
        [1.0, 0.0, 2.0, 0.0],
        [0.0, 5.0, 1.0, 5.0],
        [2.0, 0.0, 3.5, 0.0],
        [4.0, 0.0, 3.4, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [4.0, 0.0, 4.0, 3.0],
    ]);
    let simple = simplify(&pieces, limits(0.001, 0.0)).unwrap();
    assert_eq!(simple.joined, [vec![0, 2, 3, 4]]);
    assert_eq!(simple.dropped, [[0; 0]; 0]);
    let walls: Vec<_> = simple.floor.named_walls().iter().map(|w| (w.from(), w.to())).collect();
    let expected = [([0.0, 0.0], [4.0, 0.0]), ([0.0, 5.0], [1.0, 5.0]), ([4.0, 0.0], [4.0, 3.0])];
    assert_eq!(walls, expected);
    // A floor that cannot be simplified is unchanged.
    assert_eq!(simplify(&simple.floor, limits(0.001, 0.0)).unwrap().floor, simple.floor);
    // Pieces are joined before short ones are removed.
    let short = simplify(&pieces, limits(0.001, 1.5)).unwrap();
    assert_eq!((short.floor.named_walls().len(), short.dropped), (2, vec![vec![1]]));
    assert!(simplify(&pieces, limits(0.001, 9.0)).is_err());
}

fn distance([x, y]: [f64; 2], wall: &NamedWall) -> f64 {
    let ([fx, fy], [tx, ty]) = (wall.from(), wall.to());
    let (ax, ay) = (tx - fx, ty - fy);
    let share = (((x - fx) * ax + (y - fy) * ay) / (ax * ax + ay * ay)).clamp(0.0, 1.0);
    f64::hypot(x - fx - share * ax, y - fy - share * ay)
}

proptest! {
    /// For walls broken into pieces that are displaced by less than the tolerance: every point of the pieces is within the
    /// tolerance of the joined wall, and every point of that wall is within the tolerance of a piece.
    #[test]
    fn simplification_stays_within_the_tolerance(
        lines in prop::collection::vec((0.0_f64..6.0, 0.0_f64..6.0, -3.2_f64..3.2, 2..6_u8), 1..6),
        shakes in prop::collection::vec(-1.0_f64..1.0, 64),
        tolerance in 0.001_f64..0.05,
    ) {
        let mut shake = shakes.iter().cycle().map(|shake| 0.3 * tolerance * shake);
        let mut pieces = Vec::new();
        for (x, y, angle, count) in lines {
            for n in 0..count {
                let mut end = |along: f64| {
                    [x + along * angle.cos(), y + along * angle.sin()].map(|c| c + shake.next().unwrap())
                };
                let (from, to) = (end(0.7 * f64::from(n)), end(0.7 * f64::from(n + 1)));
                pieces.push([from[0], from[1], to[0], to[1]]);
            }
        }
        let before = floor(&pieces);
        let simple = simplify(&before, limits(tolerance, 0.0)).unwrap();
        let after = &simple.floor;
        prop_assert!(!simple.joined.is_empty() && simple.dropped.is_empty());
        let joined: usize = simple.joined.iter().map(|pieces| pieces.len() - 1).sum();
        prop_assert_eq!(after.named_walls().len() + joined, before.named_walls().len());
        let covers = |these: &Floor, those: &Floor| {
            these.named_walls().iter().all(|wall| (0..=20).all(|n| {
                let share = f64::from(n) / 20.0;
                let ([fx, fy], [tx, ty]) = (wall.from(), wall.to());
                let point = [fx + share * (tx - fx), fy + share * (ty - fy)];
                let nearest = those.named_walls().iter().map(|wall| distance(point, wall));
                nearest.fold(f64::INFINITY, f64::min) <= tolerance + 1e-9
            }))
        };
        prop_assert!(covers(&before, after), "a piece is off");
        prop_assert!(covers(after, &before), "a wall has come into being");
    }
}
