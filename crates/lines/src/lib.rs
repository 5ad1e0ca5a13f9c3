//! Line segments on the ground: detection on float rasters, and regularisation.

use gable_geometry::DVec2;

/// A directed line segment on the ground, local metres. The higher (or larger) side lies to its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSegment {
    /// Start.
    pub a: DVec2,
    /// End.
    pub b: DVec2,
    /// How much evidence stands behind it; the unit depends on the source (metres of supported length, as a rule).
    pub weight: f64,
    /// Where it came from.
    pub source: Source,
}

/// The source of a segment (Zhu 2018, §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// The orthophoto.
    Image,
    /// Steps of the height map.
    Height,
    /// Creases of the normal maps.
    Normal,
    /// Steep facets: walls.
    Facade,
    /// The outline of the building mask.
    Outline,
    /// Where two roof planes meet.
    Intersection,
}
