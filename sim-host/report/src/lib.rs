//! The report of a run: a self-contained HTML file with tables, figures and a player.
//!
//! The file loads no other resource, which its content security policy enforces, so it can be mailed,
//! archived or opened from a disk. The figures are also written as separate files.
//!
//! A headless browser can test the page: once the player has drawn its first frame, the root element
//! has `data-ready="true"`; the text of a script error is in `data-error`.
//!
//! | module | what |
//! |---|---|
//! | `figures` | the content of each figure; `figures.js`: values, zoom and pan
//! | `called_lost` | the figure of `sonarfix-studies health` |
//! | `chart`, `axis`, `points` | drawing of a figure |
//! | [`heat_map`] | a map with a quantity along a path |
//! | `moment.js`, `drawing.js` | the drawing of a run, shared with the live page and the playground |
//! | `playback.js`, `strip.js`, `player.js` | the player of a run, shared with the playground; `playback.js` and `strip.js` with the comparison |
//! | `curves.js` | curves over time, of the live page and the comparison |
//! | [`comparison`] | the page of two runs side by side |
//! | `palette` | one colour per role, in figures and player |
//! | [`map`] | the drawing of a map |
//! | [`starts_map`] | a map with starts without a pose, what they confuse, and boards |
//! | `page`, `escape` | tables, figures and data as HTML |
//! | [`Table`] | a table of numbers |
//! | [`residuals`] | the figure of a calibration |
//! | [`sweep`] | the figure of a sweep |

mod axis;
mod called_lost;
mod chart;
pub mod comparison;
mod escape;
mod figures;
pub mod heat_map;
pub mod map;
mod page;
mod palette;
mod points;
pub mod residuals;
pub mod starts_map;
pub mod sweep;
mod table;

use std::error::Error;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use sonarfix_files::Output;
use sonarfix_sim::spread::Spread;
use sonarfix_sim::trace::Trace;
use thiserror::Error;

use figures::Figure;

pub use called_lost::called_lost;
pub use page::fill;
pub use palette::css as palette_css;
pub use table::Table;

/// The name of the report's file.
const FILE: &str = "report.html";

const BODY: &str = include_str!("report.html");
const STYLE: &str = include_str!("report.css");

/// Values, zoom and pan of the figures.
const FIGURES: &str = include_str!("figures.js");

/// The controls of the view of [`DRAWING`]: what is shown of the map, and the scale of the ellipse.
pub const VIEW: &str = include_str!("view.html");

/// The scripts that play runs, after [`DRAWING`]: time, bar of measurement cycles.
const PLAYER: &str = concat!(include_str!("playback.js"), include_str!("strip.js"));

/// The script of the player, after [`DRAWING`].
pub const SCRIPT: &str =
    concat!(include_str!("playback.js"), include_str!("strip.js"), include_str!("player.js"));

/// The script that draws curves over time, after [`DRAWING`].
pub const CURVES: &str = include_str!("curves.js");

/// The style sheet of [`CURVES`].
pub const CURVES_STYLE: &str = include_str!("curves.css");

/// The list of the numbers of a run at one time, and what the colours of its picture mean.
const NUMBERS: &str = include_str!("numbers.html");
const LEGEND: &str = include_str!("legend.html");

/// The scripts that draw a run on a canvas; the player and the live page use them.
pub const DRAWING: &str = concat!(include_str!("moment.js"), include_str!("drawing.js"));

/// A report on one run.
#[derive(Debug, Clone)]
pub struct Report<'a> {
    /// The title of the page.
    pub title: String,
    /// A line under the title.
    pub subtitle: String,
    /// Tables, shown before the figures.
    pub tables: Vec<Table>,
    /// The run. Without ticks the page has a placeholder.
    pub trace: &'a Trace,
    /// The spread of the position error over many runs, if there are.
    pub spread: Option<&'a Spread>,
    /// Where it comes from, shown last: version, command, hashes of files.
    pub provenance: Table,
    /// Whether the figures have the numbers of the paper's.
    pub of_paper: bool,
}

