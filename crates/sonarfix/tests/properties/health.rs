//! The verdict's transitions, as drawn in `health.rs`.

use proptest::prelude::*;
use sonarfix::health::Verdict::{self, Degraded, Lost, Tracking};
use sonarfix::localizer::Start;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix::map::{Map, Wall};
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Instant, Metres, Radians};

use crate::strategies::config_for_rooms;

#[derive(Debug, Clone, Copy)]
enum Outcome {
    Accepted,
    Gated,
    Silent,
}
use Outcome::{Accepted, Gated, Silent};

fn one_wall() -> [Wall; 1] {
    [Wall::new(Point::new(2.0, -5.0), Point::new(2.0, 5.0)).unwrap()]
}

fn started(walls: &[Wall]) -> Localizer<'_> {
    let start = Start {
        pose: Pose::default(),
        position_deviation: Metres(0.03),
        heading_deviation: Radians(0.01),
    };
    let config = config_for_rooms(Point::new(0.0, 0.0));
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

fn meet(localizer: &mut Localizer, outcome: Outcome) -> Verdict {
    let aim = localizer.aim().unwrap();
    let range = match outcome {
        Accepted => Some(aim.range),
        Gated => Some(aim.range + Metres(1.0)),
        Silent => None,
    };
    let fix = localizer.fix(&aim, range);
    let as_meant = matches!(
        (outcome, fix),
        (Accepted, Fix::Accepted(_)) | (Gated, Fix::Gated(_)) | (Silent, Fix::Refused(_))
    );
    assert!(as_meant, "{outcome:?} became {fix:?}");
    localizer.health().verdict
}

/// The verdicts that a sequence leads through.
fn verdicts(outcomes: &[Outcome]) -> Vec<Verdict> {
    let walls = one_wall();
    let mut localizer = started(&walls);
    outcomes.iter().map(|&o| meet(&mut localizer, o)).collect()
}

#[test]
fn the_drawn_ways_are_taken() {
    // Tracking → Degraded → Lost by gated ranges, the third and the eighth.
    let gated = verdicts(&[Gated; 9]);
    assert_eq!(gated[..2], [Tracking; 2]);
    assert_eq!(gated[2..7], [Degraded; 5]);
    assert_eq!(gated[7..], [Lost; 2]);
    // Tracking → Degraded by silence, the tenth; and no further.
    let silent = verdicts(&[Silent; 40]);
    assert_eq!(silent[..9], [Tracking; 9]);
    assert_eq!(silent[9..], [Degraded; 31]);
    // Lost → Degraded → Tracking by accepted ranges, three each.
    let mut recovery = vec![Gated; 8];
    recovery.extend([Accepted; 7]);
    assert_eq!(
        verdicts(&recovery)[7..],
        [Lost, Lost, Lost, Degraded, Degraded, Degraded, Tracking, Tracking]
    );
}

#[test]
fn what_interrupts_a_row_and_what_does_not() {
    // An accepted range between starts the gated ones anew.
    let mut interrupted = vec![];
    for _ in 0..5 {
        interrupted.extend([Gated, Gated, Accepted]);
    }
    assert!(verdicts(&interrupted).iter().all(|v| *v == Tracking));
    // A silent turn between does not.
    let through_silence = [Gated, Silent, Gated, Silent, Silent, Gated];
    assert_eq!(verdicts(&through_silence).last(), Some(&Degraded));
    // Either ends a row of accepted ones.
    for stop in [Gated, Silent] {
        let mut broken = vec![Gated; 8];
        broken.extend([Accepted, Accepted, stop, Accepted, Accepted]);
        assert_eq!(verdicts(&broken).last(), Some(&Lost));
    }
    // Any echo, even a gated one, ends a silence.
    for sound in [Gated, Accepted] {
        let mut broken = vec![Silent; 9];
        broken.push(sound);
        broken.extend([Silent; 9]);
        assert_eq!(verdicts(&broken).last(), Some(&Tracking));
    }
}

/// The drawing again, as a table of rows.
#[derive(Default)]
struct Model {
    verdict: Verdict,
    history: Vec<Outcome>,
    /// Where the current verdict's row of accepted ranges may begin.
    since: usize,
}

impl Model {
    fn meet(&mut self, outcome: Outcome) -> Verdict {
        self.history.push(outcome);
        let row = |counts: fn(&Outcome) -> bool, ends: fn(&Outcome) -> bool| {
            self.history.iter().rev().take_while(|o| !ends(o)).filter(|o| counts(o)).count()
        };
        let gated = row(|o| matches!(o, Gated), |o| matches!(o, Accepted));
        let silent = row(|o| matches!(o, Silent), |o| !matches!(o, Silent));
        let accepted = row(|o| matches!(o, Accepted), |o| !matches!(o, Accepted));
        let accepted = accepted.min(self.history.len() - self.since);
        self.verdict = match (self.verdict, outcome) {
            (_, Gated) if gated >= 8 => Lost,
            (Tracking, Gated) if gated >= 3 => Degraded,
            (Tracking, Silent) if silent >= 10 => Degraded,
            (Lost, Accepted) if accepted >= 3 => {
                self.since = self.history.len();
                Degraded
            }
            (Degraded, Accepted) if accepted >= 3 => Tracking,
            (verdict, _) => verdict,
        };
        self.verdict
    }
}

proptest! {
    /// Any sequence of outcomes leads where the drawing says. Rows, not single outcomes, are
    /// drawn: else eight gated ones would hardly ever come together.
    #[test]
    fn any_sequence_leads_where_it_is_drawn(
        rows in proptest::collection::vec(
            (prop_oneof![Just(Accepted), Just(Gated), Just(Silent)], 1_usize..11), 1..30),
    ) {
        let walls = one_wall();
        let mut localizer = started(&walls);
        let mut model = Model::default();
        for (outcome, times) in rows {
            for _ in 0..times {
                prop_assert_eq!(meet(&mut localizer, outcome), model.meet(outcome));
            }
        }
    }
}
