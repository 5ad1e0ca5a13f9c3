//! What the fuzz targets share: a folder in memory, inputs of several files, and what is done with what was read.

use gable_city_model::{CityModel, Tolerances, quantised, triangulate, validate, write_citygml, write_cityjson};
use gable_files::Reach;
use gable_scene::{OpenOptions, Scene, SceneError, load_texture};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// What stands between the files of one input.
pub const BETWEEN: &[u8] = b"\n%%%%\n";

/// A folder of this process, in memory where the system has such folders, gone with it.
pub struct Folder(TempDir);

impl Default for Folder {
    fn default() -> Self {
        let memory = Path::new("/dev/shm");
        let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        Self(made.expect("a temporary folder"))
    }
}

impl Folder {
    /// Where it is.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes a file; gives its path.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("a temporary file");
        path
    }
}

/// The files that an input holds; those that it does not have are empty.
pub fn parts<const N: usize>(data: &[u8]) -> [&[u8]; N] {
    let mut rest = data;
    std::array::from_fn(|index| {
        let end = rest.windows(BETWEEN.len()).position(|w| w == BETWEEN).filter(|_| index + 1 < N);
        match end {
            Some(end) => {
                let part = &rest[..end];
                rest = &rest[end + BETWEEN.len()..];
                part
            }
            None => std::mem::take(&mut rest),
        }
    })
}

/// Reads a mesh with all that it names within `folder`, and its textures.
pub fn read_mesh(folder: &Path, path: &Path) {
    let reach = Reach::within([folder.to_owned()]).expect("the folder is there");
    let options = OpenOptions { reach: reach.clone(), ..OpenOptions::default() };
    let Ok(scene) = Scene::open(path, &options) else { return };
    let mut triangles = 0_u64;
    let content = scene.for_each_chunk(|chunk| {
        triangles += chunk.len() as u64;
        assert!(chunk.iter().flat_map(|t| t.corners).all(|c| c.is_finite()), "a corner is no number");
        Ok::<(), SceneError>(())
    });
    let Ok(content) = content else { return };
    assert_eq!(triangles, content.counts.triangles);
    for material in content.materials.iter().take(4) {
        let _ = load_texture(material, &reach);
    }
}

/// Does with a city model what is done with one: what is read can be triangulated, judged and written.
pub fn use_model(model: &CityModel) {
    for building in &model.buildings {
        let lods = &building.lods;
        for shell in [&lods.footprint, &lods.roof_edge].into_iter().flatten().chain(&lods.lod1).chain(&lods.lod2) {
            assert!(shell.is_well_formed());
            let _ = triangulate(shell);
            let _ = triangulate(&quantised(shell));
        }
        let _ = validate::validate_building(building, &Tolerances::default());
    }
    // What cannot be written is an error.
    let _ = write_cityjson(model, std::io::sink());
    let _ = write_citygml(model, std::io::sink());
}
