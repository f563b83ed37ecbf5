//! Golden traces: every machine reproduces the recorded answers bit by bit.

use crate::cargo;

/// The traces: a name, and the arguments of `sonarfix pil`. The second contains gated ranges, the third a search, the fourth slips of a
/// wheel, the fifth measurements that are outliers and others that are too late, the last a time-of-flight ranger.
const TRACES: [(&str, &str); 6] = [
    ("localizer", "paper --policy informative --seconds 60"),
    ("loop", "crates/sonarfix-map/scenarios/classroom.toml --seed 30 --seconds 120"),
    (
        "search",
        "crates/sonarfix-map/scenarios/classroom.toml --start unknown --fix-period as-fast-as-possible --seconds 7",
    ),
    (
        "gyro",
        "crates/sonarfix-map/scenarios/classroom.toml --gyro mpu6050 --heading-slips 10 --absolute heading --seconds 30",
    ),
    ("absolute", "tests/golden/absolute.toml --seconds 50"),
    (
        "light",
        "crates/sonarfix-map/scenarios/classroom.toml --sensor vl53l1x --seed 31 --seconds 30",
    ),
];

/// The first is this computer.
const MACHINES: [&str; 6] = ["host", "m4f", "m33", "m3", "m0plus", "rv32"];

/// Replays every trace on every machine.
pub fn check() -> anyhow::Result<()> {
    for (name, _) in TRACES {
        for machine in MACHINES {
            pil(&format!("{} --machine {machine}", path(name)))?;
        }
    }
    Ok(())
}

/// Records the traces and the hashes of whole runs on this computer.
pub fn bless() -> anyhow::Result<()> {
    for (name, run) in TRACES {
        pil(&format!("{run} --machine host --record {}", path(name)))?;
    }
    let mut runs = cargo::command("test --quiet --package sonarfix-pil-host --test golden runs::");
    cargo::printed({
        runs.env("SONARFIX_BLESS", "1");
        runs
    })?;
    Ok(())
}

fn path(name: &str) -> String {
    format!("tests/golden/{name}.golden")
}

fn pil(arguments: &str) -> anyhow::Result<()> {
    let run = "run --quiet --release --bin sonarfix -- pil";
    cargo::run(&format!("{run} {arguments}"))
}
