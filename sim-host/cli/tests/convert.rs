//! Conversion of small handwritten recordings.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "all of this file is a test, its helpers too"
)]

use std::fmt::Write;
use std::fs;
use std::path::Path;

use sonarfix_map::{Floor, robot_file};
use sonarfix_replay::Summary;
use sonarfix_replay::convert::carmen::Carmen;
use sonarfix_replay::convert::lego::{ENCODER_LAG, Lego, Nominal};
use sonarfix_replay::convert::{ConvertError, Converted};
use sonarfix_replay::fault::Complaint;
use tempfile::TempDir;

fn carmen(log: &str) -> (TempDir, Result<Converted, ConvertError>, Vec<String>) {
    let dir = TempDir::new().unwrap();
    let file = dir.path().join("made.log");
    fs::write(&file, log).unwrap();
    let walls = dir.path().join("walls.csv");
    fs::write(&walls, "x1_m,y1_m,x2_m,y2_m,scan_support\n-9,2,9,2,7\n-9,-2,9,-2,7\n").unwrap();
    let mut skipped_lines = Vec::new();
    let out = dir.path().join("out");
    let converted = Carmen { from: &file, walls: Some(&walls), to: &out }
        .convert(&mut |line| skipped_lines.push(line.rsplit('/').next().unwrap().to_owned()));
    (dir, converted, skipped_lines)
}

fn read(dir: &TempDir, name: &str) -> String {
    fs::read_to_string(dir.path().join("out").join(name)).unwrap()
}

/// The lines of the log without comments, truncated to a length.
fn records(dir: &TempDir) -> Vec<String> {
    let log = read(dir, "log.csv");
    log.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
}

#[test]
fn flaser_and_odom_of_a_corrected_log() {
    // Ranges ahead and to both sides; one metre ahead, then 90° to the left.
    let (dir, converted, skipped_lines) = carmen(
        "# CARMEN Logfile\n\
         PARAM robot_length 0.5 10.0 host 0.0\n\
         ODOM 0 0 0 0.5 0 0 10.0 host 0.1\n\
         FLASER 3 2.0 9.0 2.0 5.0 6.0 0.5 0.5 0 0 10.5 host 0.6\n\
         ODOM 1 0 0 0.5 0 0 11.0 host 1.1\n\
         FLASER 3 2.0 8.0 2.0 5.1 6.9 1.5 1 0 0 11.0 host 1.2\n\
         ODOM 1 0 1.5707963 0.5 0 0 12.0 host 2.1\n",
    );
    assert_eq!(skipped_lines, [""; 0]);
    let expected =
        Converted { encoders: 4, scans: 2, reference: 2, repeated: 1, ..Converted::default() };
    assert_eq!(converted.unwrap(), expected);
    let scan = |time, ranges| format!("scan,{time},-1.570796327,1.570796326795,{ranges}");
    // 90° with the assumed track width of 0.38 m: 0.298451 m per wheel.
    let expected = [
        "sonarfix-log,1".to_owned(),
        "wheels,10.000000,0.000000,0.000000".to_owned(),
        "start,10.500000,5.000000,6.000000,0.500000,0.05,0.03".to_owned(),
        "wheels,10.500000,0.500000,0.500000".to_owned(),
        scan("10.500000", "2.000 9.000 2.000"),
        "wheels,11.000000,1.000000,1.000000".to_owned(),
        scan("11.000000", "2.000 8.000 2.000"),
        "wheels,12.000000,1.298451,0.701549".to_owned(),
    ];
    assert_eq!(records(&dir), expected);
    let expected = "time_s,x_m,y_m,heading_rad\n\
                    10.500000,5.000000,6.000000,0.500000\n11.000000,5.100000,6.900000,1.500000\n";
    assert_eq!(read(&dir, "reference.csv"), expected);
    let out = dir.path().join("out");
    assert_eq!(Floor::read(&out.join("map.toml")).unwrap().named_walls()[1].name(), "wall 2");
    let robot = robot_file::read(&out.join("robot.toml")).unwrap();
    assert!((robot.localizer.rangers.first.servo.1.0 - std::f32::consts::FRAC_PI_2).abs() < 1e-3);
}

