//! The working folder of a run: artefacts of each stage, kept until the result is complete.
//!
//! An artefact is written whole or not at all, so that a run that was stopped goes on from what exists. The folder
//! belongs to one input and one set of parameters: its key is the hash of both, and another key empties it.

use crate::PipelineError;
use crate::artefact;
use crate::params::{GROUPS, Params};
use gable_scene::Scene;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// The working folder inside the output folder.
pub(crate) struct Workspace {
    root: PathBuf,
}

/// What it holds.
const FOLDERS: [&str; 6] = ["blocks", "ortho", "mesh", "labels", "models", "overview"];

impl Workspace {
    /// Opens the working folder, emptied if it belongs to another input or to other parameters.
    pub(crate) fn open(out: &Path, scene: &Scene, params: &Params) -> Result<Self, PipelineError> {
        let root = out.join(".work");
        let files: Vec<&PathBuf> = scene.files().iter().chain(scene.described_by()).collect();
        let key = key(&files, params)?;
        let file = root.join("key");
        let resumed = fs::read_to_string(&file).is_ok_and(|found| found == key);
        if !resumed && root.exists() {
            fs::remove_dir_all(&root).map_err(|source| PipelineError::Io { path: root.clone(), source })?;
        }
        let workspace = Self::at(&root)?;
        artefact::write(&file, key.as_bytes())?;
        Ok(workspace)
    }

    /// The working folder of one unit of work, with what is in it.
    pub(crate) fn at(root: &Path) -> Result<Self, PipelineError> {
        for folder in FOLDERS {
            artefact::create_dir(&root.join(folder))?;
        }
        Ok(Self { root: root.to_owned() })
    }

    /// A path in the working folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Empties the folders of what was made from the labels on, if it was made of other blocks and patches than
    /// `basis` tells: what failed in an earlier run may not have failed now.
    pub(crate) fn rest_on(&self, folders: &[&str], basis: &str) -> Result<(), PipelineError> {
        for folder in folders {
            let folder = self.root.join(folder);
            let file = folder.join("basis");
            if fs::read_to_string(&file).is_ok_and(|found| found == basis) {
                continue;
            }
            let io = |source| PipelineError::Io { path: folder.clone(), source };
            fs::remove_dir_all(&folder).map_err(io)?;
            artefact::create_dir(&folder)?;
            artefact::write(&file, basis.as_bytes())?;
        }
        Ok(())
    }

    /// Keeps what the same command needs to try failed blocks again: block files are split anew, rasters of good blocks
    /// stay.
    pub(crate) fn keep_for_another_try(&self) -> Result<(), PipelineError> {
        for folder in ["blocks", "labels", "models"] {
            let folder = self.root.join(folder);
            fs::remove_dir_all(&folder).map_err(|source| PipelineError::Io { path: folder, source })?;
        }
        Ok(())
    }

    /// Removes the folder.
    pub(crate) fn remove(&self) -> Result<(), PipelineError> {
        fs::remove_dir_all(&self.root).map_err(|source| PipelineError::Io { path: self.root.clone(), source })
    }
}

/// Hash of the program's version, the parameters that the result depends on, and the input files with their sizes
/// and times of change (their content would have to be read twice).
fn key(files: &[&PathBuf], params: &Params) -> Result<String, PipelineError> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    let groups: Vec<&str> = GROUPS.iter().map(|(name, _)| *name).collect();
    hasher.update(params.canonical(&groups).as_bytes());
    for path in files {
        let status = fs::metadata(path).map_err(|source| PipelineError::Io { path: path.to_path_buf(), source })?;
        let changed =
            status.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok()).map_or(0, |d| d.as_nanos());
        hasher.update(path.as_os_str().as_encoded_bytes());
        hasher.update(&status.len().to_le_bytes()).update(&changed.to_le_bytes());
    }
    Ok(hasher.finalize().to_hex().to_string())
}
