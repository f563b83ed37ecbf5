//! The live page: who may read and command, that frames are forwarded at once, and that its memory is bounded.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test should stop"
)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};
use sonarfix_link::message::Odometry;
use sonarfix_link::{
    Command as Order, CommandResult, Estimate, Receiver, Reporter, Sender, Session, SessionCommand,
    Telemetry, frame,
};
use sonarfix_live::ring::{CAPACITY, Ring};
use sonarfix_live::server::Server;
use sonarfix_sim::trace::{
    AbsoluteRecord, FixRecord, GyroEstimate, Hypothesis, Outcome, Pose, SearchRecord, Tick, Trace,
    Wall,
};

use sonarfix_telemetry::feed::{Events as _, Feed, Scene, Status};
use sonarfix_telemetry::order::{Orders, Reply};

use crate::chromium;
use crate::skipped;

/// After this a test fails instead of waiting forever; nothing is asserted about it.
const PATIENCE: Duration = Duration::from_mins(1);

/// A server with its ring, its orders, its address and its token.
struct Page {
    ring: Arc<Ring>,
    orders: Orders,
    host: String,
    token: String,
    url: String,
}

fn page() -> Page {
    let ring = Arc::new(Ring::default());
    let (server, orders) = Server::start(0, Arc::clone(&ring)).unwrap();
    let url = server.address().to_owned();
    let (host, token) = parts(&url);
    Page { ring, orders, host, token, url }
}

/// Host and token of an address.
fn parts(url: &str) -> (String, String) {
    let (host, token) = url.strip_prefix("http://").unwrap().split_once("/#token=").unwrap();
    (host.to_owned(), token.to_owned())
}

/// The answer to a request, up to the end of the connection.
fn asked(host: &str, request: &str) -> String {
    let mut stream = sent(host, request);
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

fn sent(host: &str, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    stream
}

fn get(path: &str, headers: &[String]) -> String {
    format!("GET {path} HTTP/1.1\r\n{}\r\n\r\n", headers.join("\r\n"))
}

fn post(body: &str, headers: &[String]) -> String {
    let length = body.len();
    let headers = headers.join("\r\n");
    format!("POST /order HTTP/1.1\r\n{headers}\r\nContent-Length: {length}\r\n\r\n{body}")
}

#[test]
fn only_a_page_of_this_server_with_the_token_reads_and_commands() {
    let Page { ring, orders, host, token, .. } = page();
    ring.push("{\"secret\":1}");
    ring.close();
    let own = format!("Host: {host}");
    let local = format!("Host: {}", host.replace("127.0.0.1", "localhost"));
    let with = format!("Authorization: Bearer {token}");
    let wrong = format!("Authorization: Bearer {}", "0".repeat(token.len()));
    let origin = format!("Origin: http://{host}");
    let other = "Origin: http://127.0.0.1:1".to_owned();
    let rebound = format!("Host: rebound.example:{}", host.split_once(':').unwrap().1);
    let order = "{\"order\":\"stop\"}";

    // The page itself holds no data.
    let shell = asked(&host, &get("/", std::slice::from_ref(&own)));
    assert!(shell.starts_with("HTTP/1.1 200 ") && !shell.contains("secret"));
    assert!(!shell.contains(&token));
    let events = asked(&host, &get("/events", &[own.clone(), with.clone()]));
    assert!(events.contains("{\"secret\":1}\n{\"kind\":\"end\"}\n"), "{events}");
    for headers in [vec![local, with.clone()], vec![own.clone(), with.clone(), origin.clone()]] {
        assert!(asked(&host, &get("/events?from=0", &headers)).contains("secret"));
    }

    let refused: [(&str, Vec<String>); 7] = [
        ("401", vec![own.clone()]),
        ("401", vec![own.clone(), wrong]),
        ("401", vec![own.clone(), with.clone(), with.clone()]),
        ("403", vec![own.clone(), with.clone(), other.clone()]),
        ("403", vec![own.clone(), with.clone(), "Origin: null".to_owned()]),
        ("403", vec![rebound, with.clone()]),
        ("403", vec![with.clone()]),
    ];
    for (status, headers) in &refused {
        for request in [get("/events", headers), post(order, headers)] {
            let answer = asked(&host, &request);
            assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request}\n{answer}");
            assert!(!answer.contains("secret") && !answer.contains("Access-Control"), "{answer}");
        }
    }
    // The question of a browser whether a page of another origin may send the token.
    let preflight = format!(
        "OPTIONS /order HTTP/1.1\r\n{own}\r\n{other}\r\nAccess-Control-Request-Headers: authorization\r\n\r\n"
    );
    let answer = asked(&host, &preflight);
    assert!(answer.starts_with("HTTP/1.1 403 ") && !answer.contains("Access-Control"), "{answer}");
    assert!(orders.next().is_none(), "a refused order was passed on");

    let answers = thread::spawn(move || {
        let ordered = orders.wait(PATIENCE).unwrap();
        let command = ordered.order.command();
        ordered.answer(Reply::done("stopped"));
        command
    });
    let answer = asked(&host, &post(order, &[own, with, origin]));
    assert!(answer.ends_with("{\"done\":true,\"text\":\"stopped\"}"), "{answer}");
    assert_eq!(answers.join().unwrap(), Some(Order::Stop));
}

