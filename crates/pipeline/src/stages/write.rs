//! Tiles and the whole city as CityJSON, CityJSONSeq, CityGML and 3D Tiles, and the index of what was written.

use super::model::{self, Modelled, Tile};
use super::sample::Seen;
use super::split::Blocks;
use super::{Context, mesh_tiles, rasters, tiles3d, vectors};
use crate::artefact;
use crate::failure::{Failures, guarded, is_local};
use crate::mosaic::Mosaic;
use crate::params::{Format, Params};
use crate::summary::Lod;
use crate::{PipelineError, Stage};
use gable_city_model::tiles3d::Layer;
use gable_city_model::{Building, CityModel, Header, SeqWriter, Terrain as Tin};
use gable_geometry::dvec2;
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use gable_segmentation::Terrain;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What was written of a tile.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct IndexEntry {
    pub(crate) tile: [u32; 2],
    /// West, south, east, north; world coordinates, metres.
    pub(crate) bbox: [f64; 4],
    pub(crate) buildings: usize,
    pub(crate) files: Vec<String>,
    /// Why the block failed; absent if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) failed: Option<String>,
}

impl IndexEntry {
    /// Whether there is something of the tile, ground apart, or why there is not.
    pub(crate) fn is_listed(&self) -> bool {
        self.failed.is_some() || self.buildings > 0 || !self.files.is_empty()
    }
}

/// The index: which tiles there are, where, in which files.
#[derive(Clone, Debug, Serialize)]
struct Index<'a> {
    title: &'a str,
    crs: String,
    /// Easting, northing and height of the local origin, which OBJ and GLB are relative to.
    origin: [f64; 3],
    step_m: f64,
    grid: [u32; 2],
    city: Option<&'a str>,
    buildings: usize,
    tiles: Vec<IndexEntry>,
}

/// Name of the file of the whole city.
pub(crate) const CITY: &str = "city.city.jsonl";

/// The end of the names of files of CityGML 3.0.
const CITYGML3: &str = ".citygml3.gml";

/// Ends of the names of a tile's files; of those that end alike, the longer one first.
const OF_TILES: [&str; 6] = [".city.json", CITYGML3, ".gml", ".obj", ".mtl", ".glb"];

/// Writes all formats that are asked for; returns the names of the files, relative to `out`.
pub(crate) fn write(
    context: &Context<'_>,
    blocks: &Blocks,
    seen: &[Seen],
    tiles: &[Tile],
    terrain: &Terrain,
    ortho: &Mosaic<Orthograph>,
    failures: &mut Failures,
    title: &str,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    let owned = |ix, iy| tiles.iter().find(|t| (t.ix, t.iy) == (ix, iy));
    let seen_in = |ix, iy| seen.iter().find(|s| s.block == [ix, iy]);
    let mut wanted = blocks.with_data();
    wanted.retain(|&(ix, iy)| may_hold(context.params, seen_in(ix, iy), owned(ix, iy).is_some()));
    context.observer.stage(Stage::Write, wanted.len());
    artefact::create_dir(&out.join("tiles"))?;
    let made: Vec<_> = wanted
        .par_iter()
        .map(|&(ix, iy)| {
            context.check_cancelled()?;
            let name = format!("{ix}_{iy}");
            let made = guarded(Stage::Write, &name, || {
                let modelled = owned(ix, iy).map_or(Ok(Vec::new()), model::read)?;
                let mesh = seen_in(ix, iy).and_then(|s| s.mesh.as_ref());
                tile(context, blocks, [ix, iy], modelled, terrain, ortho, mesh, title, out)
            });
            let made = match made {
                Err(error) if is_local(&error) => Err(error.to_string()),
                other => Ok(other?),
            };
            context.observer.done(Stage::Write, &name);
            Ok(([ix, iy], made))
        })
        .collect::<Result<_, PipelineError>>()?;
    let mut made: BTreeMap<(u32, u32), Written> = made
        .into_iter()
        .map(|([ix, iy], made)| {
            let written = made.unwrap_or_else(|reason| {
                failures.add([ix, iy], reason);
                Written::default()
            });
            ((ix, iy), written)
        })
        .collect();
    let (mut entries, mut tins, mut layers) = (Vec::new(), Vec::new(), Vec::new());
    for (ix, iy) in blocks.with_data() {
        let written = made.remove(&(ix, iy)).unwrap_or_default();
        let entry = entry(blocks, [ix, iy], &written, failures);
        if written.terrain.is_some() || entry.is_listed() {
            entries.push(entry);
        }
        tins.push(written.terrain);
        layers.push(written.layers);
    }
    // Formats apart, what a tile has no file for the city has not either.
    let tiles: Vec<&Tile> =
        tiles.iter().filter(|t| entries.iter().all(|e| e.tile != [t.ix, t.iy] || e.buildings > 0)).collect();
    if context.params.output.formats.contains(&Format::CityJsonSeq) {
        city(context, blocks, &tiles, &tins, title, &out.join(CITY))?;
    }
    let mut files = index(context, blocks, entries, &layers, title, out)?;
    files.extend(vectors::write(context, blocks, &tiles, out)?);
    sweep(out, &files)?;
    Ok(files)
}

