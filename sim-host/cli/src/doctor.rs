//! `sonarfix doctor`: what this computer has of what the commands and the guide use.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Serialize;
use serial2::SerialPort;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Nothing that is missing is needed to simulate, to replay or to check files."
)]
pub struct Args {
    /// Prints JSON.
    #[arg(long)]
    json: bool,
}

/// A program that a command or the guide starts.
struct Tool {
    /// Its names, of which one is enough.
    names: &'static [&'static str],
    /// What it is for.
    purpose: &'static str,
    /// How to get it.
    remedy: &'static str,
}

const TOOLS: [Tool; 8] = [
    Tool {
        names: &["cargo"],
        purpose: "building the firmware",
        remedy: "install Rust from https://rustup.rs",
    },
    Tool {
        names: &["flip-link"],
        purpose: "building the firmware",
        remedy: "cargo install flip-link --locked",
    },
    Tool {
        names: &["probe-rs"],
        purpose: "flashing over a debug probe",
        remedy: "cargo install probe-rs-tools --locked",
    },
    Tool {
        names: &["picotool"],
        purpose: "flashing a Pico over USB",
        remedy: "install it from https://github.com/raspberrypi/picotool",
    },
    Tool {
        names: &["espflash"],
        purpose: "flashing an ESP32 over USB",
        remedy: "cargo install espflash --locked",
    },
    Tool {
        names: &["qemu-system-arm"],
        purpose: "`pil` on an emulated Arm core",
        remedy: "install QEMU; on Debian: apt install qemu-system-arm",
    },
    Tool {
        names: &["qemu-system-riscv32"],
        purpose: "`pil` on an emulated RISC-V core",
        remedy: "install QEMU; on Debian: apt install qemu-system-misc",
    },
    Tool {
        names: &["firefox", "chromium", "chromium-browser", "google-chrome", "chrome", "open"],
        purpose: "reports and the live page",
        remedy: "install a browser, or open the files on another computer",
    },
];

const NO_PERMISSION: &str =
    "no permission: sudo usermod -aG dialout $USER, then log in again (on Arch the group is uucp)";

/// A program on this computer.
#[derive(Debug, Serialize)]
struct FoundTool {
    name: &'static str,
    purpose: &'static str,
    /// What it answers to `--version`; `None` if it is missing.
    version: Option<String>,
    /// How to get it, if it is missing.
    remedy: Option<&'static str>,
}

/// A serial port of this computer.
#[derive(Debug, Serialize)]
struct FoundPort {
    name: String,
    /// Why it cannot be opened, and what to do; `None` if nothing is known against it.
    problem: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct Findings {
    version: &'static str,
    system: &'static str,
    processor: &'static str,
    tools: Vec<FoundTool>,
    ports: Vec<FoundPort>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let findings = Findings {
        version: env!("CARGO_PKG_VERSION"),
        system: std::env::consts::OS,
        processor: std::env::consts::ARCH,
        tools: TOOLS.iter().map(found).collect(),
        ports: ports(),
    };
    if args.json {
        println!("{}", serde_json::to_string_pretty(&findings)?);
    } else {
        print(&findings);
    }
    Ok(())
}

fn print(findings: &Findings) {
    let Findings { version, system, processor, tools, ports } = findings;
    println!("sonarfix {version}, {system}, {processor}\n\nPrograms");
    for FoundTool { name, purpose, version, remedy } in tools {
        let found = version.as_deref().unwrap_or("missing");
        println!("  {name:<20} {found:<28} for {purpose}");
        if let Some(remedy) = remedy {
            println!("  {:<20} {remedy}", "");
        }
    }
    println!("\nSerial ports");
    if ports.is_empty() {
        println!("  none: is the robot connected with a cable that has data lines?");
    }
    for FoundPort { name, problem } in ports {
        println!("  {name:<20} {}", problem.unwrap_or("can be opened"));
    }
}

fn found(tool: &Tool) -> FoundTool {
    let answer = |name: &&'static str| Some((*name, version(name)?));
    let found = tool.names.iter().find_map(answer);
    FoundTool {
        name: found
            .as_ref()
            .map_or_else(|| tool.names.first().copied().unwrap_or_default(), |it| it.0),
        purpose: tool.purpose,
        remedy: found.is_none().then_some(tool.remedy),
        version: found.map(|(_, version)| version),
    }
}

/// The version in the first line of what a program answers to `--version`; `None` if it cannot be started.
fn version(name: &str) -> Option<String> {
    let output = Command::new(name).arg("--version").stdin(Stdio::null()).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let words = text.lines().next().unwrap_or_default().split_whitespace();
    let is_number =
        |word: &&str| word.trim_start_matches('v').starts_with(|it: char| it.is_ascii_digit());
    let number = words.clone().find(is_number).map(|it| it.trim_end_matches(','));
    Some(number.unwrap_or("present").to_owned())
}

/// The serial ports of this computer, sorted.
fn ports() -> Vec<FoundPort> {
    let mut names = SerialPort::available_ports().unwrap_or_default();
    names.sort();
    let found = |name: PathBuf| {
        let problem = (!is_permitted(&name)).then_some(NO_PERMISSION);
        FoundPort { name: name.display().to_string(), problem }
    };
    names.into_iter().map(found).collect()
}

/// Whether this user may read and write a port. It is not opened, which would reset some boards.
fn is_permitted(port: &Path) -> bool {
    let may = |what: &str| Command::new("test").arg(what).arg(port).status();
    // Without the command `test`, as on Windows, every user may.
    ["-r", "-w"].iter().all(|what| may(what).map_or(true, |status| status.success()))
}
