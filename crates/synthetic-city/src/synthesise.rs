//! Scene in, folder of tiles and truth out.

use crate::error::SynthError;
use crate::output::{obj, truth};
use crate::params::{Source, SynthParams, SynthProgress, SynthReport};
use crate::scene::{Scene, case, from_truth, place, town};
use crate::sensing::columns::{Columns, NONE};
use crate::sensing::{COLUMN, TriMesh, VOXEL, contour, decimate, defects, field, refine};
use crate::texture::{atlas, paint::Painter, render};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How far around a tile the scene is looked at for shadows and views, metres. What is higher than
/// its surroundings by more has its horizon cut there.
const MARGIN: f64 = 36.0;
/// From this density on, faces per m², the voxels may have too few faces.
const FINE: f64 = 20.0;
/// Voxels around a tile's core.
const RIM: i64 = 4;

/// Makes the scene of the parameters, without sensing it.
///
/// # Errors
/// Parameters out of range, or truth without buildings.
pub fn scene(params: &SynthParams) -> Result<Scene, SynthError> {
    params.check()?;
    match &params.source {
        Source::Procedural { area_km2 } => Ok(town(params.seed, *area_km2, params.slope)),
        Source::Case(case) => Ok(case::scene(*case, params.seed, params.slope)),
        Source::Place(place) => Ok(place::scene(place, params.seed, params.slope, params.look.season)),
        Source::Truth { model, repeat } => from_truth::scene(model, *repeat, params.seed, params.slope),
    }
}

/// Makes a city under `out`: `mesh/` as photogrammetry programs write it, and `truth/`.
///
/// Tiles are made in parallel and independently; memory is bounded by the scene's objects and a tile for
/// each thread. The same parameters give the same bytes.
///
/// # Errors
/// Parameters out of range, truth without buildings, or files that cannot be written.
pub fn synthesise(
    params: &SynthParams,
    out: &Path,
    progress: &(dyn Fn(SynthProgress) + Sync),
) -> Result<SynthReport, SynthError> {
    let scene = scene(params)?;
    let (mesh_folder, truth_folder) = (out.join("mesh"), out.join("truth"));
    for folder in [&mesh_folder, &truth_folder.join("labels"), &truth_folder.join("faces")] {
        fs::create_dir_all(folder).map_err(SynthError::io(folder))?;
    }
    obj::write_metadata(&mesh_folder, params.origin, &params.crs)?;
    let tiles = tiles(&scene, params.tile_size);
    let done = AtomicUsize::new(0);
    let results: Result<Vec<TileResult>, SynthError> = tiles
        .par_iter()
        .map(|tile| {
            let result = make_tile(&scene, params, tile, &mesh_folder, &truth_folder);
            progress(SynthProgress { done: done.fetch_add(1, Ordering::Relaxed) + 1, total: tiles.len() });
            result
        })
        .collect();
    let results = results?;
    let listed: Vec<Value> = results.iter().map(|r| r.about.clone()).collect();
    truth::write_scene(&truth_folder, &scene, params.origin, &params.crs, &listed)?;
    let size = scene.extent.size();
    Ok(SynthReport {
        tiles: tiles.len(),
        faces: results.iter().map(|r| r.faces).sum(),
        vertices: results.iter().map(|r| r.vertices).sum(),
        buildings: scene.buildings.len() - scene.hidden.len(),
        roof_faces: scene.buildings_of_truth().map(|b| b.roof.len()).sum(),
        trees: scene.trees.len(),
        area: size.x * size.y,
        bytes: results.iter().map(|r| r.bytes).sum(),
    })
}

/// A tile: its number and its core in voxels (x from, x to, y from, y to).
struct Tile {
    ix: i64,
    iy: i64,
    core: [i64; 4],
}

struct TileResult {
    faces: u64,
    vertices: u64,
    bytes: u64,
    about: Value,
}

fn tiles(scene: &Scene, size: f64) -> Vec<Tile> {
    let pitch = (size / VOXEL).round() as i64;
    let whole = |v: f64| (v / VOXEL).round() as i64;
    let (low, high) = (scene.extent.min, scene.extent.max);
    let (x0, x1, y0, y1) = (whole(low.x), whole(high.x), whole(low.y), whole(high.y));
    let mut tiles = Vec::new();
    for iy in y0.div_euclid(pitch)..=(y1 - 1).div_euclid(pitch) {
        for ix in x0.div_euclid(pitch)..=(x1 - 1).div_euclid(pitch) {
            let core =
                [(ix * pitch).max(x0), ((ix + 1) * pitch).min(x1), (iy * pitch).max(y0), ((iy + 1) * pitch).min(y1)];
            tiles.push(Tile { ix, iy, core });
        }
    }
    tiles
}

