//! What hostile and slow clients of the page get.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sonarfix_live::connection::{MOST_ARRIVING, MOST_SEATS, PATIENCE};
use sonarfix_live::http::Request;
use sonarfix_live::ring::{CAPACITY, Ring};
use sonarfix_live::server::Server;
use sonarfix_telemetry::feed::Events as _;
use sonarfix_telemetry::order::Orders;

/// A server, its ring, its orders, and what every request to it needs.
fn page() -> (Arc<Ring>, Orders, String, String) {
    let ring = Arc::new(Ring::default());
    let (server, orders) = Server::start(0, Arc::clone(&ring)).unwrap();
    let url = server.address().to_owned();
    let (host, token) = url.strip_prefix("http://").unwrap().split_once("/#token=").unwrap();
    let headers = format!("Host: {host}\r\nAuthorization: Bearer {token}\r\n");
    (ring, orders, host.to_owned(), headers)
}

fn connected(host: &str) -> TcpStream {
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(6 * PATIENCE)).unwrap();
    stream
}

/// The status of the answer to a request; empty if the connection was closed without one.
fn status(host: &str, request: &str) -> String {
    let mut stream = connected(host);
    let mut answer = String::new();
    let _ = stream.write_all(request.as_bytes());
    let _ = stream.read_to_string(&mut answer);
    answer.split(' ').nth(1).unwrap_or_default().to_owned()
}

/// Whether the server has closed a connection.
fn is_closed(stream: &mut TcpStream) -> bool {
    stream.read(&mut [0; 64]).is_ok_and(|count| count == 0)
}

/// The body is one that programs might cut out differently.
#[test]
fn framing_is_strict() {
    for framing in [
        "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: identity\r\nContent-Length: 2\r\n",
        "Content-Length: 2\r\nContent-Length: 2\r\n",
        "Content-Length: +2\r\n",
        "Content-Length: 2, 2\r\n",
        "Content-Length : 2\r\n",
        "Content-Length:\r\n",
        "X: folded\r\n Content-Length: 2\r\n",
        "Content-Length: 1\r\n",
        "",
    ] {
        let request = format!("POST /order HTTP/1.1\r\n{framing}\r\n{{}}");
        assert!(Request::read(&mut request.as_bytes()).is_err(), "{framing}");
    }
    let request = "POST /order HTTP/1.1\r\nContent-Length: 2\r\n\r\n{}";
    assert_eq!(Request::read(&mut request.as_bytes()).unwrap().unwrap().body, b"{}");
}

#[test]
fn only_this_server_is_a_host_and_an_origin() {
    let (_ring, _orders, host, _) = page();
    let port = host.split_once(':').unwrap().1;
    let local = format!("localhost:{port}");
    let shell = |headers: &str| status(&host, &format!("GET / HTTP/1.1\r\n{headers}\r\n"));
    for host in [&host, &local] {
        assert_eq!(shell(&format!("Host: {host}\r\n")), "200");
        assert_eq!(shell(&format!("Host: {host}\r\nOrigin: http://{host}\r\n")), "200");
    }
    for other in ["127.0.0.1", "127.0.0.1:80", "localhost.", "[::1]", "evil.example"] {
        assert_eq!(shell(&format!("Host: {other}\r\n")), "403", "{other}");
        let host_with = format!("Host: {host}\r\nOrigin: http://{other}\r\n");
        assert_eq!(shell(&host_with), "403", "{other}");
    }
    for origin in [&format!("http://{local}"), &format!("https://{host}"), &host, "null", ""] {
        assert_eq!(shell(&format!("Host: {host}\r\nOrigin: {origin}\r\n")), "403", "{origin}");
    }
}

/// A client that sends a byte now and then is closed after the time of a whole request, in its head as in its body.
#[test]
fn a_client_that_sends_slowly_is_dropped() {
    let (_ring, _orders, host, headers) = page();
    let body = format!("POST /order HTTP/1.1\r\n{headers}Content-Length: 4000\r\n\r\n");
    let slow = |start: &str| {
        let mut stream = connected(&host);
        stream.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        stream.write_all(start.as_bytes()).unwrap();
        let begun = Instant::now();
        while begun.elapsed() < 3 * PATIENCE {
            let ended = stream.write_all(b"x").is_err() || is_closed(&mut stream);
            if ended {
                return begun.elapsed();
            }
        }
        begun.elapsed()
    };
    std::thread::scope(|scope| {
        let slow = &slow;
        let clients =
            ["GET / HTTP/1.1\r\nX: ", &body].map(|start| scope.spawn(move || slow(start)));
        for client in clients {
            let after = client.join().unwrap();
            assert!(after < 2 * PATIENCE, "closed after {after:?}");
        }
    });
}

/// Connections that say nothing do not keep a page out: the oldest of them gives way.
#[test]
fn silent_clients_keep_nobody_out() {
    let (ring, _orders, host, headers) = page();
    ring.push("{\"event\":1}");
    let mut events = connected(&host);
    events.write_all(format!("GET /events HTTP/1.1\r\n{headers}\r\n").as_bytes()).unwrap();
    events.read_exact(&mut [0; 12]).unwrap();
    let mut silent: Vec<TcpStream> = (0..4 * MOST_ARRIVING).map(|_| connected(&host)).collect();
    let shell = status(&host, &format!("GET / HTTP/1.1\r\n{headers}\r\n"));
    assert_eq!(shell, "200");
    assert!(silent.iter_mut().take(MOST_ARRIVING).all(is_closed), "the oldest are closed");
    ring.close();
    let mut text = String::new();
    events.read_to_string(&mut text).unwrap();
    assert!(text.contains("{\"event\":1}\n") && text.contains("\"end\""), "{text}");
}

