//! `sonarfix virtual-robot`: a simulated robot on a pseudo-terminal.

use std::path::PathBuf;

use anyhow::ensure;
use sonarfix::localizer::Start;
use sonarfix_map::Scenario;
use sonarfix_sim::time::micros;
use sonarfix_terminal::progress::{catch_interrupt, is_interrupted};
use sonarfix_virtual_robot::ports::Ports;
use sonarfix_virtual_robot::robot::{Parts, VirtualRobot};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario file (docs/formats.md), of the fidelity `pins`: world, robot, map and path.
    scenario: PathBuf,
    /// Makes a symbolic link with this name to the pseudo-terminal.
    #[cfg(unix)]
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Listens on this port of 127.0.0.1 as well; 0: on a free one.
    #[arg(long, value_name = "PORT")]
    tcp: Option<u16>,
    /// The robot stands while no motion is commanded, and does not drive along the path of the scenario.
    #[arg(long)]
    stand: bool,
    /// The robot has its pose and its loop runs at once. Otherwise it waits for the commands `set-pose` and `start`.
    #[arg(long)]
    running: bool,
    /// Its time over real time.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    speed: f64,
    /// Ends after this time of the robot; by default with Ctrl-C.
    #[arg(long)]
    seconds: Option<f64>,
    /// Seed of its noise; by default that of the scenario.
    #[arg(long)]
    seed: Option<u64>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    ensure!(args.speed > 0.0 && args.speed.is_finite(), "--speed must be positive");
    ensure!(args.seconds.is_none_or(|seconds| seconds >= 0.0), "--seconds must be positive");
    let scenario = Scenario::read(&args.scenario)?;
    crate::warnings::show(&[&args.scenario]);
    let seed = args.seed.unwrap_or(scenario.run.seed);
    let parts = Parts::new(scenario)?;
    let mut robot = VirtualRobot::switched_on(&parts, seed, args.stand)?;
    let mut ports = Ports::default();
    let name = open(args, &mut ports)?;
    match parts.start() {
        start if args.running => robot.start(start.as_ref())?,
        Some(start) => advise(&name, &start),
        None => println!("it waits: sonarfix command --port {name} start"),
    }
    catch_interrupt();
    let until = args.seconds.map_or(u64::MAX, micros);
    sonarfix_virtual_robot::run(&mut robot, &mut ports, args.speed, until, is_interrupted)
}

/// Opens the ports and prints their names; returns the first one.
fn open(args: &Args, ports: &mut Ports) -> anyhow::Result<String> {
    let mut names = Vec::new();
    #[cfg(unix)]
    {
        let terminal = ports.open_terminal(args.link.as_deref())?;
        names.extend(args.link.as_ref().map(|link| link.display().to_string()));
        names.push(terminal);
    }
    if let Some(port) = args.tcp {
        names.push(format!("tcp:{}", ports.listen(port)?));
    }
    for name in &names {
        println!("port {name}");
    }
    let first = names.into_iter().next();
    first.ok_or_else(|| anyhow::anyhow!("this system has no pseudo-terminals: give --tcp"))
}

/// Prints the commands with which the robot starts at its true pose.
fn advise(port: &str, start: &Start) {
    let pose = start.pose;
    let degrees = pose.heading.radians().0.to_degrees();
    println!(
        "it waits: sonarfix command --port {port} set-pose {} {} {degrees}",
        pose.x.0, pose.y.0
    );
    println!("          sonarfix command --port {port} start");
}
