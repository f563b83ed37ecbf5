//! The golden traces on this computer. `cargo xtask golden` runs them on emulated ones.
#![cfg(test)]

use std::path::Path;

use sonarfix_pil::{Answer, line};
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

#[test]
fn this_computer_computes_the_bits_of_the_search() {
    assert_equal("search.golden", 6_000);
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
