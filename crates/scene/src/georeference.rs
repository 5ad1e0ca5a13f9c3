//! Where each mesh of a scene lies: the nearest statement for each, in its folder, those above, or elsewhere in the input.

use crate::counts::{WarningKind, Warnings};
use crate::error::SceneError;
use crate::statements::{Said, Statements};
use gable_files::Reach;
use gable_geometry::{Crs, DVec3};
use gable_reference_systems::{Unread, read};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Folders above a mesh file or a folder of meshes that are looked into.
const ABOVE: usize = 3;

/// What is said of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Georeference {
    /// The system, and the file that tells it; none where nothing does.
    pub(crate) crs: Option<Said<Crs>>,
    /// What is added to the coordinates, in the units of the system.
    pub(crate) origin: DVec3,
}

/// Looks for what is said of meshes.
pub(crate) struct Finder<'a> {
    reach: &'a Reach,
    /// The folder of the input.
    input: PathBuf,
    /// The highest folder that is looked into.
    top: PathBuf,
    folders: BTreeMap<PathBuf, Statements>,
    systems: BTreeMap<String, Result<Crs, Unread>>,
    used: BTreeSet<PathBuf>,
}

impl<'a> Finder<'a> {
    /// For the meshes in a folder, or a mesh whose folder it is.
    pub(crate) fn new(input: &Path, reach: &'a Reach) -> Self {
        let top = input.ancestors().take(ABOVE).last().unwrap_or(input).to_owned();
        Self {
            reach,
            input: input.to_owned(),
            top,
            folders: BTreeMap::new(),
            systems: BTreeMap::new(),
            used: BTreeSet::new(),
        }
    }

    /// Reads what a folder of the input says: one that no mesh lies below may still be the nearest to some.
    pub(crate) fn look_into(&mut self, folder: &Path) -> Result<(), SceneError> {
        if !self.folders.contains_key(folder) {
            self.folders.insert(folder.to_owned(), Statements::of_folder(folder, self.reach)?);
        }
        Ok(())
    }

    /// What is said of a mesh. The system is not asked for where the user gives one.
    pub(crate) fn of(&mut self, mesh: &Path, wants_crs: bool) -> Result<Georeference, SceneError> {
        let own = mesh.parent().unwrap_or(Path::new("")).to_owned();
        let mut places: Vec<PathBuf> = Vec::new();
        for folder in own.ancestors() {
            self.look_into(folder)?;
            places.push(folder.to_owned());
            if folder == self.top {
                break;
            }
        }
        let mut origin = None;
        let mut texts = Vec::new();
        for place in places.iter().cloned().chain(self.elsewhere(mesh, &places)) {
            let Some(statements) = self.folders.get(&place) else { continue };
            let is_own = place == own;
            origin = origin.or_else(|| statements.origin(mesh, is_own));
            if texts.is_empty() {
                texts = statements.systems(mesh, is_own);
            }
        }
        if let Some(said) = &origin {
            self.used.insert(said.file.clone());
        }
        self.used.extend(texts.iter().map(|said| said.file.clone()));
        let crs = if wants_crs { self.first_understood(&texts)? } else { None };
        Ok(Georeference { crs, origin: origin.map_or(DVec3::ZERO, |said| said.what) })
    }

    /// The folder of the input that says something and lies nearest to the mesh, if it is one alone, and none on the way up does.
    fn elsewhere(&self, mesh: &Path, places: &[PathBuf]) -> Option<PathBuf> {
        let says = |folder: &PathBuf| {
            self.folders
                .get(folder)
                .is_some_and(|s| s.origin(mesh, false).is_some() || !s.systems(mesh, false).is_empty())
        };
        if places.iter().any(says) {
            return None;
        }
        let shared = |folder: &Path| folder.components().zip(mesh.components()).take_while(|(a, b)| a == b).count();
        let below: Vec<&PathBuf> = self.folders.keys().filter(|f| f.starts_with(&self.input) && says(f)).collect();
        let nearest = below.iter().map(|folder| shared(folder)).max()?;
        let mut nearest = below.into_iter().filter(|folder| shared(folder) == nearest);
        match (nearest.next(), nearest.next()) {
            (Some(only), None) => Some(only.clone()),
            _ => None,
        }
    }

    /// The system of the first text that is understood; the fault of the first if none is.
    fn first_understood(&mut self, texts: &[Said<String>]) -> Result<Option<Said<Crs>>, SceneError> {
        let mut fault = None;
        for Said { file, what } in texts {
            let found = self.systems.entry(what.clone()).or_insert_with(|| read(what)).clone();
            match found {
                Ok(Crs::Unknown) => {}
                Ok(crs) => return Ok(Some(Said { file: file.clone(), what: crs })),
                Err(Unread::Unknown(name)) => {
                    // The name of a WKT tells as much as the whole of it.
                    let text = if name.is_empty() { what.trim().to_owned() } else { name };
                    fault = fault.or(Some(SceneError::UnknownCrs { path: file.clone(), text }));
                }
                Err(other @ Unread::Geographic(_)) => {
                    fault = fault.or(Some(SceneError::UnfitCrs { path: file.clone(), what: other.to_string() }));
                }
            }
        }
        fault.map_or(Ok(None), Err)
    }

    /// Files that something was taken from.
    pub(crate) fn used(&self) -> impl Iterator<Item = &PathBuf> {
        self.used.iter()
    }

    /// Says which files of the input tell where meshes lie, but of no mesh that is read.
    pub(crate) fn tell_unused(&self, warnings: &mut Warnings) {
        let below = self.folders.iter().filter(|(folder, _)| folder.starts_with(&self.input));
        // A folder tells what stands in some of its folders too.
        let files: BTreeSet<PathBuf> = below.flat_map(|(_, statements)| statements.files()).collect();
        for file in files.difference(&self.used) {
            warnings.add(WarningKind::UnusedGeoreference, || file.display().to_string());
        }
    }
}
