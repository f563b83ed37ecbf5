//! The commands that the pages print, run in the order of their page: each must end without an error, or show its page or its robot.
//!
//! Every page has a folder of its own, with the scenarios of the repository. What the reader of a page has before its first command is in
//! [`GIVEN`]; a page that needs something else must say it. A port is that of a virtual robot. Statistics are made with few runs.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use crate::documented::{arguments, in_blocks, pages, root};
use crate::virtual_robot::Robot;
use crate::{endings, flash, skipped};

/// What the reader of a page has before its first command: the files of a robot by `init`, a drive as a log, or its trace. `SCENARIO` is that of
/// the classroom; `FILES` and `FLASH` are folders of made files. A line `robot` has the arguments of the virtual robot at the port of the
/// page.
#[rustfmt::skip]
const GIVEN: [(&str, &[&str]); 14] = [
    ("bags.md", &["mkdir room", "sonarfix run SCENARIO --runs 1 --record room/log.csv", "sonarfix export room/log.csv --rosbag drive"]),
    ("build-a-robot.md", &["robot robot/scenario.toml --stand"]),
    ("calibrate.md", &["cp FILES/drive.csv log.csv", "cp FILES/map.toml .", "cp FILES/robot.toml .", "cp FILES/survey drive"]),
    ("compare.md", &["robot SCENARIO --stand"]),
    ("driving.md", &[
        "sonarfix init robot", "cp robot .", "robot scenario.toml --stand",
        "sonarfix command --port PORT set-pose 1 0.8 0", "sonarfix command --port PORT start",
    ]),
    ("exchange.md", &[
        "mkdir lego", "sonarfix run SCENARIO --runs 1 --record lego/log.csv --trace trace.csv",
        "sonarfix map export SCENARIO --out plan.yaml --resolution 0.0125", "cp plan.pgm plan.png", "cp FILES/house.dxf .",
    ]),
    ("firmware.md", &["sonarfix init robot", "cp robot/map.toml .", "cp robot/robot.toml ."]),
    ("flash.md", &["sonarfix init robot --board pico", "robot robot/scenario.toml --stand"]),
    ("live.md", &["sonarfix run SCENARIO --runs 1 --record run.csv", "robot SCENARIO --stand"]),
    ("plan.md", &["sonarfix init robot --room \"5 x 4\"", "cp robot ."]),
    ("release.md", &["mkdir scenarios", "cp SCENARIO scenarios"]),
    ("search.md", &["sonarfix run SCENARIO --runs 1 --record LOG.csv"]),
    ("survey.md", &["cp FILES/survey/log.csv .", "cp FILES/survey/robot.toml .", "cp FILES/survey drive"]),
    ("sweeps.md", &["cp SCENARIO .", "shards"]),
];

/// A command that is run in another way, and why.
#[rustfmt::skip]
const SMALL: [(&str, &str, &str); 8] = [
    ("pil paper", "pil paper --machine host --seconds 1", EMULATED),
    ("pil SCENARIO --seconds 60 --machine m0plus", "pil SCENARIO --seconds 1 --machine host", EMULATED),
    ("flash robot --board pico", "flash robot --board pico --program FLASH/pico.uf2 --to FLASH/drive", BOARD),
    ("flash robot --board pico --port PORT", "flash robot --board pico --port PORT --program FLASH/pico.uf2 --to FLASH/drive", BOARD),
    ("flash . --board xrp --port PORT", "flash . --board xrp --port PORT --program FLASH/pico.uf2 --to FLASH/drive", BOARD),
    ("command --port PORT goto 2.5 1.5 2.5 4 1 4 --map map.toml --robot robot.toml",
     "command --port PORT goto 2.5 1.5 2.5 4 1 4 --map map.toml --robot robot.toml --seconds 2", MINUTES),
    ("command --port PORT patrol 1 1 2.5 1 2.5 4 --pause 5 --rounds 3",
     "command --port PORT patrol 1 1 2.5 1 2.5 4 --pause 5 --rounds 3 --seconds 2", MINUTES),
    ("map check map.toml --starts 60 --out starts.svg", "map check map.toml --starts 2 --seconds 5 --out starts.svg", MINUTES),
];
const EMULATED: &str = "the program of the emulated core is built and run by `cargo xtask pil`";
const BOARD: &str =
    "it needs the drive of a board and the program of a release, which are made here";
const MINUTES: &str = "the robot drives for half a minute and more, or many do";

/// A command that is not run, and why.
const NEVER: [(&str, &str); 1] = [(
    "measure --port PORT --robot robot.toml --out measured.toml",
    "a person turns the wheels; the tests of `measure.rs` answer for one",
)];

