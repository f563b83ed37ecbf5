//! Maps from and for other programs: `sonarfix map import` and `map export`.

#![expect(clippy::unwrap_used, clippy::float_cmp, reason = "a test should stop")]

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use sonarfix_map::{Floor, MapFile, NamedWall};
use sonarfix_studies::floor_plan::FloorPlan;

/// Standard output, or the error.
fn map(dir: &Path, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.current_dir(dir).arg("map").args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
}

fn scenario(name: &str) -> Floor {
    let file =
        format!("{}/../../crates/sonarfix-map/scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    MapFile::read(Path::new(&file), None).unwrap().floor
}

fn plan() -> Floor {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("plan.toml");
    fs::write(&file, FloorPlan::new(0).toml).unwrap();
    MapFile::read(&file, None).unwrap().floor
}

/// The walls turned about the origin.
fn rotated(floor: &Floor, degrees: f64) -> Floor {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let turn = |[x, y]: [f64; 2]| [x * cos - y * sin, x * sin + y * cos];
    let wall = |wall: &NamedWall| {
        NamedWall::new(wall.name().to_owned(), turn(wall.from()), turn(wall.to())).unwrap()
    };
    Floor::new(floor.named_walls().iter().map(wall).collect())
}

/// The largest distance of the ends of two walls in the better order, and the angle between them in degrees.
fn apart(a: &NamedWall, b: &NamedWall) -> (f64, f64) {
    let distance = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v);
    let same = distance(a.from(), b.from()).max(distance(a.to(), b.to()));
    let other = distance(a.from(), b.to()).max(distance(a.to(), b.from()));
    let direction =
        |wall: &NamedWall| (wall.to()[1] - wall.from()[1]).atan2(wall.to()[0] - wall.from()[0]);
    let turn = (direction(a) - direction(b)).rem_euclid(PI);
    (same.min(other), turn.min(PI - turn).to_degrees())
}

#[test]
fn a_grid_returns_every_wall_within_a_pixel_and_a_degree_and_no_other() {
    // The back of this cabinet is 1 cm from the wall behind it: less than the three pixels that separate two lines.
    let hidden = "furniture 0.2";
    let plan = plan();
    let walls = plan.named_walls().iter().filter(|wall| wall.name() != hidden).cloned().collect();
    let plan = Floor::new(walls);
    let cases = [
        ("classroom", scenario("classroom"), "0.05"),
        ("classroom, rotated", rotated(&scenario("classroom"), 17.0), "0.05"),
        ("plan 0", plan.clone(), "0.02"),
        ("plan 0, rotated", rotated(&plan, 17.0), "0.02"),
        ("plan 0, rotated further", rotated(&plan, 33.0), "0.02"),
    ];
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for (name, floor, resolution) in cases {
        fs::write(dir.join("map.toml"), floor.to_toml()).unwrap();
        map(dir, &["export", "map.toml", "--out", "grid.yaml", "--resolution", resolution])
            .unwrap();
        let printed = map(dir, &["import", "grid.yaml", "--out", "back.toml"]).unwrap();
        assert!(
            printed.contains("uncertain: each end by") && !printed.contains("dropped"),
            "{printed}"
        );
        let back = Floor::read(&dir.join("back.toml")).unwrap();
        let pixel: f64 = resolution.parse().unwrap();
        assert_eq!(back.named_walls().len(), floor.named_walls().len(), "{name}");
        let (mut worst, mut turned) = (0.0_f64, 0.0_f64);
        for wall in floor.named_walls() {
            let pairs = back.named_walls().iter().map(|other| apart(wall, other));
            let (distance, angle) = pairs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            worst = worst.max(distance / pixel);
            turned = turned.max(angle);
            assert!(distance <= pixel && angle <= 1.0, "{name}: {wall:?}: {distance} m, {angle}°");
        }
        println!(
            "{name}: {} walls, within {worst:.2} pixels and {turned:.2}°",
            floor.named_walls().len()
        );
    }
}

