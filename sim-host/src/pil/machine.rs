//! Which microcontrollers there are, and one of them in QEMU.

use std::io::{self, BufReader, BufWriter, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use anyhow::{Context, ensure};
use clap::ValueEnum;
use sonarfix_pil::{Line, LineError};

use super::pair::PilError;

/// Whose instructions are emulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Machine {
    /// None: only this process answers.
    Host,
    /// Cortex-M4 with FPU.
    M4f,
    /// Cortex-M33 with FPU, as on the Pico 2.
    M33,
    /// Cortex-M3, in soft float.
    M3,
    /// Cortex-M0+, in soft float: its instructions, which a Cortex-M3 runs as they are. QEMU has no
    /// M0+ with a counter and enough memory.
    M0plus,
}

/// What carries the messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Carrier {
    /// Calls of the host by the emulated program.
    Semihosting,
    /// The board's UART, for the machines but M33: 40 times slower.
    Uart,
}

/// How an emulated program is built, and where it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Build {
    /// As rustc calls it.
    triple: &'static str,
    /// As QEMU calls it.
    board: &'static str,
}

impl Machine {
    fn build(self) -> Option<Build> {
        match self {
            Self::Host => None,
            Self::M4f => Some(Build { triple: "thumbv7em-none-eabihf", board: "mps2-an386" }),
            Self::M33 => Some(Build { triple: "thumbv8m.main-none-eabihf", board: "mps2-an505" }),
            Self::M3 => Some(Build { triple: "thumbv7m-none-eabi", board: "mps2-an385" }),
            Self::M0plus => Some(Build { triple: "thumbv6m-none-eabi", board: "mps2-an385" }),
        }
    }

    /// Starts it with this program, or with one that is built first from the sources beside this
    /// one; none for the host.
    ///
    /// # Errors
    /// What cannot be built or started, and what to do.
    pub fn start(
        self,
        carrier: Carrier,
        program: Option<&Path>,
    ) -> anyhow::Result<Option<Emulator>> {
        let Some(build) = self.build() else { return Ok(None) };
        ensure!(
            carrier == Carrier::Semihosting || self != Self::M33,
            "the UART of the board with a Cortex-M33 is elsewhere: take another machine"
        );
        let program = match program {
            Some(program) => program.to_owned(),
            None => build.program(carrier)?,
        };
        Emulator::start(build.board, carrier, &program).map(Some)
    }
}

impl Build {
    /// Builds the program.
    fn program(self, carrier: Carrier) -> anyhow::Result<PathBuf> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let bench = root.join("bench");
        ensure!(
            bench.join("Cargo.toml").exists(),
            "the emulated program's sources are not at {}: give it with --firmware",
            bench.display()
        );
        let chosen = std::env::var_os("CARGO_TARGET_DIR");
        let target = chosen.map_or_else(|| root.join("target"), |chosen| root.join(chosen));
        let target = target.join("bench");
        let Self { triple, .. } = self;
        let mut cargo = Command::new("cargo");
        cargo.args(["build", "--quiet", "--package", "bench-pil", "--bins", "--target", triple]);
        // As the firmware is built that ships: for size.
        cargo.args(["--profile", "small"]);
        cargo.current_dir(&bench).env("CARGO_TARGET_DIR", &target).env_remove("RUSTFLAGS");
        let status = cargo.status().context("cannot start cargo")?;
        ensure!(
            status.success(),
            "the emulated program cannot be built; is the target there? `rustup target add {triple}`"
        );
        let name = match carrier {
            Carrier::Semihosting => "pil",
            Carrier::Uart => "pil_uart",
        };
        Ok(target.join(triple).join("small").join(name))
    }
}

/// How long the emulator may be silent, on this computer's clock, before it is given up.
const PATIENCE: Duration = Duration::from_mins(1);

/// A running microcontroller.
#[derive(Debug)]
pub struct Emulator {
    line: Line<Pipe>,
    child: Arc<Mutex<Child>>,
    /// Answers so far.
    answers: Arc<AtomicU64>,
}

impl Emulator {
    fn start(board: &str, carrier: Carrier, program: &Path) -> anyhow::Result<Self> {
        ensure!(program.exists(), "there is no program {}", program.display());
        let mut qemu = Command::new("qemu-system-arm");
        // 2⁷ ns pass with every instruction, so that the board's timer counts instructions.
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
        let mut child = qemu.spawn().context(
            "cannot start qemu-system-arm; on Debian: `apt-get install qemu-system-arm`",
        )?;
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
    pub fn ask(&mut self, request: &[u8]) -> Result<(), PilError> {
        self.line.ask(request).map_err(|error| broken(&error))
    }

    /// Takes the reply: an answer, and how many instructions it took.
    ///
    /// # Errors
    /// [`PilError::Emulator`].
    pub fn replied<'b>(&mut self, space: &'b mut [u8]) -> Result<(&'b [u8], u32), PilError> {
        let replied = self.line.replied(space).map_err(|error| broken(&error))?;
        self.answers.fetch_add(1, Ordering::Relaxed);
        Ok(replied)
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
        LineError::Closed => " (it ended, or said nothing for a minute)",
        _ => "",
    };
    PilError::Emulator(format!("the emulated microcontroller does not answer: {error}{hint}"))
}

/// Ends an emulator that has not answered for long: a program that hangs would hang us.
fn watch(child: Weak<Mutex<Child>>, answers: Arc<AtomicU64>) {
    std::thread::spawn(move || {
        let mut seen = None;
        loop {
            std::thread::sleep(PATIENCE);
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

/// Both ends of an emulator's console.
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
