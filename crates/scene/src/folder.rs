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
/// OBJ, 3D Tiles, glTF, PLY, OFF. Of several models of one place the finest is read.
pub(crate) fn list(folder: &Path, reach: &Reach, warnings: &mut Warnings) -> Result<Listing, SceneError> {
    let mut walk = Walk { reach, left: budget::ENTRIES, files: Vec::new(), folders: Vec::new(), other: String::new() };
    walk.look_into(folder, DEPTH)?;
    walk.files.sort();
    let data = folder.join("Data");
    let is_obj = |(path, format): &(PathBuf, Format)| *format == Format::Obj && path.starts_with(&data);
    // A tileset has its tiles in a folder of this name.
    let is_tileset = walk.files.iter().any(|(path, format)| *format == Format::Tileset && !path.starts_with(&data))
        && !walk.files.iter().any(is_obj);
    if !is_tileset && walk.files.iter().any(|(path, _)| path.starts_with(&data)) {
        walk.files.retain(|(path, _)| path.starts_with(&data));
    }
    let chosen = [Format::Obj, Format::Tileset, Format::Gltf, Format::Ply, Format::Off]
        .into_iter()
        .find(|format| walk.files.iter().any(|(_, f)| f == format));
    let Some(format) = chosen else {
        return Err(SceneError::EmptyFolder { path: folder.to_owned(), found: walk.other });
    };
    if format == Format::Tileset {
        return Ok(tilesets(walk, warnings));
    }
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

/// Of tilesets those that lie below no other: others are parts of them, and so are the models below.
fn tilesets(walk: Walk<'_>, warnings: &mut Warnings) -> Listing {
    let all: Vec<PathBuf> =
        walk.files.iter().filter(|(_, format)| *format == Format::Tileset).map(|(path, _)| path.clone()).collect();
    let folder = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
    let is_below = |path: &Path| all.iter().any(|top| top != path && path.starts_with(folder(top)));
    for (path, _) in walk.files.iter().filter(|(path, _)| !all.contains(path) && !is_below(path)) {
        warnings.add(WarningKind::IgnoredFile, || path.display().to_string());
    }
    let files = all.iter().filter(|path| !is_below(path)).cloned().collect();
    Listing { format: Format::Tileset, files, folders: walk.folders }
}

struct Walk<'a> {
    reach: &'a Reach,
    /// How many more entries are looked at: links can make a small tree endless.
    left: usize,
    files: Vec<(PathBuf, Format)>,
    folders: Vec<PathBuf>,
    /// The ending of a mesh that is not read, if there is one.
    other: String,
}

/// Endings of meshes that are not read.
const OTHERS: [&str; 12] = ["osgb", "osg", "ive", "fbx", "dae", "3ds", "stl", "slpk", "3mx", "3mxb", "s3c", "las"];

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
            } else if let Some(end) = path.extension().map(|end| end.to_string_lossy().to_lowercase())
                && OTHERS.contains(&&*end)
            {
                self.other = end;
            }
        }
        Ok(())
    }
}
