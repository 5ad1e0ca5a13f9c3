//! The meshes of a folder of tiles.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::detail::{Candidate, coarser};
use crate::error::SceneError;
use crate::scene::Format;
use gable_files::Reach;
use std::path::{Path, PathBuf};

/// Folders within a folder that are looked into.
const DEPTH: usize = 4;

/// What is in a folder.
pub(crate) struct Listing {
    pub(crate) format: Format,
    /// The meshes that are read, in the order of their paths.
    pub(crate) files: Vec<PathBuf>,
    /// All folders, for what they say of the meshes.
    pub(crate) folders: Vec<PathBuf>,
}

/// The meshes of a folder: those in `Data` if there are some, as photogrammetry programs have it, and of the formats the first of
/// OBJ, glTF, PLY, OFF. Of several models of one place the finest is read.
pub(crate) fn list(folder: &Path, reach: &Reach, warnings: &mut Warnings) -> Result<Listing, SceneError> {
    let mut walk = Walk { reach, left: budget::ENTRIES, files: Vec::new(), folders: Vec::new() };
    walk.look_into(folder, DEPTH)?;
    walk.files.sort();
    let data = folder.join("Data");
    if walk.files.iter().any(|(path, _)| path.starts_with(&data)) {
        walk.files.retain(|(path, _)| path.starts_with(&data));
    }
    let chosen = [Format::Obj, Format::Gltf, Format::Ply, Format::Off]
        .into_iter()
        .find(|format| walk.files.iter().any(|(_, f)| f == format));
    let Some(format) = chosen else { return Err(SceneError::EmptyFolder { path: folder.to_owned() }) };
    for (path, _) in walk.files.iter().filter(|(_, other)| *other != format) {
        warnings.add(WarningKind::IgnoredFile, || path.display().to_string());
    }
    let mut files: Vec<PathBuf> =
        walk.files.into_iter().filter(|(_, other)| *other == format).map(|(path, _)| path).collect();
    if files.len() > 1 {
        let candidate = |path: &PathBuf| {
            // What stands before the folder is no level of detail.
            let inside = path.strip_prefix(folder).unwrap_or(path).to_owned();
            Candidate { path: inside, bytes: reach.length(path).unwrap_or(0) }
        };
        let coarser = coarser(&files.iter().map(candidate).collect::<Vec<_>>());
        files.retain(|path| {
            let is_coarser = coarser.contains(path.strip_prefix(folder).unwrap_or(path));
            if is_coarser {
                warnings.add(WarningKind::CoarserFile, || path.display().to_string());
            }
            !is_coarser
        });
    }
    Ok(Listing { format, files, folders: walk.folders })
}

struct Walk<'a> {
    reach: &'a Reach,
    /// How many more entries are looked at: links can make a small tree endless.
    left: usize,
    files: Vec<(PathBuf, Format)>,
    folders: Vec<PathBuf>,
}

impl Walk<'_> {
    fn look_into(&mut self, folder: &Path, depth: usize) -> Result<(), SceneError> {
        self.folders.push(folder.to_owned());
        let entries = self.reach.list(folder, self.left)?;
        self.left -= entries.len();
        for path in entries {
            if self.reach.is_folder(&path) {
                if depth > 0 {
                    self.look_into(&path, depth - 1)?;
                }
            } else if let Some(format) = Format::of(&path) {
                self.files.push((path, format));
            }
        }
        Ok(())
    }
}
