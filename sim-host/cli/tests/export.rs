//! The command `sonarfix export`: files for other programs.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test should stop"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;

use crate::common::{self, Sonar};
use crate::skipped;

fn sonarfix(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.current_dir(dir).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// A folder with a log, its reference, map and robot.
fn recorded(sonar: Sonar) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let (log, reference) = common::recording(20, sonar);
    // On a clock that does not start at zero, with a malformed line at the end.
    let log = shifted(&log) + "range,none\n";
    fs::write(dir.path().join("log.csv"), log).unwrap();
    fs::write(dir.path().join("reference.csv"), shifted(&reference)).unwrap();
    fs::write(dir.path().join("map.toml"), common::MAP).unwrap();
    fs::write(dir.path().join("robot.toml"), common::ROBOT).unwrap();
    dir
}

/// The records of a log or reference, 1000 s later.
fn shifted(text: &str) -> String {
    let line = |line: &str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        let at = usize::from(fields[0].starts_with(char::is_alphabetic));
        if let Some(time) = fields.get(at).and_then(|time| time.parse::<f64>().ok())
            && line != "sonarfix-log,1"
        {
            fields[at] = (time + 1000.0).to_string();
        }
        fields.join(",") + "\n"
    };
    text.lines().map(line).collect()
}

/// A message: its time in nanoseconds, its fields, and its text.
type Message = (u64, Value, String);

/// A number of a message to the bit; the parser of `serde_json` may be off by its last one.
fn exact(text: &str, name: &str) -> f64 {
    let (_, after) = text.split_once(&format!("\"{name}\":")).unwrap();
    after.split([',', '}']).next().unwrap().parse().unwrap()
}

/// The messages of a file by topic; each has the fields that its schema requires.
fn messages(file: &Path) -> BTreeMap<String, Vec<Message>> {
    let bytes = fs::read(file).unwrap();
    let mut topics: BTreeMap<String, Vec<Message>> = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!(
            (schema.encoding.as_str(), message.channel.message_encoding.as_str()),
            ("jsonschema", "json")
        );
        let schema_text: Value = serde_json::from_slice(&schema.data).unwrap();
        assert_eq!(schema_text["title"], schema.name.as_str());
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        check(&value, &schema_text);
        let text = String::from_utf8(message.data.to_vec()).unwrap();
        let of_topic = topics.entry(message.channel.topic.clone()).or_default();
        of_topic.push((message.log_time, value, text));
    }
    topics
}

/// Checks a value against the keywords that the schemas use.
fn check(value: &Value, schema: &Value) {
    let is = |kind: &str| match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("{other}"),
    };
    let fits = match &schema["type"] {
        Value::String(kind) => is(kind),
        Value::Array(kinds) => kinds.iter().any(|kind| is(kind.as_str().unwrap())),
        other => panic!("{other}"),
    };
    assert!(fits, "{value} is not {}", schema["type"]);
    for required in schema["required"].as_array().into_iter().flatten() {
        let name = required.as_str().unwrap();
        check(&value[name], &schema["properties"][name]);
    }
    if let Some(fields) = value.as_object() {
        assert!(fields.keys().all(|name| schema["properties"].get(name).is_some()), "{value}");
    }
    for item in value.as_array().into_iter().flatten() {
        check(item, &schema["items"]);
    }
    if let Some(count) = schema["minItems"].as_u64() {
        assert_eq!(value.as_array().unwrap().len() as u64, count);
    }
}

/// The lines of a kind in a log, as their fields.
fn lines(log: &str, kind: &str) -> Vec<Vec<String>> {
    let fields = log.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    fields.filter(|fields| fields[0] == kind && fields.len() > 2).collect()
}

/// A cell of a CSV beside the value of a message: the digits of the cell.
fn same(cell: &str, value: &Value) -> bool {
    match value {
        Value::Null => cell.is_empty(),
        Value::String(text) => cell == text,
        _ => {
            let (of, value) = (cell.parse::<f64>().unwrap(), value.as_f64().unwrap());
            (of - value).abs() <= 0.6e-9 + 1e-8 * value.abs().min(1e-4)
        }
    }
}

