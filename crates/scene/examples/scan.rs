//! Streams a scene and says what is in it: `cargo run --release -p gable-scene --example scan -- PATH`.

use gable_scene::{Content, OpenOptions, Scene, SceneError};
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "an example talks to the terminal")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give the path of a mesh or a folder")?;
    let start = Instant::now();
    let scene = Scene::open(&path, &OpenOptions::default())?;
    println!("{} files, {}, {:.1?}", scene.files().len(), scene.crs(), start.elapsed());
    let Content { counts, materials } = scene.for_each_chunk(|_| Ok::<(), SceneError>(()))?;
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{counts:#?}\n{} materials, {seconds:.2} s, {:.0} MB/s",
        materials.len(),
        counts.bytes as f64 / seconds / 1e6
    );
    Ok(())
}
