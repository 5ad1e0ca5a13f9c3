//! The truth: solids, labels, terrain, trees.
//!
//! Layout under `truth/` (all coordinates local unless named world; `truth.json` has the frame):
//!
//! | File | Content |
//! |---|---|
//! | `truth.json` | frame, extent, tiles, codes of classes |
//! | `truth.city.jsonl` | terrain, buildings at LOD0–2, CityJSONSeq in world coordinates |
//! | `labels/{tile}.png` | class of what is uppermost, 8 bit, 0.2 m, row 0 north |
//! | `labels/{tile}.json` | place of the raster |
//! | `faces/{tile}.u8` | class of each face, one byte each, in the order of the OBJ file |
//! | `terrain.f32`, `terrain.json` | bare ground, little-endian f32, 1 m, row 0 south |
//! | `trees.json` | place, ground, height, crown radius, species |

use crate::error::SynthError;
use crate::scene::Scene;
use crate::sensing::COLUMN;
use crate::sensing::columns::Class;
use gable_city_model::{Header, SeqWriter, Terrain};
use gable_geometry::{Crs, DVec3, dvec2};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Grid of the terrain, metres.
const TERRAIN_STEP: f64 = 1.0;

/// Grid of the terrain's triangles, metres; the fine one where the ground has steps.
const TIN_STEP: f64 = 5.0;
const FINE_STEP: f64 = 0.5;

/// In label pictures: the mesh has no surface of its own there, or one that does not tell.
pub(crate) const UNKNOWN: u8 = 255;

/// Writes everything that does not belong to a tile.
pub(crate) fn write_scene(
    folder: &Path,
    scene: &Scene,
    origin: [f64; 3],
    crs: &Crs,
    tiles: &[Value],
) -> Result<(), SynthError> {
    let world = json!({ "origin": origin, "crs": crs.to_string() });
    let codes = json!({
        "ground": Class::Ground as u8,
        "grass": Class::Grass as u8,
        "tree": Class::Tree as u8,
        "building": Class::Building as u8,
        "clutter": Class::Clutter as u8,
    });
    let extent = json!([scene.extent.min.x, scene.extent.min.y, scene.extent.max.x, scene.extent.max.y]);
    let head = json!({ "frame": world, "extent": extent, "classes": codes, "label_step": COLUMN, "tiles": tiles });
    write_json(&folder.join("truth.json"), &head)?;
    let trees: Vec<Value> = scene
        .trees
        .iter()
        .map(|t| {
            json!({
                "x": round(t.place.x), "y": round(t.place.y), "ground": round(t.ground), "height": round(t.height),
                "crown_radius": round(t.radius), "species": t.species,
            })
        })
        .collect();
    write_json(&folder.join("trees.json"), &json!({ "frame": world, "trees": trees }))?;
    write_terrain(folder, scene, &world)?;
    write_buildings(folder, scene, origin, crs)
}

fn round(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}

fn write_json(path: &Path, value: &Value) -> Result<(), SynthError> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(|e| SynthError::Truth { path: path.to_owned(), reason: e.to_string() })?;
    text.push(b'\n');
    fs::write(path, text).map_err(SynthError::io(path))
}

fn write_terrain(folder: &Path, scene: &Scene, world: &Value) -> Result<(), SynthError> {
    let size = (scene.extent.size() / TERRAIN_STEP).ceil() + 1.0;
    let (nx, ny) = (size.x as usize, size.y as usize);
    let path = folder.join("terrain.f32");
    let mut out = BufWriter::new(File::create(&path).map_err(SynthError::io(&path))?);
    for j in 0..ny {
        for i in 0..nx {
            let p = scene.extent.min + dvec2(i as f64, j as f64) * TERRAIN_STEP;
            let z = scene.ground(p) as f32;
            out.write_all(&z.to_le_bytes()).map_err(SynthError::io(&path))?;
        }
    }
    out.flush().map_err(SynthError::io(&path))?;
    let low = [scene.extent.min.x, scene.extent.min.y];
    let about = json!({
        "frame": world, "file": "terrain.f32", "type": "f32le", "samples": "nodes", "row0": "south",
        "step": TERRAIN_STEP, "width": nx, "height": ny, "lower_left": low,
    });
    write_json(&folder.join("terrain.json"), &about)
}