#[test]
fn robotlaser_of_a_raw_log_gives_the_mount_and_no_reference() {
    // The scanner is 0.2 m ahead of the axle; start −1, 0.5 rad from beam to beam; remissions.
    let (dir, converted, skipped_lines) = carmen(
        "ROBOTLASER1 0 -1.0 2.0 0.5 80 0.01 0 3 1.5 2.5 80.5 2 7 7 0.2 0 0 0 0 0 \
         0 0 0.3 0.3 1000000 100.0 host 1.0\n\
         ROBOTLASER1 0 -1.0 2.0 0.5 80 0.01 0 3 1.5 2.5 80.5 0 0 0.2 1.5707963 0 0 1.5707963 \
         0 0 0.3 0.3 1000000 101.0 host 2.0\n",
    );
    assert_eq!(skipped_lines, [""; 0]);
    let expected = Converted { encoders: 2, scans: 2, ..Converted::default() };
    assert_eq!(converted.unwrap(), expected);
    assert_eq!(records(&dir)[3], "scan,100.000000,-1.000000000,0.500000000000,1.500 2.500 80.500");
    assert!(!dir.path().join("out/reference.csv").exists());
    let robot = robot_file::read(&dir.path().join("out/robot.toml")).unwrap();
    assert!((robot.localizer.rangers.first.mount.x.0 - 0.2).abs() < 1e-6);
}

#[test]
fn the_short_form_and_its_errors() {
    let (dir, converted, skipped_lines) = carmen(
        "O 1 0 0 0\n\
         S 2 1 0 0 5 6 0.5 4 1 2 0 4\n\
         O 0.5 9 9 9\n\
         S 3 1 0 0 5 6 0.5 4 1 2 3\n\
         O 3 1 0\n\
         S 4 2 0 0 6 6 0.5 4 1 2 3 4 5\n\
         S 5 2 0 0 6 6 0.6 4 1 2 3 x\n\
         O 6 2 0 0",
    );
    let expected = [
        "made.log line 3: goes back in time",
        "made.log line 4: is no complete message",
        "made.log line 5: is no complete message",
        "made.log line 6: is no complete message",
        "made.log line 7: is no complete message",
        "made.log line 8: the line is truncated: the file ends before its newline",
    ];
    assert_eq!(skipped_lines, expected);
    let converted = converted.unwrap();
    assert_eq!((converted.encoders, converted.scans, converted.skipped), (2, 1, 6));
    // Four beams over half a turn leave out the last one.
    assert!(
        records(&dir)[4].starts_with("scan,2.000000,-1.570796327,0.785398163397,1.000 2.000 - ")
    );
}

/// A straight drive at 0.5 m/s with an `ODOM` record every 0.2 s and a scan every second. `odometry` makes the pose of a record,
/// `scan` the corrected pose and the odometry fields of a scan, from the time and the number of scans so far.
fn driven(
    odometry: impl Fn(f64, f64) -> [f64; 3],
    scan: impl Fn(f64, f64) -> ([f64; 3], [f64; 3]),
) -> String {
    let mut text = String::new();
    let line = |[x, y, heading]: [f64; 3]| format!("{x:.6} {y:.6} {heading:.6}");
    let mut scans = 0.0;
    for tick in 0_u32..200 {
        let time = f64::from(tick) * 0.2;
        writeln!(text, "ODOM {} 0.5 0 0 {time:.3} host {time:.3}", line(odometry(time, scans)))
            .unwrap();
        if tick % 5 == 2 {
            scans += 1.0;
            let time = time + 0.1;
            let (corrected, fields) = scan(time, scans);
            let poses = format!("{} {}", line(corrected), line(fields));
            writeln!(text, "FLASER 3 2 9 2 {poses} {time:.3} host {time:.3}").unwrap();
        }
    }
    text
}

