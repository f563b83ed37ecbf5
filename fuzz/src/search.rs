//! The search, fed in any order with any travels and pings.

use sonarfix::config::Config;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_search::search::{Answer, Region, Search, SearchParameters};

use crate::bytes::Bytes;

/// Most evaluations of an input: a cycle or two of few pings.
const EVALUATIONS: u16 = 600;

/// Travels, pings and evaluations until the end of the bytes, on up to eight walls.
///
/// # Panics
/// If an invariant is violated.
pub fn search(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let walls = walls(&mut bytes);
    let mut config = Config::for_track_width(Metres(0.2));
    config.rangers.first.mount = Point::new(bytes.number(0.1), bytes.number(0.1));
    if config.check().is_err() {
        return;
    }
    let mut search =
        Search::<40, 4>::new(&config.rangers.first, Map::new(&walls), SearchParameters::default());
    let mut evaluations = EVALUATIONS;
    while !bytes.is_empty() {
        call(&mut search, &mut bytes, &mut evaluations);
        check(&search);
    }
}

fn walls(bytes: &mut Bytes) -> Vec<Wall> {
    let corner = |bytes: &mut Bytes| Point::new(bytes.number(6.0), bytes.number(6.0));
    let count = bytes.byte() % 9;
    (0..count).filter_map(|_| Wall::new(corner(bytes), corner(bytes)).ok()).collect()
}

fn call(search: &mut Search<40, 4>, bytes: &mut Bytes, evaluations: &mut u16) {
    match bytes.byte() % 16 {
        0..=4 => {
            let (advance, turn) = (bytes.number(0.4), bytes.number(0.5));
            let taken = search.odometry(Metres(advance), Radians(turn));
            let is_finite = advance.is_finite() && turn.is_finite();
            assert!(is_finite || taken.is_err(), "{advance} {turn}");
        }
        5..=10 => {
            let bearing = search.aim();
            assert!(bearing.0.is_finite(), "{bearing:?}");
            ping(search, bearing, bytes);
        }
        11 => {
            let bearing = Radians(bytes.number(3.2));
            ping(search, bearing, bytes);
        }
        12 => {
            let pose = Pose::new(bytes.number(6.0), bytes.number(6.0), Radians(bytes.number(3.2)));
            let taken = search.propose(pose);
            assert!(pose.is_finite() || taken.is_err(), "{pose:?}");
        }
        13 => {
            let corner = |bytes: &mut Bytes| Point::new(bytes.number(6.0), bytes.number(6.0));
            let region = Region { from: corner(bytes), to: corner(bytes) };
            if region.is_valid() {
                search.begin_within(region);
            }
        }
        _ => {
            let count = u16::from(bytes.byte()).min(*evaluations);
            *evaluations -= count;
            search.poll(count);
        }
    }
}

/// Usually a range within reach, sometimes none, sometimes any.
fn ping(search: &mut Search<40, 4>, bearing: Radians, bytes: &mut Bytes) {
    let range = match bytes.byte() {
        0..32 => None,
        32..48 => Some(bytes.number(10.0)),
        _ => Some(bytes.between(0.1, 4.0)),
    };
    let pings = search.pings();
    let taken = search.ping(bearing, range.map(Metres));
    let is_finite = bearing.0.is_finite() && range.is_none_or(f32::is_finite);
    assert!(is_finite || taken.is_err(), "{bearing:?} {range:?}");
    assert!(taken.is_ok() || search.pings() == pings, "a refused ping is in the window");
}

fn check(search: &Search<40, 4>) {
    let mut count = 0;
    for (rank, found) in search.hypotheses().enumerate() {
        let numbers =
            [found.fit, found.explained, found.drift, found.turn_scale, found.heading_deviation.0];
        assert!(found.pose.is_finite() && numbers.iter().all(|n| n.is_finite()), "{found:?}");
        assert!(found.position_deviation >= Metres(0.0), "{found:?}");
        assert!((0.0..=1.0).contains(&found.explained), "{found:?}");
        assert_eq!(search.ranked(rank), Some(found));
        count += 1;
    }
    assert!(count <= 4 && search.pings() <= 40);
    match search.answer() {
        Answer::Unique(found) => assert!(count > 0 && found.pose.is_finite(), "{found:?}"),
        Answer::Several(several) => assert!((1..=count).contains(&several), "{several} of {count}"),
        Answer::Along { extent, .. } => assert!(extent >= Metres(0.0), "{extent:?}"),
        Answer::Searching | Answer::Nowhere => {}
    }
}