/// The names of recordings that are not in the repository: what needs one is skipped without it.
const RECORDINGS: [&str; 2] = ["lego_urg", "nxt_rotating_sonar"];

/// Runs of a command with statistics, and of one with shards.
const RUNS: &str = "2";
const SHARDED_RUNS: &str = "8";

const CLASSROOM: &str = "crates/sonarfix-map/scenarios/classroom.toml";
/// Names of a serial port.
const PORTS: [&str; 3] = ["PORT", "/dev/ttyUSB0", "/dev/ttyACM0"];
/// After this a command hangs; nothing is asserted about its time.
const PATIENCE: Duration = Duration::from_mins(4);

/// A closed room as a DXF drawing.
const HOUSE: [[f64; 4]; 4] =
    [[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 3.0], [4.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]];

/// Folders of made files, for all pages.
struct Made {
    files: tempfile::TempDir,
    flash: tempfile::TempDir,
}

impl Made {
    fn new() -> Self {
        let (files, flash) = (endings::files(), flash::folder());
        let line = |[x0, y0, x1, y1]: [f64; 4]| {
            format!("0\nLINE\n8\nWALLS\n10\n{x0}\n20\n{y0}\n11\n{x1}\n21\n{y1}\n")
        };
        let lines: String = HOUSE.into_iter().map(line).collect();
        let header = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n";
        let dxf = format!("{header}0\nSECTION\n2\nENTITIES\n{lines}0\nENDSEC\n0\nEOF\n");
        fs::write(files.path().join("house.dxf"), dxf).unwrap();
        flash::drive(&flash, "RPI-RP2");
        Self { files, flash }
    }
}

/// A reader of a page.
struct Reader<'m> {
    made: &'m Made,
    folder: tempfile::TempDir,
    here: PathBuf,
    /// Arguments of the virtual robot, and the robot once a port is used.
    robot: Option<(String, Option<Robot>)>,
    /// Robots that the page starts.
    background: Vec<Running>,
    /// Folders that a recording would fill.
    absent: Vec<String>,
    /// Entries of the tables that were met.
    met: BTreeSet<&'static str>,
    /// Commands that were run, and what went wrong.
    tried: usize,
    wrong: Vec<String>,
}

