//! A scene: one mesh file or a folder of them, opened but not read.

use crate::budget;
use crate::counts::{Counts, WarningKind, Warnings};
use crate::error::SceneError;
use crate::folder::{Listing, list};
use crate::georeference::Finder;
use crate::material::Material;
use crate::obj;
use crate::placement::{Axis, Placement};
use crate::sink::{Halt, Sink};
use crate::statements::Said;
use crate::tileset::{Model, Models};
use crate::transform::Transform;
use crate::triangle::Triangle;
use gable_files::Reach;
use gable_geometry::{Crs, DVec3, dvec3};
use gable_reference_systems::{Metric, metric};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Which axis of the file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// z, but y for GLB and glTF as their specification says; a model that seems to lie on its side or to stand on its head is
    /// an error.
    #[default]
    Auto,
    /// y: (x, y, z) becomes (x, −z, y).
    Y,
    /// z, however it looks.
    Z,
    /// z points down: (x, y, z) becomes (x, −y, −z).
    MinusZ,
    /// y points down: (x, y, z) becomes (x, z, −y).
    MinusY,
}

/// How a scene is to be read.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Which axis points up.
    pub up: Up,
    /// The reference system, in place of what the files say.
    pub crs: Option<Crs>,
    /// What is added to the coordinates of every file, z up, in the units of the reference system; in place of what files beside the
    /// meshes say.
    pub origin: Option<DVec3>,
    /// Of 3D Tiles, how far from the finest shape tiles may be, metres; 0 for the finest tiles.
    pub error: f64,
    /// Whether damage is refused that else is left out and counted: vertices that are no numbers, faces of vertices that are not
    /// there, and a file of several that breaks off or is not of its format.
    pub strict: bool,
    /// Which files may be read: those of the scene, and what they name. By default all that the system lets this process read.
    pub reach: Reach,
}

/// The formats by file ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Format {
    Obj,
    Ply,
    Off,
    Gltf,
    /// 3D Tiles: a tree of GLB files or tiles with GLB files in them.
    Tileset,
}

