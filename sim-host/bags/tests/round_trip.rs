//! A log as a bag and back; bags that are torn, lie or are none.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use sonarfix_bags::bag::Bag;
use sonarfix_bags::convert::Rosbag;
use sonarfix_bags::export::Export;
use sonarfix_bags::recording::Recording;
use sonarfix_bags::writer::{Durability, Writer};
use sonarfix_map::robot_file;
use sonarfix_replay::convert::{ConvertError, Converted};
use sonarfix_replay::log::{Record, parse};
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    Header, JointState, LaserScan, Odometry, Range, TFMessage, Time, Transform, TransformStamped,
};
use tempfile::TempDir;

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../cli/tests/robot.toml");

/// A folder with a bag of this log.
fn exported(log: &str) -> TempDir {
    let dir = TempDir::new().unwrap();
    let robot = robot_file::read(Path::new(ROBOT)).unwrap();
    let file = fs::File::create(dir.path().join("bag_0.mcap")).unwrap();
    let mut bag = Export::new(file, &robot, 0.0, &[]).unwrap();
    bag.take_log(log.as_bytes()).unwrap();
    let (_, metadata) = bag.end("bag_0.mcap").unwrap();
    fs::write(dir.path().join("metadata.yaml"), metadata).unwrap();
    dir
}

fn converted(
    bag: &Path,
    rosbag: &Rosbag,
) -> (TempDir, Result<Converted, ConvertError>, Vec<String>) {
    let out = TempDir::new().unwrap();
    let mut reports = Vec::new();
    let converted = rosbag.convert(bag, out.path(), &mut |report| reports.push(report));
    (out, converted, reports)
}

fn records(folder: &Path) -> Vec<Record> {
    let log = fs::read_to_string(folder.join("log.csv")).unwrap();
    log.lines().skip(1).filter_map(|line| parse(line).unwrap()).collect()
}

/// The track width of the robot file.
fn track_width() -> f64 {
    robot_file::read(Path::new(ROBOT)).unwrap().localizer.drive.track_width.0.into()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Every range of a log comes back with its bits as a number of 32 bits, its time and its bearing to the microsecond and
    /// microradian, and the travel to what the log's six digits add up to.
    #[test]
    fn a_log_survives(
        steps in proptest::collection::vec((-0.05_f64..0.05, -0.05_f64..0.05), 1..30),
        pings in proptest::collection::vec((0_u32..3_000, -1.5_f64..1.5, proptest::option::of(0.1_f32..3.9)), 0..30),
        start in (-5.0_f64..5.0, -5.0_f64..5.0, -3.1_f64..3.1),
    ) {
        let mut log = format!("sonarfix-log,1\nstart,1,{},{},{},0.02,0.01\n", start.0, start.1, start.2);
        let mut wheels = [0.0, 0.0];
        for (tick, (right, left)) in (0_u32..).zip(&steps) {
            wheels = [wheels[0] + right, wheels[1] + left];
            writeln!(log, "wheels,{},{},{}", 1.0 + f64::from(tick) / 10.0, wheels[0], wheels[1]).unwrap();
        }
        let mut pings = pings;
        pings.sort_by_key(|ping| ping.0);
        pings.dedup_by_key(|ping| ping.0);
        for (millis, bearing, range) in &pings {
            let range = range.map_or_else(String::new, |range| range.to_string());
            writeln!(log, "range,{},{bearing},{range}", 1.0 + f64::from(*millis) / 1e3).unwrap();
        }
        let bag = exported(&log);
        let width = Some(track_width());
        let (out, converted, reports) = converted(bag.path(), &Rosbag { track_width: width, ..Rosbag::default() });
        // A log without a ping has no ranger.
        if pings.is_empty() {
            prop_assert!(converted.unwrap_err().to_string().contains("has neither Range nor LaserScan"));
            return Ok(());
        }
        prop_assert_eq!(reports, [""; 0]);
        prop_assert_eq!(converted.unwrap().skipped, 0);
        let records = records(out.path());
        let mut travels = steps.iter();
        let (mut sum, mut echoes) = ([0.0, 0.0], pings.iter());
        let first = steps[0];
        for record in records {
            match record {
                Record::Start { pose, .. } => {
                    let error = (pose.x - start.0).abs() + (pose.y - start.1).abs() + (pose.heading - start.2).abs();
                    prop_assert!(error < 3e-6);
                }
                Record::Wheels { right, left, .. } => {
                    let (step_right, step_left) = travels.next().unwrap();
                    sum = [sum[0] + step_right, sum[1] + step_left];
                    // The odometry begins with zero at its first record.
                    prop_assert!((right - (sum[0] - first.0)).abs() < 1e-6, "{right} {sum:?}");
                    prop_assert!((left - (sum[1] - first.1)).abs() < 1e-6, "{left} {sum:?}");
                }
                Record::Range { time, bearing, range, .. } => {
                    let (millis, expected_bearing, expected) = echoes.next().unwrap();
                    prop_assert!((time - 1.0 - f64::from(*millis) / 1e3).abs() < 1e-6);
                    prop_assert!((bearing - expected_bearing).abs() < 1e-6);
                    #[expect(clippy::cast_possible_truncation, reason = "written with 32 bits")]
                    let range = range.map(|range| range as f32);
                    prop_assert_eq!(range, *expected);
                }
                other => prop_assert!(false, "{other:?}"),
            }
        }
        prop_assert!(travels.next().is_none() && echoes.next().is_none());
    }
}

