//! From components of patches to whole buildings with names and owners.
//!
//! Only here is a building whole, so only here is it judged whether it is one at all.

use super::Context;
use super::segment::{Labelled, region_params};
use crate::artefact::LabelTile;
use crate::known::{Footprint, Known};
use crate::mosaic::{Mosaic, MosaicTile};
use crate::{PipelineError, Stage};
use gable_geometry::{DVec2, Frame};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::{Evidence, Label, RegionParams};
use gable_stitching::{Component, TileComponents, Whole, building_ids, unite};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A building that is to be modelled.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Task {
    pub(crate) id: String,
    /// Pixels, moments and extent of all its pieces together.
    pub(crate) extent: Component,
    /// Where its footprint stands in the list of those that were given: the building is what was seen inside it.
    pub(crate) footprint: Option<usize>,
    /// Why it was taken for a building; `None` where the footprint was given.
    #[serde(default)]
    pub(crate) evidence: Option<Evidence>,
}

impl Task {
    fn whole(&self) -> Whole {
        Whole { pieces: Vec::new(), extent: self.extent.clone() }
    }

    /// The smallest window that holds it.
    pub(crate) fn window(&self, step: f64) -> GridWindow {
        self.whole().window(step)
    }

    /// Mean of its pixels, local metres.
    pub(crate) fn centroid(&self, step: f64) -> DVec2 {
        self.whole().centroid(step)
    }

    /// Its area, m².
    pub(crate) fn area(&self, step: f64) -> f64 {
        self.whole().area(step)
    }
}

/// Whole buildings of at least the smallest area, ordered by place. What is none gets another label.
pub(crate) fn stitch(
    context: &Context<'_>,
    labelled: Labelled,
    frame: &Frame,
    footprints: Option<&Known>,
) -> Result<(Vec<Task>, Labelled), PipelineError> {
    context.observer.stage(Stage::Stitch, 1);
    context.check_cancelled()?;
    let step = context.params.sampling.step;
    if let Some(known) = footprints {
        let tasks = known.footprints.iter().enumerate().filter_map(|(i, f)| given(i, f, step)).collect();
        context.observer.done(Stage::Stitch, "city");
        return Ok((tasks, labelled));
    }
    let (smallest, lowest) = (context.params.segmentation.min_area, context.params.segmentation.min_height);
    // What was given is not doubted.
    let params = match context.params.segmentation.labels {
        Some(_) => RegionParams::zhu2018(),
        None => region_params(context.params)?,
    };
    let (mut wholes, mut others) = (Vec::new(), BTreeMap::<usize, Vec<(u32, Label)>>::new());
    for whole in unite(&labelled.components) {
        let evidence = gathered(&whole, &labelled.evidence);
        match evidence.verdict(&params, step) {
            Label::Building if whole.area(step) >= smallest && evidence.mean_height() >= lowest => {
                wholes.push((whole, evidence))
            }
            label => {
                // Too small or too low for a building, and no tree: it lies on the ground.
                let label = if label == Label::Building { Label::Ground } else { label };
                for (tile, component) in whole.pieces {
                    others.entry(tile).or_default().push((component, label));
                }
            }
        }
    }
    // What was given stays, also where it is too small to be modelled.
    let labelled =
        if context.params.segmentation.labels.is_some() { labelled } else { relabel(context, labelled, &others)? };
    let centroids: Vec<DVec2> = wholes.iter().map(|(whole, _)| whole.centroid(step)).collect();
    let ids = building_ids(&centroids, frame);
    context.observer.done(Stage::Stitch, "city");
    let tasks = wholes.into_iter().zip(ids).map(|((whole, evidence), id)| Task {
        id,
        extent: whole.extent,
        footprint: None,
        evidence: Some(evidence),
    });
    Ok((tasks.collect(), labelled))
}

/// The building of a footprint; `None` if that holds no pixel.
fn given(number: usize, footprint: &Footprint, step: f64) -> Option<Task> {
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
    Some(Task { id: footprint.id.clone(), extent, footprint: Some(number), evidence: None })
}

/// The evidence on all pieces of a building.
fn gathered(whole: &Whole, evidence: &[Vec<Evidence>]) -> Evidence {
    let mut sum = Evidence::default();
    for &(tile, component) in &whole.pieces {
        sum.absorb(&evidence[tile][component as usize]);
    }
    sum
}

/// The labels with other ones for some components. What was labelled stays as it was, for a run that goes on here.
fn relabel(
    context: &Context<'_>,
    labelled: Labelled,
    others: &BTreeMap<usize, Vec<(u32, Label)>>,
) -> Result<Labelled, PipelineError> {
    let mut tiles: Vec<MosaicTile> = labelled.labels.tiles().to_vec();
    for (&tile, components) in others {
        context.check_cancelled()?;
        let labels = &labelled.labels.tile(tile)?.0;
        let (_, marks) = TileComponents::of(labels, |&l| l == Label::Building as u8);
        let mut becomes = vec![Label::Building; labelled.components[tile].components.len()];
        components.iter().for_each(|&(component, label)| becomes[component as usize] = label);
        let mut labels = labels.clone();
        for (label, mark) in labels.values_mut().iter_mut().zip(marks.values()).filter(|(_, mark)| **mark != 0) {
            *label = becomes[*mark as usize - 1] as u8;
        }
        let path = tiles[tile].path.with_extension("final.lab");
        LabelTile(labels).write(&path)?;
        tiles[tile].path = path;
    }
    let labels = Mosaic::new(tiles, labelled.labels.step(), context.cache_bytes() / 8);
    Ok(Labelled { labels, ..labelled })
}