#[test]
fn malformed_requests_and_orders_are_refused() {
    let Page { orders, host, token, .. } = page();
    let own = format!("Host: {host}\r\nAuthorization: Bearer {token}");
    for request in [
        "no request\r\n\r\n".to_owned(),
        format!("GET / HTTP/1.1\r\nHost: {host}\r\nX: {}\r\n\r\n", "x".repeat(20_000)),
        format!("POST /order HTTP/1.1\r\n{own}\r\nContent-Length: 99999\r\n\r\n"),
        format!("POST /order HTTP/1.1\r\n{own}\r\nContent-Length: -1\r\n\r\n"),
        format!("POST /order HTTP/1.1\r\n{own}\r\nContent-Length: 2\r\n\r\n{{}}more"),
        format!("POST /order HTTP/1.1\r\n{own}\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"),
    ] {
        // What is left unread may reset the connection before its answer is read.
        let mut answer = String::new();
        let _ = sent(&host, &request).read_to_string(&mut answer);
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 400 "), "{request}\n{answer}");
    }
    for body in ["", "{}", "{\"order\":\"explode\"}", "{\"order\":\"set_pose\",\"x\":1}"] {
        let answer = asked(&host, &post(body, std::slice::from_ref(&own)));
        assert!(answer.contains("this is no order"), "{body}\n{answer}");
    }
    assert!(orders.next().is_none());
    let answer = asked(&host, &get("/etc/passwd", &[own]));
    assert!(answer.starts_with("HTTP/1.1 404 "), "{answer}");
}

#[test]
fn the_ring_keeps_the_latest_events_and_counts_what_a_slow_reader_missed() {
    let ring = Ring::default();
    let line = |number: usize| format!("{number:09}{}", "x".repeat(991));
    let count = 3 * CAPACITY / 1_000;
    for number in 0..count {
        ring.push(&line(number));
        assert!(ring.bytes() <= CAPACITY);
    }
    ring.close();
    let (mut next, mut missed, mut read) = (0, 0, Vec::new());
    loop {
        let batch = ring.next(next, Duration::ZERO);
        missed += batch.missed;
        next = batch.next;
        read.extend(batch.lines);
        if batch.is_end {
            break;
        }
    }
    assert_eq!(usize::try_from(missed).unwrap() + read.len(), count);
    assert_eq!(read.first().unwrap().as_ref(), line(count - read.len()));
    assert_eq!(read.last().unwrap().as_ref(), line(count - 1));
    assert!(read.len() > CAPACITY / 1_001, "{} events", read.len());
}

/// A robot's end of a connection to `sonarfix monitor`.
struct Wire {
    stream: TcpStream,
    sender: Sender<Telemetry>,
}

impl Wire {
    fn send(&mut self, telemetry: &Telemetry) {
        let mut buffer = frame::EMPTY;
        self.stream.write_all(self.sender.frame(telemetry, &mut buffer)).unwrap();
    }

