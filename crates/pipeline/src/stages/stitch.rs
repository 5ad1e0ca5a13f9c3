//! From components of patches to whole buildings with names and owners.

use super::Context;
use crate::known::{Footprint, Known};
use crate::{PipelineError, Stage};
use gable_geometry::{DVec2, Frame};
use gable_ortho::{GridWindow, Raster};
use gable_stitching::{Component, TileComponents, Whole, building_ids, unite};

/// A building that is to be modelled.
#[derive(Clone, Debug)]
pub(crate) struct Task {
    pub(crate) id: String,
    pub(crate) whole: Whole,
    /// Mean of its pixels, local metres.
    pub(crate) centroid: DVec2,
    /// Its footprint, where that was given: the building is what was seen inside it.
    pub(crate) footprint: Option<Footprint>,
}

/// Whole buildings of at least the smallest area, ordered by place.
pub(crate) fn stitch(
    context: &Context<'_>,
    components: &[TileComponents],
    frame: &Frame,
    footprints: Option<&Known>,
) -> Result<Vec<Task>, PipelineError> {
    context.observer.stage(Stage::Stitch, 1);
    context.check_cancelled()?;
    let step = context.params.sampling.step;
    if let Some(known) = footprints {
        let tasks = known.footprints.iter().filter_map(|f| given(f, step)).collect();
        context.observer.done(Stage::Stitch, "city");
        return Ok(tasks);
    }
    let smallest = context.params.segmentation.min_area;
    let wholes: Vec<Whole> = unite(components).into_iter().filter(|w| w.area(step) >= smallest).collect();
    let centroids: Vec<DVec2> = wholes.iter().map(|w| w.centroid(step)).collect();
    let ids = building_ids(&centroids, frame);
    let tasks = wholes.into_iter().zip(ids).zip(centroids);
    context.observer.done(Stage::Stitch, "city");
    Ok(tasks.map(|((whole, id), centroid)| Task { id, whole, centroid, footprint: None }).collect())
}

/// The building of a footprint; `None` if that holds no pixel.
fn given(footprint: &Footprint, step: f64) -> Option<Task> {
    let mut inside = Raster::filled(GridWindow::covering(footprint.bounds, step), false);
    footprint.draw(&mut inside);
    let (parts, _) = TileComponents::of(&inside, |&i| i);
    let mut parts = parts.components.into_iter();
    let first = parts.next()?;
    let extent = parts.fold(first, |a, b| Component {
        pixels: a.pixels + b.pixels,
        sum_x: a.sum_x + b.sum_x,
        sum_y: a.sum_y + b.sum_y,
        columns: [a.columns[0].min(b.columns[0]), a.columns[1].max(b.columns[1])],
        rows: [a.rows[0].min(b.rows[0]), a.rows[1].max(b.rows[1])],
    });
    let whole = Whole { pieces: Vec::new(), extent };
    let centroid = whole.centroid(step);
    Some(Task { id: footprint.id.clone(), whole, centroid, footprint: Some(footprint.clone()) })
}
