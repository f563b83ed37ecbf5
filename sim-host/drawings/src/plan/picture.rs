//! The picture of a plan before and after.

use std::fmt::Write as _;

use super::{Piece, Plan, range};

impl Plan {
    /// The plan as it was drawn, and beside it the walls in black and what was left out in red, as an SVG.
    #[must_use]
    pub fn picture(&self) -> String {
        let [[left, right], [bottom, top]] = range(self.drawn.iter().chain(&self.walls));
        let side = (right - left).max(top - bottom);
        let margin = 0.05 * side;
        let shift = right - left + 2.0 * margin;
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.3} {:.3}\" width=\"1200\" stroke-linecap=\"round\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            2.0 * shift,
            top - bottom + 3.0 * margin
        );
        // Writing to a string does not fail.
        let mut group = |lines: &[Piece], colour: &str, width: f64, shift: f64| {
            let place = |[x, y]: [f64; 2]| {
                format!("{:.3} {:.3}", x - left + margin + shift, top - y + 2.0 * margin)
            };
            for line in lines {
                let (from, to, width) = (place(line.from), place(line.to), width * side);
                let _ = writeln!(
                    text,
                    "<path d=\"M{from} L{to}\" stroke=\"{colour}\" stroke-width=\"{width:.4}\"/>"
                );
            }
        };
        group(&self.drawn, "#555", 0.002, 0.0);
        group(&self.left_out, "#c33", 0.0015, shift);
        group(&self.walls, "black", 0.004, shift);
        let labels = [
            (margin, format!("drawn: {} lines", self.drawn.len())),
            (margin + shift, format!("map: {} walls; red: left out", self.walls.len())),
        ];
        for (x, label) in labels {
            let (y, size) = (1.2 * margin, 0.8 * margin);
            let _ = writeln!(
                text,
                "<text x=\"{x:.3}\" y=\"{y:.3}\" font-size=\"{size:.3}\" font-family=\"sans-serif\">{label}</text>"
            );
        }
        text + "</svg>\n"
    }
}
