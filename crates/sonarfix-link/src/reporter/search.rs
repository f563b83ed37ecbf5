//! The telemetry on the search for the pose.

use sonarfix::localizer::Mode;
use sonarfix_search::search::{Answer, Hypothesis, Search};

use super::{Outlet, Reporter};
use crate::message::{RankedHypothesis, SearchAnswer, SearchStatus, Telemetry};

/// Messages on the search before they begin again. There is one at each tick: with ten ticks a second, each once a second.
const SEARCH_MESSAGES: u8 = 10;

impl Reporter {
    /// Passes the next message on the search to `outlet`; to be called at a tick while the search works.
    pub fn search(&mut self, mode: Mode, search: &Search, outlet: &mut impl Outlet) {
        let (at, number) = (self.last.at, self.next);
        self.next = (number + 1) % SEARCH_MESSAGES;
        let Some(rank) = number.checked_sub(1) else {
            let pings = u16::try_from(search.pings()).unwrap_or(u16::MAX);
            let (answer, cycles) = (kind_of(&search.answer()), search.cycles());
            outlet
                .send_built(|| Telemetry::Search(SearchStatus { at, mode, answer, pings, cycles }));
            return;
        };
        if let Some(hypothesis) = search.ranked(usize::from(rank)) {
            let Hypothesis { pose, position_deviation, heading_deviation, fit, explained, .. } =
                hypothesis;
            outlet.send_built(|| {
                Telemetry::Hypothesis(RankedHypothesis {
                    at,
                    rank,
                    pose,
                    position_deviation,
                    heading_deviation,
                    fit,
                    explained,
                })
            });
        }
    }
}

fn kind_of(answer: &Answer) -> SearchAnswer {
    match *answer {
        Answer::Searching => SearchAnswer::Searching,
        Answer::Several(count) => SearchAnswer::Several(u8::try_from(count).unwrap_or(u8::MAX)),
        Answer::Along { wall, .. } => SearchAnswer::Along(wall),
        Answer::Nowhere => SearchAnswer::Nowhere,
        Answer::Unique(_) => SearchAnswer::Unique,
    }
}
