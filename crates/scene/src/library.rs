//! The material libraries of a scene's OBJ files: each is read once, however often and under however many names it is named.

use crate::budget;
use crate::counts::WarningKind;
use crate::error::SceneError;
use crate::mtl;
use crate::sink::Sink;
use gable_files::Reach;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The libraries that were read so far.
pub(crate) struct Libraries<'a> {
    reach: &'a Reach,
    /// The numbers of their materials in the scene's list, by where the library lies. Looked up only, never iterated.
    read: HashMap<PathBuf, Range<u32>>,
    /// Bytes that may still be read.
    left: u64,
}

impl<'a> Libraries<'a> {
    pub(crate) fn new(reach: &'a Reach) -> Self {
        Self { reach, read: HashMap::new(), left: budget::LIBRARIES }
    }

    /// Where a library lies that a file names. A name may hold blanks, or the statement several names.
    fn places(&self, folder: &Path, name: &[u8]) -> Vec<PathBuf> {
        let whole = mtl::resolve(folder, name, self.reach);
        if self.reach.is_file(&whole) {
            return vec![whole];
        }
        let mut seen = HashSet::new();
        let names = name.split(u8::is_ascii_whitespace).filter(|n| !n.is_empty());
        let names = names.filter(|name| seen.insert(*name)).take(budget::LIBRARY_NAMES + 1);
        names.map(|n| mtl::resolve(folder, n, self.reach)).collect()
    }

    /// The numbers of the materials of what a file names; `left` is how many more names it may have. Libraries that cannot be read
    /// are counted.
    pub(crate) fn named(
        &mut self,
        file: &Path,
        name: &[u8],
        left: &mut usize,
        sink: &mut Sink<'_>,
    ) -> Result<Vec<Range<u32>>, SceneError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut numbers = Vec::new();
        for path in self.places(folder, name) {
            *left = left.checked_sub(1).ok_or_else(|| {
                SceneError::too_much(file, format!("it names more than {} material libraries", budget::LIBRARY_NAMES))
            })?;
            match self.library(&path, sink) {
                Ok(found) => numbers.push(found),
                Err(error @ SceneError::TooMuch { .. }) => return Err(error),
                Err(error) => {
                    let what = || format!("{}: {error}", file.display());
                    sink.counts.warnings.add(WarningKind::MissingMaterialLibrary, what);
                }
            }
        }
        Ok(numbers)
    }

    fn library(&mut self, path: &Path, sink: &mut Sink<'_>) -> Result<Range<u32>, SceneError> {
        // Without links, so that no library has two names.
        let place = self.reach.resolve(path)?.canonicalize().map_err(|e| SceneError::read(path, e))?;
        if let Some(known) = self.read.get(&place) {
            return Ok(known.clone());
        }
        let bytes = self.reach.read(path, budget::LIBRARY)?;
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| {
            SceneError::too_much(
                path,
                format!("all material libraries together have more than {} MiB", budget::LIBRARIES >> 20),
            )
        })?;
        let room = budget::MATERIALS.saturating_sub(sink.materials.len());
        let materials = mtl::parse(path, &bytes, self.reach, room, &mut sink.counts.warnings)?;
        let first = sink.materials.len() as u32;
        sink.materials.extend(materials);
        let numbers = first..sink.materials.len() as u32;
        self.read.insert(place, numbers.clone());
        Ok(numbers)
    }
}
