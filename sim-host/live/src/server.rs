//! Connections of pages.
//!
//! | request | answer |
//! |---|---|
//! | `GET /` | the page |
//! | `GET /events?from=N` | the events from number N on, a line of JSON each, until the program ends |
//! | `POST /order` | an order as JSON; the answer as JSON |

use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use sonarfix_telemetry::order::{Ordered, Orders, Reply};

use crate::access::{Access, Refusal};
use crate::connection::{Connections, PATIENCE, Timed};
use crate::http::{self, Request};
use crate::page::{self, Connection};
use crate::ring::Ring;

/// Time for a robot to answer a command: all attempts of the command and of its session.
const ANSWER: Duration = Duration::from_secs(10);
/// Most orders that wait.
const MOST_ORDERS: usize = 16;

const TEXT: &str = "text/plain; charset=utf-8";

/// A server of the page; it ends with the program.
#[derive(Debug)]
pub struct Server {
    address: String,
}

/// What a connection needs.
struct Shared {
    access: Access,
    ring: Arc<Ring>,
    orders: SyncSender<Ordered>,
    connections: Connections,
}

impl Server {
    /// Starts to listen on a port of the loopback address; 0 for any free one.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn start(port: u16, ring: Arc<Ring>) -> anyhow::Result<(Self, Orders)> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port));
        let listener =
            listener.with_context(|| format!("--serve: cannot listen on port {port}"))?;
        let address = listener.local_addr()?;
        let access = Access::new(address)?;
        let (orders, received) = sync_channel(MOST_ORDERS);
        let url = format!("http://{address}/#token={}", access.token());
        let shared = Arc::new(Shared { access, ring, orders, connections: Connections::default() });
        thread::spawn(move || accept(&listener, &shared));
        Ok((Self { address: url }, Orders::new(received)))
    }

    /// The address of the page, with the token after `#`, which a browser does not send.
    #[must_use]
    pub fn address(&self) -> &str {
        &self.address
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for (number, stream) in (0..).zip(listener.incoming()) {
        let Ok(stream) = stream else { continue };
        if shared.connections.arrive(number, &stream).is_err() {
            continue;
        }
        let shared = Arc::clone(shared);
        thread::spawn(move || {
            // An error here is that of a page which has gone.
            let _ = serve(stream, number, &shared);
            shared.connections.leave(number);
        });
    }
}

fn serve(stream: TcpStream, number: u64, shared: &Shared) -> io::Result<()> {
    let mut connection = Timed::new(stream)?;
    let read = Request::read(&mut connection);
    connection.restart();
    let request = match read {
        Ok(Some(request)) => request,
        Ok(None) => return Ok(()),
        Err(error) if error.kind() == ErrorKind::InvalidData => {
            return http::answer(&mut connection, "400 Bad Request", TEXT, &error.to_string());
        }
        Err(error) => return Err(error),
    };
    let (path, query) = request.target.split_once('?').unwrap_or((&request.target, ""));
    let checked = match path {
        "/" => shared.access.page(&request),
        _ => shared.access.data(&request),
    };
    if let Err(refusal) = checked {
        return refuse(&mut connection, refusal);
    }
    if path == "/" && request.method == "GET" {
        let page = page::html(&Connection::SERVER);
        return http::answer(&mut connection, "200 OK", "text/html; charset=utf-8", &page);
    }
    let Some(_seat) = shared.connections.seat(number) else {
        let text = "too many pages are open";
        return http::answer(&mut connection, "503 Service Unavailable", TEXT, text);
    };
    match (request.method.as_str(), path) {
        ("GET", "/events") => {
            let from = query.strip_prefix("from=").and_then(|number| number.parse().ok());
            events(&mut connection, &shared.ring, from.unwrap_or(0))
        }
        ("POST", "/order") => {
            let reply = order(&request.body, &shared.orders);
            let json = serde_json::to_string(&reply).unwrap_or_default();
            connection.restart();
            http::answer(&mut connection, "200 OK", "application/json", &json)
        }
        _ => http::answer(&mut connection, "404 Not Found", TEXT, "there is nothing here"),
    }
}

fn refuse(connection: &mut Timed, refusal: Refusal) -> io::Result<()> {
    let (status, reason) = match refusal {
        Refusal::Host => ("403 Forbidden", "this server has another name"),
        Refusal::Origin => ("403 Forbidden", "pages of other origins have no access"),
        Refusal::Token => ("401 Unauthorized", "open the address that the program has printed"),
    };
    http::answer(connection, status, TEXT, reason)
}

/// Writes events as they arrive, until the end or until the page has gone.
fn events(connection: &mut Timed, ring: &Ring, from: u64) -> io::Result<()> {
    http::begin(connection, "application/x-ndjson")?;
    let mut from = from;
    loop {
        let batch = ring.next(from, PATIENCE);
        let mut text = String::new();
        if batch.missed > 0 {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{{\"kind\":\"missed\",\"count\":{}}}", batch.missed);
        }
        for line in &batch.lines {
            text.push_str(line);
            text.push('\n');
        }
        if batch.is_end {
            text.push_str("{\"kind\":\"end\"}\n");
        }
        if text.is_empty() {
            // An empty line shows whether the page is still there.
            text.push('\n');
        }
        connection.restart();
        connection.write_all(text.as_bytes())?;
        if batch.is_end {
            return Ok(());
        }
        from = batch.next;
    }
}

/// Passes an order on and waits for its answer.
fn order(body: &[u8], orders: &SyncSender<Ordered>) -> Reply {
    let order = match serde_json::from_slice(body) {
        Ok(order) => order,
        Err(error) => return Reply::refused(&format!("this is no order: {error}")),
    };
    let (sender, answer) = sync_channel(1);
    if orders.try_send(Ordered::new(order, sender)).is_err() {
        return Reply::refused("too many orders wait for their answers");
    }
    answer.recv_timeout(ANSWER).unwrap_or_else(|_| Reply::refused("no answer"))
}
