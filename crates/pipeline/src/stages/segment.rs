//! Labels for every patch of a fixed lattice.
//!
//! The lattice hangs on the local origin, not on the grid, so that a pixel gets the same label whatever the blocks; a
//! patch sees a margin around itself and keeps its core.

use super::{Context, prepare};
use crate::artefact::{self, LabelTile};
use crate::failure::{guarded, is_local};
use crate::known::Known;
use crate::label_map::{self, LabelFolder};
use crate::mosaic::{Mosaic, MosaicTile, TileData as _};
use crate::params::{Features, Method, Params, TerrainModel};
use crate::{PipelineError, Stage};
use gable_geometry::Frame;
use gable_ortho::{GridWindow, Orthograph, Raster};
use gable_segmentation::{
    CleanupParams, Evidence, FeatureSet, Label, Model, RegionParams, SegmentParams, Terrain, saturated,
};
use gable_stitching::TileComponents;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The labelled patches: their components with the evidence on each, and the mosaic of their labels.
pub(crate) struct Labelled {
    pub(crate) components: Vec<TileComponents>,
    pub(crate) evidence: Vec<Vec<Evidence>>,
    pub(crate) labels: Mosaic<LabelTile>,
    /// Patches that could not be labelled, with the reason.
    pub(crate) failed: Vec<(GridWindow, String)>,
}

/// Labels all patches with data. `saturation` brings the colours to the measure of other cities; without it the mesh has
/// no photographs.
pub(crate) fn segment(
    context: &Context<'_>,
    ortho: &Mosaic<Orthograph>,
    terrain: &Terrain,
    frame: &Frame,
    footprints: Option<&Known>,
    saturation: Option<f32>,
) -> Result<Labelled, PipelineError> {
    let patches = patches(ortho, context.params.segmentation.patch);
    context.observer.stage(Stage::Segment, patches.len());
    let model = classifier(context, saturation.is_some())?;
    // The published features see what the camera saw.
    let saturation = if model.features == FeatureSet::Full { saturation } else { None };
    let params = segment_params(context.params);
    let given = context.params.segmentation.labels.as_deref().map(LabelFolder::open).transpose()?;
    let adjust = |labels: &mut Raster<u8>| {
        if let Some(given) = &given {
            correct(labels, &given.on(labels.window(), frame)?);
        }
        if let Some(known) = footprints {
            confine(labels, &known.built(labels.window()));
        }
        Ok(())
    };
    let done: Vec<Result<(TileComponents, Vec<Evidence>, MosaicTile), (GridWindow, String)>> = patches
        .par_iter()
        .map(|&patch| {
            context.check_cancelled()?;
            let name = format!("{}_{}", patch.x0, patch.y0);
            let path = context.workspace.path(&format!("labels/{name}.lab"));
            let beside = context.workspace.path(&format!("labels/{name}.json"));
            let found = artefact::whole_json::<(TileComponents, Vec<Evidence>)>(&beside)?;
            let (components, evidence) = match found.filter(|_| LabelTile::load(&path).is_ok()) {
                Some(found) => found,
                None => {
                    let made = guarded(Stage::Segment, &name, || {
                        label(context, ortho, terrain, &model, saturation, &params, patch, &adjust)
                    });
                    let (labels, components, evidence) = match made {
                        Ok(made) => made,
                        Err(error) if is_local(&error) => return Ok(Err((patch, error.to_string()))),
                        Err(error) => return Err(error),
                    };
                    LabelTile(labels).write(&path)?;
                    let found = (components, evidence);
                    artefact::write_json(&beside, &found)?;
                    found
                }
            };
            context.observer.done(Stage::Segment, &name);
            Ok(Ok((components, evidence, MosaicTile { window: patch, path })))
        })
        .collect::<Result<_, PipelineError>>()?;
    let labels = Mosaic::new(Vec::new(), ortho.step(), 0);
    let mut labelled = Labelled { components: Vec::new(), evidence: Vec::new(), labels, failed: Vec::new() };
    let mut tiles = Vec::new();
    for patch in done {
        match patch {
            Ok((components, evidence, tile)) => {
                labelled.components.push(components);
                labelled.evidence.push(evidence);
                tiles.push(tile);
            }
            Err(failure) => labelled.failed.push(failure),
        }
    }
    labelled.labels = Mosaic::new(tiles, ortho.step(), context.cache_bytes() / 8);
    Ok(labelled)
}

