//! The search for the pose, and the navigator that hands it to the localizer.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use self_cell::self_cell;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer as of_core;
use sonarfix_search::navigator::{self as of_search, Mode};
use sonarfix_search::search::{self as core, Answer, Region, SearchParameters};

use crate::floor::{Map, Walls};
use crate::localizer::{self, Aim, Fix};
use crate::robot::Robot;
use crate::table::Table;
use crate::{columns, errors, values};

type Searching<'m> = core::Search<'m>;

self_cell!(
    /// A search with the walls that it borrows.
    struct OwnedSearch {
        owner: Walls,
        #[covariant]
        dependent: Searching,
    }
);

/// A region of the map.
fn region(region: Option<(f64, f64, f64, f64)>) -> PyResult<Option<Region>> {
    let Some((x0, y0, x1, y1)) = region else { return Ok(None) };
    let at = |value| values::single(value, "the region");
    let region = Region { from: Point::new(at(x0)?, at(y0)?), to: Point::new(at(x1)?, at(y1)?) };
    if region.is_valid() {
        return Ok(Some(region));
    }
    Err(errors::input("the region must be x0, y0, x1, y1 with x0 < x1 and y0 < y1"))
}

fn invalid(error: core::InvalidInput) -> PyErr {
    errors::input(error.to_string())
}

/// The name of an answer, and how many of the hypotheses are answers.
fn answer(search: &Searching) -> (&'static str, usize) {
    match search.answer() {
        Answer::Searching => ("searching", 0),
        Answer::Several(count) => ("several", count),
        Answer::Along { .. } => ("along", 1),
        Answer::Nowhere => ("nowhere", 0),
        Answer::Unique(_) => ("unique", 1),
    }
}

/// The hypotheses as a table, the best first.
fn hypotheses(search: &Searching) -> PyResult<Table> {
    let all: Vec<core::Hypothesis> = search.hypotheses().collect();
    let real = |of: &dyn Fn(&core::Hypothesis) -> f32| -> Vec<f64> {
        all.iter().map(|hypothesis| of(hypothesis).into()).collect()
    };
    columns::of_reals(vec![
        ("x_m", real(&|of| of.pose.x.0)),
        ("y_m", real(&|of| of.pose.y.0)),
        ("heading_rad", real(&|of| of.pose.heading.radians().0)),
        ("sigma_position_m", real(&|of| of.position_deviation.0)),
        ("sigma_heading_rad", real(&|of| of.heading_deviation.0)),
        ("fit", real(&|of| of.fit)),
        ("explained", real(&|of| of.explained)),
    ])
}

/// The search for the pose of a robot that has none, from odometry and pings in any direction.
///
/// ``region`` limits the start: x0, y0, x1, y1, metres in the map frame. Raises InputError.
#[pyclass(module = "sonarfix")]
pub struct Search(OwnedSearch);

#[pymethods]
impl Search {
    #[new]
    #[pyo3(signature = (robot, map, *, region=None))]
    fn new(robot: &Robot, map: &Map, region: Option<(f64, f64, f64, f64)>) -> PyResult<Self> {
        let region = self::region(region)?;
        let config = &robot.config.localizer;
        let parameters = SearchParameters::of(config);
        Ok(Self(OwnedSearch::new(Walls::of(&map.floor), |walls| {
            let mut search = Searching::new(&config.rangers.first, walls.map(), parameters);
            if let Some(region) = region {
                search.begin_within(region);
            }
            search
        })))
    }

    /// Moves the robot by a distance along its mid-heading (metres) and a turn (radians).
    fn odometry(&mut self, advance: f64, turn: f64) -> PyResult<()> {
        let advance = Metres(values::single(advance, "advance")?);
        let turn = Radians(values::single(turn, "turn")?);
        self.0.with_dependent_mut(|_, search| search.odometry(advance, turn)).map_err(invalid)
    }

    /// The bearing for the next ping, radians from the heading: a plain sweep.
    fn aim(&self) -> f64 {
        self.0.borrow_dependent().aim().0.into()
    }

    /// Takes the result of a ping: bearing (radians) and range (metres; None without an echo). Returns whether it is novel.
    #[pyo3(signature = (bearing, range))]
    fn ping(&mut self, bearing: f64, range: Option<f64>) -> PyResult<bool> {
        let bearing = Radians(values::single(bearing, "the bearing")?);
        let range = localizer::range(range);
        self.0.with_dependent_mut(|_, search| search.ping(bearing, range)).map_err(invalid)
    }

