//! Where the readers put their triangles: checked, gathered into chunks, handed to the visitor.

use crate::budget;
use crate::counts::{Counts, WarningKind};
use crate::error::{Place, SceneError};
use crate::lattice::Lattice;
use crate::material::Material;
use crate::overlap::Plans;
use crate::placement::Placement;
use crate::polygon::Cutter;
use crate::scene::Content;
use crate::survey::Survey;
use crate::triangle::Triangle;
use gable_files::FileError;
use gable_geometry::DVec3;
use std::ops::ControlFlow;
use std::path::Path;

/// Triangles that are handed on at a time: about 2 MB.
const CHUNK: usize = 1 << 14;

/// Why a stream ends before its end.
#[derive(Debug)]
pub(crate) enum Halt {
    /// The input is bad.
    Failed(Box<SceneError>),
    /// The visitor has had enough.
    Stopped,
}

impl From<SceneError> for Halt {
    fn from(error: SceneError) -> Self {
        Self::Failed(Box::new(error))
    }
}

impl From<FileError> for Halt {
    fn from(error: FileError) -> Self {
        SceneError::from(error).into()
    }
}

/// A corner of a polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// World coordinates.
    pub(crate) position: DVec3,
    /// sRGB and 255; 0 as fourth byte for none.
    pub(crate) colour: [u8; 4],
    /// Texture coordinate, v up; [`Corner::NO_UV`] for none.
    pub(crate) uv: [f32; 2],
}

impl Corner {
    /// In place of a texture coordinate.
    pub(crate) const NO_UV: [f32; 2] = [f32::NAN; 2];
}

/// What was found broken.
#[derive(Debug, Default)]
struct Damage {
    /// Whether it is refused rather than left out.
    strict: bool,
    /// Files of the scene, and those of them that are broken.
    files: usize,
    broken_files: usize,
    /// Faces of the file in hand that are broken, and all faces before it.
    broken_faces: u64,
    faces_before: u64,
    /// The first fault of the file in hand, and of the scene.
    in_file: Option<SceneError>,
    first: Option<SceneError>,
}

/// The receiving end of a stream.
pub(crate) struct Sink<'a> {
    path: &'a Path,
    /// The scene's materials, as far as they are known.
    pub(crate) materials: Vec<Material>,
    visit: &'a mut dyn FnMut(&[Triangle]) -> ControlFlow<()>,
    chunk: Vec<Triangle>,
    survey: Survey,
    lattice: Lattice,
    plans: Plans,
    cutter: Cutter,
    /// The places of a polygon's corners.
    border: Vec<DVec3>,
    damage: Damage,
    /// What has been read so far.
    pub(crate) counts: Counts,
}

impl<'a> Sink<'a> {
    pub(crate) fn new(
        path: &'a Path,
        materials: Vec<Material>,
        counts: Counts,
        files: usize,
        strict: bool,
        visit: &'a mut dyn FnMut(&[Triangle]) -> ControlFlow<()>,
    ) -> Self {
        Self {
            path,
            materials,
            visit,
            chunk: Vec::new(),
            survey: Survey::new(),
            lattice: Lattice::default(),
            plans: Plans::default(),
            cutter: Cutter::default(),
            border: Vec::new(),
            damage: Damage { strict, files, ..Damage::default() },
            counts,
        }
    }

    /// What comes now is in this file.
    pub(crate) fn begin(&mut self, path: &Path) {
        self.counts.files += 1;
        self.plans.begin(path);
        self.damage.broken_faces = 0;
        self.damage.faces_before = self.counts.faces;
        self.damage.in_file = None;
    }

    /// The file in hand was read, with this result. Its damage costs that file only, if there are others: an error if it costs all.
    /// Whether it was whole.
    pub(crate) fn end(&mut self, result: Result<(), Halt>) -> Result<bool, Halt> {
        let damage = &mut self.damage;
        let fault = match result {
            Err(Halt::Failed(error)) if error.is_damage() => *error,
            Err(other) => return Err(other),
            Ok(()) => match damage.in_file.take() {
                // Where most faces are broken, the file is: what is left would be no surface.
                Some(fault) if 2 * damage.broken_faces > self.counts.faces - damage.faces_before => fault,
                Some(fault) => {
                    damage.first.get_or_insert(fault);
                    return Ok(true);
                }
                None => return Ok(true),
            },
        };
        damage.broken_files += 1;
        if damage.strict || damage.files == 1 {
            return Err(fault.into());
        }
        self.counts.warnings.add(WarningKind::BrokenFile, || fault.to_string());
        let first = damage.first.get_or_insert(fault);
        if damage.broken_files < damage.files {
            return Ok(false);
        }
        Err(std::mem::replace(first, SceneError::NoTriangles { path: self.path.to_owned() }).into())
    }

