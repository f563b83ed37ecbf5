//! Boards that make the map unique, or the answer sooner: chosen by what they tell between the poses that starts confused, then by
//! simulation.

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_map::{Addition, Collision, Floor, NamedWall, PathPlan, PlacedAddition, along_walls};
use sonarfix_sim::progress::Progress;
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{direction, distance};

use super::separation::Ears;
use super::start::{Outcome, Place, Start};
use super::{AnywhereError, Settings, Times, simulate};
use crate::trial::PERIOD;

/// The board: metres from the wall.
const BOARD: Addition = Addition::Board { depth: 0.4 };
/// Distance of the places along a wall at which it is tried, metres.
const APART: f64 = 0.5;
/// Room that it leaves to the wall opposite, in widths of the robot.
const PASSAGE: f64 = 2.0;
/// Boards that are simulated, and their distance from each other, metres.
const FINALISTS: usize = 3;
const FINALISTS_APART: f64 = 1.0;
/// Lead of a unique answer (`docs/search.md`), and the share of the expected log odds that a search gets: pings that are no news
/// do not count, and furniture hides walls.
const LEAD: f64 = 24.0;
const GAINED: f64 = 0.5;
/// Pings of a sweep.
const SWEEP: f64 = 21.0;
/// Boards that are proposed at most.
pub(super) const MOST_BOARDS: u32 = 3;
/// A board that does not save this share of the time, of the slower half of the starts, is not proposed.
const WORTHWHILE: f64 = 0.1;

/// Boards, and what they change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Landmarks {
    /// The ends of each: at the wall, and in the room, metres.
    pub boards: Vec<[[f64; 2]; 2]>,
    /// Where they stand.
    #[serde(skip)]
    pub places: Vec<PlacedAddition>,
    /// What other starts lead to with them.
    #[serde(flatten)]
    pub times: Times,
}

/// The confusions of one start, and how long they last.
struct Doubts<'a> {
    start: &'a Start,
    end: f64,
    /// For each doubt and each of its rivals the evidence of a sweep without a board.
    evidence: Vec<Vec<f64>>,
}

/// The fewest boards, clear of a path, with which nearly all starts have the right answer, or those that help most; `None` if none
/// does, or it was interrupted.
///
/// # Errors
/// [`AnywhereError`], if the map cannot be used.
pub(super) fn fewest(
    place: &Place<'_>,
    starts: &[Start],
    path: Option<&PathPlan>,
    settings: &Settings,
    progress: &impl Progress,
) -> Result<Option<Landmarks>, AnywhereError> {
    let mut found: Option<Landmarks> = None;
    let (mut floor, mut starts) = (place.floor.clone(), Seeded::new(starts, settings.seed));
    for _ in 0..MOST_BOARDS {
        let place = Place::new(place.scenario, floor.clone())?;
        let Some(board) = best(&place, &starts, path, settings, progress)? else { break };
        floor = board.on(&floor);
        // Others than those by which it was chosen.
        let first = starts.first.wrapping_add(u64::from(settings.starts));
        let seeds: Vec<u64> = (first..).take(settings.starts as usize).collect();
        let with = Place::new(place.scenario, floor.clone())?;
        let others = simulate(&with, &seeds, settings, progress)?;
        let Some(times) = Times::new(&others, settings.seconds) else { break };
        if settings.lost_by(&others) >= settings.lost_by(&starts.all) {
            break;
        }
        let mut places = found.map_or_else(Vec::new, |found| found.places);
        places.push(board);
        let boards = places.iter().filter_map(|board| board.faces.first().copied()).collect();
        found = Some(Landmarks { boards, places, times });
        if times.suffices() {
            break;
        }
        starts = Seeded { all: others, first };
    }
    Ok(found)
}

/// Starts, and the seed of the first one.
struct Seeded {
    all: Vec<Start>,
    first: u64,
}

impl Seeded {
    fn new(all: &[Start], first: u64) -> Self {
        Self { all: all.to_vec(), first }
    }

    /// The slower half of them, with their seeds.
    fn slower(&self, settings: &Settings) -> (Vec<Start>, Vec<u64>) {
        let mut all: Vec<(u64, &Start)> = (self.first..).zip(&self.all).collect();
        all.sort_by(|(_, one), (_, other)| settings.lost(other).total_cmp(&settings.lost(one)));
        all.truncate(self.all.len().div_ceil(2));
        all.into_iter().map(|(seed, start)| (start.clone(), seed)).unzip()
    }
}

