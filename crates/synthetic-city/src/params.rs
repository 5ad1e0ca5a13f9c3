//! What is asked for and what came of it.

use crate::error::SynthError;
use crate::look::Look;
use crate::scene::case::RoofCase;
use crate::scene::place::Place;
use gable_city_model::CityModel;
use gable_geometry::Crs;

/// Where the buildings come from.
#[derive(Clone, Debug)]
pub enum Source {
    /// A procedural town of about this area, km².
    Procedural {
        /// Area, km².
        area_km2: f64,
    },
    /// One small scene with a roof of the given kind.
    Case(RoofCase),
    /// Buildings of a city model with LOD2 shells.
    Truth {
        /// The model.
        model: Box<CityModel>,
        /// Copies in each direction; copies are turned, mirrored and get other roof slopes.
        repeat: u32,
    },
    /// A place with what real ones have and the town has not.
    Place(Place),
}

/// Parameters of a synthetic city.
#[derive(Clone, Debug)]
pub struct SynthParams {
    /// Seed of everything drawn.
    pub seed: u64,
    /// Where the buildings come from.
    pub source: Source,
    /// Faces of the mesh per m² of ground; 0.05 to 30.
    pub density: f64,
    /// Slope of the ground, metres per metre; 0 to 0.5.
    pub slope: f64,
    /// Whether to write textures.
    pub texture: bool,
    /// Strength of the defects of matching: 0 is none, 1 as measured on a real mesh.
    pub noise: f64,
    /// How the pictures look.
    pub look: Look,
    /// Side of a tile, metres; a multiple of 0.4 from 8 to 400.
    pub tile_size: f64,
    /// World coordinates of the local origin.
    pub origin: [f64; 3],
    /// Reference system of the world coordinates.
    pub crs: Crs,
}

impl Default for SynthParams {
    fn default() -> Self {
        Self {
            seed: 1,
            source: Source::Procedural { area_km2: 0.05 },
            density: 7.5,
            slope: 0.05,
            texture: true,
            noise: 1.0,
            look: Look::default(),
            tile_size: 80.0,
            origin: [85_000.0, 446_000.0, 0.0],
            crs: Crs::Epsg(7415),
        }
    }
}

impl SynthParams {
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        let within = |name, value: f64, low: f64, high: f64, range| {
            if value >= low && value <= high { Ok(()) } else { Err(SynthError::Parameter { name, value, range }) }
        };
        within("density", self.density, 0.05, 30.0, "0.05 to 30 faces per m²")?;
        within("slope", self.slope, 0.0, 0.5, "0 to 0.5")?;
        within("noise", self.noise, 0.0, 5.0, "0 to 5")?;
        within("tile_size", self.tile_size, 8.0, 400.0, "8 to 400 m")?;
        self.look.check()?;
        if let Source::Place(place) = &self.source {
            within("side", place.side, 40.0, 1000.0, "40 to 1000 m")?;
        }
        if let Source::Procedural { area_km2 } = self.source {
            within("area", area_km2, 1e-4, 100.0, "0.0001 to 100 km²")?;
        }
        if let Source::Truth { repeat, .. } = self.source {
            within("repeat", f64::from(repeat), 1.0, 20.0, "1 to 20")?;
        }
        Ok(())
    }
}

/// How far the work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SynthProgress {
    /// Tiles written.
    pub done: usize,
    /// Tiles in all.
    pub total: usize,
}

/// What was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SynthReport {
    /// Tiles.
    pub tiles: usize,
    /// Faces of the mesh.
    pub faces: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Buildings of the truth.
    pub buildings: usize,
    /// Roof faces of the truth at LOD2.
    pub roof_faces: usize,
    /// Trees.
    pub trees: usize,
    /// Area sensed, m².
    pub area: f64,
    /// Bytes of meshes and textures.
    pub bytes: u64,
}