/// Total travel of both wheels in the log.
fn travelled(dir: &TempDir) -> [f64; 2] {
    let records = records(dir);
    let last = records.iter().rfind(|line| line.starts_with("wheels")).unwrap();
    let mut fields = last.split(',').skip(2).map(|field| field.parse().unwrap());
    [fields.next().unwrap(), fields.next().unwrap()]
}

/// The corrections of SLAM: 3 cm aside and 1° at every scan, the turns in both directions.
fn corrected(time: f64, scans: f64) -> [f64; 3] {
    [0.5 * time, 0.03 * scans, 0.0175 * (scans % 2.0)]
}

const TRAVELLED: f64 = 0.5 * 39.8;

#[test]
fn corrected_poses_in_the_odometry_fields_of_scans_are_not_used() {
    let log = driven(
        |time, _| [0.5 * time, 0.0, 0.0],
        |time, scans| (corrected(time, scans), corrected(time, scans)),
    );
    let (dir, converted, reported) = carmen(&log);
    let converted = converted.unwrap();
    assert_eq!((converted.scans, converted.reference, converted.bridged), (40, 40, 0));
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert!(
        reported[0].contains("line 4: the odometry fields of the scans contain another pose"),
        "{reported:?}"
    );
    assert!(
        travelled(&dir).iter().all(|wheel| (wheel - TRAVELLED).abs() < 1e-6),
        "{:?}",
        travelled(&dir)
    );
    assert!(read(&dir, "reference.csv").contains("\n2.500000,1.250000,0.090000,0.017500\n"));
}

#[test]
fn odometry_that_is_corrected_at_every_scan_is_bridged() {
    let log = driven(corrected, |time, scans| (corrected(time, scans), corrected(time, scans)));
    let (dir, converted, reported) = carmen(&log);
    let converted = converted.unwrap();
    assert_eq!((converted.reference, converted.bridged), (40, 40));
    assert!(reported[0].contains("the odometry jumps at the scans"), "{reported:?}");
    // The corrections turned no wheel.
    let [right, left] = travelled(&dir);
    assert!((right - left).abs() < 0.01, "{right} {left}");
    assert!((right - TRAVELLED).abs() < 0.05 * TRAVELLED, "{right}");
}

/// A robot that drives ahead at 0.5 m/s with an `ODOM` record every 0.2 s, and turns at the end. Each scan is stamped as the record before
/// it, replaces the pose by one 3 cm to the side and 1° turned, and is followed by a record of that pose with this stamp.
fn chained(stamp: &str) -> String {
    format!(
        "PARAM robot_length 0.5 nohost 0\n\
         ODOM 0 0 0 0 0 0 10.0 host 10.0\n\
         ODOM 0.1 0 0 0 0 0 10.2 host 10.2\n\
         FLASER 3 2.0 9.0 2.0 0.1 0.03 0.0175 0.1 0.03 0.0175 10.2 host 10.2\n\
         ODOM 0.1 0.03 0.0175 0 0 0 {stamp} host {stamp}\n\
         NEFF 22.1 {stamp} host {stamp}\n\
         ODOM 0.199984687 0.031749911 0.0175 0 0 0 10.4 host 10.4\n\
         FLASER 3 2.0 8.9 2.0 0.2 0 0 0.2 0 0 10.4 host 10.4\n\
         ODOM 0.2 0 0 0 0 0 {stamp} host {stamp}\n\
         ODOM 0.3 0 0 0 0 0 10.6 host 10.6\n\
         ODOM 0.3 0 0.5 0 0 0 11.0 host 11.0\n"
    )
}