    /// The wheel travel and the estimate of a tick of 100 ms.
    fn tick(&mut self, number: u32) {
        let at = Instant::from_ticks(u64::from(number) * 100_000);
        let metres = f64::from(number) * 0.02;
        let step = Odometry { at, right_metres: metres, left_metres: metres };
        self.send(&Telemetry::Odometry(step));
        self.send(&Telemetry::Estimate(estimate(at)));
    }
}

fn estimate(at: Instant) -> Estimate {
    let state = StateEstimate { x: Metres(1.25), y: Metres(0.5), ..StateEstimate::default() };
    let deviation = StandardDeviations {
        x: Metres(0.01),
        y: Metres(0.02),
        heading: Radians(0.03),
        ..StandardDeviations::default()
    };
    match Reporter::resume(at, state, deviation).1 {
        Telemetry::Initialized(estimate) => estimate,
        other => panic!("{other:?}"),
    }
}

/// `sonarfix monitor --serve` on a socket, and the robot's end of it.
struct Monitored {
    child: Child,
    robot: Wire,
    host: String,
    token: String,
    errors: BufReader<std::process::ChildStderr>,
}

impl Drop for Monitored {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn monitored(further: &[&str], dir: &Path) -> Monitored {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let mut child = monitor(&port, further, dir);
    let (stream, _) = listener.accept().unwrap();
    stream.set_nodelay(true).unwrap();
    let mut errors = BufReader::new(child.stderr.take().unwrap());
    let (host, token) = printed(&mut errors).unwrap();
    Monitored { child, robot: Wire { stream, sender: Sender::new() }, host, token, errors }
}

/// `sonarfix monitor --serve` on a port.
fn monitor(port: &str, further: &[&str], dir: &Path) -> Child {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sonarfix"))
        .args(["monitor", "--port", port, "--serve"])
        .args(further)
        .current_dir(dir)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Nobody reads the lines that it prints.
    let mut lines = child.stdout.take().unwrap();
    thread::spawn(move || std::io::copy(&mut lines, &mut std::io::sink()));
    child
}

/// Host and token of the address that was printed; `None` if it was an error.
fn printed(errors: &mut impl BufRead) -> Option<(String, String)> {
    let mut line = String::new();
    errors.read_line(&mut line).unwrap();
    line.trim().strip_prefix("open ").map(parts)
}

/// The firmware that is flashed, in an emulator: the page shows it and passes on a command, which it refuses without a map.
#[test]
#[ignore = "needs the firmware: cargo xtask test-firmware"]
fn the_emulated_firmware_is_on_the_page() {
    let elf = std::env::var("SONARFIX_FIRMWARE").expect("run `cargo xtask test-firmware`");
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let emulator = Command::new("qemu-system-arm")
        .args(["-machine", "netduinoplus2", "-display", "none"])
        .args(["-icount", "shift=0,sleep=off", "-monitor", "none", "-kernel", &elf])
        // USART1 is not connected; the link is USART2.
        .args(["-serial", "null", "-serial", &format!("tcp:{free},server=on,wait=on")])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("is qemu-system-arm installed?");
    let mut emulator = Ended(emulator);
    let dir = tempfile::tempdir().unwrap();
    let (_monitor, (host, token)) = loop {
        let mut child = Ended(monitor(&format!("tcp:{free}"), &[], dir.path()));
        let mut errors = BufReader::new(child.0.stderr.take().unwrap());
        if let Some(page) = printed(&mut errors) {
            break (child, page);
        }
        // The emulator does not listen yet.
        child.0.wait().unwrap();
        assert!(emulator.0.try_wait().unwrap().is_none(), "the emulator has ended");
        thread::sleep(Duration::from_millis(100));
    };
    let mut seen = events(&host, &token).filter_map(|event| {
        let lines = event["status"]["lines"].as_array()?;
        lines.iter().find_map(|line| Some(line.as_str()?.strip_prefix("robot   ")?.to_owned()))
    });
    let hello = seen.find(|line| line != "none yet").unwrap();
    assert!(hello.contains("map missing"), "{hello}");
    let headers = [format!("Host: {host}"), format!("Authorization: Bearer {token}")];
    let answer = asked(&host, &post("{\"order\":\"start\"}", &headers));
    assert!(answer.contains("the robot refuses: "), "{answer}");
}

/// A process that is ended when it is dropped.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The events of a page.
fn events(host: &str, token: &str) -> impl Iterator<Item = Value> + use<> {
    let headers = [format!("Host: {host}"), format!("Authorization: Bearer {token}")];
    let stream = sent(host, &get("/events", &headers));
    let lines = BufReader::new(stream).lines().map(Result::unwrap);
    lines.skip_while(|line| !line.is_empty()).filter_map(|line| serde_json::from_str(&line).ok())
}

/// The time of an encoder tick.
fn tick_time(event: &Value) -> Option<f64> {
    event["columns"]["ticks"]["time"][0].as_f64()
}

/// The robot sends the next tick only after the page has the last one. So no frame waits for another one, for a further read, or
/// for a timer: the delay is that of one read, one write and one picture of the screen.
#[test]
fn every_frame_is_forwarded_before_the_next_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let mut monitored = monitored(&[], dir.path());
    let mut events = events(&monitored.host, &monitored.token);
    monitored.robot.send(&Telemetry::Initialized(estimate(Instant::from_ticks(0))));
    for number in 1..=50 {
        monitored.robot.tick(number);
        let expected = f64::from(number) * 0.1;
        let arrived = events.find(|event| tick_time(event).is_some_and(|t| t > expected - 0.05));
        let time = tick_time(&arrived.unwrap()).unwrap();
        assert!((time - expected).abs() < 1e-6, "{time} s instead of {expected} s");
    }
}

