//! Every kind of file that a command reads, damaged in every way, and files that are small and would become large: each is read
//! or refused with a reason, within a bounded memory and processor time.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::endings::{CLASSROOM, errors, files, printing};

/// Bounds of the address space in KiB, and of the processor time in seconds, of a command without optimization.
const LIMITS: &str = "ulimit -v 400000 && ulimit -t 30 && exec \"$@\"";

/// The files that a command writes itself, and the command that reads `FILES/FILE`.
const KINDS: [(&str, &[&str]); 15] = [
    ("map.toml", &["map", "check", "FILE"]),
    ("simple.csv", &["map", "check", "FILE"]),
    ("map.bin", &["map", "check", "FILE"]),
    ("scenario.toml", &["check", "FILE"]),
    ("robot.toml", &["check", "FILE"]),
    ("config.bin", &["config", "check", "FILE"]),
    ("log.csv", &["replay", "FILE", "--map", "FILES/map.toml", "--config", "FILES/robot.toml"]),
    ("carmen.log", &["convert", "carmen", "FILE", "--out", "FILES/converted"]),
    ("carmen.log.gz", &["convert", "carmen", "FILE", "--out", "FILES/converted"]),
    ("log.mcap", &["convert", "rosbag", "FILE", "--force", "--out", "FILES/converted"]),
    ("rows.csv", &["merge", "FILE"]),
    ("map.geojson", &["map", "import", "FILE", "--unit", "m", "--out", "FILES/imported.toml"]),
    ("map.svg", &["map", "import", "FILE", "--unit", "m", "--out", "FILES/imported.toml"]),
    ("map.dxf", &["map", "import", "FILE", "--unit", "m", "--out", "FILES/imported.toml"]),
    ("grid.yaml", &["map", "import", "FILE", "--out", "FILES/imported.toml"]),
];

/// Writes one whole file of each kind.
fn write_whole(dir: &Path) {
    fs::copy(CLASSROOM, dir.join("scenario.toml")).unwrap();
    for arguments in [
        ["map", "simplify", "FILES/map.toml", "--out", "FILES/simple.csv"].as_slice(),
        &["map", "bake", "FILES/map.toml", "--out", "FILES/map.bin"],
        &["export", "FILES/pings.csv", "--rosbag", "FILES/bag"],
        &["map", "export", "FILES/map.toml", "--out", "FILES/map.geojson"],
        &["map", "export", "FILES/map.toml", "--out", "FILES/map.svg"],
        &["map", "export", "FILES/map.toml", "--out", "FILES/grid.yaml"],
    ] {
        let output = printing(arguments, dir).stdout(Stdio::null()).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
    }
    let line = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n4\n21\n3\n";
    let dxf = format!("0\nSECTION\n2\nENTITIES\n{}0\nENDSEC\n0\nEOF\n", line.repeat(3));
    fs::write(dir.join("map.dxf"), dxf).unwrap();
    let bag = fs::read_dir(dir.join("bag")).unwrap().map(|entry| entry.unwrap().path());
    let bag = bag.filter(|path| path.extension().is_some_and(|ending| ending == "mcap"));
    fs::copy(bag.last().unwrap(), dir.join("log.mcap")).unwrap();
    fs::write(dir.join("carmen.log.gz"), packed(&fs::read(dir.join("carmen.log")).unwrap(), 1))
        .unwrap();
}

/// These bytes, so many times, packed by gzip.
fn packed(bytes: &[u8], times: usize) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    for _ in 0..times {
        encoder.write_all(bytes).unwrap();
    }
    encoder.finish().unwrap()
}

/// Runs a command on a file with these bytes, within [`LIMITS`].
fn read(dir: &Path, name: &str, bytes: &[u8], arguments: &[&str]) -> Output {
    let file = dir.join("hostile").join(name);
    fs::create_dir_all(dir.join("hostile")).unwrap();
    // A grid names its image, which is beside it.
    fs::copy(dir.join("grid.pgm"), dir.join("hostile/grid.pgm")).unwrap();
    fs::write(&file, bytes).unwrap();
    let file = file.display().to_string();
    let files = dir.display().to_string();
    let arguments = arguments
        .iter()
        .map(|it| it.replace("FILES", &files))
        .map(|it| if it == "FILE" { file.clone() } else { it });
    let mut command = Command::new("bash");
    command.args(["-c", LIMITS, "limits", env!("CARGO_BIN_EXE_sonarfix")]).args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).output().unwrap()
}

/// Neither killed nor panicked; its messages are short, and an error has a reason.
fn assert_answered(what: &str, output: &Output) {
    let errors = errors(output);
    let start: String = errors.chars().take(500).collect();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{what}: {:?}: {start}", output.status);
    assert!(!errors.contains("panicked"), "{what}: {start}");
    assert!(errors.lines().count() <= 250, "{what}: {} lines", errors.lines().count());
    assert!(errors.lines().all(|line| line.chars().count() < 4_100), "{what}: {start}");
    assert!(!errors.contains(|it: char| it.is_control() && it != '\n'), "{what}: {start}");
    assert!(output.status.success() || errors.contains("error: "), "{what}: {start}");
}

