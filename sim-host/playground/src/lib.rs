//! The simulator, the form of a new robot, the page that flashes a board and the live page of a robot on a serial port as static web pages, without a server:
//! `cargo xtask playground`.
//!
//! The page keeps a scenario as JSON, with the keys of a scenario file. For each change it passes the scenario to [`answer`],
//! which runs it from start to end, and plays the result. A run is a function of its [`request`], so picking
//! up the robot is a part of the request, too: the run is computed again with it.
//!
//! | module | what |
//! |---|---|
//! | [`request`] | what the page asks for, and how it becomes a simulation |
//! | [`scenes`](mod@scenes) | the scenes of the tour |
//! | [`new_robot`] | the form of a new robot |
//! | [`flash`] | what an ESP32-C6 gets on its serial port |
//! | [`archive`] | ZIP archives of the files of a robot |
//! | [`warning`] | improbable values of such files |
//! | [`own_map`] | a map from a file of one's own |
//! | [`live`] | a robot on a serial port of the browser |
//! | [`digest`] | a hash of all bits of a run, to compare machines |
//! | `exports` | the functions that the page calls, in WebAssembly |
//! | `main.rs` | the program that writes the pages |

pub mod archive;
pub mod digest;
#[cfg(target_arch = "wasm32")]
mod exports;
pub mod flash;
pub mod live;
pub mod new_robot;
pub mod own_map;
pub mod request;
pub mod scenes;
pub mod warning;

use serde::Serialize;
use sonarfix_sim::simulate::SimulationError;
use thiserror::Error;

use request::{Request, RequestError};

