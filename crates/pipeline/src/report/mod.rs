//! `report.html` and `report.json`: what a run has made, for people and for programs.
//!
//! The page is one file without references to others. Pictures are made from down-sampled rasters
//! ([`Overview`]) and from buildings that are visited one by one, so memory does not grow with the city.

mod html;
mod overview;
mod pictures;
mod svg;

pub use overview::{Overview, OverviewBuilder, Pixel};

use crate::{PipelineError, RunSummary};
use gable_city_model::Building;
use gable_geometry::Box2;
use gable_raster::GridWindow;
use std::path::Path;

/// Where the pictures come from; several are made at once.
pub trait ReportSource: Sync {
    /// The extent with data, local metres.
    fn bounds(&self) -> Box2;

    /// Edge of a pixel of the full resolution, metres.
    fn step(&self) -> f64;

    /// The rasters on a window of the same step or a coarser one: see [`OverviewBuilder`].
    ///
    /// # Errors
    /// If they cannot be read.
    fn overview(&self, window: GridWindow) -> Result<Overview, PipelineError>;

    /// Visits the buildings that touch an extent, in a fixed order; local coordinates.
    ///
    /// # Errors
    /// If they cannot be read.
    fn buildings(&self, within: Box2, visit: &mut dyn FnMut(&Building)) -> Result<(), PipelineError>;
}

/// Writes `report.html`, `report.json` and the folder `pictures` into `out`, in place of earlier ones; each file is
/// complete or absent. The paths are returned relative to `out`.
///
/// # Errors
/// If the source cannot be read or a file cannot be written.
pub fn write(
    out: &Path,
    title: &str,
    summary: &RunSummary,
    source: &dyn ReportSource,
) -> Result<Vec<String>, PipelineError> {
    let pictures = pictures::make(source)?;
    let folder = out.join("pictures");
    let failed = |source| PipelineError::Io { path: folder.clone(), source };
    std::fs::create_dir_all(&folder).map_err(failed)?;
    let mut files = Vec::new();
    for picture in pictures.iter().flat_map(|set| &set.pictures) {
        let name = format!("pictures/{}", picture.file);
        put(&out.join(&name), &picture.bytes)?;
        files.push(name);
    }
    for number in 1..=pictures::CLOSE_UPS {
        for kind in pictures::KINDS {
            let name = format!("pictures/place-{number}-{kind}");
            if !files.contains(&name) {
                // What an earlier, larger city left; most often there is nothing.
                std::fs::remove_file(out.join(name)).ok();
            }
        }
    }
    put(&out.join("report.html"), html::page(title, summary, &pictures).as_bytes())?;
    files.push("report.html".to_owned());
    put(&out.join("report.json"), json(summary).as_bytes())?;
    files.push("report.json".to_owned());
    Ok(files)
}

/// The summary as JSON.
fn json(summary: &RunSummary) -> String {
    // A summary has neither maps with other keys than texts nor values that JSON cannot hold.
    serde_json::to_string_pretty(summary).unwrap_or_default() + "\n"
}

/// Writes a file under another name and renames it, so that it is never half-written.
fn put(path: &Path, bytes: &[u8]) -> Result<(), PipelineError> {
    let failed = |source| PipelineError::Io { path: path.to_owned(), source };
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    std::fs::write(&partial, bytes).map_err(failed)?;
    std::fs::rename(&partial, path).map_err(failed)
}

#[cfg(test)]
mod tests;
