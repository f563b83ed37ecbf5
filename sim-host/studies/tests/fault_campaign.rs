//! The fault campaign: sequences that once broke a rule, and some random ones.
use sonarfix_studies::fault_campaign::{self, Failure};

/// One line each, as `sonarfix-studies faults campaign` prints it.
const KEPT: &str = include_str!("fault_sequences.jsonl");

#[test]
fn sequences_that_broke_a_rule_keep_it() {
    for line in KEPT.lines() {
        let Failure { rule, case } = serde_json::from_str(line).unwrap();
        if let Err(broken) = fault_campaign::play(&case) {
            panic!("{rule}: {broken}");
        }
    }
}

#[test]
fn random_sequences_break_no_rule() {
    let (played, failures) = fault_campaign::campaign(1_000, 40, &|| ());
    assert_eq!(played, 40);
    assert!(failures.is_empty(), "{}", serde_json::to_string_pretty(&failures).unwrap());
}