impl<'m> Reader<'m> {
    fn new(made: &'m Made) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for scenarios in ["crates/sonarfix-map/scenarios", "tests/scenarios"] {
            let to = folder.path().join(scenarios);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            symlink(root().join(scenarios).canonicalize().unwrap(), to).unwrap();
        }
        let here = folder.path().to_owned();
        let (robot, background, absent, met) = (None, vec![], vec![], BTreeSet::new());
        Self { made, folder, here, robot, background, absent, met, tried: 0, wrong: vec![] }
    }

    /// Reads a page from its beginning.
    fn read(&mut self, name: &str, text: &str) {
        if let Some((name, given)) = GIVEN.iter().find(|(page, _)| *page == name) {
            self.met.insert(name);
            for line in *given {
                self.obey(line);
            }
        }
        for command in in_blocks(text) {
            self.obey(command.strip_prefix("time ").unwrap_or(command));
        }
        self.wrong.iter_mut().for_each(|wrong| *wrong = format!("{name}: {wrong}"));
    }

    /// Obeys a line as a shell does; what is not a command of this program changes the folder, or is left out.
    fn obey(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            // The folders of the repository and of an archive are not there.
            ["cd", to] if self.at(to).is_dir() => self.here = self.at(to),
            ["git", "clone", url] => {
                fs::create_dir(self.at(url.rsplit('/').next().unwrap())).unwrap();
            }
            ["mkdir", folder] => fs::create_dir(self.at(folder)).unwrap(),
            ["cp", from, to] => self.copy(&self.at(from), &self.at(to)),
            ["robot", of @ ..] => self.robot = Some((of.join(" "), None)),
            ["shards"] => self.shards(),
            _ => {
                if let Some(arguments) = arguments(line) {
                    self.run(arguments);
                }
            }
        }
    }

    /// A path of a line.
    fn at(&self, path: &str) -> PathBuf {
        self.here.join(self.filled(path))
    }

    /// A word with the paths of what is given.
    fn filled(&self, word: &str) -> String {
        let path = |of: &Path| of.display().to_string();
        word.replace("SCENARIO", &path(&self.folder.path().join(CLASSROOM)))
            .replace("FILES", &path(self.made.files.path()))
            .replace("FLASH", &path(self.made.flash.path()))
    }

    fn copy(&mut self, from: &Path, to: &Path) {
        // A file that a skipped command would have written is absent.
        let is_absent = |folder: &String| from.starts_with(self.here.join(folder));
        if self.absent.iter().any(is_absent) {
            return;
        }
        if from.is_dir() {
            fs::create_dir_all(to).unwrap();
            for entry in fs::read_dir(from).unwrap() {
                let entry = entry.unwrap();
                self.copy(&entry.path(), &to.join(entry.file_name()));
            }
            return;
        }
        let to = if to.is_dir() { to.join(from.file_name().unwrap()) } else { to.to_owned() };
        if let Err(error) = fs::copy(from, &to) {
            self.wrong.push(format!("cp {}: {error}", from.display()));
        }
    }

    /// The shards beside that of the page.
    fn shards(&mut self) {
        for shard in (1..=8).filter(|shard| *shard != 3) {
            let rows = format!("--shard {shard}/8 --rows shard-{shard}.csv");
            self.obey(&format!("sonarfix run classroom.toml --runs {SHARDED_RUNS} {rows}"));
        }
    }

    fn run(&mut self, words: Vec<String>) {
        let Some(words) = self.variant(words) else { return };
        if self.needs_a_recording(&words) {
            return;
        }
        self.tried += 1;
        let shown = words.join(" ");
        let words: Vec<String> = words.iter().flat_map(|word| self.expanded(word)).collect();
        let mut running = Running::new(&words, &self.here);
        let is = |name: &str| words.iter().any(|word| word == name);
        let goes_on = is("--serve") || is("virtual-robot") || (is("monitor") && !is("--seconds"));
        if !goes_on {
            if let Err(reason) = running.ended() {
                self.wrong.push(format!("{shown}: {reason}"));
            }
        } else if let Err(reason) = running.shown(is("--serve")) {
            self.wrong.push(format!("{shown}: {reason}"));
        } else if is("virtual-robot") {
            self.background.push(running);
        }
    }

    /// The words of a command as it is run here; `None` if it is not run.
    fn variant(&mut self, words: Vec<String>) -> Option<Vec<String>> {
        let normal = |word: String| match word.as_str() {
            CLASSROOM => "SCENARIO".to_owned(),
            port if PORTS.contains(&port) => "PORT".to_owned(),
            _ => word,
        };
        let mut words: Vec<String> = words.into_iter().map(normal).collect();
        let command = words.join(" ");
        if let Some((never, _)) = NEVER.iter().find(|(never, _)| *never == command) {
            self.met.insert(never);
            return None;
        }
        if let Some((usual, small, _)) = SMALL.iter().find(|(usual, ..)| *usual == command) {
            self.met.insert(usual);
            words = small.split(' ').map(str::to_owned).collect();
        }
        let is_sharded = words.iter().any(|word| word == "--shard");
        let runs = if is_sharded { SHARDED_RUNS } else { RUNS };
        match words.iter().position(|word| word == "--runs") {
            Some(at) if words.get(at + 1).is_some_and(|runs| runs != "1") => {
                runs.clone_into(words.get_mut(at + 1).unwrap());
            }
            None if words.first().is_some_and(|first| first == "paper") => {
                words.extend(["--runs", runs].map(str::to_owned));
            }
            _ => {}
        }
        Some(words)
    }

    /// Whether a recording is absent that a command, or one before it, needs; one that is there is beside the page.
    fn needs_a_recording(&mut self, words: &[String]) -> bool {
        for name in RECORDINGS.into_iter().filter(|name| words.iter().any(|word| word == name)) {
            self.met.insert(name);
            let to = self.here.join(name);
            match skipped::unless_recorded(name) {
                Some(recording) if !to.exists() => symlink(recording, to).unwrap(),
                Some(_) => {}
                None => {
                    let out = words.iter().skip_while(|word| *word != "--out").nth(1);
                    self.absent.extend(out.cloned());
                    return true;
                }
            }
        }
        let is_absent =
            |word: &&String| self.absent.iter().any(|folder| Path::new(word).starts_with(folder));
        words.iter().find(is_absent).is_some()
    }

    /// A word as the shell passes it: with what is given, a port in place of its name, and the files of a pattern.
    fn expanded(&mut self, word: &str) -> Vec<String> {
        if word == "PORT" {
            return vec![self.port()];
        }
        let Some((start, end)) = word.split_once('*') else { return vec![self.filled(word)] };
        let names = fs::read_dir(&self.here).unwrap();
        let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut found: Vec<String> =
            names.filter(|name| name.starts_with(start) && name.ends_with(end)).collect();
        found.sort();
        found
    }

    /// The port of the page's robot, which is started at its first use.
    fn port(&mut self) -> String {
        let arguments = self.robot.as_ref().map(|(arguments, _)| arguments.clone());
        let arguments = arguments.unwrap_or_else(|| "robot/scenario.toml --stand".to_owned());
        let words: Vec<String> = arguments.split(' ').map(|word| self.filled(word)).collect();
        let here = self.folder.path();
        if !words.first().is_some_and(|scenario| here.join(scenario).exists()) {
            self.wrong.push(format!("the robot has no {arguments}"));
            return "nowhere".to_owned();
        }
        let start = || {
            let (scenario, options) = words.split_first().unwrap();
            let scenario = here.join(scenario).display().to_string();
            let options = options.iter().map(String::as_str).chain(["--tcp", "0"]);
            Robot::with(&std::iter::once(scenario.as_str()).chain(options).collect::<Vec<_>>())
        };
        let (_, robot) = self.robot.get_or_insert_with(|| (String::new(), None));
        robot.get_or_insert_with(start).ports.last().unwrap().clone()
    }
}

