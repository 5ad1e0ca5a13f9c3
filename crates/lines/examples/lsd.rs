//! Line segments of a grey picture from a file, timed: the other half of `tests/benchmarks/line_detector.py`.
//!
//! The file holds, as little-endian 32-bit integers, the width, the height and the scale in thousandths; then one byte a pixel,
//! the rows from north to south. Prints the seconds of the fastest of five runs, then a line for each segment: its ends as
//! column and row of OpenCV's pixels, whose centres are whole numbers.

use gable_lines::{LsdParams, Source, detect_segments};
use gable_raster::{GridWindow, Raster};
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "the segments are read by the script")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give the file of the picture")?;
    let bytes = std::fs::read(path)?;
    let number = |k: usize| bytes[4 * k..4 * k + 4].iter().rev().fold(0, |n, &b| n << 8 | usize::from(b));
    let (width, height, scale) = (number(0), number(1), number(2) as f64 / 1000.0);
    let pixels = bytes.get(12..12 + width * height).ok_or("the file is too short")?;
    let window = GridWindow { step: 1.0, x0: 0, y0: 0, width, height };
    // Rows of rasters run north.
    let rows = pixels.chunks_exact(width).rev().flatten();
    let raster = Raster::new(window, rows.map(|&v| f32::from(v)).collect());
    let params = LsdParams { scale, min_length: 0.0, ..LsdParams::image() };
    let mut found = Vec::new();
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        found = detect_segments(&raster, Source::Image, &params);
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    println!("{fastest}");
    let row = |y: f64| height as f64 - y - 0.5;
    for segment in found.iter().map(|d| d.segment) {
        println!("{} {} {} {}", segment.a.x - 0.5, row(segment.a.y), segment.b.x - 0.5, row(segment.b.y));
    }
    Ok(())
}
