//! Labels for every patch of a fixed lattice.
//!
//! The lattice hangs on the local origin, not on the grid, so that a pixel gets the same label whatever the blocks; a
//! patch sees a margin around itself and keeps its core.

use super::terrain::Survey;
use super::{Context, prepare};
use crate::artefact::{self, LabelTile};
use crate::budget;
use crate::failure::{guarded, is_local};
use crate::known::Known;
use crate::label_map::{self, LabelFolder};
use crate::mosaic::{Mosaic, MosaicTile, TileData as _};
use crate::params::{Features, Method, Params, TerrainModel};
use crate::{PipelineError, Stage};
use gable_geometry::Frame;
use gable_ortho::Orthograph;
use gable_raster::{GridWindow, Raster};
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

/// Labels all patches with data.
pub(crate) fn segment(
    context: &Context<'_>,
    ortho: &Mosaic<Orthograph>,
    terrain: &Terrain,
    frame: &Frame,
    footprints: Option<&Known>,
    survey: &Survey,
) -> Result<Labelled, PipelineError> {
    let patches = patches(ortho, context.params.segmentation.patch);
    context.observer.stage(Stage::Segment, patches.len());
    let labeller = Labeller::new(context, frame, footprints, survey)?;
    let done: Vec<(GridWindow, Result<Found, String>)> = patches
        .par_iter()
        .map(|&patch| {
            context.check_cancelled()?;
            let found = match read_patch(context, patch)? {
                Some(found) => Ok(found),
                None => {
                    match guarded(Stage::Segment, &unit_name(patch), || labeller.label(context, ortho, terrain, patch))
                    {
                        Ok(made) => Ok(write_patch(context, patch, made)?),
                        Err(error) if is_local(&error) => Err(error.to_string()),
                        Err(error) => return Err(error),
                    }
                }
            };
            if found.is_ok() {
                context.observer.done(Stage::Segment, &unit_name(patch));
            }
            Ok((patch, found))
        })
        .collect::<Result<_, PipelineError>>()?;
    Ok(gather(context, done))
}

/// What was found on a patch: its components and the evidence on each.
pub(crate) type Found = (TileComponents, Vec<Evidence>);

/// The name of a patch among units of work, which is that of no block: its column and row on the lattice of patches.
pub(crate) fn unit_name(patch: GridWindow) -> String {
    let [column, row] =
        [(patch.x0, patch.width), (patch.y0, patch.height)].map(|(at, edge)| at.div_euclid(edge as i64));
    format!("patch_{column}_{row}")
}

/// The name of the files of a patch: its south-western pixel.
fn name(patch: GridWindow) -> String {
    format!("{}_{}", patch.x0, patch.y0)
}

/// Where the labels of a patch lie.
pub(crate) fn label_file(patch: GridWindow) -> String {
    format!("labels/{}.lab", name(patch))
}

fn found_file(patch: GridWindow) -> String {
    format!("labels/{}.json", name(patch))
}

/// What was found on a patch earlier, if both files of it are whole.
pub(crate) fn read_patch(context: &Context<'_>, patch: GridWindow) -> Result<Option<Found>, PipelineError> {
    let found = artefact::whole_json::<Found>(&context.workspace.path(&found_file(patch)))?;
    Ok(found.filter(|_| LabelTile::load(&context.workspace.path(&label_file(patch))).is_ok()))
}

/// Writes what was made of a patch.
pub(crate) fn write_patch(
    context: &Context<'_>,
    patch: GridWindow,
    (labels, components, evidence): (Raster<u8>, TileComponents, Vec<Evidence>),
) -> Result<Found, PipelineError> {
    LabelTile(labels).write(&context.workspace.path(&label_file(patch)))?;
    let found = (components, evidence);
    artefact::write_json(&context.workspace.path(&found_file(patch)), &found)?;
    Ok(found)
}

/// The files that [`write_patch`] writes.
pub(crate) fn patch_files(patch: GridWindow) -> [String; 2] {
    [label_file(patch), found_file(patch)]
}

