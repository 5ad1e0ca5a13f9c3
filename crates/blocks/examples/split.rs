//! Splits a scene: `cargo run --release -p gable-blocks --example split -- SCENE FOLDER 16x16`.

use gable_blocks::{SplitOptions, read_block, split};
use gable_scene::{OpenOptions, Scene};
use std::path::Path;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "an example talks to the terminal")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, folder, grid] = &arguments[..] else { return Err("give a scene, a folder and a grid".into()) };
    let start = Instant::now();
    let scene = Scene::open(scene, &OpenOptions::default())?;
    let report = split(&scene, Path::new(folder), &SplitOptions { grid: grid.parse()?, step: 0.2 })?;
    let seconds = start.elapsed().as_secs_f64();
    let triangles: u64 = report.blocks.iter().map(|b| b.triangles).sum();
    let bytes: u64 = report.blocks.iter().map(|b| b.bytes).sum();
    let read = report.counts.bytes as f64 / 1e6;
    println!("{} triangles of {read:.0} MB in {seconds:.2} s, {:.0} MB/s", report.counts.triangles, read / seconds);
    println!("{triangles} in {} blocks, {:.1} bytes each", report.blocks.len(), bytes as f64 / triangles as f64);
    println!("{:.1} bytes each in the temporary file", report.spilled as f64 / report.counts.triangles as f64);
    println!("extent {:?} to {:?}, {:?}", report.min, report.max, report.outliers);
    println!("left out: {:?}", report.defects);
    let start = Instant::now();
    for block in &report.blocks {
        read_block(&Path::new(folder).join(&block.file))?;
    }
    println!("read in {:.2} s", start.elapsed().as_secs_f64());
    Ok(())
}