/// Half an hour at full telemetry, and another one: the second adds nothing.
#[test]
fn half_an_hour_of_telemetry_does_not_grow_the_memory() {
    const HALF_HOUR: u32 = 30 * 60 * 10;
    let dir = tempfile::tempdir().unwrap();
    let mut monitored = monitored(&[], dir.path());
    let id = monitored.child.id();
    let peak = || -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
        line.split_ascii_whitespace().nth(1)?.parse().ok()
    };
    if peak().is_none() {
        skipped::because("the memory of the live page: this system has no /proc");
        return;
    }
    let mut events = events(&monitored.host, &monitored.token);
    let mut robot = Wire {
        stream: monitored.robot.stream.try_clone().unwrap(),
        sender: std::mem::take(&mut monitored.robot.sender),
    };
    let mut at_end_of = |half: u32| {
        let ticks = (half - 1) * HALF_HOUR + 1..=half * HALF_HOUR;
        let last = f64::from(half * HALF_HOUR) * 0.1;
        thread::scope(|scope| {
            scope.spawn(|| ticks.for_each(|number| robot.tick(number)));
            let arrived = events.find(|event| tick_time(event).is_some_and(|t| t > last - 0.05));
            assert!(arrived.is_some(), "the page did not see {last} s");
        });
        peak().unwrap()
    };
    let first = at_end_of(1);
    let second = at_end_of(2);
    assert!(second <= first + 1_024, "{first} KiB after one half hour, {second} KiB after two");
    let bound = u64::try_from(CAPACITY / 1_024).unwrap() + 40_000;
    assert!(second < bound, "{second} KiB");
}