/// Whether there may be anything to write of a tile: a building that it owns, or ground that was seen there. A block that could not be
/// sampled, of which nothing is known, goes on as ground.
pub(crate) fn may_hold(params: &Params, seen: Option<&Seen>, owns: bool) -> bool {
    let is_seen = seen.is_none_or(|seen| seen.covered > 0 || seen.failed.is_some());
    owns || is_seen && (params.output.terrain || params.shows_mesh())
}

/// What was written of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Written {
    pub(crate) buildings: Vec<Building>,
    pub(crate) terrain: Option<Tin>,
    /// Names, relative to the folder of the result.
    pub(crate) files: Vec<String>,
    /// What the tilesets have to know.
    pub(crate) layers: tiles3d::Layers,
}

/// Writes the files of a tile; none of a format that would hold nothing.
pub(crate) fn tile(
    context: &Context<'_>,
    blocks: &Blocks,
    [ix, iy]: [u32; 2],
    modelled: Vec<Modelled>,
    terrain: &Terrain,
    ortho: &Mosaic<Orthograph>,
    mesh: Option<&Layer>,
    title: &str,
    out: &Path,
) -> Result<Written, PipelineError> {
    let tin = if context.params.output.terrain { tin(context, blocks, terrain, ix, iy)? } else { None };
    let model = CityModel {
        title: format!("{title}, tile {ix}_{iy}"),
        metadata: context.params.metadata(),
        origin: blocks.frame().origin,
        crs: blocks.frame().crs.clone(),
        buildings: written(modelled),
        terrain: tin,
    };
    let is_empty = model.buildings.is_empty() && model.terrain.is_none();
    let mut files = Vec::new();
    let mut layers = tiles3d::Layers::default();
    for format in &context.params.output.formats {
        let name = match format {
            Format::CityJson => format!("{ix}_{iy}.city.json"),
            Format::CityGml => format!("{ix}_{iy}.gml"),
            Format::CityGml3 => format!("{ix}_{iy}{CITYGML3}"),
            Format::Obj => format!("{ix}_{iy}.obj"),
            Format::Glb => format!("{ix}_{iy}.glb"),
            Format::Tiles3d => {
                let Some(window) = blocks.core(ix, iy) else { continue };
                let (buildings, tin) = (&model.buildings, model.terrain.as_ref().map(|tin| (terrain, tin)));
                let (made, names) = tiles3d::tile(context, window, [ix, iy], buildings, tin, ortho, out)?;
                let mesh = layers.mesh.take();
                layers = made;
                layers.mesh = mesh;
                files.extend(names);
                continue;
            }
            Format::MeshTiles3d => {
                if let Some(mesh) = mesh {
                    files.extend(mesh_tiles::put(context, mesh, out)?);
                    layers.mesh = Some(mesh.clone());
                }
                continue;
            }
            // These come once for the city.
            Format::CityJsonSeq | Format::GeoTiff | Format::GeoPackage | Format::FlatGeobuf | Format::GeoJson => {
                continue;
            }
        };
        if is_empty {
            continue;
        }
        let wrong = |e: gable_city_model::Error| context.failed(Stage::Write, &name, e);
        let mut bytes = Vec::new();
        match format {
            Format::CityGml => gable_city_model::write_citygml(&model, &mut bytes).map_err(wrong)?,
            Format::CityGml3 => gable_city_model::write_citygml3(&model, &mut bytes).map_err(wrong)?,
            Format::Glb => bytes = gable_city_model::write_glb(&model).map_err(wrong)?.unwrap_or_default(),
            Format::Obj => {
                let materials = format!("{ix}_{iy}.mtl");
                gable_city_model::write_obj(&model, &materials, &mut bytes).map_err(wrong)?;
                let mut text = Vec::new();
                gable_city_model::write_mtl(&mut text).map_err(wrong)?;
                let materials = format!("tiles/{materials}");
                artefact::write(&out.join(&materials), &text)?;
                files.push(materials);
            }
            _ => gable_city_model::write_cityjson(&model, &mut bytes).map_err(wrong)?,
        }
        let name = format!("tiles/{name}");
        artefact::write(&out.join(&name), &bytes)?;
        files.push(name);
    }
    Ok(Written { buildings: model.buildings, terrain: model.terrain, files, layers })
}

