//! Whole simulated runs to the bit: a hash of what the loop did and of the localizer after it, every ten seconds.
//!
//! `cargo xtask bless` records the hashes in `tests/golden`, each run in a file.
#![cfg(test)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use sonarfix::geometry::pose::Point;
use sonarfix::localizer::Localizer;
use sonarfix_hal::config::StartPose;
use sonarfix_hal::robot::Report;
use sonarfix_map::{CLASSROOM, Fault, FaultKind, Fidelity, PAPER, Scenario, Wheel};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Region;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

/// Seconds from one hash to the next.
const PERIOD: u64 = 10;

/// Walls that are not parallel to the axes, a free-standing one, and a room that is never itself when it is rotated.
const SLANTED: &str = r#"
    { name = "cut corner", from = [0, 6.8], to = [0.9, 8] },
    { name = "partition", from = [2.8, 3.4], to = [3.1, 4.6] },
    { name = "board of the partition", from = [3.1, 4.6], to = [3.4, 4.5] },
    { name = "slanted cupboard", from = [6, 3.5], to = [5.6, 4.5] },
    { name = "its side", from = [5.6, 4.5], to = [6, 4.5] },
]"#;

/// Hashes a run (FNV-1a, 64 bits), and compares each hash as soon as it is complete.
#[derive(Default)]
struct Hasher {
    hash: u64,
    text: String,
    /// The lines of the file so far, and those that are recorded; none while they are renewed.
    lines: Vec<String>,
    recorded: Vec<String>,
    /// How often a pose that the search has found was confirmed.
    confirmed: u32,
}

impl Hasher {
    fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }
}

impl Recorder for Hasher {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}
    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        self.confirmed += u32::from(report.mode == Some(Mode::Tracking));
        let mut text = std::mem::take(&mut self.text);
        text.clear();
        write!(text, "{report:?}{:?}{:?}", localizer.health(), localizer.filter().state()).unwrap();
        // The reports of robots with one ranger are hashed without its number.
        text.split(", ranger: RangerId(0)").for_each(|part| self.add(part.bytes()));
        self.text = text;
        let covariance = localizer.filter().covariance();
        self.add(covariance.iter().flat_map(|entry| entry.to_bits().to_le_bytes()));
        let period = localizer.time().ticks() / (PERIOD * 1_000_000);
        while (self.lines.len() as u64) < period {
            let seconds = (self.lines.len() as u64 + 1) * PERIOD;
            let line = format!("{seconds} s {:016x}", self.hash);
            if let Some(recorded) = self.recorded.get(self.lines.len()) {
                assert_eq!(&line, recorded, "the run differs before this time");
            }
            self.lines.push(line);
        }
    }
}

/// Compares a run with its recorded hashes; returns how many poses of the search were confirmed in it.
fn assert_recorded(name: &str, scenario: Scenario, seconds: f64) -> u32 {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    let file = folder.join(name).with_extension("hashes");
    let is_renewed = std::env::var_os("SONARFIX_BLESS").is_some();
    let recorded = if is_renewed { String::new() } else { fs::read_to_string(&file).unwrap() };
    let recorded = recorded.lines().map(str::to_owned).collect();
    let mut hasher = Hasher { recorded, ..Hasher::default() };
    Simulation::new(scenario).shortened(seconds).run(7, &mut hasher).unwrap();
    if is_renewed {
        fs::write(&file, hasher.lines.join("\n") + "\n").unwrap();
    } else {
        assert!(hasher.lines.len() >= 4, "{name} is too short");
        assert_eq!(hasher.lines, hasher.recorded, "{name}");
    }
    hasher.confirmed
}

fn scenario(text: &str) -> Scenario {
    Scenario::parse(text, "scenario.toml", Path::new("")).unwrap()
}

fn slanted() -> Scenario {
    scenario(&CLASSROOM.replacen("\n]", SLANTED, 1))
}

#[test]
fn a_classroom() {
    assert_recorded("classroom", scenario(CLASSROOM), 180.0);
}

#[test]
fn the_nearest_wall_on_the_papers_path() {
    let mut scenario = scenario(PAPER);
    scenario.fidelity = Fidelity::Pins;
    assert_recorded("paper", scenario, 120.0);
}

#[test]
fn slanted_walls() {
    assert_recorded("slanted", slanted(), 180.0);
}

/// The robot searches for its pose, loses it by an encoder that counts wrongly, and searches again.
#[test]
fn two_searches() {
    let mut scenario = slanted();
    scenario.start.is_unknown = true;
    scenario.robot.start = StartPose::Unknown { region: None };
    let kind = FaultKind::DeadEncoder(Wheel::Right);
    scenario.faults = vec![Fault { kind, from: 120.0, to: 140.0 }];
    assert!(assert_recorded("searches", scenario, 240.0) >= 2);
}

/// The start without a pose, but with a region.
#[test]
fn a_search_in_a_region() {
    let mut scenario = slanted();
    let region = Region { from: Point::new(0.9, 1.0), to: Point::new(2.2, 2.1) };
    scenario.start.is_unknown = true;
    scenario.robot.start = StartPose::Unknown { region: Some(region) };
    assert!(assert_recorded("region", scenario, 120.0) >= 1);
}

/// Encoders that cannot be read for some seconds, with a search after it.
#[test]
fn failed_samples() {
    let mut scenario = slanted();
    let fault =
        |share, from, to| Fault { kind: FaultKind::ReadErrors(Wheel::Left, share), from, to };
    scenario.faults = vec![fault(0.5, 30.0, 45.0), fault(1.0, 60.0, 61.5), fault(1.0, 80.0, 84.0)];
    assert_recorded("failed-samples", scenario, 120.0);
}
