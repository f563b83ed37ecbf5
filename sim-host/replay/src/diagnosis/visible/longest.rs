//! A longest range that many pings have: what a ranger writes instead of no echo.

use std::collections::BTreeMap;

use crate::diagnosis::finding::Finding;

/// Echoes that show a share.
const ECHOES: u64 = 30;
/// The most different ranges that are counted.
const MOST: usize = 1 << 16;

/// A room has about as many ranges that are shorter by up to so many millimetres.
const BELOW: u64 = 25;
/// Different ranges among them of a ranger of a fine resolution.
const MANY: usize = 5;

const PLACEHOLDER: &str = "range_placeholder";
const LEAVE_EMPTY: &str = "leave the range empty where there is no echo";

/// The ranges by their value, millimetres.
#[derive(Debug, Default)]
pub struct Longest {
    echoes: u64,
    counts: BTreeMap<u64, Count>,
}

#[derive(Debug, Default)]
struct Count {
    echoes: u64,
    /// Pings of another range before one of this.
    runs: u64,
    line: u64,
    last: u64,
}

impl Longest {
    pub fn add(&mut self, line: u64, range: f64) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "ranges are positive; `as` saturates"
        )]
        let millimetres = (1e3 * range).round() as u64;
        if self.counts.len() >= MOST && !self.counts.contains_key(&millimetres) {
            return;
        }
        self.echoes += 1;
        let count = self.counts.entry(millimetres).or_default();
        if count.echoes == 0 {
            count.line = line;
        }
        count.runs += u64::from(count.last + 1 != self.echoes);
        count.last = self.echoes;
        count.echoes += 1;
    }

    /// A longest range that no wall has: it is apart from the others, or as long as the ranger measures.
    pub fn placeholder(&self, max_range: f64) -> Option<Finding> {
        let (longest, count) = self.piled()?;
        let metres = metres(longest);
        (metres >= 0.98 * max_range || self.is_apart(longest)).then(|| {
            Finding::at(
                count.line,
                PLACEHOLDER,
                format!("{}: the ranger writes it instead of no echo", self.shown(longest, count)),
                LEAVE_EMPTY.to_owned(),
            )
        })
    }

    /// A longest range to which longer ones are cut.
    pub fn clipped(&self, max_range: f64) -> Option<Finding> {
        let (longest, count) = self.piled()?;
        let metres = metres(longest);
        (metres < 0.98 * max_range && !self.is_apart(longest)).then(|| {
            Finding::at(
                count.line,
                "range_clipped",
                format!(
                    "{}, and max_range is {max_range} m: longer ranges are cut to it",
                    self.shown(longest, count)
                ),
                format!("leave the range empty where there is no echo, and check the ranger's time-out; or state max_range = \"{:.2} m\"", 0.98 * metres),
            )
        })
    }

    /// A range within the others that is far more frequent than any of them: walls do not repeat a range to the millimetre.
    pub fn repeated(&self) -> Option<Finding> {
        let mut counts: Vec<_> = self.counts.iter().collect();
        counts.sort_by_key(|(_, count)| std::cmp::Reverse(count.echoes));
        let [(range, first), (_, second), ..] = counts.as_slice() else { return None };
        let is_frequent = 10 * first.echoes >= self.echoes && first.runs >= 8;
        let is_alone = first.echoes > 4 * second.echoes && counts.len() >= MANY;
        (self.echoes >= ECHOES && is_frequent && is_alone).then(|| {
            let (echoes, all) = (first.echoes, self.echoes);
            Finding::at(
                first.line,
                PLACEHOLDER,
                format!("{echoes} of {all} ranges are exactly {:.3} m, again and again: the ranger writes it instead of no echo", metres(**range)),
                LEAVE_EMPTY.to_owned(),
            )
        })
    }

    fn shown(&self, longest: u64, count: &Count) -> String {
        let (echoes, all) = (count.echoes, self.echoes);
        format!("{echoes} of {all} ranges are exactly {:.3} m, the longest", metres(longest))
    }

    /// The longest range, if more echoes than slightly below are exactly that long, again and again.
    fn piled(&self) -> Option<(u64, &Count)> {
        let (&longest, count) = self.counts.last_key_value()?;
        let below = || {
            let below = self.counts.range(longest.saturating_sub(BELOW)..longest);
            below.map(|(_, it)| it.echoes)
        };
        let is_frequent = 12 * count.echoes >= self.echoes && count.runs >= 4;
        // A ranger that counts centimetres has few different ranges.
        let is_piled = if below().count() >= MANY {
            count.echoes > 4 * below().max().unwrap_or(0)
        } else {
            count.echoes > 2 * below().sum::<u64>()
        };
        (self.echoes >= ECHOES && is_frequent && is_piled).then_some((longest, count))
    }

    /// Whether the next shorter range is much shorter.
    fn is_apart(&self, longest: u64) -> bool {
        let next = self.counts.range(..longest).next_back();
        next.is_none_or(|(next, _)| 10 * next < 7 * longest)
    }
}

#[expect(clippy::cast_precision_loss, reason = "millimetres of a range")]
fn metres(millimetres: u64) -> f64 {
    1e-3 * millimetres as f64
}