/// What the index tells of a tile.
pub(crate) fn entry(blocks: &Blocks, tile: [u32; 2], written: &Written, failures: &Failures) -> IndexEntry {
    IndexEntry {
        tile,
        bbox: blocks.world_box(tile[0], tile[1]),
        buildings: written.buildings.len(),
        files: written.files.clone(),
        failed: failures.reason(tile).map(str::to_owned),
    }
}

/// Writes the index and the tilesets; returns the names of all files of the result but those of the report.
pub(crate) fn index(
    context: &Context<'_>,
    blocks: &Blocks,
    tiles: Vec<IndexEntry>,
    layers: &[tiles3d::Layers],
    title: &str,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    let city = context.params.output.formats.contains(&Format::CityJsonSeq).then_some(CITY);
    let mut files: Vec<String> = city.map(str::to_owned).into_iter().collect();
    files.extend(tiles.iter().flat_map(|e| e.files.iter().cloned()));
    files.extend(tiles3d::tilesets(context, blocks, layers, title, out)?);
    let index = Index {
        title,
        crs: blocks.frame().crs.to_string(),
        origin: blocks.frame().origin,
        step_m: context.params.sampling.step,
        grid: blocks.grid(),
        city,
        buildings: tiles.iter().map(|e| e.buildings).sum(),
        tiles,
    };
    artefact::write_json(&out.join("index.json"), &index)?;
    files.push("index.json".to_owned());
    Ok(files)
}

/// Removes what an earlier result in the same folder had and this one has not: tiles of another grid, files of other
/// formats, and its report. Files of other names are not touched.
fn sweep(out: &Path, files: &[String]) -> Result<(), PipelineError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| PipelineError::Io { path, source }
    };
    let folder = out.join("tiles");
    let mut stale = vec![CITY.to_owned(), "report.html".to_owned(), "report.json".to_owned()];
    stale.extend(rasters::FILES.into_iter().chain(vectors::FILES).map(str::to_owned));
    for entry in std::fs::read_dir(&folder).map_err(failed(&folder))? {
        let name = entry.map_err(failed(&folder))?.file_name();
        let Some(name) = name.to_str() else { continue };
        let Some(stem) = OF_TILES.iter().find_map(|ending| name.strip_suffix(ending)) else { continue };
        let number = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
        if stem.split_once('_').is_some_and(|(ix, iy)| number(ix) && number(iy)) {
            stale.push(format!("tiles/{name}"));
        }
    }
    let folder = out.join(tiles3d::FOLDER);
    if folder.is_dir() {
        for entry in std::fs::read_dir(&folder).map_err(failed(&folder))? {
            let name = entry.map_err(failed(&folder))?.file_name();
            let name = name.to_str().filter(|name| tiles3d::is_ours(name));
            stale.extend(name.map(|name| format!("{}/{name}", tiles3d::FOLDER)));
        }
    }
    for name in stale.iter().filter(|name| !files.contains(name)) {
        let path = out.join(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(failed(&path)(e)),
            _ => {}
        }
    }
    Ok(())
}

/// The buildings that have a geometry.
fn written(modelled: Vec<Modelled>) -> Vec<Building> {
    modelled.into_iter().filter(|m| m.record.lod != Lod::None).map(|m| m.building).collect()
}

/// All buildings of the city, then its terrain, one feature a line.
fn city(
    context: &Context<'_>,
    blocks: &Blocks,
    tiles: &[&Tile],
    tins: &[Option<Tin>],
    title: &str,
    path: &Path,
) -> Result<(), PipelineError> {
    let header = header(context.params, blocks, title);
    let mut failure = None;
    artefact::write_with(path, |file| {
        let fill = || -> Result<(), PipelineError> {
            let wrong = |e: gable_city_model::Error| context.failed(Stage::Write, CITY, e);
            let mut writer = SeqWriter::new(file, &header).map_err(wrong)?;
            for tile in tiles {
                for building in written(model::read(tile)?) {
                    writer.write_building(&building).map_err(wrong)?;
                }
            }
            for tin in tins.iter().flatten() {
                writer.write_terrain(tin).map_err(wrong)?;
            }
            writer.finish().map_err(wrong)?;
            Ok(())
        };
        failure = fill().err();
        if failure.is_some() { Err(std::io::Error::other("not written")) } else { Ok(()) }
    })
    .map_err(|error| failure.take().unwrap_or(error))
}