#[test]
fn corrections_of_a_log_that_continues_from_each_scan_are_no_travel() {
    for stamp in ["0", "10.0", "10.4", "99999.0"] {
        let (dir, converted, reported) = carmen(&chained(stamp));
        let expected =
            Converted { encoders: 5, scans: 2, reference: 2, repeated: 2, ..Converted::default() };
        assert_eq!(converted.unwrap(), expected, "{stamp}");
        assert_eq!(reported.len(), 1, "{reported:?}");
        assert!(
            reported[0].starts_with(
                "made.log line 4: recognised: the odometry continues from the corrected pose of each scan (2 of 2 scans)"
            ),
            "{reported:?}"
        );
        let scan =
            |time, ahead| format!("scan,{time},-1.570796327,1.570796326795,2.000 {ahead} 2.000");
        // Ahead by 0.3 m in all; 0.5 rad with the assumed track width of 0.38 m is 0.095 m per wheel.
        let expected = [
            "sonarfix-log,1".to_owned(),
            "wheels,10.000000,0.000000,0.000000".to_owned(),
            "start,10.200000,0.100000,0.030000,0.017500,0.05,0.03".to_owned(),
            "wheels,10.200000,0.100000,0.100000".to_owned(),
            scan("10.200000", "9.000"),
            "wheels,10.400000,0.200000,0.200000".to_owned(),
            scan("10.400000", "8.900"),
            "wheels,10.600000,0.300000,0.300000".to_owned(),
            "wheels,11.000000,0.395000,0.205000".to_owned(),
        ];
        assert_eq!(records(&dir), expected, "{stamp}");
        assert!(read(&dir, "reference.csv").ends_with("\n10.400000,0.200000,0.000000,0.000000\n"));
    }
}

#[test]
fn stamps_of_a_continued_log_that_go_back_get_the_time_that_the_travel_needs() {
    // The record before the second scan is stamped 0.3 s early, as is the scan.
    let log = chained("0").replace(" 10.4 host 10.4", " 10.1 host 10.1");
    let (dir, converted, reported) = carmen(&log);
    assert_eq!((converted.unwrap().restamped, reported.len()), (4, 1), "{reported:?}");
    let records = records(&dir);
    let wheels: Vec<&String> = records.iter().filter(|line| line.starts_with("wheels")).collect();
    // The mean of 10.2, 10.2, 10.1 and 10.1; then 0.1 m at 2.5 m/s.
    assert_eq!(*wheels[1], "wheels,10.150000,0.100000,0.100000");
    assert_eq!(*wheels[2], "wheels,10.190000,0.200000,0.200000");
    assert!(records.iter().any(|line| line.starts_with("scan,10.190000,")), "{records:?}");
    // A jump that no stamp explains is no travel either.
    let log = chained("0")
        .replace("ODOM 0.3 0 0 ", "ODOM 5.3 0 0 ")
        .replace("ODOM 0.3 0 0.5", "ODOM 5.3 0 0.5");
    let (dir, converted, reported) = carmen(&log);
    assert_eq!(converted.unwrap().bridged, 1);
    assert!(
        reported[1].starts_with("made.log line 10: the odometry is implausible: 5.1"),
        "{reported:?}"
    );
    assert!((travelled(&dir)[1] - 0.205).abs() < 1e-6, "{:?}", travelled(&dir));
}

/// A robot that drives ahead with an `ODOM` record every 0.1 m, and after each third one a scan that moves it 3 cm to the side. The stamp of
/// each record is that of its number; `is_continued`: a record with the pose of the scan follows it.
fn stamped(stamp: impl Fn(u32) -> String, is_continued: bool) -> String {
    let mut log = String::new();
    for record in 0_u32..31 {
        let (ahead, aside, time) = (f64::from(record) / 10.0, record / 3, stamp(record));
        let after =
            if record % 3 == 0 { f64::from(aside) * 0.03 } else { f64::from(aside + 1) * 0.03 };
        writeln!(log, "ODOM {ahead} {after} 0 0 0 0 {time} host {time}").unwrap();
        if record % 3 == 0 {
            let pose = format!("{ahead} {} 0", f64::from(aside + 1) * 0.03);
            writeln!(log, "FLASER 3 2 9 2 {pose} {pose} {time} host {time}").unwrap();
            if is_continued {
                writeln!(log, "ODOM {pose} 0 0 0 0 host 0").unwrap();
            }
        }
    }
    log
}

