//! A building of the scene: its truth at LOD0–2 and what the sensing needs to know of it.

use super::envelope::{Envelope, upper_envelope};
use super::primitive::Primitive;
use super::relief::Relief;
use super::solid::{block, outline, shell_volume, solid};
use gable_city_model::{Attributes, Building, Lods, Semantic, Shell, Value};
use gable_geometry::{Box2, DVec2, DVec3, Plane, Polygon, ring_area};

/// What a roof is covered with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Covering {
    /// Clay or concrete tiles.
    Tiles,
    /// Slate.
    Slate,
    /// Sheet metal with standing seams.
    Metal,
    /// Bitumen or concrete of the colour of roads.
    Bitumen,
    /// Gravel.
    Gravel,
    /// Sedum and grass.
    Green,
    /// Corrugated sheets: steel, some painted, some rusty; fibre cement.
    Corrugated,
    /// Glass in frames.
    Glass,
}

/// Colours and details of a building that are no part of its truth.
#[derive(Clone, Debug)]
pub struct Style {
    /// Covering of the roof.
    pub covering: Covering,
    /// Colour of the roof, sRGB 0–255.
    pub roof: [f32; 3],
    /// Colour of the facades, sRGB 0–255.
    pub facade: [f32; 3],
    /// Width of the eaves beyond the walls, metres.
    pub overhang: f64,
    /// Height of a parapet around flat roofs, metres; 0 for none.
    pub parapet: f64,
    /// Distance between rows of windows, metres.
    pub storey: f64,
    /// Distance between windows of a row, metres.
    pub bay: f64,
}

/// A planar piece of roof.
#[derive(Clone, Debug)]
pub struct RoofFace {
    /// Its plan.
    pub polygon: Polygon,
    /// Its plane.
    pub plane: Plane,
    /// Middle of its corners.
    pub middle: DVec2,
}

/// An edge of the roof beyond which there is no more roof of the building.
#[derive(Clone, Copy, Debug)]
pub struct Rim {
    /// Start; the roof is on the left.
    pub from: DVec2,
    /// End.
    pub to: DVec2,
    /// Roof face.
    pub face: usize,
}

/// A building.
#[derive(Clone, Debug)]
pub struct SceneBuilding {
    /// Truth, heights as in the scene.
    pub truth: Building,
    /// Pieces of roof.
    pub roof: Vec<RoofFace>,
    /// Outer edges of the roof.
    pub rims: Vec<Rim>,
    /// Height of the base, metres.
    pub base: f64,
    /// Around the plan.
    pub bounds: Box2,
    /// Colours and details.
    pub style: Style,
    /// Seed of its textures and details.
    pub seed: u64,
}

impl SceneBuilding {
    /// Builds the solids of the upper envelope of primitives on the ground; heights of the primitives
    /// are above the mean ground around the plan. `None` if the envelope has no valid solid.
    #[must_use]
    pub fn from_primitives(
        id: &str,
        kind: &str,
        primitives: &[Primitive],
        relief: &Relief,
        style: Style,
        seed: u64,
    ) -> Option<Self> {
        let around: Vec<DVec2> = primitives.iter().flat_map(|p| p.ring.iter().copied()).collect();
        let mean = around.iter().map(|p| relief.height(*p)).sum::<f64>() / around.len().max(1) as f64;
        let lifted: Vec<Primitive> = primitives
            .iter()
            .map(|p| Primitive {
                ring: p.ring.clone(),
                planes: p.planes.iter().map(|q| Plane { c: q.c + mean, ..*q }).collect(),
            })
            .collect();
        let envelope = upper_envelope(&lifted);
        let base = base_height(&envelope, relief);
        let lods = lods(&envelope, base)?;
        let lod2 = lods.lod2.first()?;
        let roof = roof_faces(lod2);
        let lowest = roof_vertices(lod2).map(|v| v.z).fold(f64::INFINITY, f64::min);
        if lowest < base + 1.0 || roof.is_empty() {
            return None;
        }
        let attributes = attributes(kind, lod2, base);
        let truth = Building { id: id.to_owned(), attributes, lods };
        Some(Self::from_truth(truth, base, roof, style, seed))
    }

    /// A building of the scene from truth whose heights already stand on the ground of the scene.
    #[must_use]
    pub fn from_truth(truth: Building, base: f64, roof: Vec<RoofFace>, style: Style, seed: u64) -> Self {
        let bounds = Box2::of(roof.iter().flat_map(|f| f.polygon.outer.iter().copied()));
        let rims = rims(&roof);
        Self { truth, roof, rims, base, bounds, style, seed }
    }