/// A page sets the pose of a robot, and records it.
#[test]
fn a_page_commands_and_records_the_robot() {
    let dir = tempfile::tempdir().unwrap();
    let mut monitored = monitored(&[], dir.path());
    let mut stream = monitored.robot.stream.try_clone().unwrap();
    let answers = thread::spawn(move || {
        let mut receiver = Receiver::<SessionCommand>::new();
        let (mut session, mut done) = (Session::default(), Vec::new());
        let mut buffer = [0; 256];
        let mut sender = Sender::<Telemetry>::starting_at(9_000);
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            for frame in buffer[..count].iter().filter_map(|&byte| receiver.push(byte)) {
                let ack = session.answer(&frame, 5, |order| {
                    done.push(*order);
                    CommandResult::Done
                });
                let mut buffer = frame::EMPTY;
                stream.write_all(sender.frame(&ack, &mut buffer)).unwrap();
            }
        }
        done
    });
    let headers =
        [format!("Host: {}", monitored.host), format!("Authorization: Bearer {}", monitored.token)];
    let host = monitored.host.clone();
    let order = |body: &str| asked(&host, &post(body, &headers));
    let set = "{\"order\":\"set_pose\",\"x\":1.5,\"y\":-2,\"heading\":0.5,\"position_deviation\":0.05,\"heading_deviation\":0.1}";
    assert!(order(set).ends_with("{\"done\":true,\"text\":\"done\"}"));
    assert!(order("{\"order\":\"start\"}").ends_with("{\"done\":true,\"text\":\"done\"}"));
    let tap = "{\"order\":\"position\",\"x\":1,\"y\":2,\"deviation\":0.1}";
    assert!(order(tap).ends_with("{\"done\":true,\"text\":\"done\"}"));
    assert!(order("{\"order\":\"speed\",\"factor\":2}").contains("\"done\":false"));

    let answer = order("{\"order\":\"record\",\"on\":true}");
    let file = answer.split("recording ").nth(1).unwrap().trim_end_matches("\"}").to_owned();
    monitored.robot.send(&Telemetry::Initialized(estimate(Instant::from_ticks(0))));
    monitored.robot.tick(1);
    let mut seen = events(&monitored.host, &monitored.token);
    seen.find(|event| tick_time(event).is_some_and(|time| time > 0.05)).unwrap();
    let answer = order("{\"order\":\"record\",\"on\":false}");
    assert!(answer.contains(&format!("recorded {file}")), "{answer}");
    let log = std::fs::read_to_string(dir.path().join(file)).unwrap();
    let is_whole =
        log.contains("\nwheels,0.100000,0.02,0.02\n# checksum ") && log.ends_with("\n# end\n");
    assert!(is_whole, "{log}");

    monitored.robot.stream.shutdown(std::net::Shutdown::Both).unwrap();
    let done = answers.join().unwrap();
    let [Order::SetPose(start), Order::Start, Order::Absolute { age, measurement }] = done[..]
    else {
        panic!("{done:?}")
    };
    let noise = PositionNoise::circular(Metres(0.1));
    let tapped = AbsoluteMeasurement::Position { point: Point::new(1.0, 2.0), noise };
    assert_eq!((age.ticks(), measurement), (0, tapped));
    assert_eq!((start.pose.x, start.pose.y), (Metres(1.5), Metres(-2.0)));
}

/// Ctrl-C: the last telemetry, and where the recording is.
#[cfg(unix)]
#[test]
fn an_interruption_ends_with_a_summary() {
    let dir = tempfile::tempdir().unwrap();
    let mut monitored = monitored(&["--record", "run.csv"], dir.path());
    monitored.robot.send(&Telemetry::Initialized(estimate(Instant::from_ticks(0))));
    monitored.robot.tick(1);
    let mut seen = events(&monitored.host, &monitored.token);
    seen.find(|event| tick_time(event).is_some_and(|time| time > 0.05)).unwrap();
    let id = monitored.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(monitored.child.wait().unwrap().code(), Some(130));
    let mut rest = String::new();
    monitored.errors.read_to_string(&mut rest).unwrap();
    assert!(rest.contains("recorded run.csv"), "{rest}");
    assert!(dir.path().join("run.csv").exists());
}

/// A robot between two walls.
fn scene() -> Scene {
    let wall = |name: &str, from, to| Wall { name: name.into(), from, to };
    Scene {
        title: "A <b>robot</b>".into(),
        source: "robot",
        commands: true,
        cone: 0.26,
        track: 0.12,
        walls: vec![
            wall("south </script>", [0.0, 0.0], [4.0, 0.0]),
            wall("north", [0.0, 3.0], [4.0, 3.0]),
        ],
        obstacles: Vec::new(),
        ..Scene::default()
    }
}

