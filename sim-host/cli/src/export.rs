//! `sonarfix export`: writes logs and traces for other programs.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use sonarfix_bags::export::Export;
use sonarfix_exchange::row::{Rows, Sink};
use sonarfix_exchange::{mcap_file, trace_csv, trace_parquet};
use sonarfix_files::Output;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Floor, MapFile, robot_file};
use sonarfix_replay::{Replay, Summary};
use sonarfix_sim::trace::{Recorder, Wall};

use crate::recorded::{is_log, walls};
use sonarfix_terminal::output::{self, check_file, check_folder};

/// The file of a bag that describes it.
const METADATA: &str = "metadata.yaml";

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A log, a recording of `monitor --record`, or a trace (docs/formats.md). A log is replayed.
    file: PathBuf,
    /// The map, or a scenario; by default map.toml beside the file.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// The robot of a log; by default robot.toml beside it.
    #[arg(long, value_name = "ROBOT.toml")]
    config: Option<PathBuf>,
    /// The true poses of a log; by default reference.csv beside it, if it exists.
    #[arg(long, value_name = "REF.csv")]
    reference: Option<PathBuf>,
    /// Writes MCAP, for Foxglove (docs/exchange.md).
    #[arg(long, value_name = "FILE.mcap", required_unless_present_any = ["parquet", "rosbag"])]
    mcap: Option<PathBuf>,
    /// Writes the columns of a trace as Parquet, for pandas and polars (docs/exchange.md).
    #[arg(long, value_name = "FILE.parquet")]
    parquet: Option<PathBuf>,
    /// Writes a log and its replay as a bag of ROS 2 (docs/bags.md): a folder with an MCAP file and metadata.yaml.
    #[arg(long, value_name = "DIR")]
    rosbag: Option<PathBuf>,
    /// Replaces a bag that is in the folder.
    #[arg(long, requires = "rosbag")]
    force: bool,
}

type Bag<'r> = Export<'r, Output>;
type Mcap = mcap_file::File<Output>;
type Parquet = trace_parquet::File<Output>;

/// The files that are written.
struct Outputs<'r> {
    bag: Option<(&'r Path, Bag<'r>)>,
    mcap: Option<Mcap>,
    parquet: Option<Parquet>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    for (option, file) in [("--mcap", &args.mcap), ("--parquet", &args.parquet)] {
        if let Some(file) = file {
            check_file(option, file)?;
        }
    }
    if let Some(folder) = &args.rosbag {
        check_folder("--rosbag", folder)?;
        let metadata = folder.join(METADATA);
        ensure!(
            args.force || !metadata.exists(),
            "--rosbag: {} exists: name another folder, or replace it with --force",
            metadata.display()
        );
    }
    let map = args.map.clone().unwrap_or_else(|| args.file.with_file_name("map.toml"));
    let floor = MapFile::read(&map, None)?.floor;
    if is_log(&args.file)? { export_log(args, &floor) } else { export_trace(args, &floor) }
}

fn open(file: &Path) -> anyhow::Result<BufReader<File>> {
    Ok(BufReader::new(output::open(file)?))
}

fn export_trace(args: &Args, floor: &Floor) -> anyhow::Result<()> {
    if args.rosbag.is_some() {
        let file = args.file.display();
        bail!("--rosbag: {file} is a trace, which has no odometry and no ranges: export the log");
    }
    let mut outputs = Outputs::new(args, 0.0, &walls(floor), None)?;
    let rows = trace_csv::read(open(&args.file)?, &mut outputs.sinks());
    let rows = rows.with_context(|| args.file.display().to_string())?;
    outputs.end()?;
    println!("{rows} rows");
    Ok(())
}