#[test]
fn a_log_as_mcap_has_the_values_of_the_log_and_of_its_replay() {
    let dir = recorded(Sonar::Ranges);
    let dir = dir.path();
    sonarfix(dir, &["replay", "log.csv", "--trace", "trace.csv"]);
    sonarfix(dir, &["export", "log.csv", "--mcap", "log.mcap", "--parquet", "log.parquet"]);
    let topics = messages(&dir.join("log.mcap"));

    // The records of the log, at their times.
    let log = fs::read_to_string(dir.join("log.csv")).unwrap();
    for (kind, names) in
        [("ticks", ["time_s", "right", "left"]), ("range", ["time_s", "bearing_rad", "range_m"])]
    {
        let (lines, messages) = (lines(&log, kind), &topics[&format!("/log/{kind}")]);
        assert!(lines.len() == messages.len() && lines.len() >= 50, "{kind}");
        for (line, (time, _, text)) in lines.iter().zip(messages) {
            let values = names.map(|name| exact(text, name));
            let numbers: Vec<f64> = line[1..4].iter().map(|cell| cell.parse().unwrap()).collect();
            assert_eq!(
                values.map(f64::to_bits).as_slice(),
                numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>()
            );
            assert_eq!(*time, (numbers[0] * 1e9).round() as u64);
        }
    }
    assert_eq!(topics["/log/start"].len(), 1);

    // The replay, on the log's clock.
    let mut reader = csv::Reader::from_path(dir.join("trace.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let (mut instants, mut fixes, mut last) = (0, 0, String::new());
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    for row in &rows {
        let cells = || header.iter().zip(row);
        if row[0] != last {
            let (time, estimate, _) = &topics["/estimate"][instants];
            let state = cells()
                .filter(|(name, _)| !name.starts_with("fix_") && !name.starts_with("absolute_"));
            assert!(state.clone().all(|(name, cell)| same(cell, &estimate[name])), "{estimate}");
            let start = *time as f64 / 1e9 - estimate["time_s"].as_f64().unwrap();
            assert!((start - 1000.0).abs() < 1e-6, "{start}");
            let pose = &topics["/pose"][instants].1["pose"];
            assert_eq!(pose["position"]["x"], estimate["x_m"]);
            let (sin, cos) = ["z", "w"].map(|of| pose["orientation"][of].as_f64().unwrap()).into();
            let heading = estimate["heading_rad"].as_f64().unwrap();
            assert!((2.0 * f64::atan2(sin, cos) - heading).sin().abs() < 1e-12);
            let with = &topics["/pose/with_covariance"][instants].1["pose_covariance"];
            let sigma = estimate["sigma_y_m"].as_f64().unwrap();
            assert!((with[7].as_f64().unwrap() - sigma * sigma).abs() < 1e-18);
            instants += 1;
        }
        last = row[0].to_owned();
        if !row[35].is_empty() {
            let fix = &topics["/fix"][fixes].1;
            let of_fix = cells().filter(|(name, _)| name.starts_with("fix_"));
            assert!(of_fix.clone().all(|(name, cell)| same(cell, &fix[name])), "{fix}");
            fixes += 1;
        }
    }
    assert_eq!([instants, fixes], ["/estimate", "/fix"].map(|topic| topics[topic].len()));
    assert!(instants > 190 && fixes > 50, "{instants} {fixes}");
    assert_eq!(topics["/pose/true"].len(), topics["/pose/dead_reckoning"].len() - 1);
    assert_eq!(
        topics["/scene/map"][0].1["entities"][0]["lines"][0]["points"].as_array().unwrap().len(),
        8
    );
    assert_eq!(topics["/health"][0].1["message"], "tracking");
    read_by_python(dir, "log.mcap", &topics);

    // The trace exported gives the same messages, to the digits of the trace, and Parquet its cells.
    sonarfix(dir, &["export", "trace.csv", "--mcap", "trace.mcap", "--parquet", "trace.parquet"]);
    let traced = messages(&dir.join("trace.mcap"));
    for topic in ["/estimate", "/fix", "/pose", "/tf", "/scene/beam", "/scene/ellipse", "/health"] {
        assert_eq!(traced[topic].len(), topics[topic].len(), "{topic}");
    }
    for file in ["log.parquet", "trace.parquet"] {
        let read = parquet(&dir.join(file));
        assert_eq!(read.len(), rows.len());
        for (values, row) in read.iter().zip(&rows) {
            assert_eq!(values.len(), header.len());
            assert!(values.iter().zip(row).all(|(value, cell)| same(cell, value)), "{row:?}");
        }
    }
}

/// The rows of a Parquet file.
fn parquet(file: &Path) -> Vec<Vec<Value>> {
    let reader = SerializedFileReader::new(fs::File::open(file).unwrap()).unwrap();
    let rows = reader.get_row_iter(None).unwrap();
    let value = |field: &Field| match field {
        Field::Null => Value::Null,
        Field::Double(value) => (*value).into(),
        Field::Long(value) => (*value).into(),
        Field::Str(text) => text.as_str().into(),
        other => panic!("{other}"),
    };
    rows.map(|row| row.unwrap().get_column_iter().map(|(_, field)| value(field)).collect())
        .collect()
}

/// The notebook of `docs/exchange.md` reads a file, if Python and its packages are there.
fn read_by_python(dir: &Path, file: &str, topics: &BTreeMap<String, Vec<Message>>) {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import mcap, pandas"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        skipped::because(
            "Python with the packages mcap and pandas is not there (PYTHON names another)",
        );
        return;
    }
    let notebook = include_str!("../../../docs/exchange.ipynb");
    let notebook: Value = serde_json::from_str(notebook).unwrap();
    let code =
        notebook["cells"].as_array().unwrap().iter().filter(|cell| cell["cell_type"] == "code");
    let lines = code.flat_map(|cell| cell["source"].as_array().unwrap());
    let lines: Vec<&str> = lines.map(|line| line.as_str().unwrap().trim_end()).collect();
    let program = lines.join(
        "
",
    ) + "
";
    // Sums of what it read, in the order of the messages.
    let program = program
        + "print(json.dumps([topics, estimate[\"x_m\"].tolist(), \
           estimate[\"sigma_heading_rad\"].tolist(), fix[\"fix_wall\"].tolist()]))\n";
    let output = Command::new(&python)
        .current_dir(dir)
        .args(["-c", &program])
        .env("SONARFIX_MCAP", file)
        .env("SONARFIX_PARQUET", "log.parquet")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (topic, messages) in topics {
        assert_eq!(read[0][topic], messages.len(), "{topic}");
    }
    for (at, topic, name) in
        [(1, "/estimate", "x_m"), (2, "/estimate", "sigma_heading_rad"), (3, "/fix", "fix_wall")]
    {
        let values = topics[topic].iter().map(|(_, message, _)| message[name].clone());
        assert_eq!(read[at], values.collect::<Value>(), "{name}");
    }
}

#[test]
fn what_is_no_log_or_trace_is_refused_and_leaves_a_message() {
    let dir = recorded(Sonar::Silent);
    let dir = dir.path();
    let refused = |arguments: &[&str], expected: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        let output = command.current_dir(dir).arg("export").args(arguments).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && error.contains(expected), "{error}");
    };
    refused(&["log.csv"], "--mcap");
    refused(&["reference.csv", "--mcap", "x.mcap"], "the columns are not those of a trace");
    refused(&["map.toml", "--mcap", "x.mcap"], "map.toml");
    sonarfix(dir, &["replay", "log.csv", "--trace", "trace.csv"]);
    let trace = fs::read_to_string(dir.join("trace.csv")).unwrap();
    fs::write(dir.join("bad.csv"), trace.replacen("tracking", "tracking,0", 2)).unwrap();
    refused(&["bad.csv", "--parquet", "x.parquet"], "bad.csv");
    let log = fs::read_to_string(dir.join("log.csv")).unwrap().replace("start,1000", "start,-5");
    fs::write(dir.join("early.csv"), log + "ticks,1e9,x,x\n").unwrap();
    refused(&["early.csv", "--mcap", "x.mcap"], "MCAP holds times from 0");
}