/// A page with something of everything, after which its stream ends.
fn filled() -> Page {
    let page = page();
    let feed = Feed::new(page.ring.clone());
    feed.scene(&scene());
    for number in 0..200_u32 {
        let time = f64::from(number) * 0.1;
        let x = 0.5 + 0.015 * f64::from(number);
        let pose = Pose { x, y: 1.0 + 0.2 * (time * 0.5).sin(), heading: 0.1 * time.cos() };
        let mut estimate = sonarfix_sim::trace::Estimate { pose, ..Default::default() };
        estimate.deviation = [0.01, 0.02 + 0.005 * time.sin(), 0.03, 0.01, 0.01, 0.002, 0.01];
        estimate.calibration.track_width = 0.12;
        let odometry = Pose { y: pose.y + 0.01 * time, ..pose };
        let slips = number / 70;
        estimate.gyro =
            Some(GyroEstimate { bias: 0.02 * (0.2 * time).tanh(), deviation: 0.001, slips });
        feed.tick(&Tick { time, truth: None, estimate, bound: None, odometry });
        if number.is_multiple_of(9) {
            feed.absolute(&outside(time, pose, number));
        }
        feed.wheels(time, 0.015 * f64::from(number), 0.0149 * f64::from(number));
        if number.is_multiple_of(5) {
            feed.fix(&fix(time, [x, pose.y], number));
        }
    }
    let hypothesis = |x, weight| Hypothesis { pose: Pose { x, y: 2.0, heading: 1.0 }, weight };
    let search = SearchRecord {
        time: 19.9,
        is_provisional: true,
        hypotheses: vec![hypothesis(1.0, 1.0), hypothesis(3.0, 0.2)],
        pings: Vec::new(),
        lines: Vec::new(),
    };
    feed.search(&search, "2 poses fit");
    feed.status(&Status {
        time: 19.9,
        longest_poll: Some(0.0015),
        deadlines: Some(2),
        lines: vec!["robot   1.2.3, started by power on".into()],
        hints: vec!["the left encoder counts nothing".into()],
        recording: None,
    });
    feed.notice("a notice");
    feed.end();
    page
}

/// A pose from outside; every third is an outlier.
fn outside(time: f64, pose: Pose, number: u32) -> AbsoluteRecord {
    let is_outlier = number.is_multiple_of(27);
    let aside = if is_outlier { 0.9 } else { 0.03 * time.sin() };
    AbsoluteRecord {
        time,
        position: Some([pose.x, pose.y + aside]),
        heading: Some(pose.heading + aside),
        outcome: if is_outlier { Outcome::Gated } else { Outcome::Accepted },
        reason: String::new(),
        nis: Some(if is_outlier { 90.0 } else { time.cos().powi(2) }),
    }
}

fn fix(time: f64, sonar: [f64; 2], number: u32) -> FixRecord {
    let is_gated = number.is_multiple_of(25);
    FixRecord {
        ranger: 0,
        time,
        wall: Some(1),
        sonar,
        direction: std::f64::consts::FRAC_PI_2,
        bearing: 1.5,
        range: Some(if is_gated { 0.8 } else { 3.0 - sonar[1] }),
        source: None,
        why: None,
        outcome: if is_gated { Outcome::Gated } else { Outcome::Accepted },
        association: Some(0.97),
        reason: String::new(),
        innovation: Some(if is_gated { -0.9 } else { 0.004 * f64::from(number).sin() }),
        innovation_variance: Some(1e-5),
    }
}

/// What the page shows of [`filled`].
const SHOWN: [&str; 14] = [
    "A &lt;b&gt;robot&lt;/b&gt;",
    "tracking</b>",
    "19.9 s",
    "0.970",
    "2 poses fit",
    "the left encoder counts nothing",
    "a notice",
    ">ended<",
    "missed <",
    "1.145°/s ± 0.057°/s",
    "slips <",
    "0.1 s ago, 3.47 m,",
    ", north, accepted",
    "verdict tracking",
];

#[test]
fn the_page_draws_without_an_error() {
    let Page { url, orders, .. } = filled();
    for flags in [&["--window-size=1300,1500"][..], &["--window-size=400,1800"]] {
        let Some(dom) = chromium::opened_until(&url, flags, &SHOWN) else { return };
        chromium::assert_ready(&dom);
        chromium::picture(&url, "live", flags);
        for text in SHOWN {
            assert!(dom.contains(text), "the page does not show {text}: {dom}");
        }
        // The token is no longer in the address, and nothing of the map became markup.
        assert!(!dom.contains("<b>robot"));
    }
    assert!(orders.next().is_none());
}