/// The reason for which a request has no result.
#[derive(Debug, Error)]
pub enum PlaygroundError {
    /// The request is not valid.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The run failed.
    #[error("the run failed: {0}")]
    Run(#[from] SimulationError),
    /// The run cannot be written as JSON.
    #[error("the run cannot be written: {0}")]
    Write(#[from] serde_json::Error),
}

/// The result of a run, beside its trace.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Hash of all bits of the run, in hexadecimal digits.
    pub digest: String,
    /// The verdict at the end.
    pub verdict: String,
    /// RMS position error along the path, metres.
    pub position_rms: f64,
    /// Accepted, gated and refused measurement cycles.
    pub cycles: [u64; 3],
}

/// Runs a request. Returns its summary, and its trace as the data of the player in JSON.
///
/// # Errors
/// [`PlaygroundError`]
pub fn run(request: &Request) -> Result<(Summary, String), PlaygroundError> {
    let simulation = request.simulation()?;
    let mut trace = simulation.empty_trace();
    let result = simulation.run(request.seed, &mut trace)?;
    let verdict = trace.ticks.last().map(|tick| tick.estimate.verdict).unwrap_or_default();
    let summary = Summary {
        digest: format!("{:016x}", digest::of(&trace)),
        verdict: format!("{verdict:?}"),
        position_rms: result.path.position_mean_square().sqrt(),
        cycles: [result.fixes.accepted, result.fixes.gated, result.fixes.refused],
    };
    Ok((summary, sonarfix_player::json(&trace)?))
}

/// Answers a request in JSON with JSON: `{"summary": …, "run": …}` or `{"error": "…"}`.
#[must_use]
pub fn answer(request: &str) -> String {
    let parsed = serde_json::from_str(request).map_err(RequestError::from);
    let answer = parsed.map_err(PlaygroundError::from).and_then(|request| {
        let (summary, run) = run(&request)?;
        Ok(format!("{{\"summary\":{},\"run\":{run}}}", serde_json::to_string(&summary)?))
    });
    answer.unwrap_or_else(|error| serde_json::json!({ "error": error.to_string() }).to_string())
}

/// The scenario of a request in JSON as a scenario file; empty if the request is not valid.
#[must_use]
pub fn file(request: &str) -> String {
    let request = serde_json::from_str::<Request>(request);
    request.map(|request| request.scenario.to_string()).unwrap_or_default()
}

/// The scenes of the tour in JSON.
#[must_use]
pub fn scenes() -> String {
    serde_json::to_string(&scenes::all().unwrap_or_default()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(change: impl Fn(&mut serde_json::Value)) -> String {
        let scenario = sonarfix_map::CLASSROOM.parse::<toml::Table>().unwrap();
        let mut request =
            serde_json::json!({ "scenario": scenario, "seed": 0, "seconds": 20.0, "moves": [] });
        change(&mut request);
        request.to_string()
    }

    fn answered(request: &str) -> serde_json::Value {
        serde_json::from_str(&answer(request)).unwrap()
    }

    /// The page's scenario is that of the command: the same bits as a run of the file.
    #[test]
    fn the_unchanged_scenario_is_that_of_the_file() {
        let scenario =
            sonarfix_map::Scenario::parse(sonarfix_map::CLASSROOM, "", "".as_ref()).unwrap();
        let simulation = sonarfix_sim::simulate::Simulation::new(scenario).shortened(20.0);
        let mut trace = simulation.empty_trace();
        simulation.run(0, &mut trace).unwrap();
        let answer = answered(&request(|_| {}));
        assert_eq!(answer["summary"]["digest"], format!("{:016x}", digest::of(&trace)));
        assert_eq!(answer["run"]["walls"][0]["name"], "window");
        assert_eq!(answer["run"]["obstacles"].as_array().unwrap().len(), 6);
    }

    /// A robot that is kidnapped by 1 m to the side is not at its estimate.
    #[test]
    fn a_robot_can_be_put_down_elsewhere() {
        let put = serde_json::json!([{ "at": 10.0, "x": 2.0, "y": 4.0, "heading": 1.5 }]);
        let answer = answered(&request(|request| request["moves"] = put.clone()));
        let ticks = &answer["run"]["ticks"];
        let at = |time: f64| {
            let times = ticks["time"].as_array().unwrap();
            let index = times.iter().position(|t| t.as_f64().unwrap() >= time).unwrap();
            (ticks["truth"]["y"][index].as_f64().unwrap(), ticks["estimate"]["y"][index].as_f64())
        };
        assert!((at(9.8).0 - at(9.8).1.unwrap()).abs() < 0.1);
        assert!((at(10.2).0 - 4.0).abs() < 0.1 && at(10.2).1.unwrap() < 2.0, "{:?}", at(10.2));
    }

    /// The saved scenario is the scenario of the file.
    #[test]
    fn a_scenario_can_be_saved() {
        let saved = file(&request(|_| {}));
        let [saved, expected] = [&saved, sonarfix_map::CLASSROOM]
            .map(|text| sonarfix_map::Scenario::parse(text, "", "".as_ref()).unwrap());
        assert_eq!(saved, expected);
    }

    #[test]
    fn mistakes_are_returned() {
        let no_json = answered("{");
        assert!(no_json["error"].as_str().unwrap().contains("EOF"), "{no_json}");
        let wrong = answered(&request(|request| {
            request["scenario"]["robot"]["sonar"]["cone"] = "120 deg".into();
            request["scenario"]["map"]["wall"][0]["to"] = serde_json::json!([0, 0]);
        }));
        let text = wrong["error"].as_str().unwrap();
        assert!(text.contains("robot.sonar.cone") && text.contains("map.wall"), "{text}");
        for put in [
            serde_json::json!([{ "at": -1.0, "x": 1.0, "y": 1.0, "heading": 0.0 }]),
            serde_json::json!([{ "at": 1.0, "x": 1e300, "y": 1.0, "heading": 0.0 }]),
        ] {
            let wrong = answered(&request(|request| request["moves"] = put.clone()));
            assert!(wrong["error"].as_str().is_some(), "{wrong}");
        }
        let long = answered(&request(|request| request["seconds"] = 1e9.into()));
        assert!(long["error"].as_str().unwrap().contains("seconds"), "{long}");
    }
}
