//! Validation of geometries after ISO 19107, in val3dity's order and with its error codes
//! (Ledoux 2013, "On the validation of solids represented with the international standards for geographic
//! information"; Ledoux 2018, "val3dity: validation of 3D GIS primitives according to the international standards").
//!
//! The levels build on each other: rings, then polygons, then shells, then solids. A level is only judged if the one
//! below has no error, so one defect is not reported under several names.

mod building;
mod parts;
mod polygon;
mod ring;
mod segments;
mod shell;
mod snap;
mod solid;
mod triangles;

pub use building::{BuildingIssue, validate_building};
pub use parts::validate_parts;
pub use shell::validate_shell;
pub use solid::{validate_solid, validate_solid_with_cavities};

use crate::Shell;
use snap::Snapped;
use std::fmt;

/// How exact a geometry must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Vertices closer than this are one, metres.
    pub snap: f64,
    /// Largest distance of a corner from the plane fitted to its polygon, metres.
    pub planarity: f64,
    /// Largest angle between a polygon's normal and those of its triangles, degrees.
    pub normals_deg: f64,
}

impl Default for Tolerances {
    /// val3dity's defaults: 1 mm, 1 cm, 20°.
    fn default() -> Self {
        Self { snap: 0.001, planarity: 0.01, normals_deg: 20.0 }
    }
}

impl Tolerances {
    /// The strict preset: 0.1 mm, 1 mm, 20°.
    #[must_use]
    pub fn strict() -> Self {
        Self { snap: 0.0001, planarity: 0.001, normals_deg: 20.0 }
    }
}

/// What is wrong, by val3dity's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u16)]
#[non_exhaustive]
pub enum Code {
    /// A ring with fewer than three different corners.
    TooFewPoints = 101,
    /// A corner repeated in succession.
    ConsecutivePointsSame = 102,
    /// A ring that touches or crosses itself.
    RingSelfIntersection = 104,
    /// A ring without width (val3dity reports it as 104).
    RingCollapsed = 105,
    /// Rings of a polygon that cross or share more than points.
    IntersectionRings = 201,
    /// Rings of a polygon with the same corners.
    DuplicatedRings = 202,
    /// A corner too far from the polygon's plane.
    NonPlanarDistance = 203,
    /// A triangle of the polygon tilted too much against it.
    NonPlanarNormals = 204,
    /// Rings that touch so that they cut the interior in two.
    InteriorDisconnected = 205,
    /// A hole outside the outer ring.
    InnerRingOutside = 206,
    /// A hole within a hole.
    InnerRingsNested = 207,
    /// A hole that runs the same way as the outer ring.
    OrientationRingsSame = 208,
    /// Fewer than four polygons.
    TooFewPolygons = 301,
    /// An edge with a polygon on one side only.
    ShellNotClosed = 302,
    /// A vertex where the shell touches itself (val3dity ≥ 2.3 unites 303 and 304).
    NonManifoldVertex = 303,
    /// An edge with more than two polygons.
    NonManifoldEdge = 304,
    /// Parts that no edge connects.
    MultipleComponents = 305,
    /// Polygons that meet elsewhere than in shared corners and edges.
    ShellSelfIntersection = 306,
    /// Neighbours that do not run the same way around.
    WrongPolygonOrientation = 307,
    /// Shells of a solid that cross or share more than points.
    IntersectionShells = 401,
    /// Shells of a solid with the same polygons.
    DuplicatedShells = 402,
    /// A cavity outside the outer shell.
    InnerShellOutside = 403,
    /// An outer shell whose polygons look inward, or a cavity's that look into the cavity's solid side.
    WrongShellOrientation = 405,
    /// Parts of a building that overlap.
    PartsOverlap = 601,
    /// Indices out of range or coordinates that are not finite.
    InvalidInput = 901,
    /// A geometry without faces.
    Empty = 902,
}

impl Code {
    /// val3dity's number.
    #[must_use]
    pub fn number(self) -> u16 {
        self as u16
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.number())
    }
}

/// A defect of a geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Issue {
    /// What is wrong.
    pub code: Code,
    /// Index of the face that is wrong, if it is one.
    pub face: Option<usize>,
    /// Where and how, with local coordinates.
    pub message: String,
}

impl Issue {
    pub(crate) fn new(code: Code, face: impl Into<Option<usize>>, message: impl Into<String>) -> Self {
        Self { code, face: face.into(), message: message.into() }
    }
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.face {
            Some(face) => write!(f, "{} face {face}: {}", self.code, self.message),
            None => write!(f, "{} {}", self.code, self.message),
        }
    }
}

/// Checks rings and polygons (101–208) of a set of faces that need not be closed, such as a footprint.
/// O(n log n) for each face of n corners, with exact predicates. Never panics, whatever the input.
#[must_use]
pub fn validate_surfaces(surfaces: &Shell, tolerances: &Tolerances) -> Vec<Issue> {
    match Snapped::new(surfaces, tolerances.snap) {
        Ok(snapped) => polygons(&snapped, tolerances).0,
        Err(issue) => vec![issue],
    }
}

/// Issues of rings and polygons, and each face's triangles where it has none.
fn polygons(snapped: &Snapped, tolerances: &Tolerances) -> (Vec<Issue>, Vec<Vec<[u32; 3]>>) {
    let mut issues = Vec::new();
    let mut triangles = Vec::with_capacity(snapped.faces.len());
    for (f, rings) in snapped.faces.iter().enumerate() {
        let before = issues.len();
        for ring in rings {
            issues.extend(ring::check(&snapped.points, ring, tolerances.snap).map(|(code, m)| Issue::new(code, f, m)));
        }
        let mut own = Vec::new();
        if issues.len() == before {
            match polygon::check(&snapped.points, rings, tolerances) {
                Ok(t) => own = t,
                Err((code, message)) => issues.push(Issue::new(code, f, message)),
            }
        }
        triangles.push(own);
    }
    (issues, triangles)
}

#[cfg(test)]
mod tests;
