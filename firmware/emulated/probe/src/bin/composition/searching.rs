//! The search for the pose, and what hands it over: linked and not measured.

use core::hint::black_box;

use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Metres};
use sonarfix::localizer::Localizer;
use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::{Search, SearchParameters};

/// Bytes of the search, and of the navigator beside its localizer.
pub const BYTES: usize = size_of::<Search>() + size_of::<Navigator>() - size_of::<Localizer>();

/// A robot that searches.
struct Searcher<'m> {
    navigator: Navigator<'m>,
    search: Search<'m>,
}

#[unsafe(no_mangle)]
extern "C" fn probe_search(searcher: &mut Searcher, range: &Metres) {
    let range = Some(*range);
    let Searcher { navigator, search } = searcher;
    navigator.search(search);
    let now = navigator.localizer().time() + Duration::from_ticks(100_000);
    let _ = black_box(navigator.odometry_with_turn(
        now,
        WheelTravel::new(0.01, 0.01),
        None,
        Some(search),
    ));
    let bearing = search.aim();
    let _ = black_box(navigator.ping(bearing, range, search));
    black_box(navigator.work(2, search));
    if let Ok(aim) = navigator.aim() {
        let _ = black_box(navigator.fix(&aim, range, Some(search)));
    }
}

/// Links the search of a robot at the pose of this localizer.
pub fn link(localizer: Localizer, config: &Config) {
    let map = localizer.map();
    let search = Search::new(&config.rangers.first, map, SearchParameters::default());
    let mut searcher = Searcher { navigator: Navigator::new(localizer), search };
    probe_search(&mut searcher, &black_box(Metres(1.0)));
}