/// A command that runs; it is ended when it is dropped.
struct Running {
    child: Child,
    /// Lines of both outputs, and whether they are of the standard error.
    lines: Receiver<(bool, String)>,
    ended: Receiver<()>,
}

impl Running {
    fn new(words: &[String], here: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        command.args(words).current_dir(here).stdin(Stdio::null());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (sender, lines) = channel();
        let (ends, ended) = channel();
        follow(child.stdout.take().unwrap(), false, sender.clone(), ends.clone());
        follow(child.stderr.take().unwrap(), true, sender, ends);
        Self { child, lines, ended }
    }

    /// Waits until the command has ended; its errors, if it has failed.
    fn ended(&mut self) -> Result<(), String> {
        for _ in 0..2 {
            self.ended.recv_timeout(PATIENCE).map_err(|_| "it does not end".to_owned())?;
        }
        if self.child.wait().unwrap().success() { Ok(()) } else { Err(self.errors()) }
    }

    /// Waits until the command has printed the address of its page, or a line.
    fn shown(&mut self, is_page: bool) -> Result<(), String> {
        let mut printed = String::new();
        loop {
            match self.lines.recv_timeout(PATIENCE) {
                Ok((true, line)) if is_page && line.starts_with("open http://") => return Ok(()),
                Ok((false, _)) if !is_page => return Ok(()),
                Ok((_, line)) => printed.push_str(&line),
                Err(_) => return Err(format!("it shows nothing: {printed}")),
            }
        }
    }

    fn errors(&self) -> String {
        let errors = self.lines.try_iter().filter(|(is_error, _)| *is_error);
        errors.map(|(_, line)| line + "\n").collect()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Passes the lines of an output on, and says when it has ended.
fn follow(
    output: impl Read + Send + 'static,
    is_error: bool,
    lines: Sender<(bool, String)>,
    ends: Sender<()>,
) {
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // Nobody may be interested any more.
            lines.send((is_error, line)).ok();
        }
        ends.send(()).ok();
    });
}

/// Reads all pages, several at once.
fn readers(made: &Made) -> Vec<(BTreeSet<&'static str>, usize, Vec<String>)> {
    let pages = Mutex::new(pages());
    let read = || {
        let mut results = Vec::new();
        loop {
            let page = pages.lock().unwrap().pop();
            let Some((name, text)) = page else { return results };
            let mut reader = Reader::new(made);
            reader.read(&name, &text);
            results.push((reader.met, reader.tried, reader.wrong));
        }
    };
    // Half of the time a page waits for a robot.
    let workers = 2 * thread::available_parallelism().unwrap().get();
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(read)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

#[test]
fn every_command_of_a_page_does_what_the_page_says() {
    let made = Made::new();
    let results = readers(&made);
    let wrong: Vec<&str> =
        results.iter().flat_map(|(_, _, wrong)| wrong).map(String::as_str).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let tried: usize = results.iter().map(|(_, tried, _)| tried).sum();
    assert!(tried > 90, "{tried}");
    // No table has an entry that no page needs.
    let met: BTreeSet<&str> = results.iter().flat_map(|(met, ..)| met.iter().copied()).collect();
    let given = GIVEN.iter().map(|(page, _)| *page);
    let small = SMALL.iter().map(|(command, ..)| *command);
    let never = NEVER.iter().map(|(command, _)| *command);
    let unused: Vec<&str> =
        given.chain(small).chain(never).chain(RECORDINGS).filter(|it| !met.contains(it)).collect();
    assert_eq!(unused, Vec::<&str>::new());
}