fn stamped(seconds: f64, frame: &str) -> Header {
    #[expect(clippy::cast_possible_truncation, reason = "some seconds")]
    let stamp = Time::of_nanoseconds((seconds * 1e9) as i64);
    Header { stamp, frame_id: frame.to_owned() }
}

fn placed(seconds: f64, parent: &str, child: &str, [x, y, heading]: [f64; 3]) -> TFMessage {
    let rotation = geometry::quaternion(heading);
    let transform = Transform { translation: geometry::vector(x, y), rotation };
    let child_frame_id = child.to_owned();
    let header = stamped(seconds, parent);
    TFMessage { transforms: vec![TransformStamped { header, child_frame_id, transform }] }
}

/// Writes a bag by a function into a file of its own.
fn made(
    write: impl FnOnce(&mut Writer<Cursor<Vec<u8>>>) -> anyhow::Result<()>,
) -> (TempDir, PathBuf) {
    let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
    write(&mut writer).unwrap();
    let (bytes, _) = writer.end("x").unwrap();
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("made.mcap");
    fs::write(&path, bytes.into_inner()).unwrap();
    (dir, path)
}

fn odometry(out: &mut Writer<Cursor<Vec<u8>>>) -> anyhow::Result<()> {
    for tick in 0_u8..10 {
        let seconds = 1.0 + f64::from(tick) / 10.0;
        let mut message = Odometry { header: stamped(seconds, "odom"), ..Odometry::default() };
        "base_footprint".clone_into(&mut message.child_frame_id);
        message.pose.pose = geometry::pose([seconds, 0.0, 0.0]);
        out.write("/odom", Durability::Volatile, i64::from(tick), &message)?;
    }
    Ok(())
}

fn range(out: &mut Writer<Cursor<Vec<u8>>>, topic: &str, range: f32) -> anyhow::Result<()> {
    let header = stamped(1.5, topic.trim_start_matches('/'));
    let message = Range {
        header,
        field_of_view: 0.5,
        min_range: 0.02,
        max_range: 4.0,
        range,
        ..Range::default()
    };
    out.write(topic, Durability::Volatile, 5, &message)
}