/// All patches together.
pub(crate) fn gather(context: &Context<'_>, patches: Vec<(GridWindow, Result<Found, String>)>) -> Labelled {
    let step = context.params.sampling.step;
    let labels = Mosaic::new(Vec::new(), step, 0);
    let mut labelled = Labelled { components: Vec::new(), evidence: Vec::new(), labels, failed: Vec::new() };
    let mut tiles = Vec::new();
    for (patch, found) in patches {
        match found {
            Ok((components, evidence)) => {
                labelled.components.push(components);
                labelled.evidence.push(evidence);
                tiles.push(MosaicTile { window: patch, path: context.workspace.path(&label_file(patch)) });
            }
            Err(reason) => labelled.failed.push((patch, reason)),
        }
    }
    labelled.labels = Mosaic::new(tiles, step, context.cache_bytes() / 8);
    labelled
}

/// The patches of the lattice that hold a sampled tile, row by row.
pub(crate) fn patches(ortho: &Mosaic<Orthograph>, edge: usize) -> Vec<GridWindow> {
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
    let text = context.reach.read_text(path, budget::WEIGHTS).map_err(|e| PipelineError::Input(e.to_string()))?;
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
        wall_share: given.wall_share,
        probability: given.probability,
        long_core_share: given.narrow_share,
        ..RegionParams::default()
    }
}

/// Labels patches: what has to be at hand for each of them.
pub(crate) struct Labeller<'a> {
    model: Model,
    /// Brings the colours to the measure of other cities.
    saturation: Option<f32>,
    params: SegmentParams,
    given: Option<LabelFolder>,
    footprints: Option<&'a Known>,
    frame: &'a Frame,
}

impl<'a> Labeller<'a> {
    /// As [`segment`] has it.
    pub(crate) fn new(
        context: &Context<'_>,
        frame: &'a Frame,
        footprints: Option<&'a Known>,
        survey: &Survey,
    ) -> Result<Self, PipelineError> {
        let model = classifier(context, survey.saturation.is_some())?;
        // The published features see what the camera saw.
        let saturation = survey.saturation.filter(|_| model.features == FeatureSet::Full).map(|factor| factor as f32);
        let params = SegmentParams { noise: survey.noise, ..segment_params(context.params) };
        let given = context.params.segmentation.labels.as_deref();
        let given = given.map(|folder| LabelFolder::open(folder, context.reach)).transpose()?;
        Ok(Self { model, saturation, params, given, footprints, frame })
    }

    /// The labels of a patch, its components, and the evidence on each.
    pub(crate) fn label(
        &self,
        context: &Context<'_>,
        ortho: &Mosaic<Orthograph>,
        terrain: &Terrain,
        patch: GridWindow,
    ) -> Result<(Raster<u8>, TileComponents, Vec<Evidence>), PipelineError> {
        let window = seen_by(context.params, patch);
        let mut maps = prepare::read(ortho, window)?;
        if let Some(factor) = self.saturation {
            maps.colour = saturated(&maps.colour, factor);
        }
        let input = gable_segmentation::Orthograph {
            colour: self.model.features.needs_colour().then_some(&maps.colour),
            height: &maps.height,
            normal: &maps.normal,
        };
        let ground = match context.params.segmentation.terrain {
            TerrainModel::Surface => terrain.under(&maps.height),
            TerrainModel::Constant => Terrain::constant(terrain.height(centre(patch)) as f32).raster(window),
        };
        let found = gable_segmentation::segment(&input, &ground, &self.model, &self.params);
        let found = found.map_err(|e| context.failed(Stage::Segment, &unit_name(patch), e))?;
        let mut labels = found.labels.clone();
        for (label, z) in labels.values_mut().iter_mut().zip(maps.height.values()) {
            if z.is_nan() {
                *label = artefact::NO_LABEL;
            }
        }
        let mut core = labels.crop(patch, artefact::NO_LABEL);
        if let Some(given) = &self.given {
            correct(&mut core, &given.on(patch, self.frame)?);
        }
        if let Some(known) = self.footprints {
            confine(&mut core, &known.built(patch));
        }
        let (components, marks) = TileComponents::of(&core, |&l| l == Label::Building as u8);
        let count = components.components.len();
        let evidence = Evidence::gather(&labels, &found, &maps.height, &marks, count, &region_params(context.params));
        Ok((core, components, evidence))
    }
}

/// What the labelling of a patch sees of the cleaned rasters.
pub(crate) fn seen_by(params: &Params, patch: GridWindow) -> GridWindow {
    patch.grown(params.segmentation.margin)
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
