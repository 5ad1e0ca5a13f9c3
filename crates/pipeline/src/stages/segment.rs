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
use crate::params::{Features, Params, TerrainModel};
use crate::{PipelineError, Stage};
use gable_geometry::Frame;
use gable_ortho::Orthograph;
use gable_parameters::Settings;
use gable_raster::{GridWindow, Raster};
use gable_segmentation::{Evidence, FeatureSet, Label, LabelInput, Labeller, Model, RegionParams, Terrain, saturated};
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
    let labelling = Labelling::new(context, frame, footprints, survey)?;
    let done: Vec<(GridWindow, Result<Found, String>)> = patches
        .par_iter()
        .map(|&patch| {
            context.check_cancelled()?;
            let found = match read_patch(context, patch)? {
                Some(found) => Ok(found),
                None => {
                    match guarded(Stage::Segment, &unit_name(patch), || labelling.label(context, ortho, terrain, patch))
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
fn classifier(context: &Context<'_>, method: &dyn Labeller, photographed: bool) -> Result<Model, PipelineError> {
    let params = &context.params.segmentation;
    let set = match (params.features, photographed) {
        (Features::Geometric, _) => FeatureSet::Geometric,
        (Features::Zhu27, true) => FeatureSet::Zhu27,
        (Features::Auto, true) => method.features(),
        (Features::Full, true) => FeatureSet::Full,
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

/// When a whole building is none.
pub(crate) fn region_params(params: &Params) -> Result<RegionParams, PipelineError> {
    let (method, settings) = params.labeller()?;
    method.regions(&settings).map_err(|e| PipelineError::Input(e.to_string()))
}

/// Labels patches: what has to be at hand for each of them.
pub(crate) struct Labelling<'a> {
    method: &'static dyn Labeller,
    settings: Settings,
    regions: RegionParams,
    model: Model,
    /// Brings the colours to the measure of other cities.
    saturation: Option<f32>,
    /// Noise of the mesh as a multiple of the usual.
    noise: f64,
    given: Option<LabelFolder>,
    footprints: Option<&'a Known>,
    frame: &'a Frame,
}

impl<'a> Labelling<'a> {
    /// As [`segment`] has it.
    pub(crate) fn new(
        context: &Context<'_>,
        frame: &'a Frame,
        footprints: Option<&'a Known>,
        survey: &Survey,
    ) -> Result<Self, PipelineError> {
        let (method, settings) = context.params.labeller()?;
        let regions = region_params(context.params)?;
        let model = classifier(context, method, survey.saturation.is_some())?;
        // The published features see what the camera saw.
        let saturation = survey.saturation.filter(|_| model.features == FeatureSet::Full).map(|factor| factor as f32);
        let given = context.params.segmentation.labels.as_deref();
        let given = given.map(|folder| LabelFolder::open(folder, context.reach)).transpose()?;
        Ok(Self { method, settings, regions, model, saturation, noise: survey.noise, given, footprints, frame })
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
        let seen = gable_segmentation::Orthograph {
            colour: self.model.features.needs_colour().then_some(&maps.colour),
            height: &maps.height,
            normal: &maps.normal,
        };
        let ground = match context.params.segmentation.terrain {
            TerrainModel::Surface => terrain.under(&maps.height),
            TerrainModel::Constant => Terrain::constant(terrain.height(centre(patch)) as f32).raster(window),
        };
        let input = LabelInput {
            maps: seen,
            terrain: &ground,
            classifier: &self.model,
            noise: self.noise,
            min_area: context.params.segmentation.min_area,
        };
        let found = self.method.label(&input, &self.settings);
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
        let evidence = Evidence::gather(&labels, &found, &maps.height, &marks, count, &self.regions);
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
        assert_eq!(region_params(&Params::default()).unwrap(), RegionParams::default());
        let published = Params::assemble(Some("zhu2018"), None, &[]).unwrap();
        assert_eq!(region_params(&published).unwrap(), RegionParams::zhu2018());
    }
}
