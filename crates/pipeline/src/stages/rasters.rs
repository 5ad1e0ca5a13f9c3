//! The city from above as cloud-optimised GeoTIFF: colours, heights, ground, heights above ground, and classes.

use super::Context;
use super::segment::Labelled;
use super::split::Blocks;
use crate::mosaic::Mosaic;
use crate::params::{Format, Params};
use crate::{PipelineError, Stage, artefact};
use gable_geometry::Box2;
use gable_gis_formats::geotiff::{Class, CogSet, NO_HEIGHT, PixelKind, Pixels, RasterGrid, RasterLayer, TILE};
use gable_gis_formats::{Error, GeoReference, raster_height};
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use gable_segmentation::{Label, Terrain};
use std::path::Path;

/// The files, relative to the result, in the order of the layers.
pub(crate) const FILES: [&str; 5] =
    ["rasters/orthophoto.tif", "rasters/dsm.tif", "rasters/dtm.tif", "rasters/ndsm.tif", "rasters/labels.tif"];

/// Whether the rasters are wanted.
pub(crate) fn are_wanted(params: &Params) -> bool {
    params.output.formats.contains(&Format::GeoTiff)
}

/// Writes the rasters that are wanted; returns their names relative to `out`.
pub(crate) fn write(
    context: &Context<'_>,
    blocks: &Blocks,
    ortho: &Mosaic<Orthograph>,
    labelled: &Labelled,
    terrain: &Terrain,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    let tiles = ortho.tiles().iter().map(|tile| tile.window.bounds());
    let city =
        GridWindow::covering(Box2::of(tiles.flat_map(|b| [b.min, b.max])).grown(-0.25 * ortho.step()), ortho.step());
    if !are_wanted(context.params) || city.is_empty() {
        return Ok(Vec::new());
    }
    artefact::create_dir(&out.join("rasters"))?;
    let origin = blocks.frame().origin;
    let bounds = city.bounds();
    let grid = RasterGrid {
        width: city.width,
        height: city.height,
        west: origin[0] + bounds.min.x,
        north: origin[1] + bounds.max.y,
        step: city.step,
    };
    let read = |column: usize, row: usize| -> Result<Vec<Pixels>, Failure> {
        context.check_cancelled()?;
        let north = city.y0 + city.height as i64 - (row * TILE) as i64;
        let window = GridWindow {
            step: city.step,
            x0: city.x0 + (column * TILE) as i64,
            y0: north - TILE as i64,
            width: TILE,
            height: TILE,
        };
        Ok(pixels(&ortho.read(window)?, labelled, terrain, origin[2])?)
    };
    let wrong = |error: &dyn std::fmt::Display| context.failed(Stage::Write, "rasters", error);
    let mut set = CogSet::make(layers(), grid, out, read).map_err(|failure| match failure {
        Failure::Pipeline(error) => error,
        Failure::Format(error) => wrong(&error),
    })?;
    let place = GeoReference::of(&blocks.frame().crs);
    for (layer, name) in FILES.into_iter().enumerate() {
        artefact::write_with(&out.join(name), |file| set.write(layer, &place, file))?;
    }
    Ok(FILES.map(str::to_owned).to_vec())
}

/// What goes wrong while tiles are made: of ours, or of the format.
enum Failure {
    Pipeline(PipelineError),
    Format(Error),
}

impl From<PipelineError> for Failure {
    fn from(error: PipelineError) -> Self {
        Self::Pipeline(error)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Format(error)
    }
}

fn layers() -> Vec<RasterLayer> {
    let layer = |description: &str, kind: PixelKind, has_world_heights: bool| RasterLayer {
        description: description.to_owned(),
        kind,
        has_world_heights,
    };
    let class = |label: Label| Class { value: label as u8, name: label.name().to_owned(), colour: label.colour() };
    vec![
        layer("orthophoto", PixelKind::Colour, false),
        layer("height of the topmost surface", PixelKind::Height, true),
        layer("height of the ground", PixelKind::Height, true),
        layer("height of the topmost surface above the ground", PixelKind::Height, false),
        layer("class", PixelKind::Class(Label::ALL.map(class).to_vec()), false),
    ]
}

/// The pixels of a tile, of each layer. Where no surface was seen, there is nothing in any of them.
fn pixels(maps: &Orthograph, labelled: &Labelled, terrain: &Terrain, zero: f64) -> Result<Vec<Pixels>, PipelineError> {
    let window = maps.window();
    let labels = labelled.read(window)?;
    let ground = terrain.raster(window);
    let count = window.len();
    let mut colours = Vec::with_capacity(count);
    let mut classes = Vec::with_capacity(count);
    let [mut top, mut bottom, mut above] = [(); 3].map(|()| Vec::with_capacity(count));
    for y in (0..window.height).rev() {
        for x in 0..window.width {
            let at = (x, y);
            let [surface, ground] = [maps.height[at], ground[at]].map(|z| raster_height(zero + f64::from(z)));
            if surface.is_nan() {
                colours.push([0; 4]);
                classes.push(artefact::NO_LABEL);
                for heights in [&mut top, &mut bottom, &mut above] {
                    heights.push(NO_HEIGHT);
                }
                continue;
            }
            let [red, green, blue] = maps.colour[at];
            colours.push([red, green, blue, 255]);
            classes.push(labels[at]);
            top.push(surface);
            let is_known = !ground.is_nan();
            bottom.push(if is_known { ground } else { NO_HEIGHT });
            // Both are multiples of the same step: the difference is exact.
            above.push(if is_known { surface - ground } else { NO_HEIGHT });
        }
    }
    Ok(vec![
        Pixels::Colours(colours),
        Pixels::Heights(top),
        Pixels::Heights(bottom),
        Pixels::Heights(above),
        Pixels::Classes(classes),
    ])
}