    /// Adds a pose (x, y in metres, heading in radians) to the hypotheses.
    fn propose(&mut self, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let start = localizer::start(localizer::pose_of(pose)?, 0.0, 0.0)?;
        self.0.with_dependent_mut(|_, search| search.propose(start.pose)).map_err(invalid)
    }

    /// Does so many evaluations, each a bounded slice of work.
    #[pyo3(signature = (evaluations=1000))]
    fn poll(&mut self, py: Python<'_>, evaluations: u16) {
        py.detach(|| self.0.with_dependent_mut(|_, search| search.poll(evaluations)));
    }

    /// How many cycles are complete.
    #[getter]
    fn cycles(&self) -> u32 {
        self.0.borrow_dependent().cycles()
    }

    /// ``"searching"``, ``"several"``, ``"along"`` (undetermined along a wall), ``"nowhere"`` or ``"unique"``.
    #[getter]
    fn answer(&self) -> &'static str {
        answer(self.0.borrow_dependent()).0
    }

    /// How many of the hypotheses, from the first, are answers.
    #[getter]
    fn answers(&self) -> usize {
        answer(self.0.borrow_dependent()).1
    }

    /// The hypotheses as a table, the best first: pose now, deviations, ``fit`` (mean weighted log-likelihood per ping), ``explained``
    /// (share of the echoes).
    #[getter]
    fn hypotheses(&self) -> PyResult<Table> {
        hypotheses(self.0.borrow_dependent())
    }

    fn __repr__(&self) -> String {
        let search = self.0.borrow_dependent();
        format!("<sonarfix.Search: {} pings, {}>", search.pings(), answer(search).0)
    }
}

/// A navigator and its search, on the same walls.
pub struct Pair<'m> {
    navigator: of_search::Navigator<'m>,
    search: Searching<'m>,
}

self_cell!(
    /// A navigator with the walls that it borrows.
    struct OwnedNavigator {
        owner: Walls,
        #[covariant]
        dependent: Pair,
    }
);

/// A localizer that searches for its pose when it has none.
///
/// With ``pose`` (x, y in metres, heading in radians) it tracks from there; with None it searches, within ``region`` if
/// there is one. Raises InputError.
#[pyclass(module = "sonarfix")]
pub struct Navigator(OwnedNavigator);

impl Navigator {
    fn localizer(&self) -> &of_core::Localizer<'_> {
        self.0.borrow_dependent().navigator.localizer()
    }
}

fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Tracking => "tracking",
        Mode::Searching => "searching",
        Mode::Provisional => "provisional",
    }
}

#[pymethods]
impl Navigator {
    #[new]
    #[pyo3(signature = (robot, map, pose=None, *, position_deviation=0.05, heading_deviation=0.02, time=0.0, region=None))]
    fn new(
        robot: &Robot,
        map: &Map,
        pose: Option<&Bound<'_, PyAny>>,
        position_deviation: f64,
        heading_deviation: f64,
        time: f64,
        region: Option<(f64, f64, f64, f64)>,
    ) -> PyResult<Self> {
        let region = self::region(region)?;
        let unknown = [of_search::UNKNOWN_POSITION.0, of_search::UNKNOWN_HEADING.0];
        let [position, heading] = unknown.map(f64::from);
        let start = match pose {
            Some(pose) => {
                localizer::start(localizer::pose_of(pose)?, position_deviation, heading_deviation)
            }
            None => localizer::start([0.0; 3], position, heading),
        }?;
        let (config, now) = (robot.config.localizer, values::instant(time)?);
        let owned = OwnedNavigator::try_new(Walls::of(&map.floor), |walls| {
            let map = walls.map();
            let parameters = SearchParameters::of(&config);
            let mut search = Searching::new(&config.rangers.first, map, parameters);
            let localizer = of_core::Localizer::new(config, map, start, now)?;
            let mut navigator = of_search::Navigator::new(localizer);
            if pose.is_none() {
                navigator.search_in(region, &mut search);
            }
            Ok(Pair { navigator, search })
        });
        owned.map(Self).map_err(|error: of_core::StartError| errors::input(error.to_string()))
    }

