//! Prints the messages of a bag as JSON, one a line: for `xtask/bags/proof.py`, which compares them with those that another
//! program reads.

use std::io::{BufWriter, Write};
use std::path::Path;

use serde_json::{Value as Json, json};
use sonarfix_bags::bag::Bag;
use sonarfix_bags::decode::Value;
use sonarfix_bags::error::Defect;
use sonarfix_bags::message::{Message, Take};

/// Prints what it takes.
struct Printer<W: Write>(W);

impl<W: Write> Take for Printer<W> {
    fn wants(&self, _: &str, _: &str) -> bool {
        true
    }

    fn take(&mut self, message: &Message) -> Result<(), Defect> {
        let fields = match &message.value {
            Ok(value) => json(value),
            Err(why) => return Err(Defect::content(format!("message {}: {why}", message.number))),
        };
        let line = json!({
            "topic": message.topic.name, "type": message.topic.kind, "time": message.time, "fields": fields,
        });
        writeln!(self.0, "{line}")?;
        Ok(())
    }
}

fn json(value: &Value) -> Json {
    // JSON has no infinities.
    let number =
        |number: &f64| if number.is_finite() { json!(number) } else { json!(number.to_string()) };
    match value {
        Value::Number(value) => number(value),
        Value::Text(text) => json!(text),
        Value::Numbers(numbers) => numbers.iter().map(number).collect(),
        Value::List(values) => values.iter().map(json).collect(),
        Value::Message(fields, values) => {
            let fields = fields.iter().map(|field| field.name.clone());
            Json::Object(fields.zip(values.iter().map(json)).collect())
        }
    }
}

fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).ok_or_else(|| anyhow::anyhow!("name a bag"))?;
    let mut printer = Printer(BufWriter::new(std::io::stdout().lock()));
    Bag::open(Path::new(&path))?.read(&mut printer)?;
    printer.0.flush()?;
    Ok(())
}