/// Three sonars: one by static frames, two links from the base; one without a frame that is placed by hand; one at the place of the
/// first at another bearing.
#[test]
fn frames_give_places_and_bearings() {
    let (_dir, bag) = made(|out| {
        odometry(out)?;
        let quarter = std::f64::consts::FRAC_PI_2;
        for message in [
            placed(0.0, "base_footprint", "base_link", [0.1, 0.0, 0.0]),
            placed(0.0, "base_link", "left", [0.0, 0.05, quarter]),
            placed(0.0, "base_link", "right", [0.0, 0.05, -quarter]),
        ] {
            out.write("/tf_static", Durability::Latched, 0, &message)?;
        }
        range(out, "/left", 1.25)?;
        range(out, "/right", f32::INFINITY)?;
        range(out, "/spare", 2.5)
    });
    let (_, missing, _) = converted(&bag, &Rosbag::default());
    let missing = missing.unwrap_err().to_string();
    assert!(
        missing.contains("no transform leads from `base_footprint` to `spare`")
            && missing.contains("--mount"),
        "{missing}"
    );
    let mounts = [("/spare".to_owned(), [0.2, 0.0, 0.0])];
    let (out, result, _) = converted(&bag, &Rosbag { mounts: &mounts, ..Rosbag::default() });
    assert_eq!(result.unwrap().ranges, 3);
    let log = fs::read_to_string(out.path().join("log.csv")).unwrap();
    for line in [
        "range,1.500000,1.570796,1.25",
        "range,1.500000,-1.570796,",
        "range,1.500000,0.000000,2.5,,1",
    ] {
        assert!(log.lines().any(|own| own == line), "{line}\n{log}");
    }
    let robot = robot_file::read(&out.path().join("robot.toml")).unwrap();
    let rangers: Vec<_> = robot.localizer.rangers.iter().collect();
    assert_eq!(rangers.len(), 2);
    assert!(
        (rangers[0].1.mount.x.0 - 0.1).abs() < 1e-6 && (rangers[0].1.mount.y.0 - 0.05).abs() < 1e-6
    );
    assert!((rangers[1].1.mount.x.0 - 0.2).abs() < 1e-6);
    let only = ["/left".to_owned()];
    let (_, result, _) = converted(&bag, &Rosbag { ranges: &only, ..Rosbag::default() });
    assert_eq!(result.unwrap().ranges, 1);
}

/// A scanner that hangs upside down counts clockwise; single beams have the times at which they were measured.
#[test]
fn scans_are_turned_and_taken_apart() {
    let (_dir, bag) = made(|out| {
        odometry(out)?;
        let mut hanging = placed(0.0, "base_footprint", "laser", [0.0, 0.0, 0.0]);
        // Half a turn about x.
        hanging.transforms[0].transform.rotation =
            sonarfix_ros_messages::messages::Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 };
        out.write("/tf_static", Durability::Latched, 0, &hanging)?;
        let message = LaserScan {
            header: stamped(1.5, "laser"),
            angle_min: -1.0,
            angle_increment: 0.5,
            time_increment: 0.01,
            range_min: 0.1,
            range_max: 5.0,
            ranges: vec![1.0, 2.0, 9.0, f32::NAN, 4.0],
            ..LaserScan::default()
        };
        out.write("/scan", Durability::Volatile, 0, &message)
    });
    let lines = |rosbag: &Rosbag, kind: &str| {
        let (out, result, _) = converted(&bag, rosbag);
        result.unwrap();
        let log = fs::read_to_string(out.path().join("log.csv")).unwrap();
        let lines = log.lines().filter(|line| line.starts_with(kind)).map(str::to_owned);
        lines.collect::<Vec<_>>()
    };
    let whole = lines(&Rosbag::default(), "scan");
    assert_eq!(whole, ["scan,1.500000,1.000000000,-0.500000000000,1.000 2.000 - - 4.000"]);
    let beams = [1.0, -1.0, 0.0, 3.0];
    let beams = lines(&Rosbag { beams: &beams, ..Rosbag::default() }, "range");
    assert_eq!(
        beams,
        ["range,1.500000,1.000000,1", "range,1.520000,0.000000,", "range,1.540000,-1.000000,4"]
    );
}

