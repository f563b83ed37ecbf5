//! The golden traces on this computer. `cargo xtask golden` runs them on emulated ones.
#![cfg(test)]

use std::path::Path;

use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal, Localizer};
use sonarfix_pil::{Answer, Request, Session, Unmetered, Wires, line};
use sonarfix_pil_host::pair::Pair;
use sonarfix_pil_host::progress::Progress;
use sonarfix_pil_host::{Exchange, golden};

fn trace(name: &str) -> Vec<Exchange> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    golden::read(&folder.join(name)).unwrap()
}

fn alone() -> Pair {
    Pair::new(None, Progress::of(0.0))
}

/// This computer computes the bits of a trace with at least so many requests.
fn assert_equal(name: &str, least: u64) {
    let mut pair = alone();
    golden::replay(&trace(name), &mut pair).unwrap();
    assert!(pair.requests() > least, "{name}: {} requests", pair.requests());
}

#[test]
fn this_computer_computes_the_bits_of_the_localizer() {
    assert_equal("localizer.golden", 700);
}

#[test]
fn this_computer_computes_the_bits_of_the_loop() {
    assert_equal("loop.golden", 2_000);
}

/// The loop with a time-of-flight ranger.
#[test]
fn this_computer_computes_the_bits_of_a_robot_with_light() {
    assert_equal("light.golden", 400);
}

#[test]
fn this_computer_computes_the_bits_of_the_search() {
    assert_equal("search.golden", 6_000);
}

/// Executes a trace of one session, and calls a function after each request.
fn execute(name: &str, mut after: impl FnMut(&Session)) {
    let exchanges = trace(name);
    let (first, rest) = exchanges.split_first().unwrap();
    let Some(Request::Begin(begin, map)) = line::decode_request(&first.request) else {
        panic!("{name} does not begin a session");
    };
    let wires = Wires::default();
    let (mut session, ..) = Session::begin(&begin, map, &wires, &mut Unmetered).unwrap();
    for exchange in rest {
        let _ = session.execute(&line::decode_request(&exchange.request).unwrap(), &mut Unmetered);
        after(&session);
    }
}

#[test]
fn this_computer_computes_the_bits_of_a_gyro() {
    assert_equal("gyro.golden", 3_000);
}

/// The trace with a gyro contains a slip of a wheel and headings, and the bias is estimated.
#[test]
fn the_trace_of_a_gyro_contains_a_slip_and_headings() {
    let (mut status, mut used) = (None, 0);
    execute("gyro.golden", |session| {
        status = session.localizer().and_then(Localizer::gyro);
        used += session.report().absolute.iter().filter(|result| result.fix.is_used()).count();
    });
    let status = status.unwrap();
    assert!((1..10).contains(&status.slips) && status.conflicts == 0, "{status:?}");
    assert!(status.deviation.to_degrees() < 0.05, "{status:?}");
    assert!(used > 20, "{used}");
}

#[test]
fn this_computer_computes_the_bits_of_headings_and_poses() {
    assert_equal("absolute.golden", 900);
}

/// Each outcome of a heading or pose is in the trace: used, down-weighted, an outlier, and too late.
#[test]
fn the_trace_of_headings_and_poses_contains_each_outcome() {
    let mut counts = [0; 4];
    execute("absolute.golden", |session| {
        if let Some(result) = &session.report().absolute {
            let at = match result.fix {
                AbsoluteFix::Accepted(_) => 0,
                AbsoluteFix::Downweighted(_) => 1,
                AbsoluteFix::Gated(_) => 2,
                AbsoluteFix::Refused(AbsoluteRefusal::BeforeLastStep) => 3,
                ref other => panic!("{other:?}"),
            };
            counts[at] += 1;
        }
    });
    assert!(counts[0] > 30 && counts[1..].iter().all(|count| *count >= 3), "{counts:?}");
}

/// The comparison detects any changed bit of an estimate, including the last of the covariance.
#[test]
fn a_changed_bit_is_found_and_named() {
    let exchanges = trace("localizer.golden");
    let is_estimate = |exchange: &&Exchange| {
        matches!(line::decode_answer(&exchange.answer), Some(Answer::Odometry(..)))
    };
    let at = exchanges.iter().rposition(|exchange| is_estimate(&exchange)).unwrap();
    for (byte, bit) in [(2, 0), (30, 3), (141, 7)] {
        let mut changed = exchanges.clone();
        changed[at].answer[byte] ^= 1 << bit;
        let error = golden::replay(&changed, &mut alone()).unwrap_err().to_string();
        assert!(error.contains(" is ") && error.contains("0x"), "byte {byte}: {error}");
    }
    assert!(golden::replay(&[], &mut alone()).is_err());
}
