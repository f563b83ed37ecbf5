//! A map with starts without a pose, as SVG: how long each takes, which places are confused, and boards that help.

use sonarfix_map::Floor;

use super::escape::escape;
use super::heat_map::colour_at;
use super::map::{Frame, hex, put};
use super::palette::Role;

/// Shares of the longest time up to which starts have a colour of their own.
const CLASSES: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
/// Radius of a dot, and the length of the line that shows its heading, pixels.
const DOT: f64 = 5.0;
const AHEAD: f64 = 12.0;
/// Width of the legend, and height of a row of it, pixels.
const WIDTH: f64 = 420.0;
const ROW: f64 = 20.0;

/// A start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Where: metres, radians.
    pub at: [f64; 3],
    /// Seconds until the unique answer; `None` without one.
    pub after: Option<f64>,
    /// Whether that is wrong.
    pub is_wrong: bool,
}

/// The map with its starts.
#[derive(Debug, Clone, PartialEq)]
pub struct StartsMap<'a> {
    /// Title, also for screen readers.
    pub title: String,
    /// The map.
    pub floor: &'a Floor,
    /// The starts.
    pub starts: Vec<Dot>,
    /// Longest time of a start, seconds.
    pub seconds: f64,
    /// Places that are confused, metres.
    pub confused: Vec<[[f64; 2]; 2]>,
    /// Proposed boards, each from end to end, metres.
    pub boards: Vec<[[f64; 2]; 2]>,
    /// What they change.
    pub effect: String,
}

impl StartsMap<'_> {
    /// The drawing.
    #[must_use]
    pub fn svg(&self) -> String {
        let frame = Frame::around(self.floor);
        let legend = self.legend();
        #[expect(clippy::cast_precision_loss, reason = "some rows")]
        let mut svg = frame.open(&self.title, [WIDTH, ROW * legend.len() as f64]);
        frame.axes(&mut svg);
        for ends in &self.confused {
            put(&mut svg, format_args!("{}\n", link(&line(&frame, ends))));
        }
        frame.walls(&mut svg, self.floor.named_walls());
        for dot in &self.starts {
            self.dot(&mut svg, &frame, dot);
        }
        for ends in &self.boards {
            put(&mut svg, format_args!("{}\n", board(&line(&frame, ends))));
        }
        frame.scale_bar(&mut svg);
        let (left, top) = frame.legend();
        for (n, (sign, text)) in (0_u32..).zip(&legend) {
            let (x, y) = (left + 10.0, top + ROW * f64::from(n));
            put(
                &mut svg,
                format_args!(
                    "<g transform=\"translate({x:.1} {y:.1})\">{sign}<text x=\"20\" y=\"4\">{}</text></g>\n",
                    escape(text)
                ),
            );
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// A start, with a line in the direction of its heading.
    fn dot(&self, svg: &mut String, frame: &Frame, dot: &Dot) {
        let (x, y) = frame.at([dot.at[0], dot.at[1]]);
        let (sin, cos) = dot.at[2].sin_cos();
        let (ink, sign) = (hex(Role::Ink), self.sign(dot));
        put(
            svg,
            format_args!(
                "<g transform=\"translate({x:.1} {y:.1})\"><path d=\"M0 0L{:.1} {:.1}\" stroke=\"{ink}\"/>{sign}</g>\n",
                AHEAD * cos,
                -AHEAD * sin,
            ),
        );
    }

    /// The sign of a start at the origin.
    fn sign(&self, dot: &Dot) -> String {
        match dot.after {
            None => unanswered(),
            Some(_) if dot.is_wrong => wrong(),
            Some(after) => {
                let class = CLASSES.into_iter().find(|class| after <= class * self.seconds);
                answered(class.unwrap_or(1.0))
            }
        }
    }

    /// Signs with their meanings.
    fn legend(&self) -> Vec<(String, String)> {
        let seconds = |class: f64| format!("unique within {:.0} s", class * self.seconds);
        let mut rows: Vec<_> =
            CLASSES.into_iter().map(|class| (answered(class), seconds(class))).collect();
        rows.push((unanswered(), "no unique answer".to_owned()));
        if self.starts.iter().any(|dot| dot.is_wrong) {
            rows.push((wrong(), "a wrong answer".to_owned()));
        }
        if !self.confused.is_empty() {
            rows.push((link("M-8 0H8"), "places that are confused".to_owned()));
        }
        if !self.boards.is_empty() {
            rows.push((board("M-8 0H8"), self.effect.clone()));
        }
        rows
    }
}

/// A straight line as a path.
fn line(frame: &Frame, [from, to]: &[[f64; 2]; 2]) -> String {
    let ((x1, y1), (x2, y2)) = (frame.at(*from), frame.at(*to));
    format!("M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}")
}

fn answered(class: f64) -> String {
    format!("<circle r=\"{DOT}\" fill=\"{}\"/>", colour_at(class))
}

fn unanswered() -> String {
    let (paper, colour) = (hex(Role::Paper), hex(Role::Encoders));
    format!("<circle r=\"{DOT}\" fill=\"{paper}\" stroke=\"{colour}\" stroke-width=\"2.5\"/>")
}

fn wrong() -> String {
    format!(
        "<path d=\"M-5 -5L5 5M-5 5L5 -5\" stroke=\"{}\" stroke-width=\"3\"/>",
        hex(Role::Encoders)
    )
}

fn link(path: &str) -> String {
    format!("<path d=\"{path}\" stroke=\"{}\" stroke-dasharray=\"5 5\"/>", hex(Role::Encoders))
}

fn board(path: &str) -> String {
    format!("<path d=\"{path}\" stroke=\"{}\" stroke-width=\"6\"/>", hex(Role::Accepted))
}