    /// As Localizer.odometry; the search takes it as well.
    #[pyo3(signature = (time, right, left, turn=None))]
    fn odometry(
        &mut self,
        time: f64,
        right: f64,
        left: f64,
        turn: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let now = values::instant(time)?;
        let (travel, turn) = localizer::travel(right, left, turn)?;
        let taken = self.0.with_dependent_mut(|_, Pair { navigator, search }| {
            navigator.odometry_with_turn(now, travel, turn, Some(search))
        });
        taken.map_err(|error| errors::input(error.to_string()))
    }

    /// The ping to make while the mode is not "searching"; None if no wall can be measured.
    fn aim(&self) -> Option<Aim> {
        self.0.borrow_dependent().navigator.aim().ok().map(Aim)
    }

    /// The bearing of the next ping of the sweep while the mode is "searching", radians from the heading.
    fn sweep(&self) -> f64 {
        self.0.borrow_dependent().search.aim().0.into()
    }

    /// Corrects the estimate by the range (metres; None without an echo) measured along an aim.
    #[pyo3(signature = (aim, range))]
    fn fix(&mut self, aim: &Aim, range: Option<f64>) -> Fix {
        let range = localizer::range(range);
        self.0.with_dependent_mut(|_, Pair { navigator, search }| {
            let fix = navigator.fix(&aim.0, range, Some(search));
            Fix::of(&fix, navigator.localizer().association())
        })
    }

    /// Passes a ping of the sweep to the search: bearing (radians), range (metres; None without an echo). Returns whether it
    /// is novel.
    #[pyo3(signature = (bearing, range))]
    fn ping(&mut self, bearing: f64, range: Option<f64>) -> PyResult<bool> {
        let bearing = Radians(values::single(bearing, "the bearing")?);
        let range = localizer::range(range);
        let taken = self.0.with_dependent_mut(|_, Pair { navigator, search }| {
            navigator.ping(bearing, range, search)
        });
        taken.map_err(invalid)
    }

    /// Makes so many evaluations of the search while the pose is not confirmed. Returns the new mode, if it has changed.
    #[pyo3(signature = (evaluations=1000))]
    fn work(&mut self, py: Python<'_>, evaluations: u16) -> Option<&'static str> {
        let changed = py.detach(|| {
            self.0.with_dependent_mut(|_, Pair { navigator, search }| {
                navigator.work(evaluations, search)
            })
        });
        changed.map(mode)
    }

    /// Declares the pose unknown and begins the search.
    fn search(&mut self) {
        self.0.with_dependent_mut(|_, Pair { navigator, search }| navigator.search(search));
    }

    /// Replaces the pose by one that was measured independently; it is tracked.
    #[pyo3(signature = (pose, *, position_deviation=0.05, heading_deviation=0.02))]
    fn set_pose(
        &mut self,
        pose: &Bound<'_, PyAny>,
        position_deviation: f64,
        heading_deviation: f64,
    ) -> PyResult<()> {
        let pose = localizer::pose_of(pose)?;
        let start = localizer::start(pose, position_deviation, heading_deviation)?;
        let set = self.0.with_dependent_mut(|_, pair| pair.navigator.set_pose(&start));
        set.map_err(|error| errors::input(error.to_string()))
    }

    /// What determines the pose: ``"tracking"``, ``"searching"`` or ``"provisional"``.
    #[getter]
    fn mode(&self) -> &'static str {
        mode(self.0.borrow_dependent().navigator.mode())
    }

    /// The hypotheses of the search as a table, the best first.
    #[getter]
    fn hypotheses(&self) -> PyResult<Table> {
        hypotheses(&self.0.borrow_dependent().search)
    }

    /// The estimated pose: x, y (metres), heading (radians) in the map frame; a float32 array of shape (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        localizer::pose(py, self.localizer())
    }

    /// The state, a float32 array of shape (7,), as Localizer.state.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        localizer::state(py, self.localizer())
    }

    /// The covariance of the state, a float32 array of shape (7, 7).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        localizer::covariance(py, self.localizer())
    }

    /// The verdict on the estimate: ``"tracking"``, ``"degraded"`` or ``"lost"``.
    #[getter]
    fn verdict(&self) -> &'static str {
        localizer::verdict(self.localizer().health().verdict)
    }

    fn __repr__(&self) -> String {
        format!("<sonarfix.Navigator: {}, {}>", self.mode(), self.verdict())
    }
}
