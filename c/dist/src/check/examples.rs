//! The examples for Arduino.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::command::output;
use crate::packages::Packages;
use crate::target::{HOST, PORTABLE, TARGETS};

/// Flags of Arduino's cores for C++.
const CPP: &str = "-Os -std=gnu++17 -fno-exceptions -fno-rtti -ffunction-sections -fdata-sections";
const WARNINGS: &str = "-Wall -Wextra -Werror";
/// The error of an example in the simulator over that of the firmware's loop, at most.
const WORST_RATIO: f64 = 1.1;

/// An example in the simulator.
struct Drive {
    name: &'static str,
    scenario: &'static str,
    options: &'static [&'static str],
}

const CLASSROOM: &str = "crates/sonarfix-map/scenarios/classroom.toml";
/// The room of `FindMe`, without furniture.
const ALCOVE: &str = r#"map.wall=[{name="a",from=[0,0],to=[6,0]},{name="b",from=[6,0],to=[6,8]},
{name="c",from=[6,8],to=[2.2,8]},{name="d",from=[2.2,8],to=[2.2,10]},
{name="e",from=[2.2,10],to=[0,10]},{name="f",from=[0,10],to=[0,0]}]"#;

/// The programs start at the true pose, as their robot is put there.
const KNOWN: &[&str] = &["--set", "start.drawn=false"];

const DRIVES: [Drive; 7] = [
    Drive { name: "OneFix", scenario: CLASSROOM, options: KNOWN },
    Drive { name: "DriveTheRoom", scenario: CLASSROOM, options: KNOWN },
    Drive { name: "LogToPC", scenario: CLASSROOM, options: KNOWN },
    Drive {
        name: "FindMe",
        scenario: CLASSROOM,
        options: &["--start", "unknown", "--set", ALCOVE, "--set", "world.obstacle=[]"],
    },
    Drive {
        name: "TwoRangers",
        scenario: "tests/scenarios/classroom-two-servos.toml",
        options: KNOWN,
    },
    Drive {
        name: "CalibrateHere",
        scenario: CLASSROOM,
        options: &["--gyro", "mpu6050", "--set", "start.drawn=false"],
    },
    Drive {
        name: "LightRanger",
        scenario: CLASSROOM,
        options: &["--sensor", "vl53l1x", "--set", "start.drawn=false"],
    },
];

/// The command that compiles an example of the package and the stand-in for a board.
fn compiler(
    workspace: &Path,
    package: &Path,
    program: &str,
    flags: &str,
    example: &str,
    board: &str,
) -> Command {
    let host = workspace.join("arduino-host");
    let mut command = Command::new(program);
    command.args(flags.split_whitespace()).args(CPP.split(' ')).args(WARNINGS.split(' '));
    command.arg("-I").arg(&host).arg("-I").arg(package.join("src"));
    command.args(["-x", "c++", "-include"]).arg(host.join("Arduino.h"));
    command.arg(package.join(format!("examples/{example}/{example}.ino")));
    command.arg(host.join(board)).args(["-x", "none"]);
    command
}

