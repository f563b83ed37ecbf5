//! What the link of a virtual robot is connected to: a pseudo-terminal, and a socket of this computer.
//!
//! Both are one line, like two plugs of one cable: what either sends arrives, and telemetry goes to both. Nothing waits for a
//! program that does not read: what has no room is lost, as on a UART.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
#[cfg(unix)]
use std::path::{Path, PathBuf};

use anyhow::Context;
#[cfg(unix)]
use nix::fcntl::{FcntlArg, OFlag, fcntl};
#[cfg(unix)]
use nix::pty::{OpenptyResult, openpty};
#[cfg(unix)]
use nix::sys::termios::{self, FlushArg, SetArg};
#[cfg(unix)]
use nix::unistd::ttyname;

/// The ends of the line.
#[derive(Debug, Default)]
pub struct Ports {
    #[cfg(unix)]
    terminal: Option<Terminal>,
    socket: Option<Socket>,
}

impl Ports {
    /// Opens a pseudo-terminal, and a symbolic link to it if one is named; returns the name of the terminal.
    ///
    /// # Errors
    /// If either cannot be made; an existing symbolic link is replaced, and no other file.
    #[cfg(unix)]
    pub fn open_terminal(&mut self, link: Option<&Path>) -> anyhow::Result<String> {
        let terminal = Terminal::open(link)?;
        let name = terminal.name.clone();
        self.terminal = Some(terminal);
        Ok(name)
    }

    /// Listens on this port of 127.0.0.1; returns the address. 0: on a free one.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn listen(&mut self, port: u16) -> anyhow::Result<SocketAddr> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .with_context(|| format!("cannot listen on port {port}"))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        self.socket = Some(Socket { listener, client: None });
        Ok(address)
    }

    /// The bytes that have arrived.
    ///
    /// # Errors
    /// If the pseudo-terminal fails. A client of the socket that fails is gone.
    pub fn receive(&mut self) -> anyhow::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        #[cfg(unix)]
        if let Some(terminal) = &mut self.terminal {
            read(&mut terminal.master, &mut bytes).context("the pseudo-terminal")?;
        }
        if let Some(socket) = &mut self.socket {
            socket.receive(&mut bytes);
        }
        Ok(bytes)
    }

    /// Sends bytes to whoever reads.
    pub fn send(&mut self, bytes: &[u8]) {
        #[cfg(unix)]
        if let Some(terminal) = &mut self.terminal {
            terminal.send(bytes);
        }
        if let Some(client) = self.socket.as_mut().and_then(|socket| socket.client.as_mut()) {
            // A client that is gone is noticed by the next reading.
            let _ = client.write(bytes);
        }
    }
}

/// Reads what is there; whether more may come.
fn read(from: &mut impl Read, bytes: &mut Vec<u8>) -> io::Result<bool> {
    let mut buffer = [0; 1024];
    loop {
        match from.read(&mut buffer) {
            Ok(0) => return Ok(false),
            Ok(count) => bytes.extend_from_slice(buffer.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(true),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// A socket with at most one client: a new one takes the place of the one before.
#[derive(Debug)]
struct Socket {
    listener: TcpListener,
    client: Option<TcpStream>,
}

impl Socket {
    fn receive(&mut self, bytes: &mut Vec<u8>) {
        if let Ok((client, _)) = self.listener.accept() {
            let is_ready = client.set_nonblocking(true).and_then(|()| client.set_nodelay(true));
            self.client = is_ready.is_ok().then_some(client);
        }
        self.client.take_if(|client| !read(client, bytes).unwrap_or(false));
    }
}

/// A pseudo-terminal, of which the other end is open here as well, so that it stays as it was set while no program has it open.
#[cfg(unix)]
#[derive(Debug)]
struct Terminal {
    master: std::fs::File,
    other_end: std::os::fd::OwnedFd,
    name: String,
    link: Option<PathBuf>,
}

#[cfg(unix)]
impl Terminal {
    fn open(link: Option<&Path>) -> anyhow::Result<Self> {
        let reason = "cannot open a pseudo-terminal";
        let OpenptyResult { master, slave: other_end } = openpty(None, None).context(reason)?;
        let name = ttyname(&other_end).context(reason)?.display().to_string();
        // Without the line discipline of a person's terminal, which would echo telemetry as commands.
        let mut settings = termios::tcgetattr(&other_end).context(reason)?;
        termios::cfmakeraw(&mut settings);
        termios::tcsetattr(&other_end, SetArg::TCSANOW, &settings).context(reason)?;
        fcntl(&master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).context(reason)?;
        if let Some(link) = link {
            replace(link, &name)
                .with_context(|| format!("cannot make the link {}", link.display()))?;
        }
        Ok(Self { master: master.into(), other_end, name, link: link.map(Path::to_owned) })
    }

    fn send(&mut self, bytes: &[u8]) {
        let is_sent = self.master.write(bytes).is_ok_and(|count| count == bytes.len());
        if !is_sent {
            // Nobody reads: what waits is old, and makes room for what comes. It fails for a terminal that is gone, which the
            // next reading notices.
            let _ = termios::tcflush(&self.other_end, FlushArg::TCIFLUSH);
        }
    }
}

/// Makes a symbolic link, in place of an old one.
#[cfg(unix)]
fn replace(link: &Path, target: &str) -> io::Result<()> {
    if link.symlink_metadata().is_ok_and(|file| file.is_symlink()) {
        std::fs::remove_file(link)?;
    }
    std::os::unix::fs::symlink(target, link)
}

#[cfg(unix)]
impl Drop for Terminal {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // It may have been removed already.
            let _ = std::fs::remove_file(link);
        }
    }
}