/// The board that saves the most time of the slower half of the starts; `None` if none saves enough.
fn best(
    place: &Place<'_>,
    starts: &Seeded,
    path: Option<&PathPlan>,
    settings: &Settings,
    progress: &impl Progress,
) -> Result<Option<PlacedAddition>, AnywhereError> {
    let (slower, seeds) = starts.slower(settings);
    let mut best: Option<(f64, PlacedAddition)> = None;
    for board in finalists(place, &starts.all, path, settings) {
        let with = Place::new(place.scenario, board.on(&place.floor))?;
        let simulated = simulate(&with, &seeds, settings, progress)?;
        if simulated.len() < seeds.len() {
            return Ok(None);
        }
        let lost = settings.lost_by(&simulated);
        if best.as_ref().is_none_or(|(least, _)| lost < *least) {
            best = Some((lost, board));
        }
    }
    let most = (1.0 - WORTHWHILE) * settings.lost_by(&slower);
    Ok(best.filter(|(lost, _)| *lost < most).map(|(_, board)| board))
}

/// The boards that end most of the confusions, apart from each other.
fn finalists(
    place: &Place<'_>,
    starts: &[Start],
    path: Option<&PathPlan>,
    settings: &Settings,
) -> Vec<PlacedAddition> {
    let ears = Ears::new(place.scenario, &place.floor);
    let doubts: Vec<Doubts> =
        starts.par_iter().map(|start| Doubts::new(start, &ears, settings)).collect();
    let world = World::new(&place.floor);
    let boards = along_walls(&place.floor, BOARD, APART);
    let boards = boards.into_par_iter().filter(|board| is_placeable(board, place, &world, path));
    let mut scored: Vec<(f64, PlacedAddition)> = boards
        .map(|board| {
            let with = Ears::new(place.scenario, &board.on(&place.floor));
            let saved = doubts.iter().map(|doubts| doubts.saved(&board, &with)).sum();
            (saved, board)
        })
        .filter(|(saved, _)| *saved > 0.0)
        .collect();
    scored.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let mut chosen: Vec<PlacedAddition> = Vec::new();
    for (_, board) in scored {
        let is_apart = |other: &PlacedAddition| distance(other.at, board.at) >= FINALISTS_APART;
        if chosen.len() < FINALISTS && chosen.iter().all(is_apart) {
            chosen.push(board);
        }
    }
    chosen
}

/// Whether a board stands in the free space, leaves room to pass, and is clear of a path.
fn is_placeable(
    board: &PlacedAddition,
    place: &Place<'_>,
    world: &World,
    path: Option<&PathPlan>,
) -> bool {
    let Some([_, end]) = board.faces.first().copied() else { return false };
    let is_inside = place.space.part(place.space.cell_at(end)).is_some();
    let passage = PASSAGE * 2.0 * place.clearance();
    let ahead = world.on_axis(end, direction(board.at, end));
    let leaves_room = ahead.is_none_or(|(_, wall)| distance(end, wall) >= passage);
    let faces = board
        .faces
        .iter()
        .filter_map(|[from, to]| NamedWall::new("board".to_owned(), *from, *to).ok());
    let faces = Floor::new(faces.collect());
    let is_clear =
        path.is_none_or(|path| Collision::first(path, &faces, place.clearance()).is_none());
    is_inside && leaves_room && is_clear
}

impl<'a> Doubts<'a> {
    fn new(start: &'a Start, ears: &Ears, settings: &Settings) -> Self {
        let evidence = start.doubts.iter().map(|doubt| {
            doubt.rivals.iter().map(|rival| ears.evidence(&doubt.truth, rival)).collect()
        });
        Self { start, end: settings.lost(start), evidence: evidence.collect() }
    }

    /// The seconds of confusion that a board is expected to save, `with` which the sonar hears.
    fn saved(&self, board: &PlacedAddition, with: &Ears) -> f64 {
        let is_heard = |pose: &Pose| distance([pose.x, pose.y], board.at) <= with.reach();
        let (mut lead, mut last) = (0.0, 0.0);
        for (doubt, without) in self.start.doubts.iter().zip(&self.evidence) {
            let gains = doubt.rivals.iter().zip(without).map(|(rival, without)| {
                if !is_heard(&doubt.truth) && !is_heard(rival) {
                    return 0.0;
                }
                with.evidence(&doubt.truth, rival) - without
            });
            // Some of several hypotheses are those of a bad fit, which end by themselves.
            let gain = gains.sum::<f64>() / count(without);
            let seconds = (doubt.time - last).min(2.0);
            last = doubt.time;
            lead += GAINED * gain.max(0.0) * seconds / (SWEEP * PERIOD);
            if lead >= LEAD {
                return (self.end - doubt.time).max(0.0);
            }
        }
        0.0
    }
}

#[expect(clippy::cast_precision_loss, reason = "some hypotheses")]
fn count(of: &[f64]) -> f64 {
    of.len() as f64
}

impl Settings {
    /// The time that a start costs: until the right answer, or all of it.
    fn lost(&self, start: &Start) -> f64 {
        let is_right = start.outcome == Outcome::Right;
        start.after.filter(|_| is_right).unwrap_or(self.seconds)
    }

    fn lost_by(&self, starts: &[Start]) -> f64 {
        starts.iter().map(|start| self.lost(start)).sum()
    }
}