#[test]
fn what_a_bag_does_not_tell_is_asked_for() {
    let (_dir, bag) = made(|out| {
        let message = JointState {
            header: stamped(1.0, ""),
            name: vec!["a".into(), "b".into()],
            position: vec![0.0, 0.0],
            ..JointState::default()
        };
        out.write("/joint_states", Durability::Volatile, 0, &message)
    });
    let error = |rosbag: &Rosbag| converted(&bag, rosbag).1.unwrap_err().to_string();
    assert!(
        error(&Rosbag::default()).contains("has no Odometry: for a JointState, add --wheel-radius")
    );
    let radius = Rosbag { radius: Some(0.03), ..Rosbag::default() };
    assert!(error(&radius).contains("--joints RIGHT,LEFT, of: a, b"));
    let joints = Some(["a".to_owned(), "b".to_owned()]);
    let named = Rosbag { joints, ..radius };
    assert!(error(&named).contains("--track-width"));
    let (_dir, two) = made(|out| {
        odometry(out)?;
        let message = Odometry { header: stamped(1.0, "odom"), ..Odometry::default() };
        let mut upright = message.clone();
        upright.pose.pose = geometry::pose([0.0; 3]);
        out.write("/a", Durability::Volatile, 0, &upright)?;
        // This is no rotation.
        out.write("/b", Durability::Volatile, 0, &message)
    });
    let (_, result, reports) =
        converted(&two, &Rosbag { odometry: Some("/b"), ..Rosbag::default() });
    let error = result.unwrap_err().to_string();
    assert!(error.contains("has no Odometry on /b (--odometry), but on: /a, /odom"), "{error}");
    assert!(reports[0].contains("message 12, /b: its pose is not finite"), "{reports:?}");
}

fn read(path: &Path) -> Result<(), String> {
    let mut report = |_| {};
    let mut recording = Recording::new(None, &mut report);
    Bag::open(path).and_then(|bag| bag.read(&mut recording)).map_err(|error| error.to_string())
}

/// Each is an error that names the file, at once.
#[test]
fn damaged_bags_are_errors() {
    let (dir, bag) = made(odometry);
    let whole = fs::read(&bag).unwrap();
    assert_eq!(read(&bag), Ok(()));
    let file = dir.path().join("damaged.mcap");
    let error = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        let error = read(&file).unwrap_err();
        assert!(error.contains("damaged.mcap: "), "{error}");
        error
    };
    assert!(error(b"").contains("is no file of a bag"));
    assert!(error(b"{}").contains("is no file of a bag"));
    assert!(error(&whole[..whole.len() / 2]).contains("mcap recover"));
    // A record that claims almost 2⁶⁴ bytes.
    let huge = [mcap::MAGIC, &[1], &[0xfe; 8], &[0; 100]].concat();
    let huge = error(&huge);
    assert!(huge.contains("exceeds limit") || huge.contains("claims"), "{huge}");
    // A schema and a channel whose texts claim 3 GiB.
    for (opcode, ids) in [(3, 2), (4, 4)] {
        let body = [[1; 4].get(..ids).unwrap(), &(3_u32 << 30).to_le_bytes(), &[0; 40]].concat();
        let length = (body.len() as u64).to_le_bytes();
        let bytes = [mcap::MAGIC, &[opcode], &length, &body, &[0; 99]].concat();
        assert!(error(&bytes).contains("claims a text that is longer than it"));
    }
    let mut chunk = [mcap::MAGIC, &[6]].concat();
    let body = [
        [0; 16].as_slice(),
        &u64::MAX.to_le_bytes(),
        &[0; 4],
        &4_u32.to_le_bytes(),
        b"zstd",
        &4_u64.to_le_bytes(),
        &[0x28, 0xb5, 0x2f, 0xfd],
    ]
    .concat();
    chunk.extend((body.len() as u64).to_le_bytes());
    chunk.extend(&body);
    chunk.extend([0; 64]);
    let packed = error(&chunk);
    assert!(packed.contains("zstd") || packed.contains("claims"), "{packed}");
    assert!(error(b"SQLite format 3\0 and no more").contains("no SQLite database"));
    // A part of a database is in the file beside it.
    fs::write(dir.path().join("damaged.mcap-wal"), "pages").unwrap();
    assert!(error(b"SQLite format 3\0").contains("the recording was interrupted"));
    let folder = TempDir::new().unwrap();
    assert!(read(folder.path()).unwrap_err().contains("it is no bag of ROS 2"));
    let mut metadata = fs::File::create(folder.path().join("metadata.yaml")).unwrap();
    metadata.write_all(b"rosbag2_bagfile_information: 3").unwrap();
    assert!(read(folder.path()).unwrap_err().contains("is no metadata of rosbag2"));
    assert!(read(Path::new("missing")).is_err());
}
