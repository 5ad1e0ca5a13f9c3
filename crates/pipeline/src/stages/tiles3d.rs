//! 3D Tiles: the contents of a tile, and the tilesets of the city.

use super::Context;
use super::ground_overview::{self, GroundPart};
use super::split::Blocks;
use crate::artefact;
use crate::geography;
use crate::mosaic::Mosaic;
use crate::params::Format;
use crate::{PipelineError, Stage};
use gable_city_model::tiles3d::{
    Content, GroundTexture, Layer, LayerLevel, TileLayer, TileLod, TilesetHeader, block_error, boxes,
    buildings_content, earth_transform, terrain_content, write_tileset,
};
use gable_city_model::{Building, Terrain as Tin};
use gable_geometry::DVec3;
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use gable_segmentation::Terrain;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Folder of the files, below the result's.
pub(crate) const FOLDER: &str = "3dtiles";

/// Longest side of the picture on the ground, pixels: what any graphics card takes, and what a block of 200 m has at 0.2 m.
const FINE: usize = 1024;
/// The same, for the ground from afar.
const COARSE: usize = 256;
/// Quality of the pictures, of 100.
const QUALITY: u8 = 82;
/// Colour of the ground where nothing was seen.
pub(crate) const UNSEEN: [u8; 3] = [150, 150, 146];

/// What was written of a tile: its levels by layer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Layers {
    /// Boxes, then block models, then roof shapes.
    buildings: Option<Layer>,
    /// Each level of the buildings by itself.
    lods: Vec<Option<Layer>>,
    /// The ground under its picture, coarse, then fine.
    ground: Option<Layer>,
    /// What overviews of the ground take from it.
    #[serde(default)]
    ground_part: Option<GroundPart>,
    /// The mesh that the city was modelled from.
    #[serde(default)]
    pub(crate) mesh: Option<Layer>,
}

/// The levels that a viewer may hold on to, with the names of their tilesets.
const LODS: [(TileLod, &str); 3] = [(TileLod::Lod0, "lod0"), (TileLod::Lod1, "lod1"), (TileLod::Lod2, "lod2")];

/// Writes the contents of a tile; gives what to tell the tilesets, and the names of the files relative to `out`.
pub(crate) fn tile(
    context: &Context<'_>,
    window: GridWindow,
    tile: [u32; 2],
    buildings: &[Building],
    terrain: Option<(&Terrain, &Tin)>,
    ortho: &Mosaic<Orthograph>,
    out: &Path,
) -> Result<(Layers, Vec<String>), PipelineError> {
    artefact::create_dir(&out.join(FOLDER))?;
    let [ix, iy] = tile;
    let name = format!("{ix}_{iy}");
    let wrong = |e: gable_city_model::Error| context.failed(Stage::Write, &name, e);
    let mut files = Vec::new();
    let mut put = |part: &str, error: f64, content: Option<Content>| -> Result<Option<LayerLevel>, PipelineError> {
        let Some(content) = content else { return Ok(None) };
        let uri = format!("{name}.{part}.glb");
        let file = format!("{FOLDER}/{uri}");
        artefact::write(&out.join(&file), &content.glb)?;
        files.push(file);
        Ok(Some(LayerLevel { uri, error, low: content.low, high: content.high }))
    };
    let layer = |levels: Vec<LayerLevel>| (!levels.is_empty()).then_some(Layer { tile, levels });
    let mut layers = Layers::default();
    let mut levels = Vec::new();
    for (lod, part) in LODS {
        let level = put(part, 0.0, buildings_content(buildings, lod).map_err(wrong)?)?;
        layers.lods.push(layer(level.iter().cloned().collect()));
        if lod != TileLod::Lod0 {
            levels.extend(level);
        }
    }
    if let Some(blocks) = levels.first_mut() {
        blocks.error = block_error(buildings);
        // A whole city of block models is more than a viewer can draw in time.
        if let Some((boxes, error)) = boxes(buildings) {
            let error = blocks.error + error;
            let far = put("far", error, buildings_content(&boxes, TileLod::Lod1).map_err(wrong)?)?;
            levels.splice(0..0, far);
        }
    }
    layers.buildings = layer(levels);
    if let Some((surface, terrain)) = terrain.filter(|_| !window.is_empty()) {
        let seen = ortho.read(window)?;
        let mut levels = Vec::new();
        let (coarse, fine) = (shrink(window, COARSE), shrink(window, FINE));
        let parts = [("ground-coarse", coarse), ("ground", fine)];
        // A picture may be as small as the coarse one already.
        for (part, factor) in parts.into_iter().skip(usize::from(coarse == fine)) {
            let (pixels, [width, height]) = picture(&seen, factor);
            let jpeg = jpeg(&pixels, width, height).map_err(|e| context.failed(Stage::Write, &name, e))?;
            let texture = GroundTexture { jpeg, bounds: window.bounds() };
            // The shape is the same; what is missing from afar is what a pixel blurs.
            let error = if factor == fine { 0.0 } else { window.step * factor as f64 };
            levels.extend(put(part, error, terrain_content(terrain, &texture).map_err(wrong)?)?);
        }
        layers.ground = layer(levels);
        let (pixels, size) = picture(&seen, shrink(window, ground_overview::PART));
        layers.ground_part = Some(ground_overview::keep(context, tile, window, &pixels, size, surface)?);
    }
    Ok((layers, files))
}

