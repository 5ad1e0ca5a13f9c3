//! Files that parameters name, made artefacts, so that a unit needs no file of the machine where the job was submitted.

use crate::label_map::LabelFolder;
use crate::params::Params;
use crate::{PipelineError, artefact};
use gable_files::Reach;
use std::path::{Path, PathBuf};

/// Where they lie.
const FOLDER: &str = "given";

/// The parameters that name files, each with its folder.
fn slots(params: &mut Params) -> [(&'static str, &mut Option<PathBuf>); 4] {
    [
        ("weights", &mut params.segmentation.weights),
        ("labels", &mut params.segmentation.labels),
        ("footprints", &mut params.segmentation.footprints),
        ("roofs", &mut params.modeling.roofs),
    ]
}

/// Where a file lies that a parameter names; for labels it is their folder.
fn place(slot: &str, path: &Path) -> PathBuf {
    let folder = Path::new(FOLDER).join(slot);
    match (slot, path.file_name()) {
        ("labels", _) | (_, None) => folder,
        (_, Some(name)) => folder.join(name),
    }
}

/// The parameters with the places of their files in `folder`, where they have been laid out there.
pub(super) fn localised(params: &Params, folder: &Path) -> Params {
    let mut local = params.clone();
    for (slot, path) in slots(&mut local) {
        let laid = path.as_ref().map(|p| folder.join(place(slot, p))).filter(|p| p.exists());
        if laid.is_some() {
            *path = laid;
        }
    }
    local
}

/// The parameters with names of files that are the same on every machine.
pub(super) fn portable(params: &Params) -> Params {
    let mut portable = params.clone();
    for (slot, path) in slots(&mut portable) {
        *path = path.as_ref().map(|p| place(slot, p));
    }
    portable
}

/// Largest file that is taken, bytes.
const LARGEST: u64 = 4 << 30;

/// What a unit may read besides its source: its own folder, and the files that parameters name, which whoever started it has
/// allowed.
pub(super) fn reach(params: &Params, folder: &Path) -> Result<Reach, PipelineError> {
    let mut params = params.clone();
    let given = slots(&mut params).into_iter().filter_map(|(_, path)| path.clone());
    let places = given.filter(|path| path.exists()).chain([folder.to_owned()]);
    Reach::within(places).map_err(|e| PipelineError::Input(e.to_string()))
}

/// Copies the files into `folder`; returns their names there.
pub(super) fn take(params: &Params, folder: &Path, reach: &Reach) -> Result<Vec<String>, PipelineError> {
    let mut made = Vec::new();
    let mut params = params.clone();
    let mut copy = |from: &Path, to: PathBuf| {
        let place = folder.join(&to);
        if let Some(parent) = place.parent() {
            artefact::create_dir(parent)?;
        }
        let content = reach.read(from, LARGEST).map_err(|e| PipelineError::Input(e.to_string()))?;
        artefact::write(&place, &content)?;
        made.push(to.to_string_lossy().into_owned());
        Ok::<(), PipelineError>(())
    };
    for (slot, path) in slots(&mut params) {
        let Some(path) = path else { continue };
        if slot == "labels" {
            for (from, name) in LabelFolder::files(path, reach)? {
                copy(&from, place(slot, path).join(name))?;
            }
        } else {
            copy(path, place(slot, path))?;
        }
    }
    Ok(made)
}

/// What a unit has to read so that it finds the files of these parameters.
pub(super) fn reads(params: &Params, wanted: &[&str]) -> Vec<String> {
    let mut params = params.clone();
    let set = slots(&mut params).into_iter().filter(|(slot, path)| wanted.contains(slot) && path.is_some());
    set.map(|(slot, _)| format!("{FOLDER}/{slot}/")).collect()
}
