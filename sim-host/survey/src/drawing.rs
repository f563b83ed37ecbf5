//! The drawing of a survey: walls with their names, the path, the echoes, and their residuals.

use std::fmt::Write as _;

use nalgebra::Vector2;

use crate::survey::Survey;

/// Pixels per metre.
const SCALE: f64 = 80.0;
/// Margin around the drawing, metres.
const MARGIN: f64 = 0.5;
/// Residuals are drawn as strokes along the beam, enlarged by this.
const ENLARGED: f64 = 10.0;

/// The name of a wall, from its index.
#[must_use]
pub fn name(wall: usize) -> String {
    format!("wall {}", wall + 1)
}

/// The drawing, as SVG.
#[must_use]
pub fn draw(survey: &Survey) -> String {
    let frame = Frame::around(survey);
    let [width, height] = frame.size;
    let mut svg = String::new();
    // Writing to a String does not fail.
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         width=\"{width:.0}\" height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
    );
    for echo in &survey.echoes {
        let place = frame.of(&echo.place);
        let (colour, radius) =
            if echo.residual.is_some() { ("#2b6cb0", 1.6) } else { ("#c8c8c8", 1.2) };
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{colour}\"/>",
            place.x, place.y
        );
        if let Some(residual) = echo.residual {
            let beam = (echo.place - echo.from).normalize();
            let end = frame.of(&(echo.place + beam * (residual * ENLARGED)));
            let _ = writeln!(svg, "{}", stroke(&place, &end, "#dd6b20", 0.8));
        }
    }
    let points: Vec<String> = survey
        .path
        .iter()
        .map(|(_, pose)| frame.of(&pose.xy()))
        .map(|at| format!("{:.1},{:.1}", at.x, at.y))
        .collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#38a169\" stroke-width=\"1.2\"/>",
        points.join(" ")
    );
    for (index, wall) in survey.walls.iter().enumerate() {
        let (from, to) = (frame.of(&wall.from), frame.of(&wall.to));
        let colour = if wall.is_confirmed { "black" } else { "#e53e3e" };
        let _ = writeln!(svg, "{}", stroke(&from, &to, colour, 3.0));
        // Beside the wall, on the side of the robot.
        let along = (wall.to - wall.from).normalize();
        let beside = Vector2::new(-along.y, along.x) * 0.15;
        let at = frame.of(&((wall.from + wall.to) * 0.5 + beside));
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" dominant-baseline=\"middle\">{} ± {:.0} mm</text>",
            at.x,
            at.y,
            name(index),
            1e3 * wall.accuracy
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"8\" y=\"{:.0}\">residuals (orange) are enlarged {ENLARGED:.0} times; grey: echoes without a wall; red: \
         walls of one direction only</text>\n</svg>",
        height - 8.0
    );
    svg
}

fn stroke(from: &Vector2<f64>, to: &Vector2<f64>, colour: &str, width: f64) -> String {
    format!(
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
        from.x, from.y, to.x, to.y
    )
}

/// The part of the plane that is drawn.
struct Frame {
    corner: Vector2<f64>,
    size: [f64; 2],
}

impl Frame {
    fn around(survey: &Survey) -> Self {
        let ends = survey.walls.iter().flat_map(|wall| [wall.from, wall.to]);
        let path = survey.path.iter().map(|(_, pose)| pose.xy());
        let (mut low, mut high) =
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for point in ends.chain(path) {
            low = low.inf(&point);
            high = high.sup(&point);
        }
        let span = high - low + Vector2::repeat(2.0 * MARGIN);
        Self {
            corner: Vector2::new(low.x - MARGIN, high.y + MARGIN),
            size: [span.x * SCALE, span.y * SCALE],
        }
    }

    /// A point in pixels; y grows downwards.
    fn of(&self, point: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(point.x - self.corner.x, self.corner.y - point.y) * SCALE
    }
}
