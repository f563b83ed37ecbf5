//! The difference between two answers to one request, in words.

use sonarfix_pil::{Answer, Snapshot};

use sonarfix_sim::STATES;

/// The difference between the answer of this process and that of the microcontroller, `None` if the
/// latter cannot be decoded.
#[must_use]
pub fn difference(own: &Answer, theirs: Option<&Answer>) -> String {
    let Some(theirs) = theirs else {
        return "the answer cannot be decoded".to_owned();
    };
    let number = match (snapshot(own), snapshot(theirs)) {
        (Some(own), Some(theirs)) => first_number(own, theirs),
        _ => None,
    };
    number.unwrap_or_else(|| format!("{own:?} here, {theirs:?} there"))
}

fn snapshot(answer: &Answer) -> Option<&Snapshot> {
    match answer {
        Answer::Odometry(_, snapshot)
        | Answer::Fix(_, snapshot)
        | Answer::Absolute(_, snapshot) => Some(snapshot),
        Answer::Polled { snapshot, .. } => snapshot.as_ref(),
        _ => None,
    }
}

/// The first number of two estimates whose bits differ.
fn first_number(own: &Snapshot, theirs: &Snapshot) -> Option<String> {
    let pairs = own.numbers().zip(theirs.numbers());
    let (name, (own, theirs)) =
        names().zip(pairs).find(|(_, (own, theirs))| own.to_bits() != theirs.to_bits())?;
    let (a, b) = (own.to_bits(), theirs.to_bits());
    Some(format!("{name} is {own:e} ({a:#010x}) here and {theirs:e} ({b:#010x}) there"))
}

/// The names of [`Snapshot::numbers`].
fn names() -> impl Iterator<Item = String> {
    let states = STATES.iter().map(|name| (*name).to_owned());
    let entries = (0..STATES.len()).flat_map(|row| {
        (row..STATES.len()).map(move |column| format!("covariance ({row}, {column})"))
    });
    states.chain(entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix::health::Health;

    #[test]
    fn the_first_number_that_differs_is_named_with_its_bits() {
        let own = Snapshot {
            state: sonarfix::filter::ekf::StateEstimate::default(),
            covariance: [0.0; sonarfix_pil::message::TRIANGLE],
            health: Health::default(),
        };
        let described = |theirs: Snapshot| {
            difference(&Answer::Odometry(Ok(()), own), Some(&Answer::Odometry(Ok(()), theirs)))
        };
        let mut theirs = own;
        theirs.covariance[27] = 1.0;
        assert!(
            described(theirs).starts_with("covariance (6, 6) is 0e0 (0x00000000) here and 1e0")
        );
        // The sign of a zero is a bit, too.
        theirs.covariance[7] = -0.0;
        assert!(described(theirs).contains("covariance (1, 1) is 0e0 (0x00000000) here and -0e0"));
        theirs.state.range_scale = f32::NAN;
        assert!(described(theirs).starts_with("range_scale is"));
        // Any other difference shows both answers.
        let other = Snapshot { health: Health { inflations: 1, ..own.health }, ..own };
        assert!(described(other).contains("inflations: 1"));
        assert_eq!(names().count(), own.numbers().count());
    }
}
