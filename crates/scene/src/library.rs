//! The material libraries of a scene's OBJ files: each is read once, however often and under however many names it is named.

use crate::budget;
use crate::counts::WarningKind;
use crate::error::SceneError;
use crate::lookup::{Found, Lookup};
use crate::mtl;
use crate::sink::Sink;
use gable_files::Reach;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The libraries that were read so far.
pub(crate) struct Libraries<'a> {
    lookup: Lookup<'a>,
    /// The numbers of their materials in the scene's list, by where the library lies. Looked up only, never iterated.
    read: HashMap<PathBuf, Range<u32>>,
    /// Bytes that may still be read.
    left: u64,
}

impl<'a> Libraries<'a> {
    pub(crate) fn new(reach: &'a Reach) -> Self {
        Self { lookup: Lookup::new(reach), read: HashMap::new(), left: budget::LIBRARIES }
    }

    /// Where a library lies that a file names. A name may hold blanks, or the statement several names.
    fn places(&mut self, folder: &Path, name: &[u8]) -> Vec<Found> {
        let whole = self.lookup.find(&[folder], name);
        if whole.is_there {
            return vec![whole];
        }
        let mut seen = HashSet::new();
        let names = name.split(u8::is_ascii_whitespace).filter(|n| !n.is_empty());
        let names = names.filter(|name| seen.insert(*name)).take(budget::LIBRARY_NAMES + 1);
        names.map(|n| self.lookup.find(&[folder], n)).collect()
    }

    /// The library that bears the name of a file, as programs write it that do not name it; none if there is none.
    pub(crate) fn of_same_name(&mut self, file: &Path, sink: &mut Sink<'_>) -> Result<Option<Range<u32>>, SceneError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let name = file.with_extension("mtl").file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let found = self.lookup.find(&[folder], name.as_bytes());
        if !found.is_there || found.elsewhere {
            return Ok(None);
        }
        match self.library(&found.path, file, sink) {
            Ok(numbers) => {
                let what = || format!("{}: {}", file.display(), found.path.display());
                sink.counts.warnings.add(WarningKind::FoundElsewhere, what);
                Ok(Some(numbers))
            }
            Err(error @ SceneError::TooMuch { .. }) => Err(error),
            Err(_) => Ok(None),
        }
    }

    /// The numbers of the materials of what a file names; `left` is how many more names it may have. Libraries that cannot be read
    /// are counted, unless one of the file's own name is there and `instead` says that it may be taken.
    pub(crate) fn named(
        &mut self,
        file: &Path,
        name: &[u8],
        instead: bool,
        left: &mut usize,
        sink: &mut Sink<'_>,
    ) -> Result<Vec<Range<u32>>, SceneError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut numbers = Vec::new();
        for Found { path, is_there, elsewhere } in self.places(folder, name) {
            *left = left.checked_sub(1).ok_or_else(|| {
                SceneError::too_much(file, format!("it names more than {} material libraries", budget::LIBRARY_NAMES))
            })?;
            if !is_there
                && instead
                && let Some(found) = self.of_same_name(file, sink)?
            {
                numbers.push(found);
                continue;
            }
            match self.library(&path, file, sink) {
                Ok(found) => numbers.push(found),
                Err(error @ SceneError::TooMuch { .. }) => return Err(error),
                Err(error) => {
                    let what = || format!("{}: {error}", file.display());
                    sink.counts.warnings.add(WarningKind::MissingMaterialLibrary, what);
                    continue;
                }
            }
            if elsewhere {
                let what = || format!("{}: {}", file.display(), path.display());
                sink.counts.warnings.add(WarningKind::FoundElsewhere, what);
            }
        }
        Ok(numbers)
    }

    fn library(&mut self, path: &Path, mesh: &Path, sink: &mut Sink<'_>) -> Result<Range<u32>, SceneError> {
        // Without links, so that no library has two names.
        let place = self.lookup.reach().resolve(path)?.canonicalize().map_err(|e| SceneError::read(path, e))?;
        if let Some(known) = self.read.get(&place) {
            return Ok(known.clone());
        }
        let bytes = self.lookup.reach().read(path, budget::LIBRARY)?;
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| {
            SceneError::too_much(
                path,
                format!("all material libraries together have more than {} MiB", budget::LIBRARIES >> 20),
            )
        })?;
        let room = budget::MATERIALS.saturating_sub(sink.materials.len());
        let materials = mtl::parse(path, &bytes, mesh, &mut self.lookup, room, &mut sink.counts.warnings)?;
        let first = sink.materials.len() as u32;
        sink.materials.extend(materials);
        let numbers = first..sink.materials.len() as u32;
        self.read.insert(place, numbers.clone());
        Ok(numbers)
    }
}
