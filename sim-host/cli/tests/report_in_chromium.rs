//! Opens a report in headless Chromium and checks that the page works.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::f64::consts::FRAC_PI_2;

use sonarfix::health::Verdict;
use sonarfix_report::comparison::Comparison;
use sonarfix_report::{Report, Table};
use sonarfix_sim::trace::{
    AbsoluteRecord, Calibration, Estimate, FixRecord, GyroEstimate, Outcome, Pose, Tick, Trace,
    Truth, Wall,
};
use sonarfix_sim::world::reflector::Source;

use crate::chromium::{self, assert_ready};

/// A name that would end the script of a page without escapes.
const HOSTILE: &str = "north </script><b>wall</b> & \"more\"";

/// A room 2 m wide, crossed in 20 s, with a cycle of every outcome.
fn trace(truth_known: bool) -> Trace {
    let wall = |name: &str, from, to| Wall { name: name.into(), from, to };
    Trace {
        obstacles: Vec::new(),
        walls: vec![wall(HOSTILE, [0.0, 2.0], [2.0, 2.0]), wall("south", [0.0, 0.0], [2.0, 0.0])],
        cone: 0.26,
        start: None,
        ticks: (0..200).map(|n| tick(f64::from(n) * 0.1, truth_known)).collect(),
        searches: Vec::new(),
        absolutes: if truth_known {
            vec![
                outside(4.0, Outcome::Accepted, Some(0.8)),
                outside(5.0, Outcome::Gated, Some(70.0)),
                outside(6.0, Outcome::Refused, None),
            ]
        } else {
            Vec::new()
        },
        fixes: vec![
            fix(1.0, Outcome::Accepted, Some(1.0), ""),
            fix(2.0, Outcome::Gated, Some(0.4), ""),
            fix(3.0, Outcome::Refused, None, "no echo </script>"),
        ],
    }
}

fn tick(time: f64, truth_known: bool) -> Tick {
    let pose = Pose { x: 0.2 + 0.05 * time, y: 1.0, heading: 0.0 };
    let calibration = Calibration { track_width: 0.1, ..Calibration::default() };
    // The run of which the truth is known has a gyro.
    let gyro = GyroEstimate {
        bias: 0.012 + 0.01 / (1.0 + time),
        deviation: 0.01 / (1.0 + time),
        slips: u32::from(time > 5.0) + u32::from(time > 12.0),
    };
    let estimate = Estimate {
        gyro: truth_known.then_some(gyro),
        pose: Pose { x: pose.x + 0.002, ..pose },
        calibration,
        deviation: [0.003, 0.002, 0.01, 1e-3, 1e-3, 1e-3, 1e-3],
        covariance_xy: 1e-6,
        ..Estimate::default()
    };
    let truth = truth_known.then_some(Truth {
        pose,
        calibration: Some(calibration),
        gyro_bias: Some(0.012),
    });
    let odometry = Pose { y: 1.0 + 0.01 * time, ..pose };
    Tick { time, truth, estimate, odometry, bound: None }
}

fn outside(time: f64, outcome: Outcome, nis: Option<f64>) -> AbsoluteRecord {
    let (position, reason) = (Some([0.3, 1.1]), String::new());
    AbsoluteRecord { time, position, heading: Some(0.1), outcome, reason, nis }
}

fn fix(time: f64, outcome: Outcome, range: Option<f64>, reason: &str) -> FixRecord {
    FixRecord {
        ranger: 0,
        time,
        wall: Some(0),
        sonar: [0.2 + 0.05 * time, 1.0],
        direction: FRAC_PI_2,
        bearing: FRAC_PI_2,
        range,
        source: Some(Source::Obstacle),
        why: None,
        outcome,
        association: None,
        reason: reason.into(),
        innovation: range.map(|range| range - 1.0),
        innovation_variance: range.map(|_| 1e-5),
    }
}

fn report(trace: &Trace) -> Report<'_> {
    let table = Table {
        title: "Errors".into(),
        note: String::new(),
        columns: vec!["state".into(), "mean".into()],
        rows: vec![vec!["heading".into(), "0.125 deg".into()]],
    };
    Report {
        title: "A <small> room".into(),
        subtitle: "seed 1".into(),
        tables: vec![table],
        trace,
        spread: None,
        provenance: Table::default(),
        of_paper: false,
    }
}

