//! The trial of one placement, ping by ping: a coarse score with early exit, three Gauss–Newton
//! steps with falling tolerance, the final score.

use super::bank::{Entry, State};
use super::candidates::Placement;
use super::parameters::SearchParameters;
use super::refine::{Equations, Placed, Prior, Tolerance};
use super::score::{EchoModel, Explanation, Hearing, Sharpness};
use super::window::{Chain, Window};
use sonarfix::association::reflector::Beam;
use sonarfix::geometry::vector::Vector;

/// Gauss–Newton steps after the coarse one, and those of an answer.
const STEPS: u8 = 2;
const STEPS_OF_ANSWER: u8 = 4;
/// By how much the running sum may fall short: scores deviate by 1.3 a ping.
const LEAD: f32 = 8.0;

/// Of what may answer a ping, so much is looked at in one evaluation; in the one that finds it, [`Hearing::at_first`].
const HEARD_AT_ONCE: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Coarse,
    Step(u8),
    Fine,
}

/// What a step of a trial led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Verdict {
    Running,
    Rejected,
    Scored(Entry),
}

/// What is expected of the odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Odometry {
    /// Of its bend.
    pub prior: Prior,
    /// Deviation that a metre adds to the place of a ping besides, metres.
    pub per_metre: f32,
}

