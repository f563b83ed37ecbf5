//! The replay of exact synthetic logs.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fmt::Write;

use proptest::prelude::*;
use sonarfix_replay::fault::ReplayError;
use sonarfix_sim::trace::Calibration;

use crate::common::{Sonar, recording, replay, replay_scans, try_replay};

const SECONDS: u32 = 60;

#[test]
fn exact_ranges_at_given_bearings_lead_to_the_exact_pose() {
    let (log, reference) = recording(SECONDS, Sonar::Ranges);
    let replayed = replay(&log, &reference);
    let s = &replayed.summary;
    assert_eq!(replayed.complaints, [""; 0]);
    assert!(s.fixes.accepted > 150 && s.fixes.gated == 0, "{:?}", s.fixes);
    let (rms, median) = (s.position_rms.unwrap(), s.position_median.unwrap());
    // The initial error is 18 mm. A range fused at the next encoder record instead of its own
    // instant would have an error of 0.2 m/s × 37 ms = 7 mm; counts are rounded to 0.01 mm.
    assert!(median < 0.000_5 && rms < 0.003, "median {median}, RMS {rms}");
    assert!(s.odometry_position_rms.unwrap() > 0.015, "the encoders alone stay off");
}

#[test]
fn exact_scans_lead_to_the_exact_pose() {
    let (log, reference) = recording(SECONDS, Sonar::Scans);
    let replayed = replay(&log, &reference);
    let s = &replayed.summary;
    assert_eq!(replayed.complaints, [""; 0]);
    assert!(s.fixes.accepted > 100 && s.fixes.gated == 0, "{:?}", s.fixes);
    let median = s.position_median.unwrap();
    // A beam up to half a degree off the perpendicular is 4e-5 too long.
    assert!(median < 0.001, "median {median}");
    // One range in 400 ms of three scans per second: every second or third scan is used.
    let fixes = s.fixes.accepted + s.fixes.refused;
    assert!(fixes <= u64::from(SECONDS) * 5 / 2 + 1, "{fixes} fixes");
}

/// Recorded before a scan could give more: the estimates are those of a replay that takes one range.
#[test]
fn one_ping_per_scan_has_the_recorded_bits() {
    let (log, reference) = recording(SECONDS, Sonar::Scans);
    let s = replay(&log, &reference).summary;
    // The estimates are `f32`, and every bit of them is in the `f64`.
    let bits = |it: &Calibration| {
        [it.scale_right, it.scale_left, it.track_width].map(|value| f64::to_bits(value) >> 29)
    };
    let found = (bits(&s.calibration), bits(&s.final_deviation));
    let values = [25_639_744_214, 8_417_188_608, 8_561_412_379];
    let deviations = [8_491_699_456, 8_489_347_664, 8_484_600_075];
    assert_eq!(found, (values, deviations));
    assert_eq!((s.fixes.accepted, s.fixes.gated, s.fixes.refused), (148, 0, 0));
}

#[test]
fn several_pings_of_a_scan_are_at_different_walls_and_fit_into_its_time() {
    let (log, reference) = recording(SECONDS, Sonar::Scans);
    let one = replay(&log, &reference).summary;
    for most in [2, 3, 9] {
        let replayed = replay_scans(&log, &reference, most);
        let s = &replayed.summary;
        assert_eq!((s.fixes.gated, &replayed.complaints), (0, &vec![]), "{:?}", s.fixes);
        assert!(s.position_rms < one.position_rms, "{:?} {:?}", s.position_rms, one.position_rms);
        let fixes = &replayed.trace.trace().fixes;
        let mut counts = Vec::new();
        let mut last = 0.0;
        for scan in fixes.chunk_by(|one, other| one.time.to_bits() == other.time.to_bits()) {
            let mut walls: Vec<_> = scan.iter().map(|fix| fix.wall).collect();
            walls.sort_unstable();
            walls.dedup();
            assert_eq!(walls.len(), scan.len(), "a wall twice at {} s", scan[0].time);
            // A ping takes 120 ms; up to that much may be left of the time before.
            let elapsed = scan[0].time - last;
            let needed: f64 = scan.iter().map(|_| 0.12).sum();
            assert!(needed < elapsed + 0.12, "{} in {elapsed} s", scan.len());
            last = scan[0].time;
            counts.push(scan.len());
        }
        let largest = counts.iter().copied().max().unwrap();
        assert_eq!(largest, most.min(4) as usize, "the box has four walls");
    }
}

