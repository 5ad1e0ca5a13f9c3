//! A scene: one mesh file or a folder of them, opened but not read.

use crate::budget;
use crate::counts::{Counts, WarningKind, Warnings};
use crate::error::SceneError;
use crate::material::Material;
use crate::metadata::Metadata;
use crate::obj;
use crate::sink::{Halt, Placement, Sink};
use crate::triangle::Triangle;
use gable_files::Reach;
use gable_geometry::{Crs, DVec3};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Which axis of the file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// z, but y for GLB and glTF as their specification says; a model that seems to lie on its side
    /// is an error.
    #[default]
    Auto,
    /// y: (x, y, z) becomes (x, −z, y).
    Y,
    /// z, however it looks.
    Z,
}

/// How a scene is to be read.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Which axis points up.
    pub up: Up,
    /// The reference system, in place of what the files say.
    pub crs: Option<Crs>,
    /// Which files may be read: those of the scene, and what they name. By default all that the system lets this process read.
    pub reach: Reach,
}

/// The formats by file ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Format {
    Obj,
    Ply,
    Off,
    Gltf,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "off" => Some(Self::Off),
            "glb" | "gltf" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// A textured mesh in files, read as a stream of triangles.
#[derive(Clone, Debug)]
pub struct Scene {
    path: PathBuf,
    reach: Reach,
    format: Format,
    files: Vec<PathBuf>,
    /// Index of each file's first material.
    first_materials: Vec<u32>,
    /// None for OBJ: its files name their libraries anywhere.
    materials: Vec<Material>,
    crs: Crs,
    placement: Placement,
    watch_up: bool,
    warnings: Warnings,
}

/// What a scene held.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// What was read, and what was put up with.
    pub counts: Counts,
    /// The materials; triangles refer to them by index.
    pub materials: Vec<Material>,
}

impl Scene {
    /// Opens a mesh file, or a folder with the meshes in it and in the folders below.
    ///
    /// Reads the reference system and the headers, no mesh. In a folder, OBJ
    /// files are preferred to other formats; they are streamed in the order of their paths. The
    /// reference system and origin are those of a `metadata.xml` in the folder or up to two above.
    ///
    /// # Errors
    /// If a file is missing or its header is not of its format, or the reference system is not understood. OBJ and OFF
    /// files are opened only when they are streamed.
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let reach = &options.reach;
        reach.resolve(path)?;
        let is_folder = reach.is_folder(path);
        let mut warnings = Warnings::default();
        let (format, files) = if is_folder { list(path, reach, &mut warnings)? } else { single(path)? };

