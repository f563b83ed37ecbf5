//! All cells as a picture: a row for each family with its objects, a block of columns for each sensor.

use std::fmt::Write;

use super::cell::Cell;
use super::measure::{Level, Measure};
use super::sums::Sums;

/// Width of a cell, of the labels and of the gap between blocks; height of a row and of the gap between families, pixels.
const CELL: usize = 34;
const LABELS: usize = 190;
const GAP: usize = 10;
const ROW: usize = 14;
const GROUP: usize = 5;
/// Height above the rows and below them, pixels.
const HEAD: usize = 42;
const FOOT: usize = 30;

/// The background and the ink of a level.
fn colours(level: Level) -> (&'static str, &'static str) {
    match level {
        Level::Good => ("#dcf1e4", "#1b1f24"),
        Level::Cautious => ("#d6e6f5", "#1b1f24"),
        Level::Fair => ("#fbe9a6", "#1b1f24"),
        Level::Poor => ("#f0a259", "#1b1f24"),
        Level::Bad => ("#b3352c", "#ffffff"),
    }
}

/// The legend.
const LEGEND: [(Level, &str); 5] = [
    (Level::Good, "as required"),
    (Level::Cautious, "deviations too large"),
    (Level::Fair, "beyond the requirement"),
    (Level::Poor, "far beyond"),
    (Level::Bad, "very far beyond"),
];

/// The picture as SVG.
#[must_use]
pub fn svg(results: &[(Cell, Sums)]) -> String {
    let is_shown = |(cell, _): &&(Cell, Sums)| cell.robot.is_nominal();
    let results: Vec<&(Cell, Sums)> = results.iter().filter(is_shown).collect();
    let rows = distinct(results.iter().map(|(cell, _)| (cell.family.name(), cell.objects.name())));
    let blocks = distinct(results.iter().map(|(cell, _)| (cell.robot.name(), cell.sensor.name())));
    let (tops, bottom) = tops(&rows);
    let block_width = Measure::ALL.len() * CELL + GAP;
    let (width, height) = (LABELS + blocks.len() * block_width, bottom + FOOT);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"10\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );
    // Writing to a String does not fail.
    let _ = write_labels(&mut svg, &rows, &tops);
    for (number, block) in blocks.iter().enumerate() {
        let _ = write_head(&mut svg, LABELS + number * block_width, *block);
    }
    for (cell, sums) in &results {
        let of_row = (cell.family.name(), cell.objects.name());
        let of_block = (cell.robot.name(), cell.sensor.name());
        let top = rows.iter().zip(&tops).find(|(row, _)| **row == of_row).map(|(_, top)| *top);
        let block = blocks.iter().position(|block| *block == of_block);
        if let (Some(top), Some(block)) = (top, block) {
            let _ = write_cell(&mut svg, LABELS + block * block_width, top, sums);
        }
    }
    let _ = write_legend(&mut svg, bottom + 8);
    svg.push_str("</svg>\n");
    svg
}

type Names = (&'static str, &'static str);

/// The names in the order in which they occur first.
fn distinct(names: impl Iterator<Item = Names>) -> Vec<Names> {
    let mut all = Vec::new();
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

/// The top of each row, and the bottom of the last one, pixels.
fn tops(rows: &[Names]) -> (Vec<usize>, usize) {
    let (mut next, mut family) = (HEAD, None);
    let mut tops = Vec::new();
    for (name, _) in rows {
        if family.is_some_and(|last| last != *name) {
            next += GROUP;
        }
        family = Some(*name);
        tops.push(next);
        next += ROW;
    }
    (tops, next)
}

fn write_labels(svg: &mut String, rows: &[Names], tops: &[usize]) -> std::fmt::Result {
    let mut last = "";
    for ((family, objects), top) in rows.iter().zip(tops) {
        let y = top + 11;
        if last != *family {
            writeln!(svg, "<text x=\"4\" y=\"{y}\" font-weight=\"bold\">{family}</text>")?;
        }
        last = family;
        let x = LABELS - 8;
        writeln!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"end\">{objects}</text>")?;
    }
    Ok(())
}

fn write_head(svg: &mut String, left: usize, (robot, sensor): Names) -> std::fmt::Result {
    writeln!(
        svg,
        "<text x=\"{left}\" y=\"16\" font-size=\"12\" font-weight=\"bold\">{sensor}, {robot}</text>"
    )?;
    for (number, measure) in Measure::ALL.iter().enumerate() {
        let x = left + number * CELL + CELL / 2;
        writeln!(svg, "<text x=\"{x}\" y=\"34\" text-anchor=\"middle\">{}</text>", measure.name)?;
    }
    Ok(())
}

fn write_cell(svg: &mut String, left: usize, top: usize, sums: &Sums) -> std::fmt::Result {
    for (number, measure) in Measure::ALL.iter().enumerate() {
        let (paper, ink) = colours((measure.level)(sums));
        let (x, value) = (left + number * CELL, (measure.of)(sums));
        let (middle, base) = (x + CELL / 2, top + 11);
        writeln!(
            svg,
            "<rect x=\"{x}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"{paper}\"/>\
             <text x=\"{middle}\" y=\"{base}\" fill=\"{ink}\" text-anchor=\"middle\">{value:.*}</text>",
            CELL - 1,
            ROW - 1,
            measure.decimals,
        )?;
    }
    Ok(())
}

fn write_legend(svg: &mut String, top: usize) -> std::fmt::Result {
    for (number, (level, text)) in LEGEND.into_iter().enumerate() {
        let (x, (paper, _)) = (LABELS + number * 160, colours(level));
        let (after, base) = (x + 20, top + 10);
        writeln!(
            svg,
            "<rect x=\"{x}\" y=\"{top}\" width=\"14\" height=\"12\" fill=\"{paper}\"/>\
             <text x=\"{after}\" y=\"{base}\">{text}</text>"
        )?;
    }
    Ok(())
}
