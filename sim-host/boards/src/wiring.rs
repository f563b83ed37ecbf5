//! The wiring of a robot: each part beside the board, with its pins.

use std::fmt::Write;

use crate::{Board, Bus};

/// The rangers in a drawing.
#[derive(Debug, Clone, Copy)]
pub struct Rangers {
    /// What they are sold as.
    pub name: &'static str,
    /// Whether they measure by light, on a bus.
    pub is_light: bool,
    /// Whether there are two.
    pub has_second: bool,
}

impl Rangers {
    /// One HC-SR04.
    pub const USUAL: Self = Self { name: "HC-SR04", is_light: false, has_second: false };
}

/// Sizes, pixels.
const FONT: f64 = 13.0;
/// Of a letter: more than the mean of any sans-serif font.
const LETTER: f64 = 0.66 * FONT;
const ROW: f64 = 24.0;
const TITLE: f64 = 28.0;
const MARGIN: f64 = 10.0;
/// Between the boxes of a column.
const BETWEEN: f64 = 18.0;
/// Between a column and the board: room for wires and resistors.
const GAP: f64 = 150.0;

/// A line of a box, and the pin of the board that it is connected to.
struct Row<'b> {
    text: String,
    pin: Option<&'b str>,
    /// The resistor in the wire, and the one from the pin to ground.
    resistors: [Option<&'b str>; 2],
}

impl<'b> Row<'b> {
    fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), pin: None, resistors: [None; 2] }
    }

    fn wire(text: &str, pin: &'b str) -> Self {
        Self { pin: Some(pin), ..Self::text(text) }
    }
}

/// A part: its title and its lines.
struct Part<'b>(String, Vec<Row<'b>>);

impl Part<'_> {
    fn height(&self) -> f64 {
        TITLE + ROW * count(self.1.len()) + MARGIN
    }
}

#[expect(clippy::cast_precision_loss, reason = "a few letters or lines")]
fn count(number: usize) -> f64 {
    number as f64
}

fn width(text: &str) -> f64 {
    LETTER * count(text.chars().count())
}

/// The width of a box around these texts.
fn around<'t>(texts: impl Iterator<Item = &'t str>) -> f64 {
    texts.map(width).fold(0.0, f64::max) + 2.0 * MARGIN
}

fn left(board: &Board) -> Vec<Part<'_>> {
    let (pins, kit) = (&board.pins, board.kit.as_ref());
    let encoder = |title: &str, a, b, connector: Option<&String>| {
        let supply = connector.map_or_else(|| "3.3 V of the board, GND".to_owned(), connected);
        part(title, vec![Row::wire("A", a), Row::wire("B", b), Row::text(supply)])
    };
    let [right, left] = if kit.is_some() {
        ["right motor with encoder", "left motor with encoder"]
    } else {
        ["right encoder", "left encoder"]
    };
    let mut link = vec![Row::wire("RX", &pins.tx), Row::wire("TX", &pins.rx), Row::text("GND")];
    link.extend(kit.map(|kit| Row::text(connected(&kit.link))));
    link.extend(board.usb.then(|| Row::text("or the USB socket of the board".to_owned())));
    vec![
        encoder(right, &pins.right_a, &pins.right_b, kit.map(|kit| &kit.right)),
        encoder(left, &pins.left_a, &pins.left_b, kit.map(|kit| &kit.left)),
        part("PC: serial port, 3.3 V", link),
    ]
}

/// The line of a part that is plugged into a connector.
fn connected(connector: &String) -> String {
    format!("connector: {connector}")
}

fn part<'b>(title: &str, rows: Vec<Row<'b>>) -> Part<'b> {
    Part(title.to_owned(), rows)
}

/// A ranger with its pins for sound, or its bus for light.
fn ranger<'b>(
    title: String,
    [trigger, echo]: [&'b str; 2],
    bus: Option<&'b Bus>,
    divider: Option<&'b [String; 2]>,
) -> Part<'b> {
    let rows = if let Some(Bus { scl, sda }) = bus {
        vec![Row::wire("SCL", scl), Row::wire("SDA", sda), Row::text("3.3 V of the board, GND")]
    } else if let Some([upper, lower]) = divider {
        let echo = Row { resistors: [Some(upper), Some(lower)], ..Row::wire("ECHO, 5 V", echo) };
        let supply = [Row::text("5 V of the regulator"), Row::text("GND")];
        [Row::wire("TRIG", trigger), echo].into_iter().chain(supply).collect()
    } else {
        let supply = Row::text("3.3 V of the board, GND");
        vec![Row::wire("TRIG", trigger), Row::wire("ECHO", echo), supply]
    };
    Part(title, rows)
}

