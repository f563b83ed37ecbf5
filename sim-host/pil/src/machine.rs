//! The supported microcontrollers, and one of them in QEMU.

use std::io::{self, BufReader, BufWriter, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use anyhow::{Context, ensure};
use clap::ValueEnum;
use sonarfix_pil::{Line, LineError};

use super::error::PilError;

/// The emulated processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Machine {
    /// None: this process answers alone.
    Host,
    /// Cortex-M4 with FPU.
    M4f,
    /// Cortex-M33 with FPU, as on the Pico 2.
    M33,
    /// Cortex-M3, in soft float.
    M3,
    /// Cortex-M0+, in soft float: its code on a Cortex-M3, because QEMU has no M0+ board with a
    /// timer and enough memory.
    M0plus,
    /// RISC-V of 32 bits (IMAC), in soft float, as on the ESP32-C6.
    Rv32,
}

/// The channel of the messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Carrier {
    /// Semihosting calls of the emulated program.
    Semihosting,
    /// The board's UART, of the machines M4F, M3 and M0+: 40 times slower.
    Uart,
}

/// The target and the board of an emulated program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Build {
    /// Target triple of rustc.
    triple: &'static str,
    /// The program of QEMU, and its Debian package.
    emulator: Qemu,
    /// Machine name of QEMU.
    board: &'static str,
}

/// A program of QEMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Qemu {
    name: &'static str,
    /// Its Debian package.
    package: &'static str,
    /// Options that all its machines need.
    options: &'static [&'static str],
}

const ARM: Qemu = Qemu { name: "qemu-system-arm", package: "qemu-system-arm", options: &[] };
/// The program contains all that runs: no firmware of the board starts before it.
const RISC_V: Qemu =
    Qemu { name: "qemu-system-riscv32", package: "qemu-system-misc", options: &["-bios", "none"] };

impl Qemu {
    const fn build(self, triple: &'static str, board: &'static str) -> Build {
        Build { triple, emulator: self, board }
    }
}

impl Machine {
    fn build(self) -> Option<Build> {
        match self {
            Self::Host => None,
            Self::M4f => Some(ARM.build("thumbv7em-none-eabihf", "mps2-an386")),
            Self::M33 => Some(ARM.build("thumbv8m.main-none-eabihf", "mps2-an505")),
            Self::M3 => Some(ARM.build("thumbv7m-none-eabi", "mps2-an385")),
            Self::M0plus => Some(ARM.build("thumbv6m-none-eabi", "mps2-an385")),
            Self::Rv32 => Some(RISC_V.build("riscv32imac-unknown-none-elf", "virt")),
        }
    }

    /// Starts it with this program, or with one that is built from the repository; none for the host.
    ///
    /// # Errors
    /// If the program cannot be built or started; with what to do.
    pub fn start(
        self,
        carrier: Carrier,
        program: Option<&Path>,
    ) -> anyhow::Result<Option<Emulator>> {
        let Some(build) = self.build() else { return Ok(None) };
        ensure!(
            carrier == Carrier::Semihosting || !matches!(self, Self::M33 | Self::Rv32),
            "the board of this machine has another UART: take m4f, m3 or m0plus"
        );
        let program = match program {
            Some(program) => program.to_owned(),
            None => build.program(carrier, &repository())?,
        };
        Emulator::start(build, carrier, &program).map(Some)
    }
}

/// The repository around this program, the current folder or the package that cargo runs: with `CARGO_TARGET_DIR` the program is
/// elsewhere. A released program has none, and contains no path of its build.
fn repository() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let places = [std::env::current_exe().ok(), std::env::current_dir().ok(), package];
    let folders = places.iter().flatten().flat_map(|place| place.ancestors());
    let mut repositories = folders.filter(|it| it.join("firmware/emulated/Cargo.toml").exists());
    repositories.next().unwrap_or(Path::new(".")).to_owned()
}

impl Build {
    /// Builds the program from the sources in the repository `root`.
    fn program(self, carrier: Carrier, root: &Path) -> anyhow::Result<PathBuf> {
        let sources = root.join("firmware/emulated");
        let Self { triple, .. } = self;
        let name = match carrier {
            Carrier::Semihosting => "pil",
            Carrier::Uart => "pil_uart",
        };
        // Optimized for size, as the firmware of the boards.
        let arguments =
            format!("build --package emulated-pil --bins --target {triple} --profile small");
        ensure!(
            sources.join("Cargo.toml").exists(),
            "there is no emulated program: its sources are not at {}. In a checkout of sonarfix of version {} run \
             `cd firmware/emulated && cargo {arguments}` and pass the program with `--firmware \
             firmware/emulated/target/{triple}/small/{name}`",
            sources.display(),
            env!("CARGO_PKG_VERSION"),
        );
        let chosen = std::env::var_os("CARGO_TARGET_DIR");
        let target = chosen.map_or_else(|| root.join("target"), |chosen| root.join(chosen));
        let target = target.join("emulated");
        let mut cargo = Command::new("cargo");
        cargo.args(arguments.split(' ')).arg("--quiet");
        cargo.current_dir(&sources).env("CARGO_TARGET_DIR", &target).env_remove("RUSTFLAGS");
        let status = cargo.status().context("cannot start cargo")?;
        ensure!(
            status.success(),
            "the emulated program cannot be built; is the target installed? `rustup target add {triple}`"
        );
        Ok(target.join(triple).join("small").join(name))
    }
}

