//! How well the simulated NXT sonar stands for the real one: recorded sweeps and simulated ones
//! from the same places, sorted into the same cells.
//!
//! - [`recording`]: the sweeps that were recorded, from a folder that is not part of the project;
//! - [`cells`]: by what a ping is sorted, and the shares that come out;
//! - [`page`]: both beside each other, as `docs/sonar-model.md`.

pub mod cells;
pub mod page;
pub mod recording;

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::world::sensor::SensorModel;
use crate::world::{Ping, World};
use cells::{Cells, Look};
use recording::{Recording, RecordingError, Sweep};

/// How often each recorded sweep is simulated: enough that the sampling error is the recording's.
const REPEATS: u64 = 25;

/// Both sides of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What the recorded sweeps hold.
    pub measured: Cells,
    /// What the simulated ones do.
    pub simulated: Cells,
    /// Number of sweeps that were recorded.
    pub sweeps: usize,
}

/// Compares a sensor with the recordings in a folder.
///
/// # Errors
/// [`RecordingError`], if the folder does not hold them.
pub fn compare(dir: &Path, sensor: &SensorModel) -> Result<Comparison, RecordingError> {
    let recording = Recording::read(dir)?;
    let world = World::of(recording.walls.clone());
    let mut measured = Cells::default();
    let mut simulated = Cells::default();
    for sweep in &recording.sweeps {
        for (axis, reading) in sweep.pings() {
            measured.count(Look { world: &world, from: sweep.place, axis, reading });
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
        // The robots stood.
        let ping = Ping { time: 0.0, sonar_after: &|_| sweep.place, direction: axis };
        let echo = world.echo(&ping, sensor, &mut noise, &mut luck);
        let reading = echo.map(|echo| echo.range);
        into.count(Look { world, from: sweep.place, axis, reading });
    }
}