/// The lines of a tile in the file of the whole city: of its buildings, and of its terrain. `header` is the city's, its
/// extent only to its lowest corner.
pub(crate) fn lines(context: &Context<'_>, header: &Header, written: &Written) -> Result<[Vec<u8>; 2], PipelineError> {
    let wrong = |e: gable_city_model::Error| context.failed(Stage::Write, CITY, e);
    let part = |buildings: &[Building], terrain: Option<&Tin>| {
        let mut writer = SeqWriter::new(Vec::new(), header).map_err(wrong)?;
        buildings.iter().try_for_each(|b| writer.write_building(b)).map_err(wrong)?;
        terrain.into_iter().try_for_each(|t| writer.write_terrain(t)).map_err(wrong)?;
        let bytes = writer.finish().map_err(wrong)?;
        // The first line is the header's.
        let first = bytes.iter().position(|&b| b == b'\n').map_or(bytes.len(), |end| end + 1);
        Ok::<_, PipelineError>(bytes[first..].to_vec())
    };
    Ok([part(&written.buildings, None)?, part(&[], written.terrain.as_ref())?])
}

/// The file of the whole city from the lines of its tiles: those of all buildings, then those of all terrain.
pub(crate) fn join(
    context: &Context<'_>,
    header: &Header,
    lines: &[PathBuf],
    path: &Path,
) -> Result<(), PipelineError> {
    let mut failure = None;
    artefact::write_with(path, |file| {
        let fill = || -> Result<(), PipelineError> {
            let wrong = |e: gable_city_model::Error| context.failed(Stage::Write, CITY, e);
            let mut file = SeqWriter::new(file, header).and_then(SeqWriter::finish).map_err(wrong)?;
            for part in lines {
                let io = |source| PipelineError::Io { path: part.clone(), source };
                std::io::copy(&mut std::fs::File::open(part).map_err(io)?, &mut file).map_err(io)?;
            }
            Ok(())
        };
        failure = fill().err();
        if failure.is_some() { Err(std::io::Error::other("not written")) } else { Ok(()) }
    })
    .map_err(|error| failure.take().unwrap_or(error))
}

/// The first line of the file of the whole city.
pub(crate) fn header(params: &Params, blocks: &Blocks, title: &str) -> Header {
    let frame = blocks.frame();
    Header {
        title: title.to_owned(),
        metadata: params.metadata(),
        origin: frame.origin,
        crs: frame.crs.clone(),
        extent: Some(blocks.extent()),
    }
}

/// The terrain of a tile as triangles; neighbours share the vertices along their border.
fn tin(
    context: &Context<'_>,
    blocks: &Blocks,
    terrain: &Terrain,
    ix: u32,
    iy: u32,
) -> Result<Option<Tin>, PipelineError> {
    let Some(core) = blocks.core(ix, iy) else { return Ok(None) };
    // Nodes every so many whole pixels; the last column and row may reach beyond the tile by less than a cell.
    let bounds = core.bounds();
    let cell = terrain_cell(context.params, core.step);
    let (width, height) = (nodes(bounds.size().x, cell), nodes(bounds.size().y, cell));
    let heights: Vec<f64> = (0..width * height)
        .map(|i| terrain.height(bounds.min + dvec2((i % width) as f64, (i / width) as f64) * cell))
        .collect();
    let tolerance = context.params.output.terrain_tolerance;
    let name = format!("terrain-{ix}-{iy}");
    gable_city_model::tin_from_grid(&name, &heights, width, height, cell, bounds.min, tolerance)
        .map(Some)
        .map_err(|e| context.failed(Stage::Write, &name, e))
}

/// Distance of the nodes of a written terrain: whole pixels, metres.
fn terrain_cell(params: &Params, step: f64) -> f64 {
    (params.segmentation.terrain_cell / step).round().max(1.0) * step
}

/// Where the ground is looked at for the terrain of a tile.
pub(crate) fn terrain_window(params: &Params, core: GridWindow) -> GridWindow {
    core.grown((terrain_cell(params, core.step) / core.step).ceil() as usize + 1)
}

/// Nodes along a side, at least two.
fn nodes(side: f64, cell: f64) -> usize {
    (side / cell).ceil().max(1.0) as usize + 1
}