/// Why a report failed.
#[derive(Debug, Error)]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error("figure {file} cannot be drawn")]
    Figure {
        /// The file the figure was meant for.
        file: &'static str,
        /// The error of the drawing library.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The run cannot be written as JSON.
    #[error("the data of the page cannot be written as JSON")]
    Data(#[from] serde_json::Error),
    /// A run that should be compared has no ticks.
    #[error("{name} has no encoder tick, so that there is nothing to compare")]
    Empty {
        /// The run.
        name: String,
    },
    /// A file or the directory cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file or directory.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl Report<'_> {
    /// The page.
    ///
    /// # Errors
    /// [`ReportError::Figure`] or [`ReportError::Data`].
    pub fn html(&self) -> Result<String, ReportError> {
        self.page(&self.figures()?)
    }

    /// Writes `report.html`, and each figure as an SVG file beside it, into a directory, which is
    /// created if missing. Returns the path of the page.
    ///
    /// # Errors
    /// As [`Report::html`], before anything is written; and [`ReportError::Write`].
    pub fn write(&self, dir: &Path) -> Result<PathBuf, ReportError> {
        let figures = self.figures()?;
        let page = self.page(&figures)?;
        fs::create_dir_all(dir)
            .map_err(|source| ReportError::Write { path: dir.into(), source })?;
        for Figure { file, svg, .. } in &figures {
            write(dir.join(file), svg)?;
        }
        write(dir.join(FILE), &page)
    }

    fn figures(&self) -> Result<Vec<Figure>, ReportError> {
        let data = figures::Data { trace: self.trace, spread: self.spread };
        figures::draw(data).map_err(|(file, source)| ReportError::Figure { file, source })
    }

    fn page(&self, figures: &[Figure]) -> Result<String, ReportError> {
        let parts = [
            ("tables", page::tables(&self.tables).into()),
            ("figures", page::figures(figures, self.of_paper).into()),
            ("player", player().into()),
        ];
        let page = page::Page {
            title: &self.title,
            subtitle: &self.subtitle,
            style: &style(),
            body: &page::fill(BODY, &parts),
            provenance: &self.provenance,
            without_scripts: "The player needs JavaScript; the tables and figures do not.",
            data: &sonarfix_player::json(self.trace)?,
            scripts: &[DRAWING, SCRIPT, FIGURES, include_str!("report.js")],
        };
        Ok(page.html())
    }
}

/// The player as HTML. The page that includes it calls `openPlayer(data)` of [`SCRIPT`].
#[must_use]
pub fn player() -> String {
    let values =
        [("playback", playback().into()), ("numbers", NUMBERS.into()), ("legend", LEGEND.into())];
    page::fill(include_str!("player.html"), &values)
}

/// Slider, buttons and menus of the time and the view.
fn playback() -> String {
    page::fill(include_str!("playback.html"), &[("view", VIEW.into())])
}

/// The style sheet of the report's page and of the player, with the palette.
#[must_use]
pub fn style() -> String {
    palette::css() + STYLE
}

fn write(path: PathBuf, text: &str) -> Result<PathBuf, ReportError> {
    let written = Output::create(&path).and_then(|mut out| {
        out.write_all(text.as_bytes())?;
        out.finish()
    });
    match written {
        Ok(()) => Ok(path),
        Err(source) => Err(ReportError::Write { path, source }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix::health::Verdict;
    use sonarfix_map::Oscillation;
    use sonarfix_sim::trace::{Calibration, Estimate, FixRecord, Outcome, Pose, Tick, Truth, Wall};
    use sonarfix_sim::world::obstacle::{Obstacle, Outline};

    const HOSTILE: &str = "</script><img src=x onerror=alert(1)>";

    /// A robot that drives 10 m along a wall.
    fn trace(ticks: u32) -> Trace {
        let pose = |n: u32| Pose { x: f64::from(n) * 0.1, y: 1.0, heading: 0.0 };
        let truth =
            |n| Truth { pose: pose(n), calibration: Some(Calibration::default()), gyro_bias: None };
        let estimate = |n| Estimate {
            pose: pose(n),
            calibration: Calibration { track_width: 0.35, ..Calibration::default() },
            deviation: [0.01; 7],
            covariance_xy: 1e-5,
            ..Estimate::default()
        };
        let tick = |n| Tick {
            time: f64::from(n) * 0.25,
            truth: Some(truth(n)),
            estimate: estimate(n),
            odometry: Pose { y: 1.5, ..pose(n) },
            bound: None,
        };
        Trace {
            obstacles: Vec::new(),
            walls: vec![Wall { name: HOSTILE.into(), from: [0.0, 0.0], to: [10.0, 0.0] }],
            cone: 0.26,
            start: None,
            absolutes: Vec::new(),
            ticks: (0..ticks).map(tick).collect(),
            searches: Vec::new(),
            fixes: vec![FixRecord {
                ranger: 0,
                time: 0.5,
                wall: None,
                sonar: [0.2, 1.0],
                direction: -1.57,
                bearing: -1.57,
                range: None,
                source: None,
                why: None,
                outcome: Outcome::Refused,
                association: None,
                reason: HOSTILE.into(),
                innovation: None,
                innovation_variance: None,
            }],
        }
    }

    fn html(trace: &Trace) -> String {
        let table = Table {
            title: "Errors".into(),
            note: HOSTILE.into(),
            columns: vec!["state".into(), HOSTILE.into()],
            rows: vec![vec![HOSTILE.into(), "1.5".into()]],
        };
        let (title, subtitle) = (HOSTILE.to_owned(), HOSTILE.to_owned());
        Report {
            title,
            subtitle,
            tables: vec![table],
            trace,
            spread: None,
            provenance: Table::default(),
            of_paper: true,
        }
        .html()
        .unwrap()
    }

    /// The page has three scripts of its own: the error handler, the data and the player.
    #[test]
    fn nothing_a_user_wrote_becomes_markup() {
        let html = html(&trace(100));
        assert!(!html.contains("<img"));
        assert_eq!(html.matches("</script>").count(), 3);
        assert!(html.contains("&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;</h1>"));
        assert!(html.contains(r#""name":"\u003c/script>\u003cimg"#));
    }

    #[test]
    fn every_figure_and_every_place_of_the_template_is_filled() {
        let html = html(&trace(100));
        // Without innovations and without other runs; each in two widths.
        assert_eq!(html.matches("<figure>").count(), 9);
        assert_eq!(html.matches("<svg").count(), 18);
        assert_eq!(html.matches("<b>Figure ").count(), 5, "as many as the paper's");
        assert!(!html.contains("{{"));
        for label in ["true", "estimated", "encoders alone", "walls", "X (m)", "heading (°)"] {
            assert!(html.contains(&format!("\n{label}\n")), "{label} is missing");
        }
    }

    /// A jump of the estimate is a gap between two pieces of its path.
    #[test]
    fn a_jump_is_no_path() {
        let pieces = |trace: &Trace| {
            let html = html(trace);
            let figure = html.split("<svg").nth(1).unwrap().split("</svg>").next().unwrap();
            let is_estimate =
                |line: &&str| line.starts_with("<polyline") && line.contains("#0072B2");
            figure.lines().filter(is_estimate).count()
        };
        let straight = pieces(&trace(100));
        let mut jumping = trace(100);
        jumping.ticks.iter_mut().skip(50).for_each(|tick| tick.estimate.pose.y += 0.5);
        assert_eq!(pieces(&jumping), straight + 1);
        // All three move as far as the wheels.
        let mut fast = trace(100);
        for tick in fast.ticks.iter_mut().skip(50) {
            tick.estimate.pose.y += 0.5;
            tick.odometry.y += 0.5;
        }
        assert_eq!(pieces(&fast), straight);
    }

    #[test]
    fn a_replay_without_truth_omits_the_errors() {
        let mut trace = trace(100);
        for tick in &mut trace.ticks {
            tick.truth = None;
        }
        let html = html(&trace);
        assert_eq!(html.matches("<svg").count(), 18);
        assert!(!html.contains("\ntrue\n"));
        assert!(html.contains("\nestimated\n"));
    }

    #[test]
    fn a_run_without_ticks_is_reported_as_such() {
        let html = html(&Trace::default());
        assert!(html.contains("there is nothing to draw"));
        assert!(!html.contains("<svg"));
        assert!(html.contains("Errors"));
    }

    /// Neither the figures nor the data contain NaN or infinity, and a run of a single tick does
    /// not divide by its duration of zero.
    #[test]
    fn numbers_that_are_not_finite_are_omitted() {
        let mut broken = trace(100);
        broken.ticks[50].estimate.pose.x = f64::NAN;
        broken.ticks[51].estimate.deviation = [f64::INFINITY; 7];
        broken.ticks[52].odometry.y = f64::NEG_INFINITY;
        broken.fixes[0].direction = f64::NAN;
        broken.walls[0].to[1] = f64::NAN;
        // Only the legends of both widths have a wall line: a wall with a NaN end is not drawn.
        assert_eq!(html(&broken).matches("stroke=\"#6B7280\" stroke-width").count(), 2);
        for html in [html(&broken), html(&trace(1))] {
            let figures = html.split("<svg").skip(1).map(|svg| svg.split("</svg>").next().unwrap());
            for figure in figures {
                assert!(!figure.contains("NaN") && !figure.contains("inf"), "{figure}");
                // For a NaN, plotters would write the limits of its integers.
                assert!(!figure.contains("2147483"), "{figure}");
            }
        }
    }

    /// Innovations, the verdict's steps, the spread over runs, obstacles and provenance appear where there are any.
    #[test]
    fn what_a_run_has_is_shown() {
        let mut trace = trace(100);
        let fix = |outcome, innovation| FixRecord {
            outcome,
            innovation: Some(innovation),
            innovation_variance: Some(1e-6),
            ..trace.fixes[0].clone()
        };
        trace.fixes = vec![fix(Outcome::Accepted, 1e-3), fix(Outcome::Gated, 5.0)];
        trace.ticks[50].estimate.verdict = Verdict::Lost;
        let outline = Outline::Circle { centre: [3.0, 0.5], radius: 0.2 };
        let walk = Some(Oscillation { by: [1.0, 0.0], takes: 5.0 });
        trace.obstacles = vec![Obstacle { outline, walk }];
        let spread = Spread {
            runs: 7,
            seed: 3,
            times: vec![1.0, 2.0],
            median: vec![0.01, 0.02],
            most: vec![0.03, 0.04],
        };
        let row = vec!["command".into(), "sonarfix <run>".into()];
        let provenance = Table { title: "Provenance".into(), rows: vec![row], ..Table::default() };
        let report = Report {
            title: String::new(),
            subtitle: String::new(),
            tables: vec![],
            trace: &trace,
            spread: Some(&spread),
            provenance,
            of_paper: false,
        };
        let html = report.html().unwrap();
        assert_eq!(html.matches("<figure>").count(), 11);
        assert!(!html.contains("<b>Figure "), "only those of the paper have a number");
        for text in
            ["7 runs (seeds 3 to 9)", "\nfurniture, people\n", "\nLost\n", "sonarfix &lt;run&gt;"]
        {
            assert!(html.contains(text), "{text} is missing");
        }
        // An accepted and a gated dot in each width; the latter is at the edge of the axis.
        for role in ["#009E73", "#E69F00"] {
            let dots =
                html.lines().filter(|line| line.starts_with("<polyline") && line.contains(role));
            let no_length = |line: &&str| {
                let points = line.split("points=\"").nth(1).and_then(|rest| rest.split('"').next());
                points.is_some_and(|points| {
                    let mut points = points.split_whitespace();
                    points.next() == points.next()
                })
            };
            assert_eq!(dots.filter(no_length).count(), 2, "{role}");
        }
    }

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let taken = dir.path().join("taken");
        fs::write(&taken, "a file, not a directory").unwrap();
        let trace = trace(2);
        let report = Report {
            title: String::new(),
            subtitle: String::new(),
            tables: vec![],
            trace: &trace,
            spread: None,
            provenance: Table::default(),
            of_paper: false,
        };
        let error = report.write(&taken).unwrap_err();
        assert!(error.to_string().contains("taken"), "{error}");
        let page = report.write(&dir.path().join("made")).unwrap();
        assert!(page.ends_with("made/report.html"));
        assert!(
            fs::read_to_string(page.with_file_name("trajectory.svg")).unwrap().contains("<svg")
        );
    }
}