    /// The highest roof over a place, with its face.
    #[must_use]
    pub fn roof_at(&self, p: DVec2) -> Option<(f64, usize)> {
        if !self.bounds.contains(p) {
            return None;
        }
        let over = self.roof.iter().enumerate().filter(|(_, f)| f.polygon.contains(p));
        over.map(|(i, f)| (f.plane.height(p), i)).max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

fn base_height(envelope: &Envelope, relief: &Relief) -> f64 {
    let mut low = f64::INFINITY;
    for face in &envelope.faces {
        let ring: Vec<DVec2> = face.rings[0].iter().map(|&n| envelope.nodes[n]).collect();
        low = low.min(relief.range_along(&Polygon { outer: ring, holes: Vec::new() }).0);
    }
    // A whole millimetre, so that the base survives rounding as it is.
    (low * 1e3).floor() / 1e3
}

fn lods(envelope: &Envelope, base: f64) -> Option<Lods> {
    let lod2 = solid(envelope, base)?;
    let footprint = outline(envelope, base, Semantic::GroundSurface)?;
    let area: f64 = envelope
        .faces
        .iter()
        .flat_map(|f| &f.rings)
        .map(|r| ring_area(&r.iter().map(|&n| envelope.nodes[n]).collect::<Vec<_>>()))
        .sum();
    let mean = base + shell_volume(&lod2) / area;
    let eave = roof_vertices(&lod2).map(|v| v.z).fold(f64::INFINITY, f64::min);
    Some(Lods {
        footprint: Some(footprint),
        roof_edge: outline(envelope, eave, Semantic::RoofSurface),
        lod1: vec![block(envelope, base, mean)?],
        lod2: vec![lod2],
    })
}

/// Heights of the corners of roof faces.
pub(crate) fn roof_vertices(shell: &Shell) -> impl Iterator<Item = DVec3> + '_ {
    let roofs = shell.faces.iter().filter(|f| f.semantic == Semantic::RoofSurface);
    roofs.flat_map(|f| f.rings.iter().flatten()).map(|&v| shell.vertices[v as usize])
}

pub(crate) fn attributes(kind: &str, lod2: &Shell, base: f64) -> Attributes {
    let eave = roof_vertices(lod2).map(|v| v.z).fold(f64::INFINITY, f64::min);
    let ridge = roof_vertices(lod2).map(|v| v.z).fold(f64::NEG_INFINITY, f64::max);
    Attributes::from([
        ("roof_type".to_owned(), Value::Text(kind.to_owned())),
        ("ground_height_m".to_owned(), Value::Number(base)),
        ("eave_height_m".to_owned(), Value::Number(eave)),
        ("ridge_height_m".to_owned(), Value::Number(ridge)),
        ("volume_m3".to_owned(), Value::Number(shell_volume(lod2))),
    ])
}

/// The roof faces of a shell as polygons with planes (least vertical error at three far corners).
pub(crate) fn roof_faces(shell: &Shell) -> Vec<RoofFace> {
    let mut out = Vec::new();
    for face in shell.faces.iter().filter(|f| f.semantic == Semantic::RoofSurface) {
        let mut rings = face.rings.iter().map(|r| r.iter().map(|&v| shell.vertices[v as usize]).collect::<Vec<_>>());
        let Some(outer) = rings.next() else { continue };
        let origin = outer[0];
        let mut normal = gable_geometry::DVec3::ZERO;
        for i in 0..outer.len() {
            normal += (outer[i] - origin).cross(outer[(i + 1) % outer.len()] - origin);
        }
        let mean = outer.iter().sum::<gable_geometry::DVec3>() / outer.len() as f64;
        let Some(plane) = Plane::from_normal(normal, mean).filter(|p| normal.z > 0.0 && p.slope() < 1.5) else {
            continue;
        };
        let polygon = Polygon {
            outer: outer.iter().map(|p| p.truncate()).collect(),
            holes: rings.map(|r| r.iter().map(|p| p.truncate()).collect()).collect(),
        };
        out.push(RoofFace { polygon, plane, middle: mean.truncate() });
    }
    out
}

fn rims(roof: &[RoofFace]) -> Vec<Rim> {
    let mut rims = Vec::new();
    for (face, f) in roof.iter().enumerate() {
        for ring in f.polygon.rings() {
            for i in 0..ring.len() {
                let (from, to) = (ring[i], ring[(i + 1) % ring.len()]);
                let Some(direction) = (to - from).try_normalize() else { continue };
                let beyond = from.midpoint(to) - direction.perp() * 0.05;
                if !roof.iter().any(|g| g.polygon.contains(beyond)) {
                    rims.push(Rim { from, to, face });
                }
            }
        }
    }
    rims
}
