//! The scenes of the tour: each shows one effect, and names one thing to try.

use serde::{Deserialize, Serialize};

use crate::request::{Move, Request};

/// Duration of a scene that states none, simulated seconds.
const SECONDS: f64 = 120.0;

/// A scene: a request with its text.
#[derive(Debug, Clone, Serialize)]
pub struct Scene {
    /// Its name in the address of the page.
    pub name: String,
    /// Its name on the page.
    pub title: String,
    /// What it shows, one sentence.
    pub shows: String,
    /// What to try.
    pub exercise: String,
    /// What is run.
    pub request: Request,
}

/// A scene as it is in `scenes.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    title: String,
    shows: String,
    exercise: String,
    seconds: Option<f64>,
    #[serde(default)]
    searches: bool,
    #[serde(default)]
    moves: Vec<Move>,
    /// The keys of `classroom` that it replaces.
    #[serde(default)]
    scenario: toml::Table,
}

#[derive(Deserialize)]
struct File {
    scene: Vec<Entry>,
}

/// The scenes in the order of the tour.
///
/// # Errors
/// A mistake in `scenes.toml`, which a test excludes.
pub fn all() -> Result<Vec<Scene>, toml::de::Error> {
    let file: File = toml::from_str(include_str!("scenes.toml"))?;
    file.scene.into_iter().map(Entry::scene).collect()
}

impl Entry {
    fn scene(self) -> Result<Scene, toml::de::Error> {
        let Self { name, title, shows, exercise, seconds, searches, moves, scenario: changes } =
            self;
        let mut scenario = toml::from_str(sonarfix_map::CLASSROOM)?;
        replace(&mut scenario, changes);
        let seconds = seconds.unwrap_or(SECONDS);
        let request = Request { scenario, seed: 0, seconds, moves, searches };
        Ok(Scene { name, title, shows, exercise, request })
    }
}

/// Replaces the values of a table by those of another one, table by table.
fn replace(table: &mut toml::Table, changes: toml::Table) {
    for (key, change) in changes {
        match (table.get_mut(&key), change) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => replace(old, new),
            (_, change) => drop(table.insert(key, change)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix::health::Verdict;
    use sonarfix_sim::trace::{Tick, Trace};

    /// The trace of a scene after a change of its request.
    fn changed(name: &str, change: impl Fn(&mut Request)) -> Trace {
        let mut scene = all().unwrap().into_iter().find(|scene| scene.name == name).unwrap();
        change(&mut scene.request);
        let simulation = scene.request.simulation().unwrap();
        let mut trace = simulation.empty_trace();
        simulation.run(scene.request.seed, &mut trace).unwrap();
        trace
    }

    fn trace(name: &str) -> Trace {
        changed(name, |_| {})
    }

    /// Distance of the estimate from the truth, metres.
    fn error(tick: &Tick) -> f64 {
        let (truth, estimate) = (tick.truth.unwrap().pose, tick.estimate.pose);
        (truth.x - estimate.x).hypot(truth.y - estimate.y)
    }

    fn most_error(trace: &Trace) -> f64 {
        trace.ticks.iter().map(error).fold(0.0, f64::max)
    }

    /// Largest deviations of x and y, metres.
    fn most_deviations(trace: &Trace) -> [f64; 2] {
        let most = |of: usize| {
            trace.ticks.iter().map(|tick| tick.estimate.deviation[of]).fold(0.0, f64::max)
        };
        [most(0), most(1)]
    }

    fn set_max_range(request: &mut Request, reach: &str) {
        request.scenario["robot"]["sonar"]["max_range"] = reach.into();
    }

    #[test]
    fn the_page_has_five_scenes() {
        let names: Vec<String> = all().unwrap().into_iter().map(|scene| scene.name).collect();
        assert_eq!(names, ["drift", "one-wall", "two-walls", "furniture", "kidnapped"]);
    }

    #[test]
    fn without_sonar_the_estimate_drifts_and_with_it_it_does_not() {
        let alone = trace("drift");
        assert!(alone.fixes.iter().all(|fix| fix.innovation.is_none()));
        let with_sonar = changed("drift", |request| set_max_range(request, "3.5 m"));
        let [alone, with_sonar] = [&alone, &with_sonar].map(most_error);
        assert!(alone > 0.5 && with_sonar < 0.1, "{alone} m, {with_sonar} m");
    }

    #[test]
    fn one_wall_gives_one_coordinate() {
        let [along, across] = most_deviations(&trace("one-wall"));
        // One wall does not determine the place of the sonar, which is uncertain by 5 mm.
        assert!(along > 0.1 && across < 0.035, "{along} m, {across} m");
    }

    /// Both coordinates. By the nearest wall the robot seldom measures the farther one.
    #[test]
    fn two_walls_give_both_coordinates() {
        let informative = most_deviations(&trace("two-walls"));
        let nearest = most_deviations(&changed("two-walls", |request| {
            request.scenario["robot"]["schedule"]["policy"] = "nearest".into();
        }));
        assert!(informative[0].max(informative[1]) < 0.03, "{informative:?}");
        assert!(nearest[1] > 2.0 * informative[1], "{nearest:?} {informative:?}");
    }

    #[test]
    fn echoes_of_furniture_are_gated() {
        let trace = trace("furniture");
        let gated =
            trace.fixes.iter().filter(|fix| fix.outcome == sonarfix_sim::trace::Outcome::Gated);
        assert!(gated.count() > 5);
        assert!(most_error(&trace) < 0.15, "{}", most_error(&trace));
    }

    /// Lost soon after it is put down elsewhere; found, and right, before the end. Without search it stays wrong.
    #[test]
    fn a_kidnapped_robot_finds_its_pose() {
        let (found, without) =
            (trace("kidnapped"), changed("kidnapped", |request| request.searches = false));
        for trace in [&found, &without] {
            assert!(trace.ticks.iter().any(|tick| tick.estimate.verdict == Verdict::Lost));
        }
        let last = found.ticks.last().unwrap();
        assert!(error(last) < 0.1 && last.estimate.verdict == Verdict::Tracking, "{}", error(last));
        assert!(error(without.ticks.last().unwrap()) > 0.5);
    }
}