    /// Takes note of a broken vertex or face: an error where they are refused.
    #[cold]
    pub(crate) fn broken(&mut self, kind: WarningKind, fault: SceneError) -> Result<(), Halt> {
        if self.damage.strict {
            return Err(fault.into());
        }
        self.counts.warnings.add(kind, || fault.to_string());
        if kind == WarningKind::BrokenFace {
            self.damage.broken_faces += 1;
        }
        self.damage.in_file.get_or_insert(fault);
        Ok(())
    }

    /// Takes a vertex of a file; gives its place in the world.
    #[inline]
    pub(crate) fn vertex(&mut self, vertex: DVec3, placement: &Placement) -> DVec3 {
        if vertex.is_finite() {
            self.lattice.add(vertex);
        }
        placement.apply(vertex)
    }

    /// Takes a polygon, cut to triangles; counts one of fewer than three corners.
    #[inline]
    pub(crate) fn polygon(&mut self, corners: &[Corner], material: u32, path: &Path, place: Place) -> Result<(), Halt> {
        if corners.len() < 3 {
            self.warn(WarningKind::DegenerateFace, path, place);
            return Ok(());
        }
        if corners.iter().any(|c| !c.position.is_finite()) {
            // The vertex was told already: in strict reading, it was an error.
            self.warn(WarningKind::BrokenFace, path, place);
            self.damage.broken_faces += 1;
            return Ok(());
        }
        let textured = corners.iter().all(|c| !c.uv[0].is_nan() && !c.uv[1].is_nan());
        let coloured = corners.iter().all(|c| c.colour[3] != 0);
        let triangle = |three: [&Corner; 3]| Triangle {
            corners: three.map(|c| c.position),
            uv: textured.then(|| three.map(|c| c.uv)),
            colours: coloured.then(|| three.map(|c| [c.colour[0], c.colour[1], c.colour[2]])),
            material,
        };
        if let [a, b, c] = corners {
            return self.triangle(triangle([a, b, c]), path, place);
        }
        self.border.clear();
        self.border.extend(corners.iter().map(|c| c.position));
        let mut cutter = std::mem::take(&mut self.cutter);
        let Some(indices) = cutter.cut(&self.border) else {
            let most = budget::CONCAVE_CORNERS;
            let what = format!("{place}: a face that is not convex has more than {most} corners: split it");
            return Err(SceneError::too_much(path, what).into());
        };
        for three in indices.chunks_exact(3) {
            let three = [three[0], three[1], three[2]].map(|i| &corners[i as usize]);
            self.triangle(triangle(three), path, place)?;
        }
        self.cutter = cutter;
        Ok(())
    }

    /// Takes a triangle in world coordinates; counts and leaves out one without area.
    #[inline]
    pub(crate) fn triangle(&mut self, triangle: Triangle, path: &Path, place: Place) -> Result<(), Halt> {
        if !self.survey.add(&triangle.corners) {
            self.warn(WarningKind::DegenerateFace, path, place);
            return Ok(());
        }
        self.plans.add(&triangle.corners);
        let textured = triangle.uv.is_none()
            && self.materials.get(triangle.material as usize).is_some_and(|m| m.texture.is_some());
        if textured {
            self.warn(WarningKind::MissingTextureCoordinates, path, place);
        }
        self.chunk.push(triangle);
        if self.chunk.len() == CHUNK { self.hand_on() } else { Ok(()) }
    }

    /// Counts numbers of a file with a comma in place of their point.
    pub(crate) fn commas(&mut self, count: u64, path: &Path) {
        self.counts.warnings.add_many(WarningKind::DecimalComma, count, || path.display().to_string());
    }

    /// Counts a warning at a place.
    #[cold]
    pub(crate) fn warn(&mut self, kind: WarningKind, path: &Path, place: Place) {
        self.counts.warnings.add(kind, || format!("{}: {place}", path.display()));
    }

    /// Triangles taken so far, without those that have no area.
    pub(crate) fn triangles(&self) -> u64 {
        self.survey.triangles()
    }

    fn hand_on(&mut self) -> Result<(), Halt> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        if self.triangles() > budget::TRIANGLES {
            return Err(SceneError::too_much(self.path, "more than 1000 million triangles").into());
        }
        let flow = (self.visit)(&self.chunk);
        self.chunk.clear();
        if flow.is_break() { Err(Halt::Stopped) } else { Ok(()) }
    }

    /// Hands on the rest; what was read, and the sums to judge it by.
    pub(crate) fn finish(mut self) -> Result<(Content, Survey), Halt> {
        self.hand_on()?;
        if self.triangles() == 0
            && let Some(fault) = self.damage.first.take()
        {
            return Err(fault.into());
        }
        for said in self.lattice.coarse() {
            self.counts.warnings.add(WarningKind::CoarseCoordinates, || said);
        }
        for [first, second] in self.plans.overlapping() {
            let what = || format!("{} and {}", first.display(), second.display());
            self.counts.warnings.add(WarningKind::OverlappingFiles, what);
        }
        self.survey.report(&mut self.counts);
        Ok((Content { counts: self.counts, materials: self.materials }, self.survey))
    }
}