#[test]
fn drawings_return_every_wall_exactly() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for floor in [scenario("classroom"), plan(), rotated(&plan(), 17.0)] {
        fs::write(dir.join("map.toml"), floor.to_toml()).unwrap();
        map(dir, &["export", "map.toml", "--out", "map.svg"]).unwrap();
        map(dir, &["import", "map.svg", "--out", "back.toml"]).unwrap();
        assert_eq!(Floor::read(&dir.join("back.toml")).unwrap(), floor);
        // GeoJSON to the last bit of a coordinate; in degrees, to a micrometre.
        map(dir, &["export", "map.toml", "--out", "map.geojson"]).unwrap();
        map(dir, &["import", "map.geojson", "--out", "back.toml"]).unwrap();
        let back = Floor::read(&dir.join("back.toml")).unwrap();
        let mut pairs = back.named_walls().iter().zip(floor.named_walls());
        let is_same =
            |(a, b): (&NamedWall, &NamedWall)| a.name() == b.name() && apart(a, b).0 < 1e-13;
        assert!(back.named_walls().len() == floor.named_walls().len() && pairs.all(is_same));
        let anchor = ["--anchor", "9.7,52.4"];
        map(dir, &[&["export", "map.toml", "--out", "earth.geojson"], &anchor[..]].concat())
            .unwrap();
        map(dir, &[&["import", "earth.geojson", "--out", "back.toml"], &anchor[..]].concat())
            .unwrap();
        let back = Floor::read(&dir.join("back.toml")).unwrap();
        let pairs = back.named_walls().iter().zip(floor.named_walls());
        assert!(pairs.map(|(a, b)| apart(a, b).0).all(|distance| distance < 1e-6));
        // A DXF of another hand: lines in metres, and names by layers.
        let mut dxf =
            "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
                .to_owned();
        for wall in floor.named_walls() {
            let ([x, y], [u, v], name) = (wall.from(), wall.to(), wall.name());
            write!(dxf, "0\r\nLINE\r\n  8\r\n{name}\r\n 10\r\n{x}\r\n 20\r\n{y}\r\n 11\r\n{u}\r\n 21\r\n{v}\r\n").unwrap();
        }
        fs::write(dir.join("map.dxf"), dxf + "0\nENDSEC\n0\nEOF\n").unwrap();
        map(dir, &["import", "map.dxf", "--out", "back.toml"]).unwrap();
        assert_eq!(Floor::read(&dir.join("back.toml")).unwrap(), floor);
    }
}

/// The ends of the walls of `back.toml`.
fn ends(dir: &Path) -> Vec<[f64; 4]> {
    let floor = Floor::read(&dir.join("back.toml")).unwrap();
    let walls = floor.named_walls().iter();
    walls.map(|wall| [wall.from()[0], wall.from()[1], wall.to()[0], wall.to()[1]]).collect()
}