/// Far outside of the room there is no wall. A robot with a sonar finds that out at each ping, however seldom its recording
/// has a scan.
#[test]
fn without_a_wall_each_ping_of_a_scan_counts() {
    let mut log = "sonarfix-log,1\nstart,0,50,1.2,0,0.02,0.5\nticks,0,0,0\n".to_owned();
    for second in 1..=20 {
        writeln!(log, "scan,{second},-3.1,0.5,{}", "1.5 ".repeat(12)).unwrap();
        writeln!(log, "ticks,{second}.5,0,0").unwrap();
    }
    let of = |most| replay_scans(&log, "", most).summary;
    let (one, four, nine) = (of(1), of(4), of(9));
    // A second has time for eight pings of 120 ms; the rest is left to the next one.
    assert_eq!([&one, &four, &nine].map(|s| s.fixes.refused), [20, 80, 166]);
    assert_eq!((one.refusals.len(), one.fixes.accepted + nine.fixes.accepted), (1, 0));
    // After 30 such cycles the verdict is `Lost`: the fourth of the eighth scan, the sixth of the fourth.
    assert_eq!([&one, &four, &nine].map(|s| s.health.lost_at), [None, Some(8.0), Some(4.0)]);
}

#[test]
fn without_ranges_the_localizer_equals_dead_reckoning() {
    let (log, reference) = recording(SECONDS, Sonar::Silent);
    let s = replay(&log, &reference).summary;
    let difference = s.position_rms.unwrap() - s.odometry_position_rms.unwrap();
    assert!(difference.abs() < 1e-4, "{difference}");
    assert!((s.distance - 8.0).abs() < 0.01, "{} m of 4 × 2 m", s.distance);
    assert!((s.duration - 59.9).abs() < 1e-6);
    // At every row but the last, which is after the last encoder record.
    assert_eq!(s.reference_rows, u64::from(SECONDS) * 10 - 1);
}

#[test]
fn wheels_in_metres_are_ticks_in_metres() {
    let (log, reference) = recording(SECONDS, Sonar::Ranges);
    let in_metres = |line: &str| {
        let fields: Vec<_> = line.split(',').collect();
        let metres = |ticks: &str| ticks.parse::<f64>().unwrap() * f64::from(1e-5_f32);
        match fields[0] {
            "ticks" => {
                format!("wheels,{},{},{}\n", fields[1], metres(fields[2]), metres(fields[3]))
            }
            _ => format!("{line}\n"),
        }
    };
    let metres: String = log.lines().map(in_metres).collect();
    let (ticks, metres) = (replay(&log, &reference).summary, replay(&metres, &reference).summary);
    assert!((ticks.position_rms.unwrap() - metres.position_rms.unwrap()).abs() < 1e-6);
    assert_eq!(ticks.fixes, metres.fixes);
}

/// The complaints about a log.
fn complaints(lines: &[&str]) -> Vec<String> {
    let log = format!("sonarfix-log,1\n{}\n", lines.join("\n"));
    let replayed = try_replay(log.as_bytes(), "", false).unwrap();
    assert_eq!(replayed.summary.lines_skipped, replayed.complaints.len() as u64);
    replayed.complaints
}

#[test]
fn implausible_lines_are_skipped_and_reported() {
    let reported = complaints(&[
        "start,0,1,1.2,0,0.01,0.01",
        "ticks,0,0,0",
        "ticks,1,1000,1000",
        "ticks,1,1000,1000",
        "ticks,0.5,1000,1000",
        "range,0.5,0,1",
        "start,2,1,1,0,0.01,0.01",
        "wheels,2,0.1,0.1",
        "ticks,2,2000,2000000",
        "ticks,3,2000,2000",
        "tocks,4,1,1",
        "ticks,4,3000",
    ]);
    let expected = [
        "log line 5: the time is that of the previous record",
        "log line 6: the time goes back",
        "log line 7: the time goes back",
        "log line 8: the log has a start record already",
        "log line 9: the log has both ticks and wheels",
        "log line 10: a wheel rolled faster than max_wheel_speed",
        "log line 12: `tocks` is not one of ticks, wheels, turn, range, scan, skip, heading, position, measured_pose, start, resume, pose, mode",
        "log line 13: the left count is missing",
    ];
    assert_eq!(reported, expected);
}

