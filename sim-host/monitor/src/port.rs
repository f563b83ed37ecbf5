//! A connection to a robot: serial port, socket or file.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use serial2::SerialPort;

/// Timeout of a read, so that the reader can check the time.
const TIMEOUT: Duration = Duration::from_millis(100);

/// Timeout of a connection to a socket.
const CONNECTION: Duration = Duration::from_secs(5);

/// A connection to a robot.
pub struct Port {
    reader: Box<dyn Read + Send>,
    writer: Option<Box<dyn Write + Send>>,
}

impl Port {
    /// Opens a port by its name: `-` for the standard input, `tcp:HOST:PORT` for a socket, else a
    /// path, of a serial port (`/dev/ttyUSB0`, `COM3`), a FIFO or a recorded file.
    ///
    /// # Errors
    /// If it cannot be opened; with the name.
    pub fn open(name: &str, baud: u32) -> anyhow::Result<Self> {
        let port = if name == "-" {
            Ok(Self { reader: Box::new(io::stdin()), writer: None })
        } else if let Some(address) = name.strip_prefix("tcp:") {
            Self::socket(address)
        } else if is_plain(Path::new(name)) {
            Self::recorded(name)
        } else {
            Self::serial(name, baud)
        };
        port.with_context(|| format!("cannot open the port {name}"))
    }

    fn recorded(name: &str) -> io::Result<Self> {
        let mut file = File::open(name)?;
        // A FIFO cannot be read twice.
        if file.metadata()?.is_file() && is_text(&mut file)? {
            let reason =
                "it is a text file, not the bytes of a robot; `sonarfix replay` reads logs";
            return Err(io::Error::new(ErrorKind::InvalidData, reason));
        }
        Ok(Self { reader: Box::new(file), writer: None })
    }

    fn socket(address: &str) -> io::Result<Self> {
        let mut stream = Err(io::Error::new(ErrorKind::InvalidInput, "the host has no address"));
        for address in address.to_socket_addrs()? {
            stream = TcpStream::connect_timeout(&address, CONNECTION);
            if stream.is_ok() {
                break;
            }
        }
        let stream = stream?;
        stream.set_read_timeout(Some(TIMEOUT))?;
        let writer = stream.try_clone()?;
        Ok(Self { reader: Box::new(stream), writer: Some(Box::new(writer)) })
    }

    fn serial(name: &str, baud: u32) -> io::Result<Self> {
        let mut port = SerialPort::open(name, baud)?;
        port.set_read_timeout(TIMEOUT)?;
        let writer = port.try_clone()?;
        Ok(Self { reader: Box::new(port), writer: Some(Box::new(writer)) })
    }

    /// Whether bytes can be sent.
    #[must_use]
    pub fn can_send(&self) -> bool {
        self.writer.is_some()
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// Errors of the port, or if it is read-only.
    pub fn send(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let writer = self.writer.as_mut();
        let writer = writer.context("this port can only be read: give a serial port or tcp:…")?;
        writer.write_all(bytes).and_then(|()| writer.flush()).context("cannot send to the port")
    }

    /// Reads bytes to the end, or until `take` breaks. After a timeout `take` gets an empty slice.
    ///
    /// # Errors
    /// Errors of the port or of `take`.
    pub fn read<B>(
        &mut self,
        mut take: impl FnMut(&[u8]) -> anyhow::Result<ControlFlow<B>>,
    ) -> anyhow::Result<Option<B>> {
        let mut buffer = [0; 4096];
        loop {
            let count = match self.reader.read(&mut buffer) {
                Ok(0) => return Ok(None),
                Ok(count) => count,
                Err(error) if is_silence(error.kind()) => 0,
                Err(error) => return Err(error).context("cannot read from the port"),
            };
            if let ControlFlow::Break(found) = take(buffer.get(..count).unwrap_or_default())? {
                return Ok(Some(found));
            }
        }
    }
}

fn is_silence(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// Whether a file starts like a text: every frame ends with a zero, which no text contains.
fn is_text(file: &mut File) -> io::Result<bool> {
    let mut start = Vec::new();
    Read::by_ref(file).take(4096).read_to_end(&mut start)?;
    file.rewind()?;
    let is_utf8 = match std::str::from_utf8(&start) {
        Ok(_) => true,
        // The last character may be cut off.
        Err(error) => error.error_len().is_none(),
    };
    Ok(!start.is_empty() && !start.contains(&0) && is_utf8)
}

/// Whether a path is a file or a FIFO, not a device.
fn is_plain(path: &Path) -> bool {
    let Ok(metadata) = path.metadata() else {
        return false;
    };
    #[cfg(unix)]
    let is_fifo = std::os::unix::fs::FileTypeExt::is_fifo(&metadata.file_type());
    #[cfg(not(unix))]
    let is_fifo = false;
    metadata.is_file() || is_fifo
}