/// The first ranger, and the second one.
fn rangers(board: &Board, rangers: Rangers) -> Vec<Part<'_>> {
    let Rangers { name, is_light, has_second } = rangers;
    let (pins, divider) = (&board.pins, board.divider.as_ref());
    let kind = if is_light { "ranger" } else { "sonar" };
    let bus = board.bus.as_ref().filter(|_| is_light);
    let first = ranger(format!("{kind} {name}"), [&pins.trigger, &pins.echo], bus, divider);
    let second = board.second.as_ref().filter(|_| has_second).map(|pins| {
        let bus = Some(&pins.bus).filter(|_| is_light);
        ranger(format!("second {kind}"), [&pins.trigger, &pins.echo], bus, divider)
    });
    [first].into_iter().chain(second).collect()
}

fn right(board: &Board, of: Rangers) -> Vec<Part<'_>> {
    let pins = &board.pins;
    let mut parts = rangers(board, of);
    let signal = Row::wire("signal", &pins.servo);
    if let Some(kit) = &board.kit {
        if let Some(Part(_, rows)) = parts.first_mut().filter(|_| !of.is_light) {
            rows.push(Row::text(connected(&kit.sonar)));
        }
        parts.push(part("servo", vec![signal, Row::text(connected(&kit.servo))]));
        parts.push(part("gyro, motor drivers", vec![Row::text("on the board")]));
        return parts;
    }
    let supply = [Row::text("5 V of the regulator"), Row::text("GND")];
    parts.push(part("servo", [signal].into_iter().chain(supply).collect()));
    let inputs = ["AIN1", "AIN2", "BIN1", "BIN2"];
    let wired = [&pins.right_1, &pins.right_2, &pins.left_1, &pins.left_2];
    let mut rows: Vec<_> =
        inputs.into_iter().zip(wired).map(|(it, pin)| Row::wire(it, pin)).collect();
    rows.extend(pins.enable.as_ref().map(|pin| Row {
        resistors: [None, Some("10 kΩ")],
        ..Row::wire("enable, STBY, SLP", pin)
    }));
    let supply = ["VM: cells, GND", "TB6612FNG: VCC, PWMA,", "PWMB to 3.3 V"];
    rows.extend(supply.map(Row::text));
    parts.push(part("motor driver", rows));
    parts
}

/// The lines of the box of the supply.
fn supply(board: &Board) -> Vec<String> {
    if board.kit.is_some() {
        return vec![format!("cells of the kit: {}", board.feed)];
    }
    vec![
        "cells: VM of the motor driver, regulator".to_owned(),
        "regulator 5 V, 3 A: sonar; servo, 470 µF beside it".to_owned(),
        format!("and the board: {}", board.feed),
        "GND of all parts joined".to_owned(),
    ]
}

/// The lines of the box of the motors.
fn motors(board: &Board) -> Vec<&'static str> {
    if board.kit.is_some() {
        return vec!["the other connectors stay free"];
    }
    vec![
        "right motor: AOUT1, AOUT2 of the motor driver",
        "left motor: BOUT1, BOUT2",
        "a wheel turns backwards: swap its motor's wires",
    ]
}