/// Six digits of the seconds since 1970 advance once in 10,000 s.
#[test]
fn a_continued_log_without_time_gets_that_of_a_drive() {
    let six_digits = |record| if record < 20 { "1.13486e+09" } else { "1.13487e+09" }.to_owned();
    let (dir, converted, reported) = carmen(&stamped(six_digits, true));
    assert_eq!((converted.unwrap().bridged, reported.len()), (0, 2), "{reported:?}");
    let told = "made.log line 1: the stamps of 29 of 30 records do not advance: the log has no time; its times are those of a drive at 0.5 ";
    assert!(reported[1].starts_with(told), "{reported:?}");
    let records = records(&dir);
    let at = |kind: &str, time: &str| {
        records.iter().any(|line| line.starts_with(&format!("{kind},{time},")))
    };
    // 3 m at 0.5 m/s: the 10,000 s are no time.
    assert!(
        at("wheels", "0.000000") && at("scan", "0.600000") && at("wheels", "6.000000"),
        "{records:?}"
    );
    assert!(records.last().unwrap().starts_with("scan,6.000000,"), "{records:?}");
}

#[test]
fn stamps_of_whole_seconds_are_times() {
    let (dir, _, reported) = carmen(&stamped(|record| (record / 5).to_string(), true));
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert!(records(&dir).iter().any(|line| line.starts_with("wheels,5.000000,")));
}

#[test]
fn a_raw_log_without_time_is_refused() {
    let (_dir, converted, _) = carmen(&stamped(|_| "1.13486e+09".to_owned(), false));
    let why = converted.unwrap_err().to_string();
    assert!(
        why.contains("the stamps of 30 of 30 records do not advance: the log has no time"),
        "{why}"
    );
}

#[test]
fn a_continued_log_without_odometry_between_its_scans_is_refused() {
    let mut log = "ODOM 0 0 0 0 0 0 0 host 0\n".to_owned();
    for scan in 1_u32..9 {
        let (x, y) = (f64::from(scan) * 0.3, f64::from(scan % 2) * 0.1);
        writeln!(log, "FLASER 3 2 9 2 {x} {y} 0 {x} {y} 0 0 host 0").unwrap();
        writeln!(log, "ODOM {x} {y} 0 0.3 0 0 0 host 0").unwrap();
    }
    let (_dir, converted, _) = carmen(&log);
    let why = converted.unwrap_err().to_string();
    assert!(why.contains("7 of its 8 scans have no ODOM record since the scan before"), "{why}");
}

#[test]
fn a_raw_log_with_one_pose_in_a_scan_and_the_record_after_it_is_no_continued_one() {
    let mut log = "ODOM 0 0 0 0 0 0 9.0 host 9.0\n".to_owned();
    for second in 10_u32..20 {
        let x = f64::from(second - 9) * 0.3;
        writeln!(log, "FLASER 3 2 9 2 {x} 0 0 {x} 0 0 {second} host {second}").unwrap();
        writeln!(log, "ODOM {x} 0 0 0.3 0 0 {second} host {second}").unwrap();
    }
    let (dir, converted, reported) = carmen(&log);
    assert_eq!((converted.unwrap().reference, reported.len()), (0, 0), "{reported:?}");
    assert!((travelled(&dir)[0] - 3.0).abs() < 1e-6, "{:?}", travelled(&dir));
}

