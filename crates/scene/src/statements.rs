//! What a folder says about where meshes lie: files that photogrammetry programs write beside them.

use crate::budget;
use crate::error::SceneError;
use crate::metadata::Metadata;
use crate::words::{decode, numbers};
use gable_files::Reach;
use gable_geometry::DVec3;
use std::path::{Path, PathBuf};

/// A text in a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Said<T> {
    pub(crate) file: PathBuf,
    pub(crate) what: T,
}

/// Files that go with the meshes whose names begin alike.
#[derive(Clone, Debug)]
struct Named<T> {
    /// In small letters.
    prefix: String,
    said: Said<T>,
}

/// What one folder says.
#[derive(Clone, Debug, Default)]
pub(crate) struct Statements {
    /// `metadata.xml` of ContextCapture, DJI Terra and others.
    metadata: Option<Metadata>,
    /// `*_offset.xyz` of Pix4D.
    offsets: Vec<Named<DVec3>>,
    /// `*.prj`.
    systems: Vec<Named<String>>,
    /// `odm_georeferencing/coords.txt` and `proj.txt` of OpenDroneMap.
    odm: Option<Odm>,
}

#[derive(Clone, Debug)]
struct Odm {
    systems: Vec<Said<String>>,
    origin: Option<Said<DVec3>>,
}

/// Entries of a folder that are looked at; in larger ones only the names that are known beforehand.
const LISTED: usize = 20_000;
/// Bytes of a file that holds a few numbers or a definition.
const SMALL: u64 = 1 << 20;

impl Statements {
    /// Reads what a folder says. A file that may not be read, or belongs to something else, says nothing.
    pub(crate) fn of_folder(folder: &Path, reach: &Reach) -> Result<Self, SceneError> {
        let mut found = Self::default();
        let names = reach
            .list(folder, LISTED)
            .unwrap_or_else(|_| vec![folder.join("metadata.xml"), folder.join("Metadata.xml")]);
        for path in names {
            let Some(name) = path.file_name().and_then(|n| n.to_str()).map(str::to_lowercase) else { continue };
            if name == "metadata.xml" {
                if found.metadata.is_none() {
                    found.metadata = Metadata::read(&path, reach)?;
                }
            } else if let Some(prefix) = name.strip_suffix("offset.xyz") {
                found.offset(prefix, &path, reach);
            } else if let Some(prefix) = name.strip_suffix(".prj") {
                found.system(prefix.strip_suffix("_wkt").unwrap_or(prefix), &path, reach);
            } else if name == "coords.txt" || name == "odm_georeferencing_model_geo.txt" {
                found.odm(&path, reach);
            } else if name == "odm_georeferencing" {
                found.odm(&path.join("coords.txt"), reach);
                found.odm(&path.join("odm_georeferencing_model_geo.txt"), reach);
            } else if name == "params" || name == "1_initial" {
                // Pix4D keeps them in 1_initial/params, the mesh in 2_densification/3d_mesh.
                let inner = if name == "params" { path.clone() } else { path.join("params") };
                for path in reach.list(&inner, LISTED).unwrap_or_default() {
                    let Some(name) = path.file_name().and_then(|n| n.to_str()).map(str::to_lowercase) else { continue };
                    if let Some(prefix) = name.strip_suffix("offset.xyz") {
                        found.offset(prefix, &path, reach);
                    } else if let Some(prefix) = name.strip_suffix("_wkt.prj") {
                        found.system(prefix, &path, reach);
                    }
                }
            }
        }
        Ok(found)
    }

    fn offset(&mut self, prefix: &str, path: &Path, reach: &Reach) {
        let Some(text) = small(path, reach) else { return };
        if let Some(what) = numbers(&text).as_deref().and_then(point) {
            let said = Said { file: path.to_owned(), what };
            self.offsets.push(Named { prefix: prefix.trim_end_matches(['_', '-']).to_owned(), said });
        }
    }

