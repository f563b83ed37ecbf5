//! `sonarfix command patrol`: an example of a program that drives a robot, by the trips of `goto`.

use std::time::{Duration, Instant};

use anyhow::{bail, ensure};
use sonarfix_link::CommandResult;
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request::{self, Control};
use sonarfix_monitor::route::End;

use crate::goto::{self, Journey};

#[derive(Debug, clap::Args)]
// Its group would have the name of that of `goto`.
#[group(skip)]
pub struct Args {
    #[command(flatten)]
    trip: goto::Args,
    /// Ends after so many rounds; without this option at Ctrl-C.
    #[arg(long)]
    rounds: Option<u32>,
    /// For how long the robot stands at each point, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pause: f64,
}

/// Drives from point to point, again and again. A point that cannot be reached is left out in this round.
pub fn execute(args: &Args, port: &mut Port) -> anyhow::Result<()> {
    let (points, pause) = (args.trip.route()?, goto::seconds(args.pause, "--pause")?);
    let journey = Journey::new(&args.trip)?;
    for round in 1..=args.rounds.unwrap_or(u32::MAX) {
        let mut reached = 0;
        for point in &points {
            match journey.drive(&[*point], port)? {
                End::Arrived => {
                    reached += 1;
                    println!("round {round}: at {} {}", point.x.0, point.y.0);
                    stand(&journey, pause, port)?;
                }
                End::Stopped(reason) => {
                    println!("round {round}: not at {} {}: {reason}", point.x.0, point.y.0);
                }
                End::Silent | End::Interrupted => {
                    println!("ended in round {round}");
                    return Ok(());
                }
            }
        }
        ensure!(reached > 0, "the robot has reached no point of round {round}");
    }
    Ok(())
}

/// Reads on while the robot stands, so that the next trip begins with a new estimate.
fn stand(journey: &Journey, pause: Duration, port: &mut Port) -> anyhow::Result<()> {
    let began = Instant::now();
    let result = request::steer(port, |_| {
        let is_over = journey.is_over() || began.elapsed() >= pause;
        if is_over { Control::Stop } else { Control::Keep }
    })?;
    match result {
        CommandResult::Refused(reason) => bail!("the robot refuses: {reason}"),
        _ => Ok(()),
    }
}