/// Magnifies a figure, reads values in it, and shows all of it again.
const USES_A_FIGURE: &str = r#"<script>{
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const figure = [...document.querySelectorAll("figure")].find((one) => one.textContent.includes("Deviation of X"));
  const svg = figure.querySelector("svg");
  const curve = () => svg.querySelector(".curves polyline").getAttribute("points");
  const [plus, , all] = figure.querySelectorAll(".zoom button");
  const first = curve();
  plus.click();
  assert(curve() !== first && svg.querySelector(".frame"), "a button magnifies");
  const box = svg.getBoundingClientRect();
  const [left, top, width, height] = svg.dataset.plot.split(" ").map((pixels) => Number(pixels) * box.width / svg.viewBox.baseVal.width);
  const middle = { clientX: box.left + left + width / 2, clientY: box.top + top + height / 2, bubbles: true };
  svg.dispatchEvent(new PointerEvent("pointermove", middle));
  const text = figure.querySelector("output").textContent;
  assert(/time \(s\): 9\.9\d* · .*σ: (2\.99\d*|3(\.00\d*)?)$/.test(text), `the values in the middle are shown: ${text}`);
  all.click();
  assert(curve() === first && !svg.querySelector(".frame"), "all of it is as before");
  svg.dispatchEvent(new MouseEvent("dblclick", middle));
  const time = document.querySelector('[data-value="time"]').textContent;
  assert(/^(9\.9|10\.0) s/.test(time), `the player goes there: ${time}`);
  document.documentElement.dataset.used = "true";
}</script>"#;

#[test]
fn a_figure_can_be_magnified_and_read() {
    let dir = tempfile::tempdir().unwrap();
    let trace = trace(true);
    let page = report(&trace).write(dir.path()).unwrap();
    let html = std::fs::read_to_string(&page).unwrap();
    std::fs::write(&page, html.replace("</body>", &format!("{USES_A_FIGURE}</body>"))).unwrap();
    let Some(dom) = chromium::opened(&format!("file://{}", page.display()), &[]) else {
        return;
    };
    assert_ready(&dom);
    assert!(chromium::root(&dom).contains("data-used=\"true\""), "{}", chromium::root(&dom));
}

/// Writes a report and opens it; `None`, with a message, without a browser.
fn report_opened(trace: &Trace) -> Option<String> {
    let dir = tempfile::tempdir().unwrap();
    let page = report(trace).write(dir.path()).unwrap();
    chromium::opened(&format!("file://{}", page.display()), &[])
}

#[test]
fn the_page_draws_without_an_error() {
    for truth_known in [true, false] {
        let Some(dom) = report_opened(&trace(truth_known)) else {
            return;
        };
        assert_ready(&dom);
        // Those of a gyro and of measurements from outside only where there are any.
        let figures = if truth_known { 12 } else { 10 };
        assert_eq!(dom.matches("<svg").count(), 2 * figures);
        assert_eq!(dom.matches("class=\"zoom\"").count(), figures, "the figures have no script");
        let bias = "1.261°/s ± 0.573°/s"; // at the start
        assert_eq!(dom.contains(bias), truth_known, "the player shows the bias of a gyro");
        assert!(dom.contains("<h1>A &lt;small&gt; room</h1>"));
        assert!(dom.contains("<td>0.125 deg</td>"));
        assert!(
            dom.contains("\"source\":[\"obstacle\""),
            "the player does not have the source of the echo"
        );
        assert!(dom.contains("0.0 s of 19.9 s"), "the player shows no time");
    }
}

/// Both runs at one time: the slider, a key, and a click in a curve move both; a zoom of one map zooms the other.
const USES_A_COMPARISON: &str = r#"<script>{
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const shown = (name) => [...document.querySelectorAll(`[data-value="${name}"]`)].map((place) => place.textContent);
  const maps = [...document.querySelectorAll(".map")], painted = (map) => map.toDataURL();
  const input = (time) => { const it = document.getElementById("scrub"); it.value = time; it.dispatchEvent(new Event("input")); };
  const key = (name) => maps[0].dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
  input(5);
  assert(shown("time").join("; ") === "5.0 s of 19.9 s; 5.0 s of 9.9 s", `both are at 5 s: ${shown("time")}`);
  assert(shown("error").join("; ") === "2.0 mm; —", `the error of each: ${shown("error")}`);
  assert(shown("verdict").join("; ") === "tracking; lost", `the verdict of each: ${shown("verdict")}`);
  key("ArrowRight");
  assert(shown("time")[1].startsWith("6.0 s"), "a key moves both");
  input(15);
  assert(shown("time").join("; ") === "15.0 s of 19.9 s; ended at 9.9 s", `one has ended: ${shown("time")}`);
  key("+"), key("0"); // a path that is painted at once has other pixels than one that grew
  const before = maps.map(painted);
  key("+");
  assert(maps.every((map, n) => painted(map) !== before[n]), "a key zooms both");
  key("0");
  assert(maps.every((map, n) => painted(map) === before[n]), "both are shown as before");
  const curves = [...document.querySelectorAll(".curve:not([hidden])")];
  const titles = curves.map((curve) => curve.querySelector("b").textContent).join("; ");
  assert(titles.startsWith("Position error; Heading error; Verdict"), titles);
  assert(titles.includes("Distance between the estimates"), titles);
  const verdict = curves[2], canvas = verdict.querySelector("canvas");
  assert(/first tracking.*second lost/.test(verdict.textContent), verdict.textContent);
  const box = canvas.getBoundingClientRect();
  canvas.dispatchEvent(new MouseEvent("click", { clientX: box.left + 46, clientY: box.top + 5, bubbles: true }));
  assert(shown("time")[0].startsWith("0.0 s"), `a click in a curve goes there: ${shown("time")}`);
  document.documentElement.dataset.used = "true";
}</script>"#;

