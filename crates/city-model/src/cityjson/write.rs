//! CityJSON 2.0 files: one for each city or tile.

use super::objects::{self, world};
use super::schema::VertexPool;
use crate::quantise::{STEPS_PER_METRE, from_lattice, lattice};
use crate::{CityModel, Error, Lods, Metadata, Shell};
use gable_geometry::{Crs, DVec3};
use serde::Serialize;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

/// What stands before the city objects: needed before the first of them is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Title of the data set.
    pub title: String,
    /// What else it tells of itself.
    pub metadata: Metadata,
    /// World coordinates of the local origin, whole metres.
    pub origin: [f64; 3],
    /// Reference system of the world coordinates.
    pub crs: Crs,
    /// Local box around everything that will be written, if it is known.
    pub extent: Option<(DVec3, DVec3)>,
}

impl Header {
    /// The header of a model, with the extent of its geometries.
    #[must_use]
    pub fn of(model: &CityModel) -> Self {
        let terrain = model.terrain.iter().flat_map(|t| &t.vertices);
        let shells = model.buildings.iter().flat_map(|b| b.lods.shells());
        let corners = shells.flat_map(|shell| {
            let indices = shell.faces.iter().flat_map(|face| &face.rings).flatten();
            indices.filter_map(|&i| shell.vertices.get(i as usize))
        });
        let points = corners.chain(terrain).filter(|p| p.is_finite());
        let extent = points.fold(None, |extent: Option<(DVec3, DVec3)>, &p| {
            Some(extent.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
        });
        Self {
            title: model.title.clone(),
            metadata: model.metadata.clone(),
            origin: model.origin,
            crs: model.crs.clone(),
            extent,
        }
    }

    /// The lowest corner in whole metres: two headers of the same one write the same buildings alike.
    #[must_use]
    pub fn base(&self) -> DVec3 {
        from_lattice(self.corner())
    }

    /// Lattice point of the local frame at which the file's `translate` stands: the lowest corner in whole metres.
    pub(super) fn corner(&self) -> [i64; 3] {
        let low = self.extent.map_or(DVec3::ZERO, |(low, _)| from_lattice(lattice(low)));
        lattice(low.floor())
    }

    /// Opens the file's JSON object with `type`, `version`, `transform` and `metadata`; members may follow.
    ///
    /// The reference system is an OGC URL for EPSG codes. A pair of plane and heights without a code of its own has none that the
    /// schema lets pass: `referenceSystem` is the plane's, and the heights' stands beside it as `verticalReferenceSystem`. A local
    /// tangent plane has none either: its latitude, longitude and height stand in the metadata as `localTangentPlane`. Both are
    /// free properties, and so is `lineage`.
    pub(super) fn open(&self, out: &mut impl Write) -> Result<(), Error> {
        let url = |code: u32| Some(format!("https://www.opengis.net/def/crs/EPSG/0/{code}"));
        let (reference_system, vertical_reference_system, plane) = match self.crs {
            Crs::Epsg(code) => (url(code), None, None),
            Crs::Compound { horizontal, vertical } => (url(horizontal), url(vertical), None),
            Crs::Enu { latitude, longitude, height } => {
                (None, None, Some(LocalTangentPlane { latitude, longitude, height }))
            }
            Crs::Unknown => (None, None, None),
        };
        let extent = self.extent.map(|(low, high)| {
            let [[a, b, c], [d, e, f]] = [low, high].map(|p| world(self.origin, lattice(p)));
            [a, b, c, d, e, f]
        });
        let given = &self.metadata;
        // The schema asks for a name and an address.
        let contact = given.contact_name.as_deref().zip(given.contact_email.as_deref());
        let metadata = MetadataOut {
            title: &self.title,
            identifier: given.identifier.as_deref(),
            reference_date: given.reference_date.as_deref(),
            point_of_contact: contact.map(|(contact_name, email_address)| Contact { contact_name, email_address }),
            lineage: given.lineage.as_deref(),
            reference_system,
            vertical_reference_system,
            local_tangent_plane: plane,
            geographical_extent: extent,
        };
        let transform = Transform { scale: [1.0 / STEPS_PER_METRE; 3], translate: world(self.origin, self.corner()) };
        out.write_all(b"{\"type\":\"CityJSON\",\"version\":\"2.0\",\"transform\":")?;
        to_json(&mut *out, &transform)?;
        out.write_all(b",\"metadata\":")?;
        to_json(out, &metadata)
    }
}

#[derive(Serialize)]
struct Transform {
    scale: [f64; 3],
    translate: [f64; 3],
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Contact<'a> {
    contact_name: &'a str,
    email_address: &'a str,
}

#[derive(Serialize)]
struct LocalTangentPlane {
    latitude: f64,
    longitude: f64,
    #[serde(skip_serializing_if = "is_zero")]
    height: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct MetadataOut<'a> {
    title: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    identifier: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference_date: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    point_of_contact: Option<Contact<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lineage: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference_system: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vertical_reference_system: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    local_tangent_plane: Option<LocalTangentPlane>,
    #[serde(skip_serializing_if = "Option::is_none")]
    geographical_extent: Option<[f64; 6]>,
}

impl Lods {
    /// All geometries, coarse ones first.
    pub fn shells(&self) -> impl Iterator<Item = &Shell> {
        self.footprint.iter().chain(&self.roof_edge).chain(&self.lod1).chain(&self.lod2)
    }
}

/// Writes a city or tile as one CityJSON 2.0 file.
///
/// Coordinates are integers of 0.1 mm from the lower corner; the shells are written as [`crate::quantised`] returns
/// them, buildings in the order of the model. Footprint and roof edge are two MultiSurfaces of LOD "0" with the
/// semantics GroundSurface and RoofSurface, block and roof models Solids of LOD "1" and "2". The bytes depend on
/// nothing but the model. O(corners); only the vertices are held in memory.
///
/// # Errors
/// If the stream fails, an id occurs twice, an attribute is not finite, or a geometry is malformed or over 214 km
/// from the lower corner.
pub fn write_cityjson(model: &CityModel, mut out: impl Write) -> Result<(), Error> {
    let header = Header::of(model);
    header.open(&mut out)?;
    out.write_all(b",\"CityObjects\":{")?;
    let mut pool = VertexPool::new(header.corner());
    let mut ids = BTreeSet::new();
    let mut first = true;
    let mut object = |out: &mut dyn Write, id: &str, object: &super::schema::CityObject<'_>| -> Result<(), Error> {
        if !ids.insert(id.to_owned()) {
            return Err(Error::object(id, "the identifier occurs twice: make identifiers unique"));
        }
        out.write_all(if first { b"\n" } else { b",\n" })?;
        first = false;
        to_json(&mut *out, id)?;
        out.write_all(b":")?;
        to_json(out, object)
    };
    if let Some(terrain) = &model.terrain {
        let relief = objects::terrain(terrain, model.origin, &mut pool)?;
        object(&mut out, &terrain.id, &relief)?;
    }
    for building in &model.buildings {
        for (id, part) in objects::building(building, model.origin, &mut pool)? {
            object(&mut out, &id, &part)?;
        }
    }
    out.write_all(b"},\n\"vertices\":")?;
    to_json(&mut out, &pool.vertices)?;
    out.write_all(b"}\n")?;
    Ok(out.flush()?)
}

/// Writes a city or tile to a CityJSON 2.0 file; see [`write_cityjson`].
///
/// # Errors
/// As [`write_cityjson`], and if the file cannot be made.
pub fn write_cityjson_file(model: &CityModel, path: &Path) -> Result<(), Error> {
    let file = std::fs::File::create(path).map_err(|source| Error::File { path: path.to_owned(), source })?;
    write_cityjson(model, std::io::BufWriter::new(file)).map_err(|error| match error {
        Error::Write(source) => Error::File { path: path.to_owned(), source },
        other => other,
    })
}

/// JSON without spaces.
pub(super) fn to_json(out: impl Write, value: &(impl serde::Serialize + ?Sized)) -> Result<(), Error> {
    serde_json::to_writer(out, value).map_err(|error| Error::Write(error.into()))
}
