//! Requests and answers of HTTP/1.1, one per connection.

use std::io::{self, ErrorKind, Read, Write};

/// Most bytes of a request line with its headers.
const MOST_HEAD: usize = 16 << 10;
/// Most headers of a request.
const MOST_HEADERS: usize = 64;
/// Most bytes of a request's body.
const MOST_BODY: usize = 4 << 10;

/// In every answer: nothing is stored, framed, guessed or loaded from elsewhere.
const HEADERS: &str = "Connection: close\r\n\
    Cache-Control: no-store\r\n\
    Referrer-Policy: no-referrer\r\n\
    X-Content-Type-Options: nosniff\r\n\
    X-Frame-Options: DENY\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
    connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n";

/// A request.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Request {
    /// GET, POST …
    pub method: String,
    /// Path and query.
    pub target: String,
    /// Names in lower case, and values.
    headers: Vec<(String, String)>,
    /// The body.
    pub body: Vec<u8>,
}

impl Request {
    /// Reads a request. `None` if the connection was closed before one.
    ///
    /// # Errors
    /// Errors of the connection; [`ErrorKind::InvalidData`] if it is malformed or too long.
    pub fn read(from: &mut impl Read) -> io::Result<Option<Self>> {
        let mut bytes = Vec::new();
        let mut buffer = [0; 4096];
        loop {
            let count = from.read(&mut buffer)?;
            if count == 0 {
                return if bytes.is_empty() { Ok(None) } else { Err(malformed()) };
            }
            bytes.extend(buffer.iter().take(count));
            let parsed = Self::parse(&bytes)?;
            if parsed.as_ref().map_or(bytes.len(), |(_, head)| *head) > MOST_HEAD {
                return Err(malformed());
            }
            if let Some((mut request, head)) = parsed {
                request.body = bytes.split_off(head);
                request.read_body(from)?;
                return Ok(Some(request));
            }
        }
    }

    /// The request without its body, and the length of its head; `None` if it is incomplete.
    fn parse(bytes: &[u8]) -> io::Result<Option<(Self, usize)>> {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut parsed = httparse::Request::new(&mut headers);
        let Ok(status) = parsed.parse(bytes) else { return Err(malformed()) };
        let httparse::Status::Complete(head) = status else { return Ok(None) };
        let text = |value: &[u8]| String::from_utf8_lossy(value).into_owned();
        let headers = parsed.headers.iter();
        let headers = headers.map(|of| (of.name.to_ascii_lowercase(), text(of.value))).collect();
        let (method, target) = (parsed.method.unwrap_or_default(), parsed.path.unwrap_or_default());
        let request =
            Self { method: method.into(), target: target.into(), headers, body: Vec::new() };
        Ok(Some((request, head)))
    }

    fn read_body(&mut self, from: &mut impl Read) -> io::Result<()> {
        let length = match self.header("content-length") {
            None => 0,
            Some(text) if text.bytes().all(|byte| byte.is_ascii_digit()) => {
                text.parse().map_err(|_| malformed())?
            }
            Some(_) => return Err(malformed()),
        };
        // Two lengths, or pieces of unknown length, are read differently by different programs.
        if length > MOST_BODY || self.header("transfer-encoding").is_some() {
            return Err(malformed());
        }
        let missing = length.checked_sub(self.body.len()).ok_or_else(malformed)?;
        Read::by_ref(from).take(missing as u64).read_to_end(&mut self.body)?;
        if self.body.len() == length { Ok(()) } else { Err(malformed()) }
    }

    /// The value of a header that occurs once, by its name in lower case.
    #[must_use]
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(of, _)| of == name);
        let (_, value) = found.next()?;
        // Which of two values counts is undefined: a value that matches nothing.
        Some(if found.next().is_some() { "?" } else { value })
    }
}

fn malformed() -> io::Error {
    io::Error::new(ErrorKind::InvalidData, "the request is malformed or too long")
}

/// Writes an answer.
///
/// # Errors
/// Errors of the connection.
pub fn answer(to: &mut impl Write, status: &str, kind: &str, body: &str) -> io::Result<()> {
    let length = body.len();
    write!(
        to,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADERS}\r\n{body}"
    )?;
    to.flush()
}

/// Writes the head of an answer that ends with the connection.
///
/// # Errors
/// Errors of the connection.
pub fn begin(to: &mut impl Write, kind: &str) -> io::Result<()> {
    write!(to, "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\n{HEADERS}\r\n")?;
    to.flush()
}