/// How a file is damaged, with what is left of it.
fn damages(whole: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let changed = |change: fn(usize, u8) -> u8| {
        whole.iter().enumerate().map(|(at, byte)| change(at, *byte)).collect::<Vec<_>>()
    };
    let middle = whole.len() / 2;
    let (head, tail) = whole.split_at(middle);
    vec![
        ("empty", Vec::new()),
        ("torn in the middle", head.to_vec()),
        ("without its last byte", whole.split_last().unwrap().1.to_vec()),
        ("without its first half", tail.to_vec()),
        ("one bit in 64 bytes", changed(|at, byte| if at % 64 == 63 { byte ^ 4 } else { byte })),
        ("digits are nines", changed(|_, byte| if byte.is_ascii_digit() { b'9' } else { byte })),
        ("no UTF-8", [head, [0xff; 16].as_slice(), tail].concat()),
        ("zeros inside", [head, [0; 4096].as_slice(), tail].concat()),
        ("twice", whole.repeat(2)),
        ("only zeros", vec![0; 1 << 20]),
        ("one long line", vec![b'1'; 1 << 20]),
        ("deep", [head, "[".repeat(1 << 18).as_bytes(), tail].concat()),
    ]
}

#[test]
fn a_damaged_file_is_read_or_refused() {
    let dir = files();
    let dir = dir.path();
    write_whole(dir);
    let (mut cases, mut refused) = (0, 0);
    for (name, arguments) in KINDS {
        let whole = fs::read(dir.join(name)).unwrap();
        let output = read(dir, name, &whole, arguments);
        assert!(output.status.success(), "{name} is whole: {}", errors(&output));
        for (damage, bytes) in damages(&whole) {
            let output = read(dir, name, &bytes, arguments);
            assert_answered(&format!("{name}, {damage}"), &output);
            cases += 1;
            refused += usize::from(!output.status.success());
        }
    }
    assert!(cases >= 50 && refused > cases / 2, "{refused} of {cases} are refused");
}

#[test]
fn a_file_that_would_become_large_is_refused() {
    let dir = files();
    let dir = dir.path();
    write_whole(dir);
    let refused = |name: &str, bytes: &[u8], arguments: &[&str], expected: &str| {
        let output = read(dir, name, bytes, arguments);
        assert_answered(name, &output);
        let errors = errors(&output);
        assert!(!output.status.success() && errors.contains(expected), "{name}: {errors}");
    };
    let wall = "[[map.wall]]\nname = 'w'\nfrom = ['0 m', '0 m']\nto = ['1 xx', '0 m']\n";
    let head = "format = 1\n[map]\nunit = 'm'\n";
    let walls = |length: usize| format!("{head}{}", wall.repeat(length / wall.len()));
    let check = ["map", "check", "FILE"].as_slice();
    refused("walls.toml", walls(2 << 20).as_bytes(), check, "must be a number");
    refused("walls.toml", walls(5 << 20).as_bytes(), check, "it has more than 4 MiB");
    let lines = format!("x1,y1,x2,y2\n{}", "0,0,1,x\n".repeat(1 << 18));
    refused("walls.csv", lines.as_bytes(), &["map", "check", "FILE", "--unit", "m"], "error");
    let bomb = packed(&vec![b'1'; 1 << 20], 300);
    let convert = ["convert", "carmen", "FILE", "--out", "FILES/converted"].as_slice();
    refused("bomb.log.gz", &bomb, convert, "more than 256 MiB");
    let lines = packed("ODOM 1 0 0 0.5 0 0 1 host 0\n".repeat(1 << 16).as_bytes(), 200);
    refused("lines.log.gz", &lines, convert, "more than 16777216 ranges");
    let nested = format!("a = {}{}", "[".repeat(1 << 20), "]".repeat(1 << 20));
    refused("deep.toml", nested.as_bytes(), check, "error");
}

/// As many walls as a TOML may have: their check takes a time that grows with their number, not with its square.
#[test]
fn a_map_of_the_largest_size_is_checked() {
    let dir = files();
    let wall = |number: usize| {
        format!("[[map.wall]]\nname = 'w{number}'\nfrom = [0, {number}]\nto = [1, {number}]\n")
    };
    let walls: String = (0..60_000).map(wall).collect();
    let text = format!("format = 1\n[map]\nunit = 'mm'\n{walls}");
    let dir = dir.path();
    write_whole(dir);
    let output = read(dir, "walls.toml", text.as_bytes(), &["check", "FILE"]);
    assert_answered("60,000 walls", &output);
}
