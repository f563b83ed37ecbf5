//! Calibration by a reference stream with a clock of its own: recordings of a robot under motion capture.

#![expect(clippy::unwrap_used, reason = "all of this file is a test")]

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use sonarfix_batch::calibrate::{Calibration, Determined, Nominal, calibrate};
use sonarfix_batch::constants::Name;
use sonarfix_batch::odometry::WheelNoise;
use sonarfix_batch::problem::Noise;
use sonarfix_batch::recording::{Reading, Recording, ReferencePose};

/// The folder of the recordings, if it is there.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("SONARFIX_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let folder = folder.join("inesctec");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return None;
    }
    Some(folder)
}

const NOMINAL: Nominal = Nominal {
    track_width: 0.2,
    mount: [0.0, 0.0],
    reach: [0.0, 1.0],
    sure_within: 0.0,
    noise: Noise {
        wheel: WheelNoise::independent(0.001),
        range: 0.01,
        range_per_metre: 0.0,
        position: 0.002,
        heading: 0.004,
    },
    has_servo: false,
};

/// Rows of time, x, y, heading, counts of the right and the left wheel in this cycle.
fn read(path: &Path) -> Recording {
    let travel = std::f64::consts::PI * 0.084 / 2796.8;
    let mut recording = Recording::default();
    let mut counted = [0.0, 0.0];
    for line in std::fs::read_to_string(path).unwrap().lines() {
        let fields: Vec<f64> =
            line.split(',').filter_map(|field| field.trim().parse().ok()).collect();
        let &[time, x, y, heading, right, left] = fields.as_slice() else { continue };
        counted = [counted[0] + right * travel, counted[1] + left * travel];
        recording.readings.push(Reading { time, travel: counted });
        recording.references.push(ReferencePose { time, pose: Vector3::new(x, y, heading) });
    }
    recording
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().filter_map(Result::ok) {
        let path = entry.path();
        if path.is_dir() {
            files.extend(self::files(&path));
        } else if path.to_string_lossy().contains("_run-") {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn value(found: &Calibration, name: Name) -> (f64, f64) {
    let estimate = found.estimates.iter().find(|estimate| estimate.name == name).unwrap();
    (estimate.value, estimate.deviation)
}

/// The runs of a session: the folders with this date.
fn session(folder: &Path, date: &str) -> Vec<(bool, Calibration)> {
    let files = files(folder).into_iter().filter(|file| {
        file.file_name().is_some_and(|name| name.to_string_lossy().starts_with(date))
    });
    let calibrated = files.map(|file| {
        let is_circle = file.to_string_lossy().contains("circular");
        (is_circle, calibrate(&read(&file), &[], &NOMINAL).unwrap())
    });
    calibrated.collect()
}

#[test]
fn squares_and_circles_of_a_session_agree_within_their_intervals() {
    let Some(folder) = data() else { return };
    let runs = session(&folder, "2312");
    assert!(runs.len() >= 10, "{}", runs.len());
    for name in [Name::Right, Name::Left, Name::Track] {
        let of = |wanted: bool| {
            runs.iter()
                .filter(move |(is_circle, _)| *is_circle == wanted)
                .map(|(_, found)| value(found, name))
        };
        for (square, of_square) in of(false) {
            for (circle, of_circle) in of(true) {
                let interval = 1.96 * of_square.hypot(of_circle);
                assert!(
                    (square - circle).abs() <= interval,
                    "{name:?}: {square} {circle} ± {interval}"
                );
            }
        }
    }
    // A circle in one direction cannot separate wheels and track width, and must not claim to.
    for (_, found) in runs.iter().filter(|(is_circle, _)| *is_circle) {
        let width = found.estimates.iter().find(|estimate| estimate.name == Name::Track).unwrap();
        assert_eq!(width.determined, Determined::Jointly);
        assert!(1.96 * width.deviation > 0.015, "{}", width.deviation);
    }
}

#[test]
fn lag_and_rate_of_the_clock_are_found() {
    let Some(folder) = data() else { return };
    let runs: Vec<_> = ["2306", "2312"].iter().flat_map(|date| session(&folder, date)).collect();
    let lags = runs.iter().map(|(_, found)| value(found, Name::Lag).0);
    let (least, most) =
        lags.fold((0.0_f64, 0.0_f64), |(least, most), lag| (least.min(lag), most.max(lag)));
    eprintln!("lags from {least} to {most} s");
    assert!(least < -0.05 && most > 0.03 && least > -0.12 && most < 0.12, "{least} {most}");
    let rates = runs.iter().map(|(_, found)| value(found, Name::ClockRate).0.abs());
    let fastest = rates.fold(0.0_f64, f64::max);
    assert!(fastest > 1.5e-3 && fastest < 2.5e-3, "{fastest}");
}

#[test]
fn a_known_lag_is_found_to_a_millisecond() {
    let Some(folder) = data() else { return };
    let files = files(&folder);
    let square = files.iter().find(|file| file.to_string_lossy().contains("square"));
    let mut recording = read(square.unwrap());
    let before = value(&calibrate(&recording, &[], &NOMINAL).unwrap(), Name::Lag).0;
    for row in &mut recording.references {
        row.time += 0.04;
    }
    let after = value(&calibrate(&recording, &[], &NOMINAL).unwrap(), Name::Lag).0;
    assert!((after - before - 0.04).abs() < 1e-3, "{before} {after}");
}