/// Timeout of an answer of the emulator, wall-clock time.
const TIMEOUT: Duration = Duration::from_mins(1);

/// A running microcontroller.
#[derive(Debug)]
pub struct Emulator {
    line: Line<Pipe>,
    child: Arc<Mutex<Child>>,
    /// Number of answers.
    answers: Arc<AtomicU64>,
}

impl Emulator {
    fn start(build: Build, carrier: Carrier, program: &Path) -> anyhow::Result<Self> {
        ensure!(program.exists(), "there is no program {}", program.display());
        let Build { emulator, board, .. } = build;
        let mut qemu = Command::new(emulator.name);
        // An instruction takes 2⁷ ns of virtual time, so that the board's timer counts instructions.
        qemu.args(emulator.options);
        qemu.args([
            "-machine", board, "-icount", "shift=7", "-display", "none", "-monitor", "none",
        ]);
        qemu.args(["-semihosting-config", "enable=on,target=native"]);
        match carrier {
            Carrier::Semihosting => qemu.args(["-serial", "none"]),
            Carrier::Uart => {
                qemu.args(["-chardev", "stdio,id=line,signal=off", "-serial", "chardev:line"])
            }
        };
        qemu.arg("-kernel").arg(program).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = qemu.spawn().with_context(|| {
            let Qemu { name, package, .. } = emulator;
            format!("cannot start {name}; on Debian: `apt-get install {package}`")
        })?;
        let stdin = child.stdin.take().context("the emulator has no input")?;
        let stdout = child.stdout.take().context("the emulator has no output")?;
        let pipe = Pipe { input: BufWriter::new(stdin), output: BufReader::new(stdout) };
        let child = Arc::new(Mutex::new(child));
        let answers = Arc::new(AtomicU64::new(0));
        watch(Arc::downgrade(&child), Arc::clone(&answers));
        Ok(Self { line: Line(pipe), child, answers })
    }

    /// Sends a request.
    ///
    /// # Errors
    /// [`PilError::Emulator`].
    pub fn send_request(&mut self, request: &[u8]) -> Result<(), PilError> {
        self.line.send_request(request).map_err(|error| broken(&error))
    }

    /// Receives an answer and its number of instructions.
    ///
    /// # Errors
    /// [`PilError::Emulator`].
    pub fn receive_reply<'b>(&mut self, space: &'b mut [u8]) -> Result<(&'b [u8], u32), PilError> {
        let reply = self.line.receive_reply(space).map_err(|error| broken(&error))?;
        self.answers.fetch_add(1, Ordering::Relaxed);
        Ok(reply)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if let Ok(mut child) = self.child.lock() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn broken(error: &LineError<io::Error>) -> PilError {
    let hint = match error {
        LineError::Closed => " (it exited, or timed out after a minute)",
        _ => "",
    };
    PilError::Emulator(format!("the emulated microcontroller does not answer: {error}{hint}"))
}

/// Kills an emulator after the timeout, so that a hanging program does not block this process.
fn watch(child: Weak<Mutex<Child>>, answers: Arc<AtomicU64>) {
    std::thread::spawn(move || {
        let mut seen = None;
        loop {
            std::thread::sleep(TIMEOUT);
            let now = answers.load(Ordering::Relaxed);
            let Some(child) = child.upgrade() else { return };
            if seen.replace(now) == Some(now) {
                if let Ok(mut child) = child.lock() {
                    let _ = child.kill();
                }
                return;
            }
        }
    });
}

/// The console of an emulator.
#[derive(Debug)]
struct Pipe {
    input: BufWriter<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl embedded_io::ErrorType for Pipe {
    type Error = io::Error;
}

impl embedded_io::Read for Pipe {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.output.read(bytes)
    }
}

impl embedded_io::Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.input.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.input.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An installed command has no sources; its error has the commands that provide the program.
    #[test]
    fn without_sources_the_error_has_the_commands_to_run() {
        let build = Machine::M0plus.build().unwrap();
        let error = build.program(Carrier::Uart, Path::new("/nowhere")).unwrap_err().to_string();
        assert!(
            error.contains("`cd firmware/emulated && cargo build --package emulated-pil"),
            "{error}"
        );
        assert!(error.contains("--target thumbv6m-none-eabi --profile small`"), "{error}");
        let firmware = "--firmware firmware/emulated/target/thumbv6m-none-eabi/small/pil_uart`";
        assert!(error.contains(firmware), "{error}");
    }
}
