//! Small drawings inside the page: blocks by seconds, and histograms.

use crate::{BlockState, RunSummary};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Cells a side of the drawn grid at most; larger grids are drawn with several blocks in one cell.
const CELLS: u32 = 64;

/// What one cell of the drawn grid stands for.
#[derive(Default)]
struct Cell {
    seconds: f64,
    triangles: u64,
    buildings: u32,
    failed: Vec<String>,
    empty: bool,
    name: String,
}

/// The grid of blocks, north up, coloured by seconds.
pub(super) fn blocks(summary: &RunSummary) -> String {
    let [columns, rows] = summary.grid.map(|n| n.max(1));
    let together = columns.max(rows).div_ceil(CELLS).max(1);
    let (width, height) = (columns.div_ceil(together), rows.div_ceil(together));
    let mut cells: BTreeMap<(u32, u32), Cell> = BTreeMap::new();
    for block in &summary.blocks {
        let cell = cells.entry((block.iy / together, block.ix / together)).or_insert_with(|| Cell {
            empty: true,
            name: format!("{}_{}", block.ix, block.iy),
            ..Cell::default()
        });
        cell.seconds += block.seconds;
        cell.triangles += block.triangles;
        cell.buildings += block.buildings;
        cell.empty &= block.status == BlockState::Empty;
        if let BlockState::Failed(reason) = &block.status {
            cell.failed.push(reason.clone());
        }
    }
    let most = cells.values().map(|c| c.seconds).fold(1e-9, f64::max);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"blocks by seconds\" style=\"max-height:480px\">"
    );
    for y in 0..height {
        for x in 0..width {
            let empty = Cell { empty: true, ..Cell::default() };
            let cell = cells.get(&(y, x)).unwrap_or(&empty);
            let class = match (cell.failed.is_empty(), cell.empty) {
                (false, _) => "cell failed",
                (true, true) => "cell empty",
                (true, false) => "cell",
            };
            let fill = if class == "cell" { format!(" fill=\"{}\"", heat(cell.seconds / most)) } else { String::new() };
            let mut title = format!(
                "block {}: {:.2} s, {} triangles, {} buildings",
                cell.name, cell.seconds, cell.triangles, cell.buildings
            );
            for reason in &cell.failed {
                title += &format!("; failed: {}", super::html::escape(reason));
            }
            if class == "cell empty" {
                title = "no data".to_owned();
            }
            // Writing to a String cannot fail.
            let _ = write!(
                svg,
                "<rect class=\"{class}\" x=\"{x}\" y=\"{}\" width=\"1\" height=\"1\"{fill}><title>{title}</title></rect>",
                height - 1 - y
            );
        }
    }
    svg + "</svg>"
}

/// From pale to dark red.
fn heat(share: f64) -> String {
    let t = share.clamp(0.0, 1.0).sqrt();
    let mix = |a: f64, b: f64| (a + (b - a) * t).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(247.0, 158.0), mix(222.0, 42.0), mix(190.0, 43.0))
}

/// Columns for the number of values in equal classes from 0 to `top`, the last with all above.
pub(super) fn histogram(values: &[f64], top: f64, classes: usize, unit: &str) -> String {
    let mut counts = vec![0usize; classes];
    for value in values {
        let class = (value / top * classes as f64).max(0.0) as usize;
        counts[class.min(classes - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    let (width, height) = (400.0, 130.0);
    let column = width / classes as f64;
    let mut svg = format!("<svg viewBox=\"0 0 {width} {}\" role=\"img\">", height + 30.0);
    for (i, count) in counts.iter().enumerate() {
        let tall = (height - 12.0) * *count as f64 / most as f64;
        let (from, to) = (top * i as f64 / classes as f64, top * (i + 1) as f64 / classes as f64);
        let range =
            if i + 1 == classes { format!("over {from:.2} {unit}") } else { format!("{from:.2} to {to:.2} {unit}") };
        let _ = write!(
            svg,
            "<rect class=\"column\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{tall:.1}\"><title>{count} with {range}</title></rect>",
            i as f64 * column + 1.0,
            height - tall,
            column - 2.0
        );
    }
    let _ = write!(svg, "<line class=\"axis\" x1=\"0\" x2=\"{width}\" y1=\"{height}\" y2=\"{height}\"/>");
    for (share, anchor) in [(0.0, "start"), (0.5, "middle"), (1.0, "end")] {
        let more = if share == 1.0 { "≥ " } else { "" };
        let _ = write!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"{anchor}\">{more}{:.2} {unit}</text>",
            width * share,
            height + 18.0,
            top * share
        );
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BlockRecord;

    #[test]
    fn large_grids_are_drawn_coarser() {
        let record = |ix, iy, status| BlockRecord { ix, iy, status, triangles: 5, buildings: 1, seconds: 2.0 };
        let summary = RunSummary {
            grid: [200, 100],
            blocks: vec![
                record(0, 0, BlockState::Done),
                record(1, 0, BlockState::Done),
                record(199, 99, BlockState::Failed("a < b".to_owned())),
            ],
            ..RunSummary::default()
        };
        let svg = blocks(&summary);
        assert!(svg.contains("viewBox=\"0 0 50 25\""));
        assert!(svg.contains("4.00 s, 10 triangles, 2 buildings"));
        assert!(svg.contains("failed: a &lt; b") && svg.contains("cell failed"));
    }

    #[test]
    fn all_values_are_counted() {
        let svg = histogram(&[0.0, 0.05, 0.35, 9.0], 0.4, 4, "m");
        assert!(svg.contains("2 with 0.00 to 0.10 m") && svg.contains("2 with over 0.30 m"));
    }
}