fn export_log(args: &Args, floor: &Floor) -> anyhow::Result<()> {
    let beside = args.file.with_file_name("robot.toml");
    let robot = robot_file::read(args.config.as_ref().unwrap_or(&beside))?;
    // The start is known after a replay: MCAP needs its time on the log's clock.
    let start = replay(args, &robot, floor, &mut ())?.started_at;
    let walls = walls(floor);
    let mut outputs = Outputs::new(args, start, &walls, Some(&robot))?;
    let mut left_out = 0;
    if let Some((_, bag)) = &mut outputs.bag {
        left_out = bag.take_log(open(&args.file)?)?;
    }
    let mut rows = Rows::new(&walls, outputs.sinks());
    let summary = replay(args, &robot, floor, &mut rows)?;
    rows.end()?;
    let mount = robot.localizer.rangers.first.mount;
    let mount = [mount.x.0.into(), mount.y.0.into()];
    if let Some(mcap) = &mut outputs.mcap {
        mcap.take_log(open(&args.file)?, mount)?;
    }
    outputs.end()?;
    let (lines, skipped) = (summary.lines, summary.lines_skipped);
    println!("{lines} lines, {skipped} of them skipped; {:.1} s", summary.duration);
    if left_out > 0 {
        eprintln!(
            "{left_out} records are not in the bag: ROS has no message for them (docs/bags.md)"
        );
    }
    Ok(())
}

fn replay(
    args: &Args,
    robot: &RobotConfig,
    floor: &Floor,
    recorder: &mut impl Recorder,
) -> anyhow::Result<Summary> {
    let usual = args.file.with_file_name("reference.csv");
    let reference = args.reference.clone().or_else(|| usual.exists().then_some(usual));
    let reference = reference.as_deref().map(open).transpose()?;
    let walls = floor.walls();
    let replay = Replay { robot, walls: &walls, strict: false, pings_per_scan: 1 };
    let summary = replay.run(open(&args.file)?, reference, recorder, &mut |_| {});
    summary.with_context(|| args.file.display().to_string())
}

/// The name of the only file with messages of a bag, as rosbag2 names it.
fn bag_file(folder: &Path) -> String {
    let name = folder.file_name().map_or_else(|| "bag".into(), |name| name.to_string_lossy());
    format!("{name}_0.mcap")
}

impl<'r> Outputs<'r> {
    fn new(
        args: &'r Args,
        epoch: f64,
        walls: &[Wall],
        robot: Option<&'r RobotConfig>,
    ) -> anyhow::Result<Self> {
        let create = |file: &PathBuf| -> anyhow::Result<_> {
            Output::create(file).with_context(|| format!("cannot write {}", file.display()))
        };
        let metadata = [
            ("sonarfix", env!("CARGO_PKG_VERSION").to_owned()),
            ("source", args.file.display().to_string()),
            ("start_s", epoch.to_string()),
        ];
        let mcap = args.mcap.as_ref().map(|file| Mcap::new(create(file)?, epoch, walls, &metadata));
        let parquet = args.parquet.as_ref().map(|file| Parquet::new(create(file)?));
        let mut bag = None;
        if let (Some(folder), Some(robot)) = (&args.rosbag, robot) {
            let file = create(&folder.join(bag_file(folder)))?;
            bag = Some((folder.as_path(), Bag::new(file, robot, epoch, walls)?));
        }
        Ok(Self { bag, mcap: mcap.transpose()?, parquet: parquet.transpose()? })
    }

    fn sinks(&mut self) -> Vec<&mut dyn Sink> {
        let mcap = self.mcap.iter_mut().map(|file| file as &mut dyn Sink);
        let parquet = self.parquet.iter_mut().map(|file| file as &mut dyn Sink);
        let bag = self.bag.iter_mut().map(|(_, bag)| bag as &mut dyn Sink);
        mcap.chain(parquet).chain(bag).collect()
    }

    fn end(self) -> anyhow::Result<()> {
        if let Some((folder, bag)) = self.bag {
            let (file, metadata) = bag.end(&bag_file(folder))?;
            file.finish()?;
            sonarfix_files::write(&folder.join(METADATA), metadata)?;
        }
        if let Some(file) = self.mcap {
            file.end()?.finish()?;
        }
        if let Some(file) = self.parquet {
            file.end()?.finish()?;
        }
        Ok(())
    }
}
