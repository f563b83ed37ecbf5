//! The golden traces on this computer. `cargo xtask golden` has the emulated ones.
#![cfg(test)]

use std::path::PathBuf;

use sonarfix_pil::{Answer, line};
use sonarfix_sim::pil::golden::{self, Exchange};
use sonarfix_sim::pil::pair::Pair;
use sonarfix_sim::pil::progress::Progress;

fn trace(name: &str) -> Vec<Exchange> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    golden::read(&path).unwrap()
}

fn alone() -> Pair {
    Pair::new(None, Progress::of(0.0))
}

#[test]
fn this_computer_computes_the_bits_of_every_trace() {
    for (name, least) in [("localizer.golden", 700), ("loop.golden", 10_000)] {
        let mut pair = alone();
        golden::replay(&trace(name), &mut pair).unwrap();
        assert!(pair.questions() > least, "{name}: {} questions", pair.questions());
    }
}

/// A trace that could not fail would show nothing: any bit of any estimate counts, the last of the
/// covariance too.
#[test]
fn a_bit_that_is_another_is_found_and_named() {
    let exchanges = trace("localizer.golden");
    let is_estimate =
        |exchange: &&Exchange| matches!(line::answer(&exchange.answer), Some(Answer::Rolled(..)));
    let at = exchanges.iter().rposition(|exchange| is_estimate(&exchange)).unwrap();
    for (byte, bit) in [(2, 0), (30, 3), (141, 7)] {
        let mut changed = exchanges.clone();
        changed[at].answer[byte] ^= 1 << bit;
        let error = golden::replay(&changed, &mut alone()).unwrap_err().to_string();
        assert!(error.contains(" is ") && error.contains("0x"), "byte {byte}: {error}");
    }
    assert!(golden::replay(&[], &mut alone()).is_err());
}
