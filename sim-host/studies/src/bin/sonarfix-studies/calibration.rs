//! `sonarfix-studies calibration`: the accuracy of `sonarfix calibrate` on simulated robots.

use sonarfix_studies::calibration::{self, Errors, From, echoes, wheel_noise};

use sonarfix_terminal::progress::Runs;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of robots.
    #[arg(long, default_value_t = 200)]
    runs: u32,
    /// Seed of the first robot; the others count up from it.
    #[arg(long, default_value_t = 60_000)]
    seed: u64,
    /// Distances driven, metres.
    #[arg(long, value_delimiter = ',', default_value = "10,20,60")]
    metres: Vec<f64>,
    /// Wheels 10 % wrong instead of 3 % and 2 %.
    #[arg(long)]
    gross: bool,
    /// True noises of the wheels, mm/√m: how exactly these are found, instead of the constants.
    #[arg(long, value_delimiter = ',', value_name = "MM", conflicts_with = "gross")]
    wheel_noise: Vec<f64>,
    /// Without the start pose: from the poses that the search finds.
    #[arg(long, conflicts_with = "wheel_noise")]
    unknown_start: bool,
    /// With four sonars: what is found of their echoes, instead of the constants.
    #[arg(long, conflicts_with_all = ["gross", "wheel_noise", "unknown_start"])]
    echoes: bool,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.runs > 0, "--runs must be at least 1");
    if !args.wheel_noise.is_empty() {
        return wheel_noises(args);
    }
    if args.echoes {
        return echoes_of_sensors(args);
    }
    let errors = if args.gross { Errors::GROSS } else { Errors::BUILDER };
    let from = if args.unknown_start { From::Search } else { From::Start };
    let sets = u32::try_from(args.metres.len())?;
    let progress = Runs::new(args.runs.saturating_mul(sets));
    let mut rows = Vec::new();
    for &metres in &args.metres {
        let trials = calibration::trials(args.seed, args.runs, metres, errors, from, &progress)?;
        // An interruption may come before the first trial of a distance.
        if !trials.is_empty() {
            rows.push((metres, trials));
        }
    }
    progress.end()?;
    print!("{}", calibration::page(&rows));
    Ok(())
}

/// The accuracy of the noise of the wheels.
fn wheel_noises(args: &Args) -> anyhow::Result<()> {
    let is_possible = |noise: &f64| (0.1..=40.0).contains(noise);
    anyhow::ensure!(
        args.wheel_noise.iter().all(is_possible),
        "--wheel-noise must be 0.1 to 40 mm/√m"
    );
    let sets = u32::try_from(args.metres.len() * args.wheel_noise.len())?;
    let progress = Runs::new(args.runs.saturating_mul(sets));
    let mut rows = Vec::new();
    for &metres in &args.metres {
        for millimetres in &args.wheel_noise {
            let truth = 1e-3 * millimetres;
            let row = wheel_noise::trials(args.seed, args.runs, metres, truth, &progress)?;
            if !row.outcomes.is_empty() {
                rows.push(row);
            }
        }
    }
    progress.end()?;
    print!("{}", wheel_noise::page(&rows));
    Ok(())
}

/// What is found of the echoes of each sensor.
fn echoes_of_sensors(args: &Args) -> anyhow::Result<()> {
    let &[metres] = args.metres.as_slice() else {
        anyhow::bail!("--echoes needs one distance, for example --metres 20");
    };
    let sensors = u32::try_from(echoes::SENSORS.len())?;
    let progress = Runs::new(args.runs.saturating_mul(sensors));
    let mut rows = Vec::new();
    for sensor in echoes::SENSORS {
        let row = echoes::trials(args.seed, args.runs, metres, sensor, &progress)?;
        if !row.outcomes.is_empty() {
            rows.push(row);
        }
    }
    progress.end()?;
    print!("{}", echoes::page(&rows));
    Ok(())
}