/// The wiring of a robot as an SVG.
#[must_use]
pub fn drawing(board: &Board, rangers: Rangers) -> String {
    let (left, right) = (left(board), right(board, rangers));
    let column = |parts: &[Part]| {
        let texts = |part: &Part| {
            around(part.1.iter().map(|row| row.text.as_str()).chain([part.0.as_str()]))
        };
        parts.iter().map(texts).fold(0.0, f64::max)
    };
    let height = |parts: &[Part]| {
        parts.iter().map(Part::height).sum::<f64>() + BETWEEN * count(parts.len() - 1)
    };
    let (left_width, right_width) = (column(&left), column(&right));
    let pins =
        |parts: &[Part]| around(parts.iter().flat_map(|part| &part.1).filter_map(|row| row.pin));
    let board_width = around([board.title.as_str()].into_iter()).max(pins(&left) + pins(&right));
    let board_height = height(&left).max(height(&right)) + TITLE;
    let board_at = MARGIN + left_width + GAP;
    let right_at = board_at + board_width + GAP;
    let all = (right_at + right_width + MARGIN, board_height + 2.0 * MARGIN);
    let (lines, motors) = (supply(board), motors(board));
    let supply_height = TITLE + ROW * count(lines.len().max(motors.len())) + MARGIN;
    let supply_width = around(lines.iter().map(String::as_str));
    let motors_at = MARGIN + supply_width + BETWEEN;
    let motors_width = around(motors.iter().copied());
    let below = motors_at + motors_width + MARGIN;
    let mut svg = Svg::new(all.0.max(below), all.1 + supply_height + MARGIN);
    svg.part(board_at, MARGIN, board_width, board_height, &board.title);
    let top = MARGIN + TITLE;
    svg.column(&left, MARGIN, left_width, top, Side { board: board_at, is_left: true });
    let edge = board_at + board_width;
    svg.column(&right, right_at, right_width, top, Side { board: edge, is_left: false });
    let at = all.1;
    let boxes: [(f64, f64, &str, Vec<&str>); 2] = [
        (MARGIN, supply_width, "supply", lines.iter().map(String::as_str).collect()),
        (motors_at, motors_width, "motors", motors),
    ];
    for (x, width, title, lines) in boxes {
        svg.part(x, at, width, supply_height, title);
        for (number, line) in lines.into_iter().enumerate() {
            svg.text(x + MARGIN, at + TITLE + ROW * (count(number) + 0.7), line, "start", false);
        }
    }
    svg.end()
}

/// The edge of the board that a column is connected to.
#[derive(Clone, Copy)]
struct Side {
    board: f64,
    is_left: bool,
}

struct Svg(String);