#[test]
fn a_truncated_or_overlong_or_undecodable_line_is_skipped() {
    let start = b"sonarfix-log,1\nstart,0,1,1.2,0,0.01,0.01\nticks,0,0,0\nticks,1,0,0\n";
    let mut log = start.to_vec();
    log.extend(b"ticks,2,\xff\xfe,0\nscan,2,0,0.1,");
    log.extend(b"1.5 ".repeat(300_000));
    log.extend(b"\nticks,3,0,0\nticks,4,0,");
    let replayed = try_replay(&log, "", false).unwrap();
    let expected = [
        "log line 5: the line is not UTF-8 text",
        "log line 6: the line is longer than 1 MiB",
        "log line 8: the line is truncated: the file ends before its newline",
    ];
    assert_eq!(replayed.complaints, expected);
    assert_eq!(replayed.summary.encoder_records, 3);
}

#[test]
fn reset_counters_are_detected() {
    let (log, reference) = recording(SECONDS, Sonar::Ranges);
    let mut from = None;
    let reset = |line: &str| {
        let fields: Vec<_> = line.split(',').collect();
        let late = fields[0] == "ticks" && fields[1].parse::<f64>().unwrap() > 30.0;
        if !late {
            return format!("{line}\n");
        }
        let count = |field: usize| fields[field].parse::<i64>().unwrap();
        let [right, left] = *from.get_or_insert([count(2), count(3)]);
        format!("ticks,{},{},{}\n", fields[1], count(2) - right, count(3) - left)
    };
    let log: String = log.lines().map(reset).collect();
    let replayed = replay(&log, &reference);
    assert_eq!(replayed.summary.encoder_jumps, 1);
    assert_eq!(replayed.complaints.len(), 1, "{:?}", replayed.complaints);
    assert!(replayed.summary.position_median.unwrap() < 0.001);
}

#[test]
fn strict_ends_at_the_first_line_that_is_wrong() {
    let (log, reference) = recording(2, Sonar::Ranges);
    assert!(try_replay(log.as_bytes(), &reference, true).is_ok());
    let torn = &log[..log.len() - 1];
    let Err(ReplayError::Strict(complaint)) = try_replay(torn.as_bytes(), &reference, true) else {
        panic!("a torn line passed");
    };
    assert_eq!(complaint.line, log.lines().count() as u64);
    let wrong = format!("{reference}0,0\n");
    let error = try_replay(log.as_bytes(), &wrong, true).err();
    assert!(error.is_none(), "rows after the end of the log are not read");
    let wrong = reference.replacen("heading_rad\n", "heading_rad\n0,0\n", 1);
    assert!(matches!(
        try_replay(log.as_bytes(), &wrong, true),
        Err(ReplayError::Strict(complaint)) if complaint.line == 2
    ));
}

#[test]
fn a_file_that_is_not_a_log_is_refused() {
    let error = |log: &str| try_replay(log.as_bytes(), "", false).err().unwrap().to_string();
    let header = "the log must start with the line `sonarfix-log,1`";
    assert_eq!(error(""), header);
    assert_eq!(error("sonarfix-log,2\n"), header);
    assert_eq!(error("ticks,1,2,3\n"), header);
    let no_start = "the log has no start record with an encoder record after it";
    assert_eq!(error("sonarfix-log,1\nticks,1,2,3\n"), no_start);
    assert_eq!(error("sonarfix-log,1\nstart,2,0,0,0,1,1\nticks,1,2,3\n"), no_start);
    assert!(error("sonarfix-log,1\nstart,0,0,0,0,0,0\nstart,0,0,0,0,0,0\n").contains("no start"));
}

#[test]
fn ranges_without_encoders_are_held_only_so_long() {
    let ranges = (0..2000).map(|n| format!("range,{},0,1\n", 1.0 + f64::from(n) * 1e-3));
    let ranges: String = ranges.collect();
    let log =
        format!("sonarfix-log,1\nstart,0,1,1.2,0,0.01,0.01\nticks,0,0,0\n{ranges}ticks,9,0,0\n");
    let replayed = replay(&log, "");
    assert_eq!(replayed.summary.lines_skipped, 2000 - 1024);
    assert!(replayed.complaints[0].contains("too many ranges"));
    let fixes = replayed.summary.fixes;
    assert_eq!(fixes.accepted + fixes.gated + fixes.refused, 1024);
}