/// Before the first estimate the page shows the map, and what the estimate waits for.
#[test]
fn a_page_without_an_estimate_says_what_it_waits_for() {
    for (hints, needs) in [
        (vec!["the loop is stopped: start it".to_owned()], "the loop is stopped: start it"),
        (Vec::new(), "needs a robot that sends, a pose (Set pose) and a loop that runs (Start)"),
    ] {
        let Page { url, ring, orders: _orders, .. } = page();
        let feed = Feed::new(ring);
        feed.scene(&scene());
        let lines = vec!["robot   1.2.3".to_owned()];
        let (time, longest_poll, deadlines, recording) = (0.0, None, None, None);
        feed.status(&Status { time, longest_poll, deadlines, lines, hints, recording });
        feed.end();
        let label = format!("aria-label=\"waiting for the first estimate: {needs}\"");
        let shown = [label.as_str(), ">waiting for the first estimate</b>", ">ended<"];
        let flags = ["--window-size=400,1800"];
        let Some(dom) = chromium::opened_until(&url, &flags, &shown) else { return };
        chromium::assert_ready(&dom);
        chromium::picture(&url, "live-waiting", &flags);
        for text in shown {
            assert!(dom.contains(text), "the page does not show {text}: {dom}");
        }
    }
}

/// A run beside is shown at the same time since its start: the robot's clock is at 1000 s when the run begins.
#[test]
fn another_run_is_shown_beside_at_the_same_time() {
    let Page { url, ring, orders: _orders, .. } = page();
    let feed = Feed::new(ring);
    let at = |time, verdict| {
        let deviation = [0.01; 7];
        let estimate = sonarfix_sim::trace::Estimate { verdict, deviation, ..Default::default() };
        Tick { time, truth: None, estimate, bound: None, odometry: Pose::default() }
    };
    let other = Trace {
        walls: scene().walls,
        ticks: (0..100).map(|n| at(f64::from(n) * 0.1, Verdict::Degraded)).collect(),
        ..Trace::default()
    };
    feed.beside("yesterday <b>.csv", &other).unwrap();
    feed.scene(&scene());
    for n in 0..50 {
        feed.tick(&at(1000.0 + f64::from(n) * 0.1, Verdict::Tracking));
    }
    feed.end();
    let shown = [
        ">Beside: yesterday &lt;b&gt;.csv<",
        ">4.9 s of 9.9 s, degraded<",
        "Verdict: 0 tracking, 1 degraded, 2 lost: verdict tracking, beside degraded\"",
        ">ended<",
    ];
    for flags in [&["--window-size=1300,1500"][..], &["--window-size=400,1800"]] {
        let Some(dom) = chromium::opened_until(&url, flags, &shown) else { return };
        chromium::assert_ready(&dom);
        chromium::picture(&url, "live-beside", flags);
        for text in shown {
            assert!(dom.contains(text), "the page does not show {text}: {dom}");
        }
    }
}

/// A page of another origin, with the token: its script can neither read nor command.
#[test]
fn a_page_of_another_origin_is_refused_by_a_browser() {
    let Page { host, token, orders, .. } = filled();
    let script = format!(
        "<p id=\"result\"></p><script>
        const authorization = {{ Authorization: 'Bearer {token}' }};
        const tries = [
          fetch('http://{host}/events', {{ headers: authorization }}),
          fetch('http://{host}/'),
          fetch('http://{host}/order', {{ method: 'POST', headers: authorization, body: '{{\"order\":\"stop\"}}' }}),
          fetch('http://{host}/order', {{ method: 'POST', mode: 'no-cors', body: '{{\"order\":\"stop\"}}' }})
            .then((answer) => {{ if (answer.type === 'opaque') throw 0; return answer; }}),
        ];
        Promise.all(tries.map((one) => one.then((answer) => answer.text(), () => 'unreadable')))
          .then((all) => {{ document.getElementById('result').textContent = all.join(' ');
            document.title = 'decided'; }});
        </script>"
    );
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/", listener.local_addr().unwrap());
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let _ = stream.read(&mut [0; 4096]);
            let length = script.len();
            let head =
                format!("HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {length}");
            let _ = write!(stream, "{head}\r\nConnection: close\r\n\r\n{script}");
        }
    });
    let all = "<p id=\"result\">unreadable unreadable unreadable unreadable</p>";
    let Some(dom) = chromium::opened_until(&url, &[], &["<title>decided<"]) else { return };
    assert!(dom.contains(all), "{dom}");
    assert!(orders.next().is_none(), "a page of another origin has commanded");
}
