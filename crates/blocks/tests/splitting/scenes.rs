//! Scenes made for the tests, and helpers to split them.

use gable_blocks::{BlockTriangle, BlocksError, GridSpec, SplitOptions, SplitReport, read_block, split};
use gable_geometry::{Counter, DVec3, dvec3};
use gable_scene::{OpenOptions, Scene, Up};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A folder for one test.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes triangles as an OBJ file with a colour at each corner.
    pub(crate) fn obj(&self, name: &str, triangles: &[[DVec3; 3]]) -> PathBuf {
        let mut text = String::new();
        for (at, corners) in triangles.iter().enumerate() {
            for c in corners {
                let _ = writeln!(text, "v {} {} {} {} 7 255", c.x, c.y, c.z, at % 250 + 2);
            }
            text += "f -3 -2 -1\n";
        }
        let path = self.path().join(name);
        std::fs::write(&path, text).expect("temporary file");
        path
    }

    /// Splits a scene into a folder of its own.
    pub(crate) fn split(&self, scene: &Path, grid: GridSpec, into: &str) -> Result<SplitReport, BlocksError> {
        // Random scenes may look as if they lay on their side.
        let scene = Scene::open(scene, &OpenOptions { up: Up::Z, ..OpenOptions::default() }).expect("opens");
        split(&scene, &self.path().join(into), &SplitOptions { grid, step: 0.3 })
    }

    /// Each block's triangles.
    pub(crate) fn blocks(&self, report: &SplitReport, into: &str) -> Vec<Vec<BlockTriangle>> {
        let read = |file: &str| read_block(&self.path().join(into).join(file)).expect("reads").triangles;
        report.blocks.iter().map(|block| read(&block.file)).collect()
    }
}

/// A grid of so many columns and rows.
pub(crate) fn count(columns: u32, rows: u32) -> GridSpec {
    GridSpec::Count { columns: Some(columns), rows: Some(rows) }
}

/// Triangles of every size up to 60 m, strewn over 150 × 100 m in a projected system.
pub(crate) fn strewn(seed: u64, triangles: usize) -> Vec<[DVec3; 3]> {
    let mut random = Counter::new(seed);
    let mut one = || {
        let middle = dvec3(random.range(0.0, 150.0), random.range(0.0, 100.0), random.range(-3.0, 20.0));
        let size = random.range(0.1, 1.0).powi(6) * 60.0;
        let mut corner = || {
            let d = dvec3(random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-0.2, 0.2));
            middle + d * size + dvec3(451_000.3, 5_712_000.7, 0.0)
        };
        [corner(), corner(), corner()]
    };
    (0..triangles).map(|_| one()).collect()
}

/// A sheet of n × n cells of `cell` metres, south-west corner at a place.
pub(crate) fn sheet(n: i32, cell: f64, at: DVec3) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let p = |di: i32, dj: i32| at + dvec3(f64::from(i + di), f64::from(j + dj), 0.0) * cell;
            triangles.push([p(0, 0), p(1, 0), p(1, 1)]);
            triangles.push([p(0, 0), p(1, 1), p(0, 1)]);
        }
    }
    triangles
}