impl Format {
    pub(crate) fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "off" => Some(Self::Off),
            "glb" | "gltf" | "b3dm" => Some(Self::Gltf),
            "json" if path.file_stem()?.eq_ignore_ascii_case("tileset") => Some(Self::Tileset),
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
    /// Where each file lies.
    placements: Vec<Placement>,
    /// Files beside the meshes that say where they lie.
    described_by: Vec<PathBuf>,
    watch_up: bool,
    strict: bool,
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
    /// files are preferred to other formats; they are streamed in the order of their paths. The reference system and origin of each are
    /// those that the nearest of the files tells which photogrammetry programs write beside meshes (see the README).
    ///
    /// # Errors
    /// If a file is missing or no file's header is of its format, or the reference system is not understood, not one of lengths, or not
    /// the same for all. OBJ and OFF files are opened only when they are streamed.
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let reach = &options.reach;
        reach.resolve(path)?;
        let is_folder = reach.is_folder(path);
        let mut warnings = Warnings::default();
        let folder = if is_folder { path } else { path.parent().unwrap_or(Path::new("")) };
        let listing = if is_folder { list(path, reach, &mut warnings)? } else { single(path)? };
        let Listing { format, files, folders } = listing;
        let tiles = match format {
            Format::Tileset => Some(Models::read(&files, reach, options.error, options.strict, &mut warnings)?),
            _ => None,
        };
        let plane = match &tiles {
            Some(tiles) => tiles.plane(options.crs.as_ref(), path)?,
            None => None,
        };
        if let (Some((plane, _)), Some(_)) = (&plane, options.origin) {
            let what = format!("its tiles have their place on the Earth, and end in {plane}: leave --origin out");
            return Err(SceneError::UnfitCrs { path: path.to_owned(), what });
        }
        let mut finder = Finder::new(folder, reach);
        folders.iter().try_for_each(|folder| finder.look_into(folder))?;
        let mut origins = Vec::with_capacity(files.len());
        let mut told: Option<Said<Crs>> = None;
        // What lies on the Earth needs nobody to tell where.
        for file in files.iter().filter(|_| plane.is_none()) {
            let found = finder.of(file, options.crs.is_none())?;
            origins.push(options.origin.unwrap_or(found.origin));
            match (&told, found.crs) {
                (Some(first), Some(other)) if first.what != other.what => return Err(two_systems(first, &other)),
                (None, Some(first)) => told = Some(first),
                _ => {}
            }
        }
        if options.origin.is_none() && plane.is_none() {
            finder.tell_unused(&mut warnings);
        }
        let (crs, said_by) = match (&options.crs, told) {
            _ if plane.is_some() => (plane.as_ref().map_or(Crs::Unknown, |(crs, _)| crs.clone()), path.to_owned()),
            (Some(crs), _) => (crs.clone(), path.to_owned()),
            (None, Some(said)) => (said.what, said.file),
            (None, None) => (Crs::Unknown, path.to_owned()),
        };
        let unfit = |what: String| SceneError::UnfitCrs { path: said_by.clone(), what };
        let Metric { crs: in_metres, plan, height } = metric(&crs).map_err(|e| unfit(e.to_string()))?;
        if (plan, height) != (1.0, 1.0) {
            warnings.add(WarningKind::ScaledUnits, || {
                format!(
                    "{}: {crs} has units of {plan} m, heights of {height} m: the result is in {in_metres}",
                    said_by.display()
                )
            });
        }
        let up = match (options.up, format) {
            (Up::Auto, Format::Gltf | Format::Tileset) | (Up::Y, _) => Axis::Y,
            (Up::Auto | Up::Z, _) => Axis::Z,
            (Up::MinusZ, _) => Axis::MinusZ,
            (Up::MinusY, _) => Axis::MinusY,
        };
        let units = dvec3(plan, plan, height);
        let mut placements: Vec<Placement> =
            origins.into_iter().map(|origin| Placement { up, origin, frame: None, units }).collect();
        let (mut files, mut described_by): (_, Vec<PathBuf>) = (files, finder.used().cloned().collect());
        if let Some(tiles) = tiles {
            let origin = placements.first().map_or(DVec3::ZERO, |placement| placement.origin);
            let to_world = plane.map_or(Transform::IDENTITY.after_shift(origin), |(_, to_plane)| to_plane);
            files = tiles.models.iter().map(|model| model.file.clone()).collect();
            let place = |model: &Model| Placement {
                up: if model.z_up && options.up == Up::Auto { Axis::Z } else { up },
                origin: DVec3::ZERO,
                frame: Some(to_world.after(&model.transform)),
                units,
            };
            placements = tiles.models.iter().map(place).collect();
            described_by.extend(tiles.files);
        }
        let mut scene = Self {
            path: path.to_owned(),
            reach: reach.clone(),
            format,
            files,
            first_materials: Vec::new(),
            materials: Vec::new(),
            crs: in_metres,
            placements,
            described_by,
            watch_up: options.up == Up::Auto,
            strict: options.strict,
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

    /// Files beside the meshes that say where they lie, in the order of their paths.
    #[must_use]
    pub fn described_by(&self) -> &[PathBuf] {
        &self.described_by
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
        let mut sink = Sink::new(&self.path, self.materials.clone(), counts, self.files.len(), self.strict, visit);
        let reach = &self.reach;
        match self.format {
            Format::Obj => obj::stream(&self.files, &self.placements, reach, &mut sink)?,
            format => {
                for ((file, first), placement) in self.files.iter().zip(&self.first_materials).zip(&self.placements) {
                    let before = sink.triangles();
                    sink.begin(file);
                    let read = match format {
                        Format::Ply => crate::ply::stream(file, reach, *first, *placement, &mut sink),
                        Format::Off => crate::off::stream(file, reach, *placement, &mut sink),
                        Format::Obj | Format::Gltf | Format::Tileset => {
                            crate::gltf::stream(file, reach, *first, *placement, &mut sink)
                        }
                    };
                    if sink.end(read)? && sink.triangles() == before {
                        sink.counts.warnings.add(WarningKind::EmptyFile, || file.display().to_string());
                    }
                }
            }
        }
        let (content, survey) = sink.finish()?;
        let up = self.placements.first().map_or(Axis::Z, |placement| placement.up);
        survey.check(&self.path, self.watch_up.then_some(up))?;
        Ok(content)
    }

    /// Reads the materials that headers name, in the order of the files. Files of several whose header is broken are left out.
    fn read_materials(&mut self) -> Result<(), SceneError> {
        use rayon::prelude::*;
        let (format, reach) = (self.format, &self.reach);
        let read = |file: &PathBuf| {
            let mut warnings = Warnings::default();
            let materials = match format {
                Format::Ply => crate::ply::read_materials(file, reach, &mut warnings),
                Format::Obj | Format::Off => Ok(Vec::new()),
                Format::Gltf | Format::Tileset => crate::gltf::read_materials(file, reach, &mut warnings),
            };
            materials.map(|materials| (materials, warnings))
        };
        let all: Vec<_> = self.files.par_iter().map(read).collect();
        let mut broken: Option<SceneError> = None;
        let files = std::mem::take(&mut self.files);
        let placements = std::mem::take(&mut self.placements);
        let forgiving = !self.strict && files.len() > 1;
        for ((file, placement), read) in files.into_iter().zip(placements).zip(all) {
            let (materials, warnings) = match read {
                Ok(read) => read,
                Err(fault) if forgiving && fault.is_damage() => {
                    self.warnings.add(WarningKind::BrokenFile, || fault.to_string());
                    broken.get_or_insert(fault);
                    continue;
                }
                Err(fault) => return Err(fault),
            };
            self.files.push(file);
            self.placements.push(placement);
            self.first_materials.push(self.materials.len() as u32);
            self.materials.extend(materials);
            if self.materials.len() > budget::MATERIALS {
                return Err(SceneError::too_much(&self.path, format!("more than {} materials", budget::MATERIALS)));
            }
            self.warnings.merge(warnings);
        }
        match broken {
            Some(fault) if self.files.is_empty() => Err(fault),
            _ => Ok(()),
        }
    }
}

/// A single file and its format.
fn single(path: &Path) -> Result<Listing, SceneError> {
    // Of a tileset any name may be given.
    let is_json = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
    match Format::of(path).or(is_json.then_some(Format::Tileset)) {
        Some(format) => Ok(Listing { format, files: vec![path.to_owned()], folders: Vec::new() }),
        None => {
            let extension = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
            Err(SceneError::UnsupportedType { path: path.to_owned(), extension })
        }
    }
}

/// The error for meshes that do not lie in one plane.
fn two_systems(first: &Said<Crs>, other: &Said<Crs>) -> SceneError {
    SceneError::UnfitCrs {
        path: other.file.clone(),
        what: format!(
            "{} is said here, but {} in {}: give the meshes of one system at a time, or say by --crs which it is",
            other.what,
            first.what,
            first.file.display()
        ),
    }
}
