//! The labels as pictures, on request: one for each block, for training and for measuring.

use super::Context;
use super::segment::Labelled;
use super::split::Blocks;
use crate::{PipelineError, Stage, artefact};
use gable_segmentation::Label;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;

/// Writes `labels/{ix}_{iy}.png` (8 bit, the number of the class, 255 without data, row 0 north) and a `.json` beside
/// it that says where it lies; returns the names relative to `out`.
pub(crate) fn write(
    context: &Context<'_>,
    blocks: &Blocks,
    labelled: &Labelled,
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    let folder = out.join("labels");
    artefact::create_dir(&folder)?;
    let classes: std::collections::BTreeMap<_, _> = Label::ALL.iter().map(|l| (l.name(), *l as u8)).collect();
    let names = blocks.with_data().into_par_iter().map(|(ix, iy)| {
        context.check_cancelled()?;
        let Some(window) = blocks.core(ix, iy).filter(|w| !w.is_empty()) else { return Ok(Vec::new()) };
        let labels = labelled.read(window)?;
        let mut pixels = Vec::with_capacity(window.len());
        (0..window.height).rev().for_each(|row| pixels.extend_from_slice(labels.row(row)));
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes)
            .write_image(&pixels, window.width as u32, window.height as u32, ExtendedColorType::L8)
            .map_err(|e| context.failed(Stage::Write, &format!("labels {ix}_{iy}"), e))?;
        let [west, south, ..] = blocks.world_box(ix, iy);
        let about = json!({
            "file": format!("{ix}_{iy}.png"), "step": window.step, "width": window.width, "height": window.height,
            "row0": "north", "lower_left_world": [west, south], "crs": blocks.frame().crs.to_string(),
            "classes": classes,
        });
        let (picture, place) = (format!("labels/{ix}_{iy}.png"), format!("labels/{ix}_{iy}.json"));
        artefact::write(&out.join(&picture), &bytes)?;
        artefact::write_json(&out.join(&place), &about)?;
        Ok(vec![picture, place])
    });
    Ok(names.collect::<Result<Vec<_>, PipelineError>>()?.concat())
}