#[test]
fn corrected_poses_without_odometry_are_refused() {
    let log = driven(
        |time, _| [0.5 * time, 0.0, 0.0],
        |time, scans| (corrected(time, scans), corrected(time, scans)),
    );
    let scans: String = log
        .lines()
        .filter(|line| !line.starts_with('O'))
        .fold(String::new(), |all, line| all + line + "\n");
    let (dir, converted, _) = carmen(&scans);
    let error = converted.unwrap_err().to_string();
    assert!(error.contains("made.log: its odometry fields contain corrected poses"), "{error}");
    assert!(!dir.path().join("out").exists());
    // Odometry in the same fields is used.
    let log =
        driven(|_, _| [0.0; 3], |time, scans| (corrected(time, scans), [0.5 * time, 0.0, 0.0]));
    let scans: String = log
        .lines()
        .filter(|line| !line.starts_with('O'))
        .fold(String::new(), |all, line| all + line + "\n");
    let (_dir, converted, reported) = carmen(&scans);
    assert_eq!((converted.unwrap().reference, reported.len()), (40, 0));
}

#[test]
fn jumps_are_reported_with_their_line_and_late_stamps_are_repaired() {
    // From 20 s on, the odometry is 2 m further: a jump at one record, line 121.
    let jumping = |time: f64, _: f64| [0.5 * time + if time > 19.9 { 2.0 } else { 0.0 }, 0.0, 0.0];
    let log = driven(jumping, |time, scans| (corrected(time, scans), jumping(time, scans)));
    let (dir, converted, reported) = carmen(&log);
    assert_eq!(converted.unwrap().bridged, 1);
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert!(
        reported[0].starts_with("made.log line 121: the odometry is implausible: 2."),
        "{reported:?}"
    );
    assert!((travelled(&dir)[0] - TRAVELLED).abs() < 0.2, "{:?}", travelled(&dir));

    // Record 50 (10.0 s) is stamped 0.25 s late, after the next: both get the mean of their stamps.
    let log = driven(
        |time, _| [0.5 * time, 0.0, 0.0],
        |time, scans| (corrected(time, scans), [0.5 * time, 0.0, 0.0]),
    );
    let late = log.replace(" 10.000 host 10.000", " 10.250 host 10.250");
    let (dir, converted, reported) = carmen(&late);
    let converted = converted.unwrap();
    assert_eq!((converted.restamped, converted.skipped, reported.len()), (2, 0, 0), "{reported:?}");
    assert!((travelled(&dir)[0] - TRAVELLED).abs() < 1e-6);
    let times: Vec<f64> = records(&dir)
        .iter()
        .filter(|line| line.starts_with("wheels"))
        .map(|line| line.split(',').nth(1).unwrap().parse().unwrap())
        .collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn a_log_without_scans_is_an_error() {
    let (_dir, converted, _) = carmen("ODOM 0 0 0 0 0 0 1 host 1\n");
    assert!(converted.unwrap_err().to_string().ends_with("made.log: has no scans"));
}

/// A recording of a robot that drives 0.3289 m ahead along the arena's south wall, at 1 m from it.
fn lego(dir: &Path) {
    let mut motors = String::new();
    let mut scans = String::new();
    let mut reference = "scan_index,t_s,x_mm,y_mm,th_rad,cam_x_mm,cam_y_mm\n".to_owned();
    for n in 0_u32..=10 {
        let ticks = n * 100;
        // Stamped 0.415 s before the scan of the same instant; each poll twice.
        let row = format!("M {} {ticks} 0 0 0 {ticks} 0 0 0 0 0 0 0\n", n * 1000 + 1000);
        motors.push_str(&row);
        motors.push_str(&row);
        let time = n * 1000 + 1415;
        let ranges: Vec<String> = (0..660)
            .map(|beam| {
                let angle = (f64::from(beam) - 330.0) * 0.006_135_923_151_543 - 0.069_813_17;
                let range = if angle < -0.3 { 1000.0 / (-angle).sin() } else { 7.0 };
                format!("{range:.0}")
            })
            .collect();
        writeln!(scans, "S {time} 660 {}", ranges.join(" ")).unwrap();
        let x = 500.0 + f64::from(ticks) * (0.3289 + 0.3255) / 2.0;
        writeln!(reference, "{n},{},{x},1000,0,0,0", f64::from(time) / 1e3).unwrap();
    }
    scans.push_str("S 13000 660 1 2\nX\n");
    fs::write(dir.join("a_motors.txt"), motors).unwrap();
    fs::write(dir.join("a_scan.txt"), scans).unwrap();
    fs::write(dir.join("derived_reference_laserframe.csv"), reference).unwrap();
    let walls = "name,x1,y1,x2,y2\nsouth,-1000,0,3000,-0\nwest,-1000,0,-1000,2000\n";
    fs::write(dir.join("derived_walls_mm.csv"), walls).unwrap();
}

#[test]
fn lego_stamps_columns_and_angles() {
    let dir = TempDir::new().unwrap();
    lego(dir.path());
    let out = dir.path().join("out");
    let mut skipped_lines = Vec::new();
    let lego =
        Lego { from: dir.path(), to: &out, nominal: Nominal::Rounded, encoder_lag: ENCODER_LAG };
    let converted = lego.convert(&mut |line| skipped_lines.push(line)).unwrap();
    let expected = Converted {
        encoders: 11,
        scans: 11,
        reference: 11,
        repeated: 11,
        skipped: 2,
        ..Converted::default()
    };
    assert_eq!(converted, expected);
    assert!(
        skipped_lines[0].ends_with("a_scan.txt line 12: is no `S` record"),
        "{skipped_lines:?}"
    );
    let log = fs::read_to_string(out.join("log.csv")).unwrap();
    // Encoders and scans of the same instant have the same time.
    assert!(
        log.contains("\nticks,2.415000,100,100\n") && log.contains("\nscan,2.415000,-2.094667")
    );
    assert!(log.contains("\nstart,1.415000,0.500000,1.000000,0.000000,0.01,0.02\n"));
    assert!(log.contains(" - -\n"), "7 mm is no range");
    for nominal in ["robot.toml", "robot-fitted.toml", "robot-rounded.toml", "robot-course.toml"] {
        let robot = robot_file::read(&out.join(nominal)).unwrap();
        let right = robot.right_wheel.travel_per_edge.0;
        let expected = match nominal {
            "robot-fitted.toml" => 0.3289e-3,
            "robot-course.toml" => 0.349e-3,
            _ => 0.327e-3,
        };
        assert!((right - expected).abs() < 1e-9, "{nominal}: {right}");
    }
    let summary = replay(&out);
    assert_eq!(summary.lines_skipped, 0);
    assert!(summary.fixes.accepted >= 8, "{:?}", summary.fixes);
    // The left wheel is 0.5 % smaller than nominal: the path bends, and the wall corrects it.
    assert!(summary.position_max.unwrap() < 0.01, "{summary:?}");
}

fn replay(folder: &Path) -> Summary {
    let floor = Floor::read(&folder.join("map.toml")).unwrap();
    let robot = robot_file::read(&folder.join("robot.toml")).unwrap();
    let walls = floor.walls();
    let open = |name: &str| std::io::BufReader::new(fs::File::open(folder.join(name)).unwrap());
    let replay =
        sonarfix_replay::Replay { robot: &robot, walls: &walls, strict: true, pings_per_scan: 1 };
    let mut report = |complaint: &Complaint| panic!("{complaint}");
    replay.run(open("log.csv"), Some(open("reference.csv")), &mut (), &mut report).unwrap()
}

#[test]
fn a_missing_key_is_named() {
    let dir = TempDir::new().unwrap();
    let out = dir.path().join("out");
    let lego = Lego { from: dir.path(), to: &out, nominal: Nominal::Fitted, encoder_lag: 0.0 };
    let error = lego.convert(&mut |_| {}).unwrap_err().to_string();
    assert!(error.ends_with("has no *_motors.txt"), "{error}");
}
