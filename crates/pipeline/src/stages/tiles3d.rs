//! 3D Tiles: the contents of a tile, and the tilesets of the city.

use super::Context;
use super::split::Blocks;
use crate::artefact;
use crate::mosaic::Mosaic;
use crate::{PipelineError, Stage};
use gable_city_model::tiles3d::{
    Content, GroundTexture, Layer, LayerLevel, TileLod, TilesetHeader, block_error, buildings_content, earth_transform,
    terrain_content, write_tileset,
};
use gable_city_model::{Building, Terrain as Tin};
use gable_ortho::{GridWindow, Orthograph};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Folder of the files, below the result's.
pub(crate) const FOLDER: &str = "3dtiles";

/// Longest side of the picture on the ground, pixels: what any graphics card takes, and what a block of 200 m has at 0.2 m.
const FINE: usize = 1024;
/// The same, for the ground from afar.
const COARSE: usize = 128;
/// Quality of the pictures, of 100.
const QUALITY: u8 = 82;
/// Colour of the ground where nothing was seen.
const UNSEEN: [u8; 3] = [150, 150, 146];

/// What was written of a tile: its levels by layer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Layers {
    /// Block models, then roof shapes.
    buildings: Option<Layer>,
    /// Each level of the buildings by itself.
    lods: Vec<Option<Layer>>,
    /// The ground under its picture, coarse, then fine.
    ground: Option<Layer>,
}

/// The levels that a viewer may hold on to, with the names of their tilesets.
const LODS: [(TileLod, &str); 3] = [(TileLod::Lod0, "lod0"), (TileLod::Lod1, "lod1"), (TileLod::Lod2, "lod2")];

/// Writes the contents of a tile; gives what to tell the tilesets, and the names of the files relative to `out`.
pub(crate) fn tile(
    context: &Context<'_>,
    window: GridWindow,
    tile: [u32; 2],
    buildings: &[Building],
    terrain: Option<&Tin>,
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
    }
    layers.buildings = layer(levels);
    if let Some(terrain) = terrain.filter(|_| !window.is_empty()) {
        let seen = ortho.read(window)?;
        let mut levels = Vec::new();
        let (coarse, fine) = (shrink(window, COARSE), shrink(window, FINE));
        let parts = [("ground-coarse", coarse), ("ground", fine)];
        // A picture may be as small as the coarse one already.
        for (part, factor) in parts.into_iter().skip(usize::from(coarse == fine)) {
            let jpeg = picture(&seen, factor).map_err(|e| context.failed(Stage::Write, &name, e))?;
            let texture = GroundTexture { jpeg, bounds: window.bounds() };
            // The shape is the same; what is missing from afar is what a pixel blurs.
            let error = if factor == fine { 0.0 } else { window.step * factor as f64 };
            levels.extend(put(part, error, terrain_content(terrain, &texture).map_err(wrong)?)?);
        }
        layers.ground = layer(levels);
    }
    Ok((layers, files))
}

/// Pixels that become one, so that no side is longer than `most`.
fn shrink(window: GridWindow, most: usize) -> usize {
    window.width.max(window.height).div_ceil(most).max(1)
}

/// The colours as JPEG, `factor` × `factor` pixels united to one, row 0 in the north.
fn picture(seen: &Orthograph, factor: usize) -> image::ImageResult<Vec<u8>> {
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
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY).write_image(
        &pixels,
        width as u32,
        height as u32,
        ExtendedColorType::Rgb8,
    )?;
    Ok(bytes)
}

/// Writes the tilesets; gives their names relative to `out`. `tileset.json` has all, with what is nearer shown finer; the others have
/// one layer each, for viewers that let people choose.
pub(crate) fn tilesets(
    blocks: &Blocks,
    tiles: &[Layers],
    title: &str,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    artefact::create_dir(&out.join(FOLDER))?;
    let frame = blocks.frame();
    let (low, high) = blocks.extent();
    let header = TilesetHeader {
        title: title.to_owned(),
        crs: frame.crs.to_string(),
        origin: frame.origin,
        transform: earth_transform(&frame.crs, frame.origin, (low + high) / 2.0),
    };
    let of = |pick: &dyn Fn(&Layers) -> Option<&Layer>| tiles.iter().filter_map(pick).cloned().collect::<Vec<_>>();
    let ground = of(&|l| l.ground.as_ref());
    let buildings = of(&|l| l.buildings.as_ref());
    let mut sets = vec![
        ("tileset", write_tileset(&header, &[&ground, &buildings])),
        ("ground", write_tileset(&header, &[&ground])),
        ("buildings", write_tileset(&header, &[&buildings])),
    ];
    for (i, (_, name)) in LODS.into_iter().enumerate() {
        let lod = of(&|l| l.lods.get(i)?.as_ref());
        sets.push((name, write_tileset(&header, &[&lod])));
    }
    let mut files = Vec::new();
    for (name, bytes) in sets {
        let file = format!("{FOLDER}/{name}.json");
        artefact::write(&out.join(&file), &bytes)?;
        files.push(file);
    }
    Ok(files)
}

/// Whether a file of [`FOLDER`] is one that a result may have.
pub(crate) fn is_ours(name: &str) -> bool {
    let sets = ["tileset.json", "ground.json", "buildings.json"];
    name.ends_with(".glb") || sets.contains(&name) || LODS.iter().any(|(_, lod)| name == format!("{lod}.json"))
}