impl Odometry {
    pub fn of(parameters: &SearchParameters) -> Self {
        let prior = Prior { drift: parameters.drift.0, turn_scale: parameters.turn_scale };
        Self { prior, per_metre: parameters.odometry }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Trial {
    placement: Placement,
    stage: Stage,
    chain: Chain,
    /// The ping that is being looked at.
    hearing: Option<Hearing>,
    /// Pings looked at in this stage, and those of them with an echo.
    seen: u16,
    echoes: u16,
    /// Of their weighted scores, relative to a place without walls.
    sum: f32,
    /// The final score that must be within reach.
    least: f32,
    equations: Equations,
    past: f32,
    /// Whether the placement becomes an answer.
    pub is_answer: bool,
}

impl Trial {
    /// A new candidate that has to reach a final score; `past` is what earlier pings tell for it.
    pub fn of_candidate(placement: Placement, least: f32, past: f32) -> Self {
        Self {
            placement,
            stage: Stage::Coarse,
            chain: Chain::new(Vector::default()),
            hearing: None,
            seen: 0,
            echoes: 0,
            sum: 0.0,
            least,
            equations: Equations::default(),
            past,
            is_answer: false,
        }
    }

    /// A placement of the bank, refined again with the present pings.
    pub fn of_entry(entry: &Entry) -> Self {
        Self {
            stage: Stage::Step(0),
            ..Self::of_candidate(entry.placement, f32::NEG_INFINITY, entry.past)
        }
    }

    /// Looks at one ping, or at a part of what may answer it.
    #[inline(never)]
    pub fn advance<const PINGS: usize>(
        &mut self,
        echoes: &EchoModel,
        window: &Window<PINGS>,
        odometry: &Odometry,
    ) -> Verdict {
        let Some(ping) = window.newest(usize::from(self.seen)) else {
            return self.end_stage(odometry.prior, PINGS);
        };
        let sharpness =
            Sharpness::new(self.deviation(echoes), odometry.per_metre * ping.station.travelled);
        if self.hearing.is_none() {
            self.chain.add(&window.link(ping, self.placement.bend.minus(window.bend())));
        }
        let placed = Placed::new(ping, &self.placement, &self.chain);
        let Some(explanation) = self.explain(echoes, &placed.beam, sharpness) else {
            return Verdict::Running;
        };
        self.seen += 1;
        let has_echo = placed.beam.range.is_some();
        self.echoes += u16::from(has_echo);
        self.sum += ping.weight() * (explanation.score - echoes.nothing(has_echo));
        if let Some(target) = explanation.target {
            let by = Tolerance { deviation: sharpness.deviation, by_beam: echoes.by_beam };
            let placed = if echoes.is_light { placed.at_its_point() } else { placed };
            self.equations.add(&placed, &target, by);
        }
        if self.sum < self.least_sum(window.pings().len()) {
            return Verdict::Rejected;
        }
        Verdict::Running
    }

    /// The score of a ping, in a few evaluations if much may answer it.
    fn explain(
        &mut self,
        echoes: &EchoModel,
        beam: &Beam,
        sharpness: Sharpness,
    ) -> Option<Explanation> {
        if echoes.is_light {
            return Some(echoes.explain_lit(beam, sharpness));
        }
        let most = self.hearing.is_some().then_some(HEARD_AT_ONCE);
        let hearing = self.hearing.get_or_insert_with(|| echoes.listen(beam, sharpness));
        let most = most.unwrap_or(hearing.at_first());
        let explanation = echoes.hear(hearing, (beam, sharpness), most)?;
        self.hearing = None;
        Some(explanation)
    }

    /// Expected deviation of the ranges in this stage, metres.
    fn deviation(&self, echoes: &EchoModel) -> f32 {
        match self.stage {
            Stage::Coarse => Sharpness::COARSE,
            Stage::Step(0) => Sharpness::MEDIUM,
            Stage::Step(1) => echoes.fine(),
            Stage::Step(_) => echoes.sharp(),
            Stage::Fine if self.is_answer => echoes.sharp(),
            Stage::Fine => echoes.fine(),
        }
    }

    /// The sum below which the trial ends: a sequential test against the mean that a placement of the
    /// wanted final score would have. Earlier stages are less sharp and ask for less.
    fn least_sum(&self, pings: usize) -> f32 {
        let (share, slack) = match self.stage {
            Stage::Coarse => (0.5, 0.0),
            Stage::Step(0) => (0.7, 0.0),
            Stage::Step(_) | Stage::Fine => (0.9, 0.1),
        };
        let rate = share * self.least / count(pings) - slack;
        rate * f32::from(self.seen) - LEAD
    }

    fn end_stage(&mut self, prior: Prior, most: usize) -> Verdict {
        match self.stage {
            Stage::Coarse => self.step(0, prior),
            Stage::Step(number) => self.step(number + 1, prior),
            Stage::Fine => Verdict::Scored(Entry {
                placement: self.placement,
                score: self.sum,
                past: self.past,
                evidence: self.evidence(most),
                pings: narrow(self.seen),
                echoes: narrow(self.echoes),
                explained: narrow(self.equations.count),
                spread: self.equations.spread(prior),
                state: State::Fresh,
            }),
        }
    }

    /// The past, and what it does not hold of the pings: the newer, the more ([`Entry::age`]); of a full window half, on the mean.
    fn evidence(&self, most: usize) -> f32 {
        self.past + (1.0 - 0.5 * f32::from(self.seen) / count(most)) * self.sum
    }

    /// Takes the Gauss–Newton step of a stage and begins the next.
    fn step(&mut self, next: u8, prior: Prior) -> Verdict {
        let Some(placement) = self.equations.step(&self.placement, prior) else {
            return Verdict::Rejected;
        };
        self.placement = placement;
        let steps = if self.is_answer { STEPS_OF_ANSWER } else { STEPS };
        self.begin(if next < steps { Stage::Step(next) } else { Stage::Fine })
    }

    fn begin(&mut self, stage: Stage) -> Verdict {
        self.stage = stage;
        self.chain = Chain::new(Vector::default());
        self.hearing = None;
        self.seen = 0;
        self.echoes = 0;
        self.sum = 0.0;
        self.equations = Equations::default();
        Verdict::Running
    }
}

/// A number of pings in a byte: a window holds at most 255.
fn narrow(count: u16) -> u8 {
    u8::try_from(count).unwrap_or(u8::MAX)
}

/// A number of pings as `f32`.
pub fn count(of: usize) -> f32 {
    #[expect(clippy::cast_precision_loss, reason = "a window holds far fewer than 2^24 pings")]
    let count = of as f32;
    count
}

#[cfg(test)]
mod tests;