        let folder = if is_folder { path } else { path.parent().unwrap_or(Path::new("")) };
        let metadata = Metadata::find(folder, reach)?;
        let crs = match (&options.crs, &metadata) {
            (Some(crs), _) => crs.clone(),
            (None, Some(metadata)) => metadata.crs(&mut warnings)?,
            (None, None) => Crs::Unknown,
        };
        let y_up = match options.up {
            Up::Auto => format == Format::Gltf,
            Up::Y => true,
            Up::Z => false,
        };
        let mut scene = Self {
            path: path.to_owned(),
            reach: reach.clone(),
            format,
            files,
            first_materials: Vec::new(),
            materials: Vec::new(),
            crs,
            placement: Placement { y_up, origin: metadata.map_or(DVec3::ZERO, |m| m.origin) },
            watch_up: options.up == Up::Auto && !y_up,
            warnings,
        };
        scene.read_materials()?;
        Ok(scene)
    }

    /// Which files are read: also what shows the scene's textures is to keep to it.
    #[must_use]
    pub fn reach(&self) -> &Reach {
        &self.reach
    }

    /// The reference system of the triangles' coordinates.
    #[must_use]
    pub fn crs(&self) -> &Crs {
        &self.crs
    }

    /// The mesh files, in the order in which they are read.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Hands every triangle that has an area to `visit`, some thousands at a time.
    ///
    /// The order is that of the files and of the faces in them, whatever the threads. In memory stand
    /// the vertices of one file (24 bytes each, 8 more for each texture coordinate) and some pieces
    /// of 4 MiB, never the faces. Every file is read once. Time is linear; OBJ text is parsed on all threads of the pool.
    ///
    /// # Errors
    /// Those of `visit`, as they are; a [`SceneError`] for bad input. What the whole looks like
    /// (no triangles, y up, nonsense scale) is known, and said, only when all of it was handed on.
    pub fn for_each_chunk<E: From<SceneError>>(
        &self,
        mut visit: impl FnMut(&[Triangle]) -> Result<(), E>,
    ) -> Result<Content, E> {
        let mut stopped = None;
        let mut visit = |chunk: &[Triangle]| match visit(chunk) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                stopped = Some(error);
                ControlFlow::Break(())
            }
        };
        let result = self.stream(&mut visit);
        match (result, stopped) {
            (_, Some(error)) => Err(error),
            (Ok(content), None) => Ok(content),
            (Err(Halt::Failed(error)), None) => Err((*error).into()),
            // A stop without an error cannot be; no triangles were handed on is the nearest truth.
            (Err(Halt::Stopped), None) => Err(SceneError::NoTriangles { path: self.path.clone() }.into()),
        }
    }

    fn stream(&self, visit: &mut dyn FnMut(&[Triangle]) -> ControlFlow<()>) -> Result<Content, Halt> {
        let mut counts = Counts { warnings: self.warnings.clone(), ..Counts::default() };
        for file in &self.files {
            counts.bytes += self.reach.length(file)?;
        }
        let mut sink = Sink::new(&self.path, self.materials.clone(), counts, visit);
        let reach = &self.reach;
        match self.format {
            Format::Obj => obj::stream(&self.files, reach, self.placement, &mut sink)?,
            format => {
                for (file, first) in self.files.iter().zip(&self.first_materials) {
                    let before = sink.triangles();
                    sink.counts.files += 1;
                    match format {
                        Format::Ply => crate::ply::stream(file, reach, *first, self.placement, &mut sink)?,
                        Format::Off => crate::off::stream(file, reach, self.placement, &mut sink)?,
                        Format::Obj | Format::Gltf => {
                            crate::gltf::stream(file, reach, *first, self.placement, &mut sink)?;
                        }
                    }
                    if sink.triangles() == before {
                        sink.counts.warnings.add(WarningKind::EmptyFile, || file.display().to_string());
                    }
                }
            }
        }
        let (content, survey) = sink.finish()?;
        survey.check(&self.path, self.watch_up)?;
        Ok(content)
    }

    /// Reads the materials that headers name, in the order of the files.
    fn read_materials(&mut self) -> Result<(), SceneError> {
        use rayon::prelude::*;
        let (format, reach) = (self.format, &self.reach);
        let read = |file: &PathBuf| {
            let mut warnings = Warnings::default();
            let materials = match format {
                Format::Ply => crate::ply::read_materials(file, reach, &mut warnings),
                Format::Obj | Format::Off => Ok(Vec::new()),
                Format::Gltf => crate::gltf::read_materials(file, reach, &mut warnings),
            };
            materials.map(|materials| (materials, warnings))
        };
        let all: Vec<_> = self.files.par_iter().map(read).collect();
        for read in all {
            let (materials, warnings) = read?;
            self.first_materials.push(self.materials.len() as u32);
            self.materials.extend(materials);
            if self.materials.len() > budget::MATERIALS {
                return Err(SceneError::too_much(&self.path, format!("more than {} materials", budget::MATERIALS)));
            }
            self.warnings.merge(warnings);
        }
        Ok(())
    }
}

/// A single file and its format.
fn single(path: &Path) -> Result<(Format, Vec<PathBuf>), SceneError> {
    match Format::of(path) {
        Some(format) => Ok((format, vec![path.to_owned()])),
        None => {
            let extension = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
            Err(SceneError::UnsupportedType { path: path.to_owned(), extension })
        }
    }
}

/// Folders within a folder that are looked into.
const DEPTH: usize = 4;

/// The meshes of a folder: those in `Data` if there is such a folder, as photogrammetry programs have it.
fn list(folder: &Path, reach: &Reach, warnings: &mut Warnings) -> Result<(Format, Vec<PathBuf>), SceneError> {
    let data = folder.join("Data");
    let start = if reach.is_folder(&data) { &data } else { folder };
    let (mut files, mut left) = (Vec::new(), budget::ENTRIES);
    walk(start, reach, DEPTH, &mut left, &mut files)?;
    files.sort();
    let chosen = [Format::Obj, Format::Gltf, Format::Ply, Format::Off]
        .into_iter()
        .find(|format| files.iter().any(|(_, f)| f == format));
    let Some(chosen) = chosen else { return Err(SceneError::EmptyFolder { path: folder.to_owned() }) };
    for (path, _) in files.iter().filter(|(_, format)| *format != chosen) {
        warnings.add(WarningKind::IgnoredFile, || path.display().to_string());
    }
    Ok((chosen, files.into_iter().filter(|(_, format)| *format == chosen).map(|(path, _)| path).collect()))
}

/// Gathers the meshes; `left` is how many more entries are looked at: links can make a small tree endless.
fn walk(
    folder: &Path,
    reach: &Reach,
    depth: usize,
    left: &mut usize,
    files: &mut Vec<(PathBuf, Format)>,
) -> Result<(), SceneError> {
    let entries = reach.list(folder, *left)?;
    *left -= entries.len();
    for path in entries {
        if reach.is_folder(&path) {
            if depth > 0 {
                walk(&path, reach, depth - 1, left, files)?;
            }
        } else if let Some(format) = Format::of(&path) {
            files.push((path, format));
        }
    }
    Ok(())
}
