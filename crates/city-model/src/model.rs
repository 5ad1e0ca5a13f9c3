//! City objects as gable holds them between modelling and writing.

use crate::Metadata;
use gable_geometry::{Crs, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a surface of a building is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Semantic {
    /// Underside, where the building meets the ground.
    GroundSurface,
    /// Facade.
    WallSurface,
    /// Roof.
    RoofSurface,
}

/// An attribute of a city object or of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A truth value.
    Bool(bool),
    /// A count.
    Integer(i64),
    /// A measure, in the unit that the attribute's name says (`_m`, `_m2`, `_m3`, `_deg`).
    Number(f64),
    /// A text.
    Text(String),
}

impl Value {
    /// Memory that it takes, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + if let Self::Text(text) = self { text.len() } else { 0 }
    }
}

/// Attributes by name, written in this order.
pub type Attributes = BTreeMap<String, Value>;

/// A planar polygon in space: rings of vertex indices, the outer one first, no vertex repeated.
/// Seen from outside the solid, the outer ring runs counter-clockwise and holes clockwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Face {
    /// Rings of indices into the vertices of the geometry.
    pub rings: Vec<Vec<u32>>,
    /// Meaning.
    pub semantic: Semantic,
    /// Attributes of this surface (slope and azimuth of a roof surface, …).
    pub attributes: Attributes,
}

/// A boundary representation: a solid's outer shell, or an open set of faces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shell {
    /// Corners, local metres.
    pub vertices: Vec<DVec3>,
    /// Faces.
    pub faces: Vec<Face>,
}

/// The geometries of a building, each `None` where that LOD does not hold.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lods {
    /// Footprint at ground height: horizontal faces (GroundSurface).
    pub footprint: Option<Shell>,
    /// Roof edge at eave height: horizontal faces (RoofSurface).
    pub roof_edge: Option<Shell>,
    /// Block models: one closed shell for each solid.
    pub lod1: Vec<Shell>,
    /// Roof shapes: one closed shell for each solid.
    pub lod2: Vec<Shell>,
}

/// A building.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Building {
    /// Identifier, the same from run to run.
    pub id: String,
    /// Attributes.
    pub attributes: Attributes,
    /// Geometries. A building with several solids in a LOD is written with one BuildingPart for each.
    pub lods: Lods,
}

impl Building {
    /// The best level of detail that there is of it, and its shells: roof shape, else block model, else footprint.
    #[must_use]
    pub fn best(&self) -> (&'static str, Vec<&Shell>) {
        let lods = &self.lods;
        let order = [
            ("2", lods.lod2.iter().collect::<Vec<_>>()),
            ("1", lods.lod1.iter().collect()),
            ("0", lods.footprint.iter().collect()),
        ];
        order.into_iter().find(|(_, shells)| !shells.is_empty()).unwrap_or_default()
    }
}

/// A triangulated terrain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Terrain {
    /// Identifier.
    pub id: String,
    /// Corners, local metres.
    pub vertices: Vec<DVec3>,
    /// Triangles, counter-clockwise from above.
    pub triangles: Vec<[u32; 3]>,
}

/// A city, or one tile of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CityModel {
    /// Title.
    pub title: String,
    /// What else the data set tells of itself.
    #[serde(default)]
    pub metadata: Metadata,
    /// World coordinates of the local origin, metres.
    pub origin: [f64; 3],
    /// Reference system of the world coordinates.
    pub crs: Crs,
    /// Buildings, by id.
    pub buildings: Vec<Building>,
    /// Terrain.
    pub terrain: Option<Terrain>,
}