/// A client that sends a byte each second, and connects again when it is closed.
fn slow_client(host: &str, number: u64, is_over: &AtomicBool) {
    let start: &[u8] = if number.is_multiple_of(2) { b"GET / HTTP/1.1\r\nX: " } else { b"" };
    let mut stream = None;
    // Not all in the same instant.
    std::thread::sleep(Duration::from_millis(number % 1000));
    while !is_over.load(Ordering::Relaxed) {
        let mut sender = stream.take().or_else(|| {
            let mut stream = TcpStream::connect(host).ok()?;
            stream.write_all(start).ok()?;
            Some(stream)
        });
        stream = sender.take_if(|stream| stream.write_all(b"x").is_ok());
        std::thread::sleep(Duration::from_secs(1));
    }
}

/// A thousand slow clients: a page that is open misses no event, and another one can be opened. `SONARFIX_CROWD=60` takes a
/// minute.
#[test]
fn a_thousand_slow_clients_disturb_no_page() {
    const CLIENTS: u64 = 1_000;
    let seconds = std::env::var("SONARFIX_CROWD").ok().map_or(3, |text| text.parse().unwrap());
    let (ring, _orders, host, headers) = page();
    let mut events = connected(&host);
    events.write_all(format!("GET /events HTTP/1.1\r\n{headers}\r\n").as_bytes()).unwrap();
    events.read_exact(&mut [0; 12]).unwrap();
    let is_over = AtomicBool::new(false);
    let (mut pushed, mut opened) = (0, 0);
    let text = std::thread::scope(|scope| {
        for number in 0..CLIENTS {
            let (host, is_over) = (&host, &is_over);
            scope.spawn(move || slow_client(host, number, is_over));
        }
        let reader = scope.spawn(move || {
            let mut text = String::new();
            events.read_to_string(&mut text).unwrap();
            text
        });
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(seconds) {
            for _ in 0..10 {
                ring.push(&format!("{{\"event\":{pushed}}}"));
                pushed += 1;
                std::thread::sleep(Duration::from_millis(20));
            }
            assert_eq!(status(&host, &format!("GET / HTTP/1.1\r\n{headers}\r\n")), "200");
            opened += 1;
        }
        ring.close();
        is_over.store(true, Ordering::Relaxed);
        reader.join().unwrap()
    });
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("{\"event\"")).collect();
    let expected: Vec<String> = (0..pushed).map(|event| format!("{{\"event\":{event}}}")).collect();
    assert_eq!(lines, expected);
    assert!(opened > 0 && pushed > 0);
    println!("{CLIENTS} slow clients, {seconds} s: {opened} pages opened, {pushed} events read");
}

/// With the token there are at most so many; one that has ended makes room.
#[test]
fn the_pages_are_limited() {
    let (_ring, _orders, host, headers) = page();
    let request = format!("GET /events HTTP/1.1\r\n{headers}\r\n");
    let seated: Vec<TcpStream> = (0..MOST_SEATS)
        .map(|_| {
            let mut stream = connected(&host);
            stream.write_all(request.as_bytes()).unwrap();
            stream.read_exact(&mut [0; 12]).unwrap();
            stream
        })
        .collect();
    assert_eq!(status(&host, &request), "503");
    drop(seated);
    let begun = Instant::now();
    let other = format!("GET /none HTTP/1.1\r\n{headers}\r\n");
    while status(&host, &other) != "404" {
        assert!(begun.elapsed() < 6 * PATIENCE, "no room again");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// A reader that is too slow gets the number of the events that it has missed, and the next one after them.
#[test]
fn dropped_events_are_counted() {
    let ring = Ring::default();
    let line = "x".repeat(CAPACITY / 4);
    for _ in 0..4 {
        ring.push(&line);
    }
    assert_eq!(ring.next(0, Duration::ZERO).missed, 0);
    ring.push(&line);
    let batch = ring.next(0, Duration::ZERO);
    assert_eq!((batch.missed, batch.lines.len(), batch.next), (1, 4, 5));
    for _ in 0..3 {
        ring.push(&line);
    }
    let batch = ring.next(2, Duration::ZERO);
    assert_eq!((batch.missed, batch.lines.len(), batch.next), (2, 4, 8));
}

/// A reader does not wait while there are events, and the last batch of many is the end.
#[test]
fn events_that_wait_are_returned_at_once() {
    let ring = Ring::default();
    for _ in 0..600 {
        ring.push("x");
    }
    let begun = Instant::now();
    let batch = ring.next(0, 6 * PATIENCE);
    assert!(begun.elapsed() < PATIENCE, "waited {:?}", begun.elapsed());
    ring.close();
    let again = ring.next(0, Duration::ZERO);
    assert_eq!((again.lines.len(), again.is_end), (batch.lines.len(), false));
    let rest = ring.next(batch.next, Duration::ZERO);
    assert_eq!((rest.next, rest.is_end), (600, true));
}

/// The page reads the number in an event before the others.
#[test]
fn missed_events_are_reported_to_the_page() {
    let (ring, _orders, host, headers) = page();
    let line = "x".repeat(CAPACITY / 4);
    for _ in 0..6 {
        ring.push(&line);
    }
    ring.close();
    let mut stream = connected(&host);
    stream.write_all(format!("GET /events HTTP/1.1\r\n{headers}\r\n").as_bytes()).unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let body = text.split_once("\r\n\r\n").unwrap().1;
    assert!(body.starts_with("{\"kind\":\"missed\",\"count\":2}\nxxx"), "{}", &body[..60]);
}
