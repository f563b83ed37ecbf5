//! The examples at the end of each subcommand's help.

use clap::Command;

/// A subcommand, and examples of it.
pub const EXAMPLES: [(&str, &[&str]); 34] = [
    ("init", &["sonarfix init robot --board pico"]),
    ("check", &["sonarfix check scenario.toml", "sonarfix check robot.toml map.toml --json"]),
    (
        "paper",
        &["sonarfix paper --out report", "sonarfix paper --runs 200 --policy nearest --json"],
    ),
    (
        "run",
        &[
            "sonarfix run scenario.toml --out report",
            "sonarfix run scenario.toml --runs 1000 --rows rows.csv",
            "sonarfix run scenario.toml --sweep sonar.noise=1mm,5mm,20mm",
            "sonarfix run scenario.toml --start unknown --serve",
        ],
    ),
    ("pil", &["sonarfix pil scenario.toml --machine m0plus --seconds 20"]),
    (
        "replay",
        &[
            "sonarfix replay drive.csv --map map.toml --config robot.toml --out report",
            "sonarfix replay drive.csv --json",
        ],
    ),
    (
        "compare",
        &[
            "sonarfix compare before.csv after.csv --out comparison",
            "sonarfix compare drive.csv drive.csv --config robot.toml --config calibrated.toml --out comparison",
        ],
    ),
    ("find", &["sonarfix find drive.csv --map map.toml"]),
    ("calibrate", &["sonarfix calibrate drive.csv --map map.toml --out calibrated.toml"]),
    ("measure", &["sonarfix measure --port /dev/ttyACM0 --robot robot.toml --out measured.toml"]),
    ("survey", &["sonarfix survey drive.csv --out map.toml --drawing map.svg"]),
    ("convert carmen", &["sonarfix convert carmen intel.log --out intel"]),
    ("convert lego", &["sonarfix convert lego recording --out lego"]),
    ("convert nxt", &["sonarfix convert nxt recording --out nxt"]),
    ("convert rosbag", &["sonarfix convert rosbag bag --out drive"]),
    (
        "export",
        &[
            "sonarfix export drive.csv --mcap drive.mcap --parquet drive.parquet",
            "sonarfix export trace.csv --map map.toml --mcap run.mcap",
        ],
    ),
    (
        "monitor",
        &[
            "sonarfix monitor --port /dev/ttyACM0 --map map.toml --robot robot.toml",
            "sonarfix monitor --port tcp:192.168.1.7:5000 --record drive.csv",
            "sonarfix monitor --port /dev/ttyACM0 --signs-of-life",
        ],
    ),
    (
        "command",
        &[
            "sonarfix command --port /dev/ttyACM0 set-pose 1.5 0.8 90",
            "sonarfix command --port /dev/ttyACM0 start",
            "sonarfix command --port /dev/ttyACM0 drive --speed 0.1 --turn 20 --seconds 3",
            "sonarfix command --port /dev/ttyACM0 goto 2.5 1.5 2.5 4 --map map.toml --robot robot.toml",
            "sonarfix command --port /dev/ttyACM0 self-test --loop",
            "sonarfix command --port /dev/ttyACM0 patrol 1 1 2.5 1 2.5 4 --pause 5 --rounds 3",
        ],
    ),
    (
        "virtual-robot",
        &[
            "sonarfix virtual-robot scenario.toml --link robot.port",
            "sonarfix virtual-robot scenario.toml --tcp 5000 --stand --running",
        ],
    ),
    ("merge", &["sonarfix merge shard-1.csv shard-2.csv --json"]),
    ("config bake", &["sonarfix config bake robot.toml --out config.bin"]),
    ("config check", &["sonarfix config check config.bin"]),
    ("config show", &["sonarfix config show config.bin"]),
    (
        "flash",
        &[
            "sonarfix flash robot --board pico",
            "sonarfix flash robot --board pico --port /dev/ttyUSB0",
            "sonarfix flash robot --board pico2 --out robot.uf2",
            "sonarfix flash robot --board esp32c6 --dry-run",
        ],
    ),
    (
        "map check",
        &[
            "sonarfix map check map.toml",
            "sonarfix map check map.toml --robot robot.toml --starts 60 --out starts.svg",
        ],
    ),
    ("map bake", &["sonarfix map bake map.toml --out map.bin"]),
    ("map draw", &["sonarfix map draw map.toml --out map.svg"]),
    ("map simplify", &["sonarfix map simplify map.csv --out simple.csv"]),
    (
        "map import",
        &[
            "sonarfix map import house.dxf --layer WALLS --out map.toml",
            "sonarfix map import plan.png --unit 0.0125 --out map.toml --picture plan.svg",
        ],
    ),
    ("map export", &["sonarfix map export map.toml --out grid.yaml --resolution 0.05"]),
    ("bound", &["sonarfix bound scenario.toml --every 10"]),
    (
        "plan",
        &[
            "sonarfix plan scenario.toml --compare --need 50",
            "sonarfix plan map.toml --path path.csv --sensor hc_sr04",
        ],
    ),
    ("doctor", &["sonarfix doctor", "sonarfix doctor --json"]),
    ("man", &["sonarfix man --out ~/.local/share/man/man1"]),
];

/// The command with the examples in its help.
pub fn added(command: Command) -> Command {
    EXAMPLES.iter().fold(command, |command, (path, lines)| {
        let text = format!("Examples:\n  {}", lines.join("\n  "));
        at(command, &path.split(' ').collect::<Vec<_>>(), text)
    })
}

/// The command with a text after the help of a subcommand.
fn at(command: Command, path: &[&str], text: String) -> Command {
    if let [first, rest @ ..] = path {
        return command.mut_subcommand(first, |below| at(below, rest, text));
    }
    let before = command.get_after_help().map(|text| format!("{text}\n\n"));
    command.after_help(before.unwrap_or_default() + &text)
}