/// The first has true poses and the second has none, ends earlier and is lost.
#[test]
fn two_runs_are_side_by_side_at_one_time() {
    let (first, mut second) = (trace(true), trace(false));
    second.ticks.truncate(100);
    second.ticks.iter_mut().for_each(|tick| tick.estimate.verdict = Verdict::Lost);
    let table = Table {
        title: "Differences".into(),
        columns: vec![String::new(), "first".into()],
        rows: vec![vec![HOSTILE.into(), "1.5".into()]],
        ..Table::default()
    };
    let comparison = Comparison {
        title: "Two <runs>".into(),
        subtitle: HOSTILE.into(),
        names: [HOSTILE.to_owned(), "b.csv".to_owned()],
        runs: [&first, &second],
        tables: vec![table],
        provenance: Table::default(),
    };
    let dir = tempfile::tempdir().unwrap();
    let page = comparison.write(dir.path()).unwrap();
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(!html.contains("<b>wall") && !html.contains("{{"), "a text became markup");
    std::fs::write(&page, html.replace("</body>", &format!("{USES_A_COMPARISON}</body>"))).unwrap();
    let url = format!("file://{}", page.display());
    for flags in [&["--window-size=1300,1500"][..], &["--window-size=400,1800"]] {
        let Some(dom) = chromium::opened(&url, flags) else { return };
        assert_ready(&dom);
        assert!(chromium::root(&dom).contains("data-used=\"true\""), "{}", chromium::root(&dom));
        chromium::picture(&url, "comparison", flags);
    }
    let empty = Trace::default();
    let error = Comparison { runs: [&first, &empty], ..comparison }.html().unwrap_err();
    assert!(error.to_string().starts_with("b.csv has no encoder tick"), "{error}");
}

#[test]
fn the_page_of_a_run_without_ticks_has_a_placeholder() {
    let Some(dom) = report_opened(&Trace::default()) else {
        return;
    };
    assert_ready(&dom);
    assert!(dom.contains("there is nothing to draw"));
    assert!(!dom.contains("<svg"));
}

/// A pose that moves farther than the wheels jumps: its path has a gap there, and between both ticks the robot stays.
#[test]
fn a_jump_is_found_by_the_wheels() {
    let script = r#"
      const column = (x) => ({ x, y: x.map(() => 0), heading: x.map(() => 0) });
      const still = [0, 0, 0, 0], none = { time: [] };
      const ticks = {
        time: [0, 1, 2, 3], encoders: column([0, 0.1, 0.2, 3.2]), estimate: column([0, 0.1, 1, 4]), truth: column([0, null, 1, 4]),
        sigma_x: still, sigma_y: still, sigma_heading: still, correlation: still,
      };
      const jumps = (role) => [0, 1, 2, 3].filter((index) => Moment.isJump(ticks, role, index)).join();
      const { estimate } = Moment.momentAt({ ticks, fixes: none, gyro: none, absolutes: none }, 1.5);
      document.title = `${jumps("estimate")};${jumps("truth")};${jumps("encoders")};${estimate.x}`;
    "#;
    let dir = tempfile::tempdir().unwrap();
    let page = dir.path().join("jumps.html");
    let drawing = sonarfix_report::DRAWING;
    std::fs::write(&page, format!("<script>{drawing}{script}</script>")).unwrap();
    let Some(dom) = chromium::opened(&format!("file://{}", page.display()), &[]) else { return };
    assert!(dom.contains("<title>2;;;0.1</title>"), "{dom}");
}