/// Pixels that become one, so that no side is longer than `most`.
fn shrink(window: GridWindow, most: usize) -> usize {
    window.width.max(window.height).div_ceil(most).max(1)
}

/// The colours, `factor` × `factor` pixels united to one, row 0 in the north; and how many columns and rows there are.
fn picture(seen: &Orthograph, factor: usize) -> (Vec<u8>, [u32; 2]) {
    let window = seen.window();
    let (width, height) = (window.width.div_ceil(factor), window.height.div_ceil(factor));
    let mut pixels = Vec::with_capacity(width * height * 3);
    for row in (0..height).rev() {
        for column in 0..width {
            let (mut sum, mut count) = ([0_u32; 3], 0);
            for y in row * factor..((row + 1) * factor).min(window.height) {
                for x in column * factor..((column + 1) * factor).min(window.width) {
                    if !seen.height[(x, y)].is_nan() {
                        let colour = seen.colour[(x, y)];
                        (0..3).for_each(|i| sum[i] += u32::from(colour[i]));
                        count += 1;
                    }
                }
            }
            let mean = |i: usize| (sum[i] + count / 2).checked_div(count).map_or(UNSEEN[i], |v| v as u8);
            pixels.extend((0..3).map(mean));
        }
    }
    (pixels, [width as u32, height as u32])
}

pub(crate) fn jpeg(pixels: &[u8], width: u32, height: u32) -> image::ImageResult<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY).write_image(pixels, width, height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

/// Writes the tilesets that the formats ask for; gives their names relative to `out`. `tileset.json` has the whole model, with what is
/// nearer shown finer; the others have one layer each, for viewers that let people choose.
pub(crate) fn tilesets(
    context: &Context<'_>,
    blocks: &Blocks,
    tiles: &[Layers],
    title: &str,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    let params = context.params;
    let model = params.output.formats.contains(&Format::Tiles3d);
    if !model && !params.shows_mesh() {
        return Ok(Vec::new());
    }
    artefact::create_dir(&out.join(FOLDER))?;
    let frame = blocks.frame();
    let (low, high) = blocks.extent();
    let centre = (low + high) / 2.0;
    let world = DVec3::from_array(frame.origin) + centre;
    let zero = geography::zero(&frame.crs, world, params.geoid()?).metres;
    let header = TilesetHeader {
        title: title.to_owned(),
        crs: frame.crs.to_string(),
        origin: frame.origin,
        transform: earth_transform(&frame.crs, frame.origin, centre, zero),
    };
    let of = |pick: &dyn Fn(&Layers) -> Option<&Layer>| tiles.iter().filter_map(pick).cloned().collect::<Vec<_>>();
    let (mut sets, mut files) = (Vec::new(), Vec::new());
    if model {
        let ground = of(&|l| l.ground.as_ref());
        let buildings = of(&|l| l.buildings.as_ref());
        let parts = tiles.iter().filter_map(|l| Some((l.ground.as_ref()?, l.ground_part.as_ref()?)));
        let overviews = ground_overview::write(context, &parts.collect::<Vec<_>>(), &out.join(FOLDER))?;
        files.extend(overviews.iter().map(|overview| format!("{FOLDER}/{}", overview.level.uri)));
        let ground = TileLayer { tiles: &ground, overviews: &overviews };
        sets.push(("tileset", write_tileset(&header, &[ground, plain(&buildings)])));
        sets.push(("ground", write_tileset(&header, &[ground])));
        sets.push(("buildings", write_tileset(&header, &[plain(&buildings)])));
        for (i, (_, name)) in LODS.into_iter().enumerate() {
            let lod = of(&|l| l.lods.get(i)?.as_ref());
            sets.push((name, write_tileset(&header, &[plain(&lod)])));
        }
    }
    if params.shows_mesh() {
        sets.push(("mesh", write_tileset(&header, &[plain(&of(&|l| l.mesh.as_ref()))])));
    }
    for (name, bytes) in sets {
        let file = format!("{FOLDER}/{name}.json");
        artefact::write(&out.join(&file), &bytes)?;
        files.push(file);
    }
    Ok(files)
}

/// A layer whose tiles stand for themselves only.
fn plain(tiles: &[Layer]) -> TileLayer<'_> {
    TileLayer { tiles, overviews: &[] }
}

/// Whether a file of [`FOLDER`] is one that a result may have.
pub(crate) fn is_ours(name: &str) -> bool {
    let sets = ["tileset.json", "ground.json", "buildings.json", "mesh.json"];
    name.ends_with(".glb") || sets.contains(&name) || LODS.iter().any(|(_, lod)| name == format!("{lod}.json"))
}