/// The mesh of a part of a scene, without textures: for tests and calibration.
///
/// # Errors
/// Parameters out of range, or truth without buildings.
pub fn mesh_of(params: &SynthParams) -> Result<TriMesh, SynthError> {
    let scene = scene(params)?;
    let mut all = TriMesh::default();
    for tile in tiles(&scene, params.tile_size) {
        let (_, mesh, _) = sense_tile(&scene, params, &tile);
        let first = all.vertices.len() as u32;
        all.vertices.extend(mesh.vertices);
        all.faces.extend(mesh.faces.iter().map(|f| f.map(|v| v + first)));
    }
    Ok(all)
}

fn sense_tile(scene: &Scene, params: &SynthParams, tile: &Tile) -> (Columns, TriMesh, Vec<bool>) {
    let [x0, x1, y0, y1] = tile.core;
    let margin = (MARGIN / COLUMN) as i64;
    let columns = Columns::sample(
        scene,
        2 * x0 - margin,
        2 * y0 - margin,
        (2 * (x1 - x0) + 2 * margin) as usize,
        (2 * (y1 - y0) + 2 * margin) as usize,
    );
    let (nx, ny) = ((x1 - x0 + 2 * RIM) as usize, (y1 - y0 + 2 * RIM) as usize);
    let field = field::sense(&columns, params.seed, params.noise, x0 - RIM, y0 - RIM, nx, ny);
    let mut fine = contour::surface(&field, tile.core);
    let area = (x1 - x0) as f64 * (y1 - y0) as f64 * VOXEL * VOXEL;
    let wanted = (area * params.density) as usize;
    // What the voxels have is enough up to here, and stays as it is.
    if params.density > FINE {
        refine::refine(&mut fine, wanted);
    }
    let mut mesh = decimate::decimate(&fine, wanted);
    if params.noise > 0.0 {
        defects::tear(&mut mesh, &field, &columns, params.seed);
        defects::spike_and_fold(&mut mesh, params.seed);
        defects::misplace(&mut mesh, params.seed, tile.ix, tile.iy);
        mesh.compact();
    }
    let plain = scene.faults.apply(&mut mesh);
    (columns, mesh, plain)
}

fn make_tile(
    scene: &Scene,
    params: &SynthParams,
    tile: &Tile,
    mesh_folder: &Path,
    truth_folder: &Path,
) -> Result<TileResult, SynthError> {
    let (columns, mesh, plain) = sense_tile(scene, params, tile);
    let name = obj::tile_name(tile.ix, tile.iy);
    let painter = Painter::new(scene, &columns, params.look);
    let classes: Vec<u8> = (0..mesh.faces.len())
        .map(|f| {
            let [a, b, c] = mesh.corners(f);
            painter.class((a + b + c) / 3.0, mesh.area_normal(f).normalize_or_zero()) as u8
        })
        .collect();
    let bytes = if params.texture {
        let atlas = atlas::unwrap(&mesh, params.look.texel);
        let picture = render::render(&mesh, &atlas, &painter, params.seed);
        obj::write_tile(mesh_folder, &name, &mesh, Some((&atlas, &picture)), &plain)?
    } else {
        obj::write_tile(mesh_folder, &name, &mesh, None, &plain)?
    };
    let labels = labels(scene, &columns, tile);
    truth::write_tile(truth_folder, &name, &labels, &classes)?;
    let [x0, x1, y0, y1] = tile.core.map(|v| v as f64 * VOXEL);
    let about = json!({
        "name": name, "ix": tile.ix, "iy": tile.iy, "extent": [x0, y0, x1, y1],
        "faces": mesh.faces.len(), "vertices": mesh.vertices.len(),
    });
    Ok(TileResult { faces: mesh.faces.len() as u64, vertices: mesh.vertices.len() as u64, bytes, about })
}

fn labels(scene: &Scene, columns: &Columns, tile: &Tile) -> truth::Labels {
    let [x0, x1, y0, y1] = tile.core.map(|v| 2 * v);
    let (width, height) = ((x1 - x0) as usize, (y1 - y0) as usize);
    let mut data = Vec::with_capacity(width * height);
    for j in 0..height {
        for i in 0..width {
            let (ci, cj) = (i + (x0 - columns.x0) as usize, j + (y0 - columns.y0) as usize);
            let column = &columns.data[cj * columns.width + ci];
            let label = columns.label(scene, column) as u8;
            // Where the mesh has no surface of its own, nobody could tell more than that the ground goes on under what was filled.
            let seen = scene.faults.has_surface(columns.centre(ci, cj));
            let hidden = column.building != NONE && scene.hidden.contains(&(column.building as usize));
            data.push(if seen && !hidden { label } else { truth::UNKNOWN });
        }
    }
    truth::Labels { x0, y0, width, height, data }
}
