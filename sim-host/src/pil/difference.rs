//! In what two answers to one question differ, in words.

use sonarfix_pil::{Answer, Belief};

use crate::STATES;

/// In what an answer differs from this process's; another's cannot always be read.
#[must_use]
pub fn difference(own: &Answer, theirs: Option<&Answer>) -> String {
    let Some(theirs) = theirs else {
        return "the answer cannot be read".to_owned();
    };
    let number = match (belief(own), belief(theirs)) {
        (Some(own), Some(theirs)) => first_number(own, theirs),
        _ => None,
    };
    number.unwrap_or_else(|| format!("{own:?} here, {theirs:?} there"))
}

fn belief(answer: &Answer) -> Option<&Belief> {
    match answer {
        Answer::Rolled(_, belief) | Answer::Fixed(_, belief) => Some(belief),
        Answer::Polled { belief, .. } => belief.as_ref(),
        _ => None,
    }
}

/// The first number of two estimates that has not the same bits.
fn first_number(own: &Belief, theirs: &Belief) -> Option<String> {
    let pairs = own.numbers().zip(theirs.numbers());
    let (name, (own, theirs)) =
        names().zip(pairs).find(|(_, (own, theirs))| own.to_bits() != theirs.to_bits())?;
    let (a, b) = (own.to_bits(), theirs.to_bits());
    Some(format!("{name} is {own:e} ({a:#010x}) here and {theirs:e} ({b:#010x}) there"))
}

/// The names of [`Belief::numbers`].
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
        let own = Belief {
            state: sonarfix::ekf::State::default(),
            covariance: [0.0; sonarfix_pil::message::TRIANGLE],
            health: Health::default(),
        };
        let said = |theirs: Belief| {
            difference(&Answer::Rolled(Ok(()), own), Some(&Answer::Rolled(Ok(()), theirs)))
        };
        let mut theirs = own;
        theirs.covariance[27] = 1.0;
        assert!(said(theirs).starts_with("covariance (6, 6) is 0e0 (0x00000000) here and 1e0"));
        // A zero's sign is a bit.
        theirs.covariance[7] = -0.0;
        assert!(said(theirs).contains("covariance (1, 1) is 0e0 (0x00000000) here and -0e0"));
        theirs.state.range_scale = f32::NAN;
        assert!(said(theirs).starts_with("range_scale is"));
        // Whatever else differs is shown whole.
        let other = Belief { health: Health { reopened: 1, ..own.health }, ..own };
        assert!(said(other).contains("reopened: 1"));
        assert_eq!(names().count(), own.numbers().count());
    }
}
