//! The latest telemetry on a terminal: numbers, map, innovations and what to check.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Line as Segment, Points};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};
use sonarfix::health::Verdict;
use sonarfix::localizer::Fix;
use sonarfix_link::Telemetry;
use sonarfix_sim::text::wrapped;
use sonarfix_sim::trace::Wall;

use sonarfix_telemetry::hints::hints;
use sonarfix_telemetry::{Monitor, Received, view};

use crate::teleoperation::Teleoperation;

/// Innovations that are drawn.
const INNOVATIONS: usize = 200;
/// Positions of the path that are drawn: a minute at ten ticks a second.
const POSITIONS: usize = 600;
/// Radius of the robot where its track width is unknown, metres.
const RADIUS: f64 = 0.08;
/// Width from which map and innovations are beside the numbers.
const WIDE: u16 = 120;

/// Colours of what the filter uses and of what is uncertain. Blue and yellow differ for everybody.
const USED: Color = Color::Cyan;
const UNCERTAIN: Color = Color::Yellow;

/// What the terminal draws of the past.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// Number of the ping and its innovation in millimetres; accepted, gated.
    innovations: VecDeque<(f64, f64, bool)>,
    pings: u32,
    path: VecDeque<(f64, f64)>,
}

impl History {
    /// Takes a message.
    pub fn take(&mut self, received: &Received) {
        match &received.telemetry {
            Telemetry::Initialized(_) => *self = Self::default(),
            Telemetry::Estimate(estimate) => {
                let state = &estimate.state;
                push(&mut self.path, (state.x.0.into(), state.y.0.into()), POSITIONS);
            }
            Telemetry::Ping(ping) => {
                self.pings = self.pings.saturating_add(1);
                let (innovation, is_used) = match ping.fix {
                    Fix::Accepted(innovation) | Fix::Downweighted(innovation) => (innovation, true),
                    Fix::Gated(innovation) => (innovation, false),
                    _ => return,
                };
                let of = (self.pings.into(), 1e3 * f64::from(innovation.value.0), is_used);
                push(&mut self.innovations, of, INNOVATIONS);
            }
            _ => {}
        }
    }
}

fn push<T>(kept: &mut VecDeque<T>, value: T, most: usize) {
    kept.push_back(value);
    if kept.len() > most {
        kept.pop_front();
    }
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Screen<'a> {
    /// The latest telemetry.
    pub monitor: &'a Monitor,
    /// The past.
    pub history: &'a History,
    /// The map; empty if it is unknown.
    pub walls: &'a [Wall],
    /// The names of its walls.
    pub names: &'a [String],
    /// The file that is recorded.
    pub recording: Option<&'a str>,
    /// The answer to the last command.
    pub notice: &'a str,
    /// The keys that drive the robot; `None` for a connection that can only be read.
    pub teleoperation: Option<&'a Teleoperation>,
}