#[test]
fn what_is_no_wall_is_dropped_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let polyline =
        "0\nLWPOLYLINE\n8\nwalls\n70\n1\n10\n0\n20\n0\n10\n4000\n20\n0\n10\n4000\n20\n3000\n";
    let old = "0\nPOLYLINE\n8\nold\n10\n0\n20\n0\n70\n0\n0\nVERTEX\n10\n500\n20\n0\n0\nVERTEX\n10\n500\n20\n900\n0\nSEQEND\n";
    let circle = "0\nCIRCLE\n8\ntables\n10\n1\n20\n1\n40\n5\n";
    let bent = "0\nLWPOLYLINE\n8\nwalls\n10\n0\n20\n0\n42\n0.5\n10\n1\n20\n1\n";
    let dxf = format!("0\nSECTION\n2\nENTITIES\n{polyline}{circle}{bent}{old}0\nENDSEC\n0\nEOF\n");
    fs::write(dir.join("a.dxf"), dxf).unwrap();
    assert!(
        map(dir, &["import", "a.dxf", "--out", "back.toml"]).unwrap_err().contains("give --unit")
    );
    let mm = ["import", "a.dxf", "--out", "back.toml", "--unit", "mm", "--origin", "1,-2"];
    let printed = map(dir, &mm).unwrap();
    for expected in [
        "scale: one unit is 0.001 m; its origin is at (1, -2) m",
        "dropped: CIRCLE entities: no straight lines (1)",
        "dropped: LWPOLYLINE entities with arcs (1)",
        "back.toml: 4 walls",
    ] {
        assert!(printed.contains(expected), "{printed}");
    }
    assert_eq!(ends(dir)[..2], [[1.0, -2.0, 5.0, -2.0], [5.0, -2.0, 5.0, 1.0]]);
    assert_eq!(ends(dir)[3], [1.5, -2.0, 1.5, -1.1]);
    let printed = map(dir, &[&mm[..], &["--layer", "old"]].concat()).unwrap();
    assert!(
        printed.contains("entities on the layer \"walls\" (2)") && ends(dir).len() == 1,
        "{printed}"
    );

    let svg = "<svg xmlns='http://www.w3.org/2000/svg' width='4000mm' viewBox='0 0 400 300'>\
        <g transform='translate(100 0) rotate(90)'><line id='door' x1='0' y1='0' x2='100' y2='0'/></g>\
        <path d='M0,0 h100 v50 c1,1 2,2 3,3 l10,0 z'/><circle r='4'/><rect width='100' height='50' rx='3'/>\
        <text>Plan</text><title>Plan</title></svg>";
    fs::write(dir.join("a.svg"), svg).unwrap();
    let printed = map(dir, &["import", "a.svg", "--out", "back.toml"]).unwrap();
    for expected in [
        "one user unit is 0.01 m",
        "dropped: circle elements (1)",
        "dropped: curves of paths (1)",
        "dropped: text elements (1)",
        "uncertain: the round corners",
        "back.toml: 9 walls",
    ] {
        assert!(printed.contains(expected), "{printed}");
    }
    let door = ends(dir)[0];
    assert!(door.iter().zip([1.0, 0.0, 1.0, -1.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{door:?}");

    let features = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","properties":{"name":"hall"},"geometry":{"type":"Polygon","coordinates":[[[0,0],[5,0],[5,4],[0,0]]]}},
        {"type":"Feature","properties":null,"geometry":{"type":"Point","coordinates":[1,1]}},
        {"type":"Feature","properties":null,"geometry":null}]}"#;
    fs::write(dir.join("a.json"), features).unwrap();
    assert!(
        map(dir, &["import", "a.json", "--out", "back.toml"]).unwrap_err().contains("--anchor")
    );
    let printed = map(dir, &["import", "a.json", "--out", "back.toml", "--unit", "m"]).unwrap();
    assert!(printed.contains("dropped: Point geometries (1)") && ends(dir).len() == 3, "{printed}");

    // A table of 0.5 m and a line of 5 cm thickness, drawn as PNG beside the YAML.
    let mut pixels = vec![255_u8; 100 * 80];
    for (x, y) in (0..100).flat_map(|x| (0..80).map(move |y| (x, y))) {
        if (10..90).contains(&x) && (9..14).contains(&y)
            || (30..80).contains(&x) && (20..75).contains(&y)
        {
            pixels[y * 100 + x] = 0;
        }
    }
    let mut encoder = png::Encoder::new(fs::File::create(dir.join("a.png")).unwrap(), 100, 80);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let yaml = "image: a.png\nresolution: 0.01 # m\norigin: [2.0, -1.0, 0.0]\nnegate: 0\n";
    fs::write(dir.join("a.yaml"), yaml).unwrap();
    let printed = map(dir, &["import", "a.yaml", "--out", "back.toml"]).unwrap();
    assert!(
        printed.contains("areas thicker than 0.3 m (2750 pixels)") && ends(dir).len() == 1,
        "{printed}"
    );
    // Its centre line; thinning shortens it by up to its thickness.
    let [x, y, u, v] = ends(dir)[0];
    assert!((y + 0.315).abs() < 0.011 && (v + 0.315).abs() < 0.011, "{y} {v}");
    assert!((x.min(u) - 2.1).abs() < 0.05 && (x.max(u) - 2.9).abs() < 0.05, "{x} {u}");
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let refused = |file: &str, bytes: &[u8], expected: &str| {
        fs::write(dir.join(file), bytes).unwrap();
        let error = map(dir, &["import", file, "--out", "back.toml", "--unit", "m"]).unwrap_err();
        assert!(error.contains(expected) && !dir.join("back.toml").exists(), "{file}: {error}");
    };
    let bomb = "<?xml version='1.0'?><!DOCTYPE svg [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;'>]>\
                <svg><text>&b;</text></svg>";
    refused("bomb.svg", bomb.as_bytes(), "document type");
    let deep = format!("<svg>{}{}</svg>", "<g>".repeat(5_000), "</g>".repeat(5_000));
    refused("deep.svg", deep.as_bytes(), "");
    refused("none.svg", b"<html/>", "it is no SVG");
    refused("cut.svg", b"<svg><line x1=", "it is no XML");
    refused("path.svg", b"<svg><path d='M 0 0 L nan 1'/></svg>", "the element path");
    refused("long.dxf", &vec![b'7'; 100_000], "a line is longer than 4096 bytes");
    refused("text.dxf", b"hello\nworld\n", "no group code");
    refused("half.dxf", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n10\ninf\n", "no finite number");
    refused("binary.dxf", b"AutoCAD Binary DXF\r\n\x1a\0", "it is binary");
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    refused("deep.json", deep.as_bytes(), "it is no JSON");
    refused(
        "bad.json",
        br#"{"type":"LineString","coordinates":[[0,"x"],[1]]}"#,
        "a position without numbers",
    );
    refused("far.json", br#"{"type":"LineString","coordinates":[[0,0],[1e300,1]]}"#, "the segment");

    // More than the limits: a million entities, 200,000 walls, 67,108,864 pixels, 32 MiB.
    let mut dxf = b"0\nSECTION\n2\nENTITIES\n".to_vec();
    dxf.extend(b"0\nPOINT\n".repeat(1_000_002));
    refused("points.dxf", &dxf, "it has more than 1000000 entities");
    let mut dxf = b"0\nSECTION\n2\nENTITIES\n".to_vec();
    dxf.extend(b"0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n".repeat(200_002));
    refused("lines.dxf", &dxf, "it has more than 200000 segments");
    let huge = fs::File::create(dir.join("huge.svg")).unwrap();
    huge.set_len(33 << 20).unwrap();
    let error = map(dir, &["import", "huge.svg", "--out", "back.toml"]).unwrap_err();
    assert!(error.contains("it has more than 32 MiB"), "{error}");
    let yaml = |image: &str| format!("image: {image}\nresolution: 0.05\norigin: [0, 0, 0]\n");
    let import = |name: &str, image: &[u8]| {
        fs::write(dir.join("image"), image).unwrap();
        fs::write(dir.join(name), yaml("image")).unwrap();
        map(dir, &["import", name, "--out", "back.toml"]).unwrap_err()
    };
    let mut png = Vec::new();
    let encoder = png::Encoder::new(&mut png, 100_000, 100_000);
    drop(encoder.write_header().unwrap());
    for image in [png.as_slice(), b"P5 100000 100000 255\n"] {
        let error = import("huge.yaml", image);
        let expected = "it has 100000 × 100000 pixels: at most 67108864 are read";
        assert!(error.contains(expected), "{error}");
    }
    assert!(import("cut.yaml", b"P5 8000 8000 255\n0").contains("it ends too early"));
    assert!(import("cut.yaml", b"GIF89a").contains("it is neither PGM nor PNG"));
    for (text, expected) in [
        ("image: image\nresolution: 0\norigin: [0,0,0]\n", "resolution: 0 m is not within"),
        ("image: image\nresolution: 0.05\n", "`origin` is missing"),
        ("image: ../../none\nresolution: 0.05\norigin: [0,0,0]\n", "the image"),
    ] {
        fs::write(dir.join("bad.yaml"), text).unwrap();
        let error = map(dir, &["import", "bad.yaml", "--out", "back.toml"]).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

/// The middles of the walls of a flat of two rooms and a corridor, with two doors, metres.
const FLAT: [[[f64; 2]; 2]; 8] = [
    [[1.0, 1.0], [9.0, 1.0]],
    [[9.0, 1.0], [9.0, 7.0]],
    [[9.0, 7.0], [1.0, 7.0]],
    [[1.0, 7.0], [1.0, 1.0]],
    [[5.0, 1.0], [5.0, 3.0]],
    [[5.0, 3.9], [5.0, 7.0]],
    [[5.0, 4.5], [6.5, 4.5]],
    [[7.4, 4.5], [9.0, 4.5]],
];
/// A bed and a table.
const FURNITURE: [[[f64; 2]; 2]; 2] = [[[1.5, 5.0], [3.4, 6.2]], [[6.5, 2.0], [7.7, 2.8]]];
/// The thickness of its walls, metres.
const WALL: f64 = 0.16;

fn to_segment([x, y]: [f64; 2], [[x1, y1], [x2, y2]]: [[f64; 2]; 2]) -> f64 {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let part = (((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    (x - x1 - part * dx).hypot(y - y1 - part * dy)
}

fn nearest(point: [f64; 2], segments: impl Iterator<Item = [[f64; 2]; 2]>) -> f64 {
    segments.map(|segment| to_segment(point, segment)).fold(f64::INFINITY, f64::min)
}

/// The sides of a rectangle.
fn sides([[x1, y1], [x2, y2]]: [[f64; 2]; 2]) -> [[[f64; 2]; 2]; 4] {
    let [a, b, c, d] = [[x1, y1], [x2, y1], [x2, y2], [x1, y2]];
    [[a, b], [b, c], [c, d], [d, a]]
}

/// A scan of the flat, 2 cm a pixel, turned by a degree, whose paper is grey and dirty. `is_wall` draws the walls by the distance
/// from their middles.
fn scanned(is_wall: impl Fn(f64) -> bool) -> Vec<u8> {
    const SIZE: [u32; 2] = [520, 420];
    let mut bytes = format!("P5\n{} {}\n255\n", SIZE[0], SIZE[1]).into_bytes();
    let (sin, cos) = 1_f64.to_radians().sin_cos();
    let pixels = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (column, row)));
    for (column, row) in pixels {
        let [x, y] = [0.02 * (f64::from(column) + 0.5), 0.02 * (f64::from(SIZE[1] - row) - 0.5)];
        let point = [x * cos + y * sin, y * cos - x * sin];
        let furniture = nearest(point, FURNITURE.into_iter().flat_map(sides));
        let is_ink = is_wall(nearest(point, FLAT.into_iter())) || furniture < 0.012;
        // Dirt: every 997th pixel.
        let is_dirt = (row * SIZE[0] + column).is_multiple_of(997);
        let noise = (column * 7 + row * 13) % 11;
        let grey = 215 + noise - if is_ink || is_dirt { 180 } else { 0 };
        bytes.push(u8::try_from(grey).unwrap());
    }
    bytes
}

/// Asserts that the walls are those of the flat turned by an angle: at most two more or fewer, within 3 cm.
fn assert_flat(floor: &Floor, degrees: f64, name: &str) {
    let walls = FLAT.iter().map(|[from, to]| NamedWall::new("wall".into(), *from, *to).unwrap());
    let flat = rotated(&Floor::new(walls.collect()), degrees);
    let found = || floor.named_walls().iter().map(|wall| [wall.from(), wall.to()]);
    assert!(floor.named_walls().len().abs_diff(FLAT.len()) <= 2, "{name}: {floor:?}");
    for wall in flat.named_walls() {
        for part in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let ([x1, y1], [x2, y2]) = (wall.from(), wall.to());
            let point = [x1 + part * (x2 - x1), y1 + part * (y2 - y1)];
            let off = nearest(point, found());
            assert!(off <= 0.03, "{name}: {wall:?} is {off} m off at {part}: {floor:?}");
        }
    }
}

#[test]
fn a_scanned_plan_has_one_wall_for_each_wall() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let half = 0.5 * WALL;
    let kinds = [
        ("thick", scanned(|off| off < half)),
        ("double", scanned(|off| (off - half).abs() < 0.016)),
        ("single", scanned(|off| off < 0.016)),
    ];
    for (name, image) in kinds {
        fs::write(dir.join("scan.pgm"), image).unwrap();
        let import = ["import", "scan.pgm", "--out", "map.toml", "--picture", "plan.svg"];
        let printed = map(dir, &[&import[..], &["--unit", "0.02"]].concat()).unwrap();
        assert!(printed.contains("plan: "), "{name}: {printed}");
        assert_flat(&Floor::read(&dir.join("map.toml")).unwrap(), 1.0, name);
        assert!(fs::read_to_string(dir.join("plan.svg")).unwrap().contains("walls; red"));
    }
    let error = map(dir, &["import", "scan.pgm", "--out", "map.toml"]).unwrap_err();
    assert!(error.contains("--unit: the length of a pixel is unknown"), "{error}");
    map(dir, &["export", "map.toml", "--out", "grid.yaml"]).unwrap();
    let grid = ["import", "grid.yaml", "--plan", "--out", "map.toml", "--unit", "m"];
    assert!(map(dir, &grid).unwrap_err().contains("--unit: the unit of a grid"));
}

#[test]
fn a_drawn_plan_with_double_lines_and_copies_has_one_wall_for_each_wall() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let mut svg = String::from("<svg width=\"10m\" viewBox=\"0 0 10 8\">");
    let mut line = |[[x1, y1], [x2, y2]]: [[f64; 2]; 2]| {
        // Each line twice.
        for _ in 0..2 {
            writeln!(svg, "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>").unwrap();
        }
    };
    for [[x1, y1], [x2, y2]] in FLAT {
        let length = (x2 - x1).hypot(y2 - y1);
        let (nx, ny) = (0.5 * WALL * (y1 - y2) / length, 0.5 * WALL * (x2 - x1) / length);
        for side in [1.0, -1.0] {
            line([[x1 + side * nx, y1 + side * ny], [x2 + side * nx, y2 + side * ny]]);
        }
    }
    FURNITURE.into_iter().flat_map(sides).for_each(&mut line);
    fs::write(dir.join("plan.svg"), svg + "</svg>").unwrap();
    let import = ["import", "plan.svg", "--out", "map.toml", "--unit", "m"];
    let printed = map(dir, &import).unwrap();
    assert!(printed.contains("hint: as a floor plan (--plan) it has 8 walls"), "{printed}");
    let printed = map(dir, &[&import[..], &["--plan", "--picture", "p.svg"]].concat()).unwrap();
    assert!(printed.contains("faces of walls") && printed.contains("16 cm thick"), "{printed}");
    let floor = Floor::read(&dir.join("map.toml")).unwrap();
    // An SVG points down.
    let up = |wall: &NamedWall| {
        let [from, to] = [wall.from(), wall.to()].map(|[x, y]| [x, -y]);
        NamedWall::new(wall.name().to_owned(), from, to).unwrap()
    };
    let floor = Floor::new(floor.named_walls().iter().map(up).collect());
    assert_eq!(floor.named_walls().len(), FLAT.len(), "{printed}");
    assert_flat(&floor, 0.0, "svg");
    let error = map(dir, &[&import[..], &["--picture", "p.svg"]].concat()).unwrap_err();
    assert!(error.contains("add --plan"), "{error}");
}
