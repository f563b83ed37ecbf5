//! Validation of the simulated NXT sonar: recorded sweeps and simulated ones from the same poses, in
//! the same cells.
//!
//! - [`recording`]: the recorded sweeps, from a folder outside of the project;
//! - [`cells`]: the classification of pings, and the shares of the classes;
//! - [`echo_fit`]: the parameters of the echo model of the core;
//! - [`page`]: the comparison as `docs/sonar-model.md`.

pub mod cells;
pub mod echo_fit;
pub mod page;
pub mod recording;

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix_sim::world::sensor::SensorModel;
use sonarfix_sim::world::{Ping, World};

use cells::{Beam, Cells};
use recording::{Recording, RecordingError, Sweep};

/// How often each recorded sweep is simulated, so that the sampling error is that of the recording.
const REPEATS: u64 = 25;

/// Both sides of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The recorded sweeps.
    pub measured: Cells,
    /// The simulated sweeps.
    pub simulated: Cells,
    /// Number of recorded sweeps.
    pub sweeps: usize,
}

/// Compares a sensor with the recordings in a folder.
///
/// # Errors
/// [`RecordingError`], if a file is missing or malformed.
pub fn compare(dir: &Path, sensor: &SensorModel) -> Result<Comparison, RecordingError> {
    let recording = Recording::read(dir)?;
    let world = World::of(recording.walls.clone());
    let mut measured = Cells::default();
    let mut simulated = Cells::default();
    for sweep in &recording.sweeps {
        for (axis, reading) in sweep.pings() {
            measured.count(Beam { world: &world, from: sweep.place, axis, reading });
        }
        for repeat in 0..REPEATS {
            simulate(&world, sensor, sweep, repeat, &mut simulated);
        }
    }
    Ok(Comparison { measured, simulated, sweeps: recording.sweeps.len() })
}

fn simulate(world: &World, sensor: &SensorModel, sweep: &Sweep, seed: u64, into: &mut Cells) {
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let mut luck = ChaCha8Rng::seed_from_u64(seed);
    luck.set_stream(1);
    for (axis, _) in sweep.pings() {
        // The robots did not move.
        let ping = Ping { time: 0.0, sonar_after: &|_| sweep.place, direction: axis };
        let echo = world.echo(&ping, sensor, &mut noise, &mut luck);
        let reading = echo.map(|echo| echo.range);
        into.count(Beam { world, from: sweep.place, axis, reading });
    }
}
