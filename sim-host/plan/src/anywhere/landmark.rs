//! Boards that make the map unique, or the answer sooner: the best of the candidates by simulation.

use serde::Serialize;
use sonarfix_map::{PathPlan, PlacedAddition};
use sonarfix_sim::progress::Progress;

use super::candidates::finalists;
use super::settings::{AnywhereError, MOST_BOARDS, Settings};
use super::start::{Place, Start};
use super::times::{Times, simulate};

/// A board that does not save this share of the time, of the slower half of the starts, is not proposed.
const WORTHWHILE: f64 = 0.1;

/// Boards, and what they change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Landmarks {
    /// The boards; in JSON the ends of each: at the wall, and in the room, metres.
    #[serde(serialize_with = "as_ends")]
    pub boards: Vec<PlacedAddition>,
    /// What other starts lead to with them.
    #[serde(flatten)]
    pub times: Times,
}

impl Landmarks {
    /// The ends of each board: at the wall, and in the room, metres.
    pub fn ends(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        ends(&self.boards)
    }
}

fn ends(boards: &[PlacedAddition]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    boards.iter().filter_map(|board| board.faces.first().copied())
}

fn as_ends<S: serde::Serializer>(boards: &[PlacedAddition], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(ends(boards))
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
        if settings.total_search_time(&others) >= settings.total_search_time(&starts.all) {
            break;
        }
        let mut boards = found.map_or_else(Vec::new, |found| found.boards);
        boards.push(board);
        found = Some(Landmarks { boards, times });
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
        all.sort_by(|(_, one), (_, other)| {
            settings.search_time(other).total_cmp(&settings.search_time(one))
        });
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
        let seconds = settings.total_search_time(&simulated);
        if best.as_ref().is_none_or(|(least, _)| seconds < *least) {
            best = Some((seconds, board));
        }
    }
    let most = (1.0 - WORTHWHILE) * settings.total_search_time(&slower);
    Ok(best.filter(|(seconds, _)| *seconds < most).map(|(_, board)| board))
}