/// The patches of the lattice that hold a sampled tile, row by row.
fn patches(ortho: &Mosaic<Orthograph>, edge: usize) -> Vec<GridWindow> {
    let e = edge as i64;
    let mut cells = BTreeSet::new();
    for tile in ortho.tiles() {
        let w = tile.window;
        for y in w.y0.div_euclid(e)..=(w.y0 + w.height as i64 - 1).div_euclid(e) {
            for x in w.x0.div_euclid(e)..=(w.x0 + w.width as i64 - 1).div_euclid(e) {
                cells.insert((y, x));
            }
        }
    }
    let window = |(y, x)| GridWindow { step: ortho.step(), x0: x * e, y0: y * e, width: edge, height: edge };
    cells.into_iter().map(window).collect()
}

/// The tree classifier.
fn classifier(context: &Context<'_>, photographed: bool) -> Result<Model, PipelineError> {
    let params = &context.params.segmentation;
    let set = match (params.features, photographed) {
        (Features::Geometric, _) => FeatureSet::Geometric,
        (Features::Zhu27, true) => FeatureSet::Zhu27,
        (Features::Auto, true) if params.method == Method::Zhu2018 => FeatureSet::Zhu27,
        (Features::Auto | Features::Full, true) => FeatureSet::Full,
        (_, false) => {
            context.observer.warning("the mesh has no texture: trees are told from buildings by their shape alone");
            FeatureSet::Geometric
        }
    };
    let Some(path) = &params.weights else { return Ok(Model::shipped(set)) };
    let wrong = |reason: String| PipelineError::Input(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    let model = Model::from_json(&text).map_err(|e| wrong(e.to_string()))?;
    if model.features.needs_colour() && !photographed {
        return Err(wrong("these weights look at colour, and the mesh has none".to_owned()));
    }
    Ok(model)
}

fn segment_params(params: &Params) -> SegmentParams {
    let given = &params.segmentation;
    let published = given.method == Method::Zhu2018;
    let base = if published { SegmentParams::zhu2018() } else { SegmentParams::default() };
    SegmentParams {
        height: given.h_trunc,
        steepness: given.steepness,
        tree_weight: given.tree_weight,
        tree_share: given.tree_share,
        doubt: given.doubt,
        smoothness: given.mu,
        step_smoothness: given.step_smoothness,
        cleanup: CleanupParams {
            opening: given.opening,
            closing: given.closing,
            hole_area: given.hole_area,
            // The published method judges no region; too small buildings are dropped when all pieces are united.
            building_area: if published { base.cleanup.building_area } else { given.min_area },
            roof_tree_area: given.roof_tree_area,
            building_tree_share: given.building_tree_share,
            ..base.cleanup
        },
        ..base
    }
}

/// When a whole building is none.
pub(crate) fn region_params(params: &Params) -> RegionParams {
    let given = &params.segmentation;
    RegionParams {
        half_width: given.min_width / 2.0,
        tree_share: given.building_tree_share,
        among_trees: given.among_trees,
        ..RegionParams::default()
    }
}

fn label(
    context: &Context<'_>,
    ortho: &Mosaic<Orthograph>,
    terrain: &Terrain,
    model: &Model,
    saturation: Option<f32>,
    params: &SegmentParams,
    patch: GridWindow,
    adjust: &(dyn Fn(&mut Raster<u8>) -> Result<(), PipelineError> + Sync),
) -> Result<(Raster<u8>, TileComponents, Vec<Evidence>), PipelineError> {
    let window = patch.grown(context.params.segmentation.margin);
    let mut maps = prepare::read(ortho, window)?;
    if let Some(factor) = saturation {
        maps.colour = saturated(&maps.colour, factor);
    }
    let input = gable_segmentation::Orthograph {
        colour: model.features.needs_colour().then_some(&maps.colour),
        height: &maps.height,
        normal: &maps.normal,
    };
    let ground = match context.params.segmentation.terrain {
        TerrainModel::Surface => terrain.raster(window),
        TerrainModel::Constant => Terrain::constant(terrain.height(centre(patch)) as f32).raster(window),
    };
    let found = gable_segmentation::segment(&input, &ground, model, params);
    let found = found.map_err(|e| context.failed(Stage::Segment, &format!("{}_{}", patch.x0, patch.y0), e))?;
    let mut labels = found.labels;
    for (label, z) in labels.values_mut().iter_mut().zip(maps.height.values()) {
        if z.is_nan() {
            *label = artefact::NO_LABEL;
        }
    }
    let mut core = labels.crop(patch, artefact::NO_LABEL);
    adjust(&mut core)?;
    let (components, marks) = TileComponents::of(&core, |&l| l == Label::Building as u8);
    let count = components.components.len();
    let evidence = Evidence::gather(&labels, &found.plants, &marks, count, &region_params(context.params));
    Ok((core, components, evidence))
}

/// Replaces labels by those that are given, where there are any and a surface was seen.
fn correct(labels: &mut Raster<u8>, given: &Raster<u8>) {
    for (label, &given) in labels.values_mut().iter_mut().zip(given.values()) {
        if *label != artefact::NO_LABEL && given != label_map::NONE {
            *label = given;
        }
    }
}

/// Makes building what lies in a footprint, and nothing else.
fn confine(labels: &mut Raster<u8>, built: &Raster<bool>) {
    let building = Label::Building as u8;
    for (label, &built) in labels.values_mut().iter_mut().zip(built.values()) {
        match (built, *label) {
            (_, artefact::NO_LABEL) => {}
            (true, _) => *label = building,
            (false, other) if other == building => *label = Label::Ground as u8,
            (false, _) => {}
        }
    }
}

fn centre(window: GridWindow) -> gable_geometry::DVec2 {
    let b = window.bounds();
    0.5 * (b.min + b.max)
}

impl Labelled {
    /// The labels on a window.
    pub(crate) fn read(&self, window: GridWindow) -> Result<Raster<u8>, PipelineError> {
        Ok(self.labels.read(window)?.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_given_holds_where_a_surface_was_seen() {
        let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 5, height: 1 };
        assert_eq!(label_map::CLASSES, Label::ALL.map(Label::name), "numbers of classes mean the same");
        let (building, tree) = (Label::Building as u8, Label::Tree as u8);
        let mut labels = Raster::new(window, vec![0, building, building, tree, artefact::NO_LABEL]);
        correct(&mut labels, &Raster::new(window, vec![tree, label_map::NONE, 1, building, building]));
        assert_eq!(labels.values(), [tree, building, 1, building, artefact::NO_LABEL]);
        confine(&mut labels, &Raster::new(window, vec![true, false, false, false, true]));
        assert_eq!(labels.values(), [building, 0, 1, 0, artefact::NO_LABEL]);
    }

    #[test]
    fn regions_are_judged_by_default_and_never_by_the_published_method() {
        assert_eq!(region_params(&Params::default()), RegionParams::default());
        let published = region_params(&Params::assemble(Some("zhu2018"), None, &[]).unwrap());
        assert_eq!(RegionParams { core_share: 0.0, ..published }, RegionParams::zhu2018());
    }

    #[test]
    fn the_defaults_are_the_labelling_crates_and_the_preset_is_the_published_rule() {
        let params = Params::default();
        let mut expected = SegmentParams::default();
        expected.cleanup.building_area = params.segmentation.min_area;
        assert_eq!(segment_params(&params), expected);

        let published = SegmentParams::zhu2018();
        for (preset, settings) in [(Some("zhu2018"), vec![]), (None, vec![("method".to_owned(), "zhu2018".to_owned())])]
        {
            let found = segment_params(&Params::assemble(preset, None, &settings).unwrap());
            // These belong to the other method and are not looked at.
            let ours = SegmentParams::default();
            let unused = SegmentParams {
                tree_weight: ours.tree_weight,
                tree_share: ours.tree_share,
                doubt: ours.doubt,
                ..published
            };
            assert_eq!(found, unused);
        }
    }
}