fn write_buildings(folder: &Path, scene: &Scene, origin: [f64; 3], crs: &Crs) -> Result<(), SynthError> {
    let path = folder.join("truth.city.jsonl");
    let wrong = |reason: String| SynthError::Truth { path: path.clone(), reason };
    let out = BufWriter::new(File::create(&path).map_err(SynthError::io(&path))?);
    let corners = || scene.buildings_of_truth().flat_map(|b| &b.truth.lods.lod2).flat_map(|s| &s.vertices);
    let extent = corners().fold(None, |extent: Option<(DVec3, DVec3)>, &p| {
        Some(extent.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
    });
    let header =
        Header { title: "Synthetic city".to_owned(), metadata: Default::default(), origin, crs: crs.clone(), extent };
    let mut writer = SeqWriter::new(out, &header).map_err(|e| wrong(e.to_string()))?;
    writer.write_terrain(&tin(scene)).map_err(|e| wrong(e.to_string()))?;
    for building in scene.buildings_of_truth() {
        writer.write_building(&building.truth).map_err(|e| wrong(e.to_string()))?;
    }
    let mut out = writer.finish().map_err(|e| wrong(e.to_string()))?;
    out.flush().map_err(SynthError::io(&path))
}

/// The bare ground as triangles over a grid; flat to within 2 cm between its nodes, but for the edges of water and steps.
fn tin(scene: &Scene) -> Terrain {
    let size = scene.extent.size();
    let step = if scene.fine_ground { FINE_STEP } else { TIN_STEP };
    let (nx, ny) = ((size.x / step).ceil() as u32 + 1, (size.y / step).ceil() as u32 + 1);
    let mut terrain = Terrain { id: "terrain".to_owned(), ..Terrain::default() };
    for j in 0..ny {
        for i in 0..nx {
            let p = (scene.extent.min + dvec2(f64::from(i), f64::from(j)) * step).min(scene.extent.max);
            terrain.vertices.push(p.extend(scene.ground(p)));
            if i + 1 < nx && j + 1 < ny {
                let k = j * nx + i;
                terrain.triangles.extend([[k, k + 1, k + nx + 1], [k, k + nx + 1, k + nx]]);
            }
        }
    }
    terrain
}

/// A label raster of a tile: `labels` row 0 south, its lower left corner at lattice (x0, y0).
pub(crate) struct Labels {
    pub(crate) x0: i64,
    pub(crate) y0: i64,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<u8>,
}

/// Writes the labels and face classes of a tile.
pub(crate) fn write_tile(folder: &Path, name: &str, labels: &Labels, faces: &[u8]) -> Result<(), SynthError> {
    let path = folder.join("labels").join(format!("{name}.png"));
    let mut flipped = Vec::with_capacity(labels.data.len());
    for row in labels.data.chunks_exact(labels.width).rev() {
        flipped.extend_from_slice(row);
    }
    let file = File::create(&path).map_err(SynthError::io(&path))?;
    let mut out = BufWriter::new(file);
    PngEncoder::new(&mut out)
        .write_image(&flipped, labels.width as u32, labels.height as u32, ExtendedColorType::L8)
        .map_err(|source| SynthError::Picture { path: path.clone(), source })?;
    out.flush().map_err(SynthError::io(&path))?;
    let about = json!({
        "file": format!("{name}.png"), "step": COLUMN, "width": labels.width, "height": labels.height, "row0": "north",
        "lower_left": [labels.x0 as f64 * COLUMN, labels.y0 as f64 * COLUMN],
        "lattice": [labels.x0, labels.y0],
    });
    write_json(&folder.join("labels").join(format!("{name}.json")), &about)?;
    let path = folder.join("faces").join(format!("{name}.u8"));
    fs::write(&path, faces).map_err(SynthError::io(path))
}
