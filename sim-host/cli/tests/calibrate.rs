//! `sonarfix calibrate`.

use std::fs;
use std::process::Command;

use crate::common::{MAP, ROBOT};

/// A log of a robot whose wheels are 2 % larger than its file states, in the room of [`MAP`]: squares of a metre to the left
/// and to the right, and a sonar that sweeps by 20°.
pub fn log() -> String {
    use std::fmt::Write as _;
    let mut log = String::from("sonarfix-log,1\nstart,0,1.5,1.5,0,0.01,0.01\nticks,0,0,0\n");
    let (mut x, mut y, mut heading, mut counts, mut time) =
        (1.5_f64, 1.5_f64, 0.0_f64, [0.0, 0.0], 0.0);
    let mut beam = 0_u32;
    for leg in 0..24 {
        let quarter = if (leg / 4) % 2 == 0 { 1.0 } else { -1.0 } * std::f64::consts::FRAC_PI_2;
        let straight = std::iter::repeat_n((0.04, 0.0), 25);
        for (advance, turn) in straight.chain(std::iter::repeat_n((0.0, quarter / 10.0), 10)) {
            x += advance * heading.cos();
            y += advance * heading.sin();
            heading += turn;
            time += 0.1;
            let arc = 0.5 * turn * 0.2;
            counts = [counts[0] + (advance + arc) / 1.02e-5, counts[1] + (advance - arc) / 1.02e-5];
            let bearing = f64::from(beam % 18) * 20_f64.to_radians() - 3.0;
            beam += 1;
            let (sin, cos) = heading.sin_cos();
            let at = [x + 0.03 * cos - 0.01 * sin, y + 0.03 * sin + 0.01 * cos];
            let axis = heading + bearing;
            let walls = [(-0.5, at[1]), (0.0, 4.0 - at[0]), (0.5, 3.0 - at[1]), (1.0, at[0])];
            let heard = walls.into_iter().filter(|(normal, _)| {
                let off = axis - normal * std::f64::consts::PI;
                off.cos() > 15_f64.to_radians().cos()
            });
            let range = heard.map(|(_, range)| format!("{range:.4}")).next().unwrap_or_default();
            let _ = writeln!(log, "ticks,{time:.3},{:.0},{:.0}", counts[0], counts[1]);
            let _ = writeln!(log, "range,{time:.3},{bearing:.5},{range}");
        }
    }
    let _ = writeln!(log, "ticks,{:.3},{:.0},{:.0}", time + 0.1, counts[0], counts[1]);
    log
}

#[test]
fn the_robot_file_is_corrected_and_keeps_its_comments() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("log.csv"), log()).unwrap();
    fs::write(path("map.toml"), MAP).unwrap();
    let commented =
        ROBOT.replace("track_width = \"200 mm\"", "track_width = \"200 mm\"  # by ruler");
    fs::write(path("robot.toml"), commented).unwrap();
    let sonarfix = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        command.args(arguments).current_dir(folder.path()).output().unwrap()
    };
    let output = sonarfix(&[
        "calibrate",
        "log.csv",
        "--out",
        "out.toml",
        "--trajectory",
        "smooth.csv",
        "--residuals",
        "r.svg",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(path("out.toml")).unwrap();
    assert!(text.contains("# by ruler"), "{text}");
    let robot = sonarfix_map::robot_file::read(&path("out.toml")).unwrap();
    for wheel in [robot.right_wheel, robot.left_wheel] {
        let scale = f64::from(wheel.signed_travel().0) / 1e-5;
        assert!((scale - 1.02).abs() < 1e-3, "{scale}");
    }
    assert!((robot.localizer.drive.track_width.0 - 0.2).abs() < 5e-4);
    assert!(fs::read_to_string(path("r.svg")).unwrap().starts_with("<svg"));

    // The smoothed poses are a reference for the replay.
    let replay = sonarfix(&[
        "replay",
        "log.csv",
        "--config",
        "out.toml",
        "--reference",
        "smooth.csv",
        "--json",
    ]);
    assert!(replay.status.success(), "{}", String::from_utf8_lossy(&replay.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&replay.stdout).unwrap();
    assert!(summary["position_rms"].as_f64().unwrap() < 0.02, "{summary}");

    // Without a start pose the calibration begins where the search finds it.
    let without_start = log().replace("start,0,1.5,1.5,0,0.01,0.01\n", "");
    fs::write(path("nowhere.csv"), without_start).unwrap();
    let searched = sonarfix(&["calibrate", "nowhere.csv", "--out", "searched.toml"]);
    assert!(searched.status.success(), "{}", String::from_utf8_lossy(&searched.stderr));
    let message = String::from_utf8_lossy(&searched.stdout).into_owned();
    assert!(message.contains("where the search finds"), "{message}");
    let robot = sonarfix_map::robot_file::read(&path("searched.toml")).unwrap();
    assert!((f64::from(robot.right_wheel.signed_travel().0) / 1e-5 - 1.02).abs() < 2e-3);

    // A recording without a map has nothing that measures the wheels.
    fs::remove_file(path("map.toml")).unwrap();
    let refused = sonarfix(&["calibrate", "log.csv"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && message.contains("pass the true poses"), "{message}");
}