    fn system(&mut self, prefix: &str, path: &Path, reach: &Reach) {
        let Some(what) = small(path, reach).filter(|text| !text.trim().is_empty()) else { return };
        self.systems.push(Named { prefix: prefix.to_owned(), said: Said { file: path.to_owned(), what } });
    }

    /// `coords.txt`: the system, then easting and northing of what was taken off, then a line for each picture.
    fn odm(&mut self, path: &Path, reach: &Reach) {
        let Some(text) = small(path, reach) else { return };
        let mut lines = text.lines();
        let (Some(first), Some(second)) = (lines.next(), lines.next()) else { return };
        let Some(origin) = numbers(second).filter(|n| n.len() == 2 || n.len() == 3).as_deref().and_then(point) else {
            return;
        };
        let mut systems = vec![Said { file: path.to_owned(), what: first.to_owned() }];
        let beside = path.with_file_name("proj.txt");
        systems.extend(small(&beside, reach).map(|what| Said { file: beside, what }));
        self.odm = Some(Odm { systems, origin: Some(Said { file: path.to_owned(), what: origin }) });
    }

    /// What is added to the coordinates of a mesh, if this folder says it. `own` is whether the mesh lies in this folder.
    pub(crate) fn origin(&self, mesh: &Path, own: bool) -> Option<Said<DVec3>> {
        if let Some(found) = &self.metadata {
            return Some(Said { file: found.path.clone(), what: found.origin });
        }
        if let Some(found) = for_mesh(&self.offsets, mesh, own) {
            return Some(found.clone());
        }
        self.odm.as_ref().filter(|_| is_georeferenced(mesh)).and_then(|odm| odm.origin.clone())
    }

    /// The texts that may tell the system of a mesh, the best first.
    pub(crate) fn systems(&self, mesh: &Path, own: bool) -> Vec<Said<String>> {
        let mut found = Vec::new();
        let metadata = self.metadata.as_ref().filter(|m| !m.srs.trim().is_empty());
        found.extend(metadata.map(|m| Said { file: m.path.clone(), what: m.srs.clone() }));
        found.extend(for_mesh(&self.systems, mesh, own).cloned());
        if let Some(odm) = self.odm.as_ref().filter(|_| is_georeferenced(mesh)) {
            found.extend(odm.systems.iter().cloned());
        }
        found
    }

    /// The files that say something.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let metadata = self.metadata.iter().map(|m| m.path.clone());
        let named = self.offsets.iter().map(|n| n.said.file.clone());
        let odm = self.odm.iter().flat_map(|odm| &odm.origin).map(|said| said.file.clone());
        metadata.chain(named).chain(odm).collect()
    }
}

/// OpenDroneMap's models that are not called geo lie in a frame of their own, which the offset does not belong to.
fn is_georeferenced(mesh: &Path) -> bool {
    let name = mesh.file_stem().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    !matches!(name.as_str(), "odm_textured_model" | "odm_mesh" | "odm_25dmesh")
}

/// The one whose name is the longest beginning of the mesh's; in the mesh's own folder also the only one.
fn for_mesh<'a, T>(all: &'a [Named<T>], mesh: &Path, own: bool) -> Option<&'a Said<T>> {
    let stem = mesh.file_stem()?.to_string_lossy().to_lowercase();
    let mut best: Option<&Named<T>> = None;
    for named in all.iter().filter(|n| stem.starts_with(&n.prefix)) {
        if best.is_none_or(|b| named.prefix.len() > b.prefix.len()) {
            best = Some(named);
        }
    }
    match (best, all) {
        (Some(best), _) => Some(&best.said),
        (None, [only]) if own => Some(&only.said),
        _ => None,
    }
}

fn point(numbers: &[f64]) -> Option<DVec3> {
    match *numbers {
        [x, y] => Some(DVec3::new(x, y, 0.0)),
        [x, y, z] => Some(DVec3::new(x, y, z)),
        _ => None,
    }
}

fn small(path: &Path, reach: &Reach) -> Option<String> {
    let bytes = reach.is_file(path).then(|| reach.read(path, SMALL.min(budget::METADATA)).ok())??;
    Some(decode(&bytes))
}
