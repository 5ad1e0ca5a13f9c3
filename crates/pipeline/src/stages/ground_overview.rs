//! The ground of many tiles from afar: one picture on a coarse surface for each square of the quadtree.
//!
//! The writing of a tile keeps a small picture and a few heights of it. Squares are made from those, each from its quarters, so that
//! neither the rasters nor the terrain of the city are looked at again; one line of the tree is in memory at a time.

use super::Context;
use super::tiles3d::{UNSEEN, jpeg};
use crate::{PipelineError, Stage, artefact};
use gable_city_model::Terrain as Tin;
use gable_city_model::tiles3d::{GroundTexture, Layer, LayerLevel, Overview, quadtree, terrain_content};
use gable_geometry::{Box2, DVec2, dvec2, dvec3};
use gable_raster::GridWindow;
use gable_segmentation::Terrain;
use image::RgbImage;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Longest side of the picture that a tile gives, pixels.
pub(crate) const PART: usize = PIXELS / 2;
/// Longest side of an overview's picture, pixels.
const PIXELS: usize = 256;
/// Cells of heights along a side of a tile.
const PART_CELLS: usize = 16;
/// The same of an overview.
const CELLS: usize = 32;

/// What overviews take from a tile.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct GroundPart {
    bounds: Box2,
    /// Of the nodes of a grid over the bounds, row by row from the south-west.
    heights: Vec<f64>,
}

/// The artefact that holds the picture of a tile.
pub(crate) fn file([ix, iy]: [u32; 2]) -> String {
    format!("overview/{ix}_{iy}.png")
}

/// Keeps what overviews take from a tile.
pub(crate) fn keep(
    context: &Context<'_>,
    tile: [u32; 2],
    window: GridWindow,
    pixels: &[u8],
    [width, height]: [u32; 2],
    terrain: &Terrain,
) -> Result<GroundPart, PipelineError> {
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, pixels, width, height, image::ColorType::Rgb8, image::ImageFormat::Png)
        .map_err(|e| context.failed(Stage::Write, &file(tile), e))?;
    artefact::write(&context.workspace.path(&file(tile)), &png.into_inner())?;
    let bounds = window.bounds();
    // To the millimetre, which is short as text.
    let heights = nodes(bounds, PART_CELLS).map(|p| (terrain.height(p) * 1000.0).round() / 1000.0).collect();
    Ok(GroundPart { bounds, heights })
}

/// Places of the nodes of a grid.
fn nodes(bounds: Box2, cells: usize) -> impl Iterator<Item = DVec2> {
    let at = move |i: usize| dvec2((i % (cells + 1)) as f64, (i / (cells + 1)) as f64) / cells as f64;
    (0..(cells + 1) * (cells + 1)).map(move |i| bounds.min + at(i) * bounds.size())
}

/// The ground of a tile or of a square of tiles.
struct Ground {
    bounds: Box2,
    picture: RgbImage,
    cells: usize,
    heights: Vec<f64>,
    /// The largest geometric error of what is shown of it nearer by.
    error: f64,
}

impl Ground {
    fn contains(&self, p: DVec2) -> bool {
        p.cmpge(self.bounds.min).all() && p.cmple(self.bounds.max).all()
    }

    fn colour(&self, p: DVec2) -> [u8; 3] {
        let part = (p - self.bounds.min) / self.bounds.size();
        let at = |part: f64, most: u32| ((part * f64::from(most)) as u32).min(most - 1);
        let (width, height) = self.picture.dimensions();
        self.picture.get_pixel(at(part.x, width), at(1.0 - part.y, height)).0
    }

    /// Interpolated between the nodes; not a number where the ground is not known.
    fn height(&self, p: DVec2) -> f64 {
        let at = (p - self.bounds.min) / self.bounds.size() * self.cells as f64;
        let cell = at.floor().clamp(DVec2::ZERO, DVec2::splat(self.cells as f64 - 1.0));
        let part = at - cell;
        let first = cell.y as usize * (self.cells + 1) + cell.x as usize;
        let node = |right: usize, up: usize| self.heights[first + right + up * (self.cells + 1)];
        // A node that is met exactly counts alone: what is beyond it may not be known.
        let mix = |a: f64, b: f64, t: f64| {
            if t <= 0.0 {
                a
            } else if t >= 1.0 {
                b
            } else {
                a + (b - a) * t
            }
        };
        mix(mix(node(0, 0), node(1, 0), part.x), mix(node(0, 1), node(1, 1), part.x), part.y)
    }