#[test]
fn a_start_between_two_encoder_records_is_interpolated() {
    // Half of the travel is before the start.
    let log = "sonarfix-log,1\nticks,0,0,0\nstart,1,1,1.2,0,0.01,0.01\nticks,2,20000,20000\n";
    let s = replay(log, "time_s,x_m,y_m,heading_rad\n1,1,1.2,0\n2,1.1,1.2,0\n").summary;
    assert_eq!(s.reference_rows, 2);
    assert!(s.position_max.unwrap() < 1e-6, "{:?}", s.position_max);
    assert!((s.started_at - 1.0).abs() < 1e-9 && (s.distance - 0.1).abs() < 1e-6);
}

#[test]
fn the_trace_has_the_reference_where_it_is_known() {
    let (log, reference) = recording(SECONDS, Sonar::Ranges);
    let replayed = replay(&log, &reference);
    let trace = replayed.trace.trace();
    assert_eq!(trace.ticks.len(), SECONDS as usize * 10 - 1);
    for tick in trace.ticks.iter().skip(1) {
        let truth = tick.truth.unwrap().pose;
        let ([x, y, _], _) = crate::common::truth(tick.time);
        // The reference is interpolated across the corners of the path.
        assert!((truth.x - x).hypot(truth.y - y) < 0.005, "at {} s", tick.time);
    }
    assert!(trace.fixes.windows(2).all(|pair| pair[0].time < pair[1].time));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Lines that are not records never stop a replay, are all counted, and have no effect.
    #[test]
    fn garbage_is_counted_and_changes_nothing(
        garbage in prop::collection::vec(
            (0_usize..300, prop::collection::vec(any::<u8>(), 0..60)), 0..20,
        ),
    ) {
        let (log, reference) = recording(20, Sonar::Ranges);
        let clean = replay(&log, &reference).summary;
        let mut lines: Vec<Vec<u8>> = log.lines().map(|line| line.as_bytes().to_vec()).collect();
        for (place, bytes) in &garbage {
            // A line with `?` is never a record, a comment or empty.
            let mut line = vec![b'?'];
            line.extend(bytes.iter().filter(|&&byte| byte != b'\n'));
            lines.insert(1 + place % (lines.len() - 1), line);
        }
        lines.push(Vec::new());
        let dirty = try_replay(&lines.join(&b'\n'), &reference, false).unwrap().summary;
        prop_assert_eq!(dirty.lines_skipped, garbage.len() as u64);
        prop_assert_eq!(dirty.fixes, clean.fixes);
        prop_assert_eq!(dirty.calibration, clean.calibration);
        prop_assert_eq!(dirty.position_rms, clean.position_rms);
    }

    /// No text after the first line stops a replay.
    #[test]
    fn no_input_stops_a_replay(
        lines in prop::collection::vec(
            (
                prop::sample::select(vec!["ticks", "wheels", "range", "scan", "start", "", "#", "x"]),
                prop::collection::vec(
                    prop_oneof![
                        Just(String::new()), Just("nan".to_owned()), Just("1e9".to_owned()),
                        Just("9223372036854775807".to_owned()), Just("1 2 - 0".to_owned()),
                        (-5.0_f64..50.0).prop_map(|n| n.to_string()),
                        (-50_i32..50_000).prop_map(|n| n.to_string()),
                    ],
                    0..7,
                ),
            ),
            0..60,
        ),
    ) {
        let (mut log, reference) = recording(1, Sonar::Ranges);
        for (kind, fields) in &lines {
            writeln!(log, "{kind},{}", fields.join(",")).unwrap();
        }
        let s = try_replay(log.as_bytes(), &reference, false).unwrap().summary;
        prop_assert!(s.lines_skipped <= lines.len() as u64);
        prop_assert!(s.position_rms.unwrap().is_finite());
    }

    /// A log truncated anywhere, even inside a number, is replayed up to there.
    #[test]
    fn a_log_cut_anywhere_is_replayed_up_to_there(cut in 0.2_f64..1.0) {
        let (log, reference) = recording(5, Sonar::Scans);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a place in a text")]
        let cut = (log.len() as f64 * cut) as usize;
        let replayed = try_replay(&log.as_bytes()[..cut], &reference, false).unwrap();
        let torn = !log[..cut].ends_with('\n');
        prop_assert_eq!(replayed.summary.lines_skipped, u64::from(torn));
    }
}
