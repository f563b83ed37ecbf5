//! The figures that need no network, as TOML: the example drive through the node, and hostile bytes: `figures TRIES`.

use std::time::Instant;

use anyhow::Context;
use sonarfix_ros::drive::{Drive, Errors};
use sonarfix_ros::hostile::{Random, targets};
use sonarfix_ros::motion::between;
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::Parameters;
use sonarfix_ros::view::Frames;
use sonarfix_ros::walls::Walls;

/// Length of the example drive, seconds.
const LENGTH: f64 = 1000.0;
const BEGIN: i64 = 1_000_000_000;

fn node(drive: &Drive, parameters: &Parameters) -> anyhow::Result<Node> {
    let walls = Walls::new(&drive.scenario.floor);
    let mut node = Node::new(parameters, drive.scenario.robot, Some(walls))?;
    node.set_active(true);
    node.take(Input::InitialPose(Box::new(drive.start.clone())), BEGIN);
    Ok(node)
}

/// The drive in simulated time against the robot's own localizer.
fn classroom(parameters: &Parameters) -> anyhow::Result<()> {
    let drive = Drive::classroom(LENGTH, BEGIN, &Frames::of(parameters))?;
    let mut node = node(&drive, parameters)?;
    let mut truths = drive.truth.iter().peekable();
    let (mut own, mut of_node, mut largest) = (Errors::default(), Errors::default(), 0.0_f64);
    for (at, input) in drive.messages.iter().cloned() {
        while let Some(truth) = truths.next_if(|truth| truth.at < at) {
            let Some(view) = node.view().filter(|view| view.at == truth.at) else { continue };
            own.add(truth.estimate, truth.pose);
            of_node.add(view.pose, truth.pose);
            let [x, y, _] = between(truth.estimate, view.pose);
            largest = largest.max(x.hypot(y));
        }
        node.take(input, at);
    }
    println!("[classroom]\nposes = {}", own.count());
    for (name, errors) in [("simulator", own), ("node", of_node)] {
        let [x, y, heading] = errors.rms();
        println!("{name} = {{ x = {x}, y = {y}, heading = {heading} }}");
    }
    println!("largest_difference = {largest}\n");
    Ok(())
}

/// Resident memory of this process, kB.
fn memory() -> anyhow::Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmRSS")).context("no VmRSS")?;
    let number = line.split_ascii_whitespace().nth(1).context("VmRSS")?;
    Ok(number.parse()?)
}

/// Hostile bytes to each subscription, and to the node what they decode to.
fn hostile(parameters: &Parameters, tries: u32) -> anyhow::Result<()> {
    let drive = Drive::empty_classroom(5.0, BEGIN, &Frames::of(parameters))?;
    let mut node = node(&drive, parameters)?;
    let (begin, mut decoded, mut before) = (Instant::now(), 0_u64, 0);
    for round in 0..2_u32 {
        for (number, target) in targets().into_iter().enumerate() {
            let mut random = Random::new(number as u64 + 7);
            // The first round is a warm-up, of a tenth.
            for step in 0..if round == 0 { tries / 10 } else { tries } {
                let Some(input) = (target.decode)(&random.bytes(&target.message)) else { continue };
                decoded += u64::from(round);
                node.take(input, BEGIN + i64::from(step) * 1_000_000);
            }
        }
        if round == 0 {
            before = memory()?;
        }
    }
    println!(
        "[hostile]\nsubscriptions = {}\ntries = {tries}\ndecoded = {decoded}",
        targets().len()
    );
    println!(
        "seconds = {:.1}\nmemory_growth_kb = {}\n",
        begin.elapsed().as_secs_f64(),
        memory()?.saturating_sub(before)
    );
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let tries = std::env::args().nth(1).context("figures TRIES")?.parse()?;
    let parameters = Parameters::default();
    classroom(&parameters)?;
    hostile(&parameters, tries)
}