impl Screen<'_> {
    /// Draws everything.
    pub fn draw(&self, frame: &mut Frame) {
        let footer = self.footer(frame.area().width);
        let rows = Layout::vertical([
            Constraint::Length(1),
            Constraint::Min(10),
            Constraint::Length(u16::try_from(footer.len()).unwrap_or(1)),
        ]);
        let [top, middle, bottom] = rows.areas(frame.area());
        frame.render_widget(self.title(), top);
        frame.render_widget(text(footer), bottom);
        if frame.area().width >= WIDE {
            let [left, right] =
                Layout::horizontal([Constraint::Min(60), Constraint::Percentage(40)]).areas(middle);
            let [above, below] =
                Layout::vertical([Constraint::Percentage(60), Constraint::Percentage(40)])
                    .areas(right);
            self.draw_numbers(frame, left);
            self.draw_map(frame, above);
            self.draw_innovations(frame, below);
        } else {
            let rows = self.numbers(middle).len().saturating_add(2).min(middle.height.into());
            let rows = u16::try_from(rows).unwrap_or(u16::MAX);
            let [above, below] =
                Layout::vertical([Constraint::Length(rows), Constraint::Min(0)]).areas(middle);
            self.draw_numbers(frame, above);
            if below.height >= 6 {
                self.draw_map(frame, below);
            }
        }
    }

    /// The telemetry in an area with a border.
    fn numbers(&self, area: Rect) -> Vec<String> {
        let [width, height] = [area.width, area.height].map(|it| usize::from(it.saturating_sub(2)));
        view::fitted(self.monitor, self.names, width, height)
    }

    fn draw_numbers(&self, frame: &mut Frame, area: Rect) {
        let numbers = text(self.numbers(area)).block(Block::bordered().title(" telemetry "));
        frame.render_widget(numbers, area);
    }

    /// The verdict has a sign beside its colour, and colours that differ in brightness and between blue and yellow.
    fn title(&self) -> Line<'_> {
        let verdict = self.monitor.estimate().map(|estimate| estimate.health.verdict);
        let (sign, text, style) = match verdict {
            None => ("○", "no estimate yet", Style::default().fg(Color::DarkGray)),
            Some(Verdict::Tracking) => {
                ("●", view::verdict(Verdict::Tracking), Style::default().fg(USED))
            }
            Some(Verdict::Degraded) => {
                ("▲", view::verdict(Verdict::Degraded), Style::default().fg(UNCERTAIN))
            }
            Some(Verdict::Lost) => {
                ("✖", view::verdict(Verdict::Lost), Style::default().fg(Color::Magenta).reversed())
            }
        };
        let count = hints(self.monitor).len();
        let check = if count == 0 { String::new() } else { format!("  {count} to check") };
        let verdict = Span::styled(format!("{sign} {text}"), style).bold();
        let mut title =
            vec![" sonarfix monitor  ".bold(), verdict, check.fg(UNCERTAIN), "  ".into()];
        if let Some(teleoperation) = self.teleoperation {
            let (text, drives) = teleoperation.text();
            title.push(if drives {
                format!(" {text} ").black().on_red().bold()
            } else {
                text.into()
            });
        }
        Line::from(title)
    }

    /// The keys, the recording and the answer to the last command, wrapped.
    fn footer(&self, width: u16) -> Vec<String> {
        let recording = self
            .recording
            .map_or_else(|| "not recording".to_owned(), |name| format!("recording {name}"));
        let keys = " q ends  r records  s starts  x stops";
        let line = format!("{keys}  {recording}  {}", self.notice);
        wrapped(line.trim_end(), width.into(), 1)
    }

    fn draw_map(&self, frame: &mut Frame, area: Rect) {
        let pose = self.monitor.estimate().map(|estimate| {
            let state = &estimate.state;
            (f64::from(state.x.0), f64::from(state.y.0), f64::from(state.heading.0))
        });
        let path: Vec<_> = self.history.path.iter().copied().collect();
        let ([left, right], [bottom, top]) = bounds(self.walls, &path, area);
        let canvas = Canvas::default()
            .block(Block::bordered().title(" map "))
            .marker(Marker::Braille)
            .x_bounds([left, right])
            .y_bounds([bottom, top])
            .paint(|draw| {
                for Wall { from: [x1, y1], to: [x2, y2], .. } in self.walls {
                    let (x1, y1, x2, y2) = (*x1, *y1, *x2, *y2);
                    draw.draw(&Segment { x1, y1, x2, y2, color: Color::Gray });
                }
                draw.draw(&Points { coords: &path, color: Color::Blue });
                if let Some((x, y, heading)) = pose {
                    let (x2, y2) =
                        (x + 3.0 * RADIUS * heading.cos(), y + 3.0 * RADIUS * heading.sin());
                    draw.draw(&Circle { x, y, radius: RADIUS, color: Color::Cyan });
                    draw.draw(&Segment { x1: x, y1: y, x2, y2, color: Color::Cyan });
                }
            });
        frame.render_widget(canvas, area);
    }

    fn draw_innovations(&self, frame: &mut Frame, area: Rect) {
        let of = |used: bool| -> Vec<(f64, f64)> {
            let innovations = self.history.innovations.iter();
            innovations.filter(|(.., is_used)| *is_used == used).map(|of| (of.0, of.1)).collect()
        };
        let (used, gated) = (of(true), of(false));
        let most = used.iter().map(|(_, value)| value.abs()).fold(10.0, f64::max);
        let last = f64::from(self.history.pings.max(1));
        let first = self.history.innovations.front().map_or(0.0, |of| of.0);
        let data = |name, marker, points, colour| {
            Dataset::default()
                .name(name)
                .marker(marker)
                .graph_type(GraphType::Scatter)
                .style(Style::default().fg(colour))
                .data(points)
        };
        let chart = Chart::new(vec![
            data("used", Marker::Dot, &used, USED),
            data("gated", Marker::Bar, &gated, UNCERTAIN),
        ])
        .block(Block::bordered().title(" innovations (mm) "))
        .x_axis(Axis::default().bounds([first, last.max(first + 1.0)]))
        .y_axis(Axis::default().bounds([-most, most]).labels([
            format!("{:.0}", -most),
            "0".to_owned(),
            format!("{most:.0}"),
        ]));
        frame.render_widget(chart, area);
    }
}

/// Lines as they are.
fn text(lines: Vec<String>) -> Paragraph<'static> {
    Paragraph::new(lines.into_iter().map(Line::from).collect::<Vec<_>>())
}

/// The extent of map or path with a margin, widened so that a metre is as long in x as in y: a character is twice as high as wide.
fn bounds(walls: &[Wall], path: &[(f64, f64)], area: Rect) -> ([f64; 2], [f64; 2]) {
    let ends = walls.iter().flat_map(|wall| [wall.from, wall.to]);
    let points: Vec<[f64; 2]> =
        if walls.is_empty() { path.iter().map(|&(x, y)| [x, y]).collect() } else { ends.collect() };
    let extent = |axis: fn(&[f64; 2]) -> f64| {
        let values = points.iter().map(axis).filter(|value| value.is_finite());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        if low <= high { [low - 0.3, high + 0.3] } else { [-1.0, 1.0] }
    };
    let (x, y) = (extent(|point| point[0]), extent(|point| point[1]));
    let wide = f64::from(area.width.max(3));
    let high = 2.0 * f64::from(area.height.max(3));
    let scale = ((x[1] - x[0]) / wide).max((y[1] - y[0]) / high);
    let widened = |[low, up]: [f64; 2], length: f64| {
        let middle = 0.5 * (low + up);
        [middle - 0.5 * length, middle + 0.5 * length]
    };
    (widened(x, scale * wide), widened(y, scale * high))
}