    /// One ground of several.
    fn of(parts: &[Self]) -> Self {
        let bounds = Box2::of(parts.iter().flat_map(|part| [part.bounds.min, part.bounds.max]));
        let size = bounds.size();
        let pixel = size.max_element() / PIXELS as f64;
        let [width, height] = [size.x, size.y].map(|side| (side / pixel).round().max(1.0) as u32);
        let part_at = |p: DVec2| parts.iter().find(|part| part.contains(p));
        let picture = RgbImage::from_fn(width, height, |column, row| {
            // Four probes: the pictures of the parts are up to twice as fine.
            let mut sum = [0_u32; 3];
            for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                let x = (f64::from(column) + dx) / f64::from(width) * size.x;
                let y = (f64::from(row) + dy) / f64::from(height) * size.y;
                let p = dvec2(bounds.min.x + x, bounds.max.y - y);
                let colour = part_at(p).map_or(UNSEEN, |part| part.colour(p));
                (0..3).for_each(|i| sum[i] += u32::from(colour[i]));
            }
            image::Rgb(sum.map(|v| ((v + 2) / 4) as u8))
        });
        let known = |p: DVec2| {
            let heights = parts.iter().filter(|part| part.contains(p)).map(|part| part.height(p));
            heights.into_iter().find(|z| !z.is_nan()).unwrap_or(f64::NAN)
        };
        let heights = nodes(bounds, CELLS).map(known).collect();
        let error = parts.iter().map(|part| part.error).fold(pixel, |error, part| error.max(2.0 * part));
        Self { bounds, picture, cells: CELLS, heights, error }
    }

    /// Its surface; cells without a known height are left out.
    fn surface(&self) -> Tin {
        let mut number = vec![u32::MAX; self.heights.len()];
        let mut surface = Tin { id: "overview".to_owned(), ..Tin::default() };
        for (i, p) in nodes(self.bounds, self.cells).enumerate().filter(|&(i, _)| !self.heights[i].is_nan()) {
            number[i] = surface.vertices.len() as u32;
            surface.vertices.push(dvec3(p.x, p.y, self.heights[i]));
        }
        let side = self.cells + 1;
        for i in (0..self.cells * self.cells).map(|i| i / self.cells * side + i % self.cells) {
            let [a, b, c, d] = [i, i + 1, i + 1 + side, i + side].map(|i| number[i]);
            surface.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| !t.contains(&u32::MAX)));
        }
        surface
    }
}

/// Makes the overviews of the ground and writes them into `folder`.
pub(crate) fn write(
    context: &Context<'_>,
    tiles: &[(&Layer, &GroundPart)],
    folder: &Path,
) -> Result<Vec<Overview>, PipelineError> {
    // Both ends of the tree may fail; the first fault is told.
    let fault = std::cell::OnceCell::new();
    let mut made = Vec::new();
    let tiles: Vec<_> = tiles.iter().map(|(layer, part)| (layer.tile, (*layer, *part))).collect();
    let mut load = |(layer, part): &(&Layer, &GroundPart)| {
        let path = context.workspace.path(&file(layer.tile));
        match image::open(&path) {
            Ok(picture) => Some(Ground {
                bounds: part.bounds,
                picture: picture.into_rgb8(),
                cells: PART_CELLS,
                heights: part.heights.clone(),
                error: layer.levels.iter().map(|level| level.error).fold(0.0, f64::max),
            }),
            Err(e) => {
                fault.get_or_init(|| PipelineError::Artefact { path, reason: e.to_string() });
                None
            }
        }
    };
    let mut unite = |corner: [u32; 2], side: u32, parts: Vec<Ground>| {
        let ground = Ground::of(&parts);
        let name = format!("{}_{}-{side}.ground-overview.glb", corner[0], corner[1]);
        match content(context, &ground, &name, folder) {
            Ok(level) => made.extend(level.map(|level| Overview { corner, side, level })),
            Err(error) => drop(fault.set(error)),
        }
        Some(ground)
    };
    quadtree(&tiles, &mut load, &mut unite);
    fault.into_inner().map_or(Ok(made), Err)
}

fn content(
    context: &Context<'_>,
    ground: &Ground,
    name: &str,
    folder: &Path,
) -> Result<Option<LayerLevel>, PipelineError> {
    let (width, height) = ground.picture.dimensions();
    let jpeg = jpeg(ground.picture.as_raw(), width, height).map_err(|e| context.failed(Stage::Report, name, e))?;
    let texture = GroundTexture { jpeg, bounds: ground.bounds };
    let content = terrain_content(&ground.surface(), &texture).map_err(|e| context.failed(Stage::Report, name, e))?;
    let Some(content) = content else { return Ok(None) };
    artefact::write(&folder.join(name), &content.glb)?;
    Ok(Some(LayerLevel { uri: name.to_owned(), error: ground.error, low: content.low, high: content.high }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(x: f64, colour: [u8; 3]) -> Ground {
        let bounds = Box2 { min: dvec2(x, 0.0), max: dvec2(x + 10.0, 10.0) };
        Ground {
            bounds,
            picture: RgbImage::from_pixel(128, 128, image::Rgb(colour)),
            cells: PART_CELLS,
            heights: nodes(bounds, PART_CELLS).map(|p| 5.0 + 0.1 * p.x).collect(),
            error: 0.04,
        }
    }

    #[test]
    fn a_square_shows_its_parts_where_they_are() {
        let ground = Ground::of(&[part(0.0, [200, 0, 0]), part(10.0, [0, 0, 200])]);
        assert_eq!(ground.picture.dimensions(), (256, 128));
        assert_eq!(ground.picture.get_pixel(127, 5).0, [200, 0, 0]);
        assert_eq!(ground.picture.get_pixel(128, 5).0, [0, 0, 200]);
        assert!(ground.error >= 0.08);
        let surface = ground.surface();
        assert_eq!(surface.triangles.len(), 2 * CELLS * CELLS);
        assert!(surface.vertices.iter().all(|p| (p.z - 5.0 - 0.1 * p.x).abs() < 1e-9));

        // Where no tile is, there is no ground.
        let gap = Ground::of(&[part(0.0, [200, 0, 0]), part(30.0, [0, 0, 200])]);
        assert_eq!(gap.picture.get_pixel(128, 5).0, UNSEEN);
        let surface = gap.surface();
        assert!(surface.triangles.len() < 2 * CELLS * CELLS && !surface.triangles.is_empty());
        assert!(surface.vertices.iter().all(|p| p.x <= 10.0 || p.x >= 30.0));
    }
}