/// Links each example for each processor, with the compiled library, and compiles it and the portable source for the others.
///
/// # Errors
/// If one cannot be compiled.
pub fn compile(workspace: &Path, package: &Path, work: &Path) -> Result<()> {
    for target in &TARGETS {
        eprintln!("examples for {}", target.folder);
        let program = format!("{}g++", target.compiler);
        for Drive { name, .. } in &DRIVES {
            let flags = format!("{} -ffreestanding", target.flags);
            let mut command = compiler(workspace, package, &program, &flags, name, "bare.cpp");
            command.arg(package.join(format!("src/{}/libsonarfix.a", target.folder)));
            command.args(["-nostdlib", "-Wl,--gc-sections", "-Wl,-e,main", "-lgcc", "-o"]);
            output(command.arg(work.join("example.elf")))
                .with_context(|| format!("{name} for {}", target.folder))?;
        }
    }
    for (prefix, flags) in PORTABLE {
        eprintln!("examples and portable source by {prefix}gcc {flags}");
        let mut library = Command::new(format!("{prefix}gcc"));
        library.args(flags.split_whitespace()).args(["-Os", "-ffreestanding", "-c"]);
        library.args(WARNINGS.split(' ')).arg("-I").arg(package.join("src"));
        library.arg(package.join("src/sonarfix.c")).arg("-o");
        output(library.arg(work.join("portable.o")))?;
        for Drive { name, .. } in &DRIVES {
            let program = format!("{prefix}g++");
            let flags = format!("{flags} -ffreestanding");
            let mut command = compiler(workspace, package, &program, &flags, name, "bare.cpp");
            // Linked without a runtime library: the compiler of the ESP8266 has none here.
            command.arg(work.join("portable.o")).args(["-nostdlib", "-r", "-o"]);
            output(command.arg(work.join("example.o")))
                .with_context(|| format!("{name} by {prefix}g++"))?;
        }
    }
    Ok(())
}

/// Compares a robot by Arduino's classes with one by the functions of C.
///
/// # Errors
/// If they differ.
pub fn compare(workspace: &Path, packages: &Packages, work: &Path) -> Result<()> {
    let (host, program) = (workspace.join("arduino-host"), work.join("same_bits"));
    let mut command = Command::new("g++");
    command.args(CPP.split(' ')).args(WARNINGS.split(' ')).arg("-I").arg(&host).arg("-I");
    command.arg(packages.arduino.join("src")).arg(host.join("same_bits.cpp"));
    command.arg(packages.c.join(format!("lib/{HOST}/libsonarfix.a"))).arg("-o").arg(&program);
    output(&mut command)?;
    print!("Arduino's classes and C: {}", output(&mut Command::new(program))?);
    Ok(())
}

/// Drives each example in the simulator, beside the loop of the firmware.
///
/// # Errors
/// If one is lost, or worse than the firmware.
pub fn drive(workspace: &Path, packages: &Packages, work: &Path) -> Result<()> {
    let root = workspace.join("..").canonicalize()?;
    let mut build = Command::new("cargo");
    build.current_dir(&root).args(["build", "--quiet", "--release", "--package"]);
    build.args(["sonarfix-sketch", "--target-dir"]);
    output(build.arg(root.join("target")))?;
    for drive in &DRIVES {
        let program = compile_for_pc(workspace, packages, work, drive.name)?;
        let mut simulator = Command::new(root.join("target/release/sonarfix-sketch"));
        simulator.arg(program).arg(root.join(drive.scenario)).args(drive.options);
        // Seeds that nothing was chosen on.
        simulator.args(["--seed", "9000", "--runs", "3", "--seconds", "400"]);
        let summary = output(&mut simulator).with_context(|| drive.name.to_owned())?;
        judge(drive.name, &summary)?;
    }
    Ok(())
}

fn compile_for_pc(
    workspace: &Path,
    packages: &Packages,
    work: &Path,
    name: &str,
) -> Result<PathBuf> {
    let program = work.join(name);
    let mut command = compiler(workspace, &packages.arduino, "g++", "", name, "host.cpp");
    command.arg(packages.c.join(format!("lib/{HOST}/libsonarfix.a"))).arg("-o").arg(&program);
    output(&mut command).with_context(|| name.to_owned())?;
    Ok(program)
}

fn judge(name: &str, summary: &str) -> Result<()> {
    let results: serde_json::Value = serde_json::from_str(summary)?;
    let number = |of: &str, key: &str| results[of][key].as_f64().context("no such result");
    let (lost, rms) = (number("program", "lost")?, number("program", "rms_along")?);
    let ratio = rms / number("firmware", "rms_along")?;
    println!("{name}: lost {lost}, RMS {ratio:.2} of the firmware's");
    ensure!(lost == 0.0, "{name} is lost");
    ensure!(ratio <= WORST_RATIO, "{name} is worse than the firmware");
    Ok(())
}