impl Svg {
    fn new(width: f64, height: f64) -> Self {
        Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             font-family=\"sans-serif\" font-size=\"{FONT}\">\n\
             <rect width=\"{width:.0}\" height=\"{height:.0}\" fill=\"#ffffff\"/>\n"
        ))
    }

    fn end(self) -> String {
        self.0 + "</svg>\n"
    }

    fn add(&mut self, element: std::fmt::Arguments) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "{element}");
    }

    /// A box with its title.
    fn part(&mut self, x: f64, y: f64, width: f64, height: f64, title: &str) {
        self.add(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"6\" \
             fill=\"#f4f6f8\" stroke=\"#444444\" stroke-width=\"1.5\"/>"
        ));
        self.text(x + 0.5 * width, y + 19.0, title, "middle", true);
    }

    fn text(&mut self, x: f64, y: f64, text: &str, anchor: &str, is_bold: bool) {
        let weight = if is_bold { " font-weight=\"bold\"" } else { "" };
        self.add(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{weight} fill=\"#222222\">{text}</text>"
        ));
    }

    fn wire(&mut self, path: &str) {
        self.add(format_args!(
            "<path d=\"{path}\" stroke=\"#1f6fb2\" stroke-width=\"2\" fill=\"none\"/>"
        ));
    }

    fn resistor(&mut self, x: f64, y: f64, width: f64, height: f64) {
        self.add(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width}\" height=\"{height}\" stroke=\"#1f6fb2\" \
             stroke-width=\"2\" fill=\"#ffffff\"/>"
        ));
    }

    /// A column of parts, wired to the board.
    fn column(&mut self, parts: &[Part], x: f64, width: f64, top: f64, side: Side) {
        let mut y = top;
        for part in parts {
            self.part(x, y, width, part.height(), &part.0);
            for (number, row) in part.1.iter().enumerate() {
                let at = y + TITLE + ROW * (count(number) + 0.5);
                let (text_at, anchor, edge) = if side.is_left {
                    (x + width - MARGIN, "end", x + width)
                } else {
                    (x + MARGIN, "start", x)
                };
                self.text(text_at, at + 4.0, &row.text, anchor, false);
                if let Some(pin) = row.pin {
                    self.connect(row, pin, at, edge, side);
                }
            }
            y += part.height() + BETWEEN;
        }
    }

    /// The wire of a row, with its resistors, from the edge of its box to the board.
    fn connect(&mut self, row: &Row, pin: &str, y: f64, edge: f64, side: Side) {
        let (pin_at, anchor) = if side.is_left {
            (side.board + MARGIN, "start")
        } else {
            (side.board - MARGIN, "end")
        };
        self.text(pin_at, y + 4.0, pin, anchor, false);
        self.wire(&format!("M{edge:.1} {y:.1}H{:.1}", side.board));
        if let Some(resistor) = row.resistors[0] {
            let x = 0.4 * side.board + 0.6 * edge;
            self.resistor(x, y - 6.0, 30.0, 12.0);
            self.text(x + 15.0, y - 10.0, resistor, "middle", false);
        }
        if let Some(resistor) = row.resistors[1] {
            let x = 0.75 * side.board + 0.25 * edge;
            self.wire(&format!("M{x:.1} {y:.1}v46M{:.1} {:.1}h20", x - 10.0, y + 46.0));
            self.resistor(x - 6.0, y + 10.0, 12.0, 26.0);
            self.text(x + 12.0, y + 28.0, resistor, "start", false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of each board all rangers that it can have.
    fn drawings() -> Vec<(String, String)> {
        let boards = crate::all().unwrap_or_default();
        let mut drawings = Vec::new();
        for board in &boards {
            for (name, is_light) in [("HC-SR04", false), ("VL53L1X", true)] {
                for has_second in [false, true] {
                    let is_possible = (!is_light || board.bus.is_some())
                        && (!has_second || board.second.is_some());
                    let rangers = Rangers { name, is_light, has_second };
                    let svg = is_possible.then(|| drawing(board, rangers));
                    drawings.extend(svg.map(|svg| (board.name.clone(), svg)));
                }
            }
        }
        drawings
    }

    #[test]
    fn rangers_are_drawn_with_their_pins() {
        let drawings = drawings();
        assert!(drawings.len() > 12);
        let board = crate::named("pico2").unwrap();
        let light = drawing(&board, Rangers { name: "VL53L1X", is_light: true, has_second: true });
        for text in ["ranger VL53L1X", "second ranger", "SCL", "SDA"] {
            assert!(light.contains(text), "{text}");
        }
        assert!(!light.contains("TRIG"));
    }

    /// A number of an element.
    fn number(element: &str, name: &str) -> f64 {
        let (_, rest) = element.split_once(&format!(" {name}=\"")).unwrap_or_default();
        rest.split('"').next().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
    }

    /// Each text lies in one box of its drawing, or, beside a resistor, in none; and no box lies on another one.
    #[test]
    fn nothing_is_outside_its_box() {
        for (board, svg) in drawings() {
            let of = |start: &str| -> Vec<&str> {
                svg.lines().filter(|line| line.starts_with(start)).collect()
            };
            let rectangle = |line: &&str| {
                let [x, y, width, height] =
                    ["x", "y", "width", "height"].map(|name| number(line, name));
                [x, y, x + width, y + height]
            };
            let page =
                of("<rect width").first().map(|line| ["width", "height"].map(|n| number(line, n)));
            let Some([page_width, page_height]) = page else { panic!("no page") };
            let rounded: Vec<_> =
                of("<rect x").into_iter().filter(|line| line.contains("rx=")).collect();
            let boxes: Vec<[f64; 4]> = rounded.iter().map(rectangle).collect();
            assert!(boxes.len() >= 9, "{board}");
            let overlap = |one: &[f64; 4], other: &[f64; 4]| {
                let apart = |low, high| one[high] <= other[low] || other[high] <= one[low];
                !(apart(0, 2) || apart(1, 3))
            };
            let holds = |outer: &[f64; 4], inner: &[f64; 4]| {
                outer[0] <= inner[0]
                    && outer[1] <= inner[1]
                    && inner[2] <= outer[2]
                    && inner[3] <= outer[3]
            };
            for (number, one) in boxes.iter().enumerate() {
                assert!(holds(&[0.0, 0.0, page_width, page_height], one));
                assert!(!boxes.iter().skip(number + 1).any(|other| overlap(one, other)));
            }
            for line in of("<text") {
                let text =
                    line.split('>').nth(1).and_then(|rest| rest.split('<').next()).unwrap_or("");
                let (x, y, width) = (number(line, "x"), number(line, "y"), width(text));
                let from = match line {
                    middle if middle.contains("\"middle\"") => x - 0.5 * width,
                    end if end.contains("\"end\"") => x - width,
                    _ => x,
                };
                let space = [from, y - 0.8 * FONT, from + width, y + 0.25 * FONT];
                let is_in_one = boxes.iter().any(|outer| holds(outer, &space));
                let is_beside =
                    text.ends_with('Ω') && !boxes.iter().any(|outer| overlap(outer, &space));
                assert!(is_in_one || is_beside, "{board}: {text}");
            }
        }
    }
}
