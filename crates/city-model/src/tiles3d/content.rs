//! The contents of tiles: GLB of buildings and of terrain.

use super::glb::Glb;
use super::metadata::Table;
use crate::surface_kinds::{KINDS, kind};
use crate::{Attributes, Building, Error, Semantic, Shell, Terrain, quantised, triangulate};
use gable_geometry::{Box2, DVec3, dvec3};
use serde_json::{Value, json};

/// Bounds are this much larger than what they hold, metres: more than the rounding of any reader, less than anyone sees.
const SLACK: f64 = 0.001;

/// The smallest geometric error between LOD1 and LOD2, metres: also where all roofs are flat, what is near is shown in full.
const LEAST_ERROR: f64 = 0.25;

/// A level of detail of buildings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileLod {
    /// Footprints and roof edges.
    Lod0,
    /// Block models.
    Lod1,
    /// Roof shapes.
    Lod2,
}

/// The content of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// The GLB.
    pub glb: Vec<u8>,
    /// Lowest corner of a box that holds it, local metres.
    pub low: DVec3,
    /// Highest corner.
    pub high: DVec3,
}

/// The picture that is draped over a terrain.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTexture {
    /// JPEG, row 0 in the north.
    pub jpeg: Vec<u8>,
    /// What it shows, local metres; beyond it the border's pixels go on.
    pub bounds: Box2,
}

/// The shells of a building that stand for a level: its own, or else the nearest that there is, so that no building is missing.
fn shells(building: &Building, lod: TileLod) -> (&'static str, Vec<&Shell>) {
    let lods = &building.lods;
    let flat = || ("0", lods.footprint.iter().chain(&lods.roof_edge).collect::<Vec<_>>());
    let blocks = || ("1", lods.lod1.iter().collect::<Vec<_>>());
    let roofs = || ("2", lods.lod2.iter().collect::<Vec<_>>());
    let order = match lod {
        TileLod::Lod0 => [flat(), blocks(), roofs()],
        TileLod::Lod1 => [blocks(), roofs(), flat()],
        TileLod::Lod2 => [roofs(), blocks(), flat()],
    };
    let mut order = order.into_iter();
    order.find(|(_, shells)| !shells.is_empty()).unwrap_or_default()
}

/// How far the block models of buildings are from their roofs, metres: the largest vertical distance of a roof's corner from the top of
/// the block, which is the geometric error of showing LOD1 in place of LOD2.
#[must_use]
pub fn block_error(buildings: &[Building]) -> f64 {
    let of = |building: &Building| {
        let tops = building.lods.lod1.iter().filter_map(|shell| Some(shell.bounds()?.1.z));
        let top = tops.fold(f64::NEG_INFINITY, f64::max);
        let roofs = building.lods.lod2.iter().flat_map(|shell| {
            let roofs = shell.faces.iter().filter(|f| f.semantic == Semantic::RoofSurface);
            roofs.flat_map(|f| &f.rings).flatten().map(|&i| shell.vertices[i as usize].z)
        });
        if top.is_finite() { roofs.map(|z| (z - top).abs()).fold(0.0, f64::max) } else { 0.0 }
    };
    buildings.iter().map(of).fold(LEAST_ERROR, f64::max)
}

/// Vertices of a mesh, in the order of their triangles.
#[derive(Default)]
struct Mesh {
    positions: Vec<DVec3>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[u8; 4]>,
    buildings: Vec<[f32; 1]>,
    surfaces: Vec<[f32; 1]>,
    indices: Vec<u32>,
}

/// Buildings of a tile at a level of detail; none if no building has a geometry. A building without that level is shown at the nearest
/// one that it has, which the attribute `lod` tells.
///
/// # Errors
/// If a geometry points at vertices that it does not have.
pub fn buildings_content(buildings: &[Building], lod: TileLod) -> Result<Option<Content>, Error> {
    let mut mesh = Mesh::default();
    let mut shown: Vec<(&Building, &str)> = Vec::new();
    let (mut kinds, mut owners, mut attributes) = (Vec::new(), Vec::new(), Vec::new());
    // Attributes of surfaces outlive the quantised shells that they came from.
    let mut kept: Vec<Attributes> = Vec::new();
    for building in buildings {
        let (level, shells) = shells(building, lod);
        if level.is_empty() {
            continue;
        }
        let number = shown.len() as u32;
        for shell in shells {
            if !shell.is_well_formed() {
                let reason = "a geometry has a vertex index out of range or a coordinate not finite";
                return Err(Error::object(&building.id, reason));
            }
            let shell = quantised(shell);
            let mut surface = None;
            for triangle in triangulate(&shell) {
                let face = &shell.faces[triangle.face as usize];
                if surface != Some(triangle.face) {
                    surface = Some(triangle.face);
                    kinds.push(kind(face.semantic));
                    owners.push(number);
                    kept.push(face.attributes.clone());
                }
                let normal = to_gltf(shell.vector_area(face).normalize_or_zero()).as_vec3().to_array();
                for corner in triangle.corners {
                    mesh.indices.push(mesh.positions.len() as u32);
                    mesh.positions.push(shell.vertices[corner as usize]);
                    mesh.normals.push(normal);
                    mesh.colours.push(KINDS[usize::from(kind(face.semantic))].1);
                    mesh.buildings.push([number as f32]);
                    mesh.surfaces.push([(kinds.len() - 1) as f32]);
                }
            }
        }
        shown.push((building, level));
    }
    if mesh.indices.is_empty() {
        return Ok(None);
    }
    attributes.extend(kept.iter());
    mesh.unite();

    let mut glb = Glb::default();
    let (positions, translation, low, high) = centred(&mesh.positions);
    let primitive = json!({
        "attributes": {
            "POSITION": glb.vectors(&positions),
            "NORMAL": glb.vectors(&mesh.normals),
            "COLOR_0": glb.colours(&mesh.colours),
            "_FEATURE_ID_0": glb.vectors(&mesh.buildings),
            "_FEATURE_ID_1": glb.vectors(&mesh.surfaces),
        },
        "indices": glb.indices(&mesh.indices),
        "material": 0,
        "mode": 4,
        "extensions": { "EXT_mesh_features": { "featureIds": [
            { "featureCount": shown.len(), "attribute": 0, "label": "building", "propertyTable": 0 },
            { "featureCount": kinds.len(), "attribute": 1, "label": "surface", "propertyTable": 1 },
        ] } },
    });
    let mut table = Table::new(shown.len());
    table.texts(&mut glb, "id", &shown.iter().map(|(b, _)| b.id.as_str()).collect::<Vec<_>>(), "Identifier");
    table.texts(&mut glb, "lod", &shown.iter().map(|(_, lod)| *lod).collect::<Vec<_>>(), "The LOD that is shown");
    table.attributes(&mut glb, &shown.iter().map(|(b, _)| &b.attributes).collect::<Vec<_>>());
    let (building_class, building_table) = table.finish("building");
    let mut table = Table::new(kinds.len());
    table.kinds(&mut glb, "kind", "surfaceKind", &kinds, "What the surface is");
    table.numbers(&mut glb, "building", &owners, "Feature number of its building");
    table.attributes(&mut glb, &attributes);
    let (surface_class, surface_table) = table.finish("surface");
    let values: Vec<Value> =
        KINDS.iter().enumerate().map(|(i, (name, _))| json!({ "name": name, "value": i })).collect();
    let document = json!({
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": translation }],
        "meshes": [{ "primitives": [primitive] }],
        "materials": [{
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "doubleSided": lod == TileLod::Lod0,
        }],
        "extensionsUsed": ["EXT_mesh_features", "EXT_structural_metadata"],
        "extensions": { "EXT_structural_metadata": {
            "schema": {
                "id": "gable",
                "classes": { "building": building_class, "surface": surface_class },
                "enums": { "surfaceKind": { "valueType": "UINT8", "values": values } },
            },
            "propertyTables": [building_table, surface_table],
        } },
    });
    Ok(Some(Content { glb: glb.finish(document), low, high }))
}

impl Mesh {
    /// Makes one vertex of the equal ones of a surface.
    fn unite(&mut self) {
        let mut known = std::collections::HashMap::new();
        let mut kept: Vec<usize> = Vec::new();
        for (i, index) in self.indices.iter_mut().enumerate() {
            let key = (self.surfaces[i][0] as u32, crate::lattice(self.positions[i]));
            *index = *known.entry(key).or_insert_with(|| {
                kept.push(i);
                kept.len() as u32 - 1
            });
        }
        self.positions = kept.iter().map(|&i| self.positions[i]).collect();
        self.normals = kept.iter().map(|&i| self.normals[i]).collect();
        self.colours = kept.iter().map(|&i| self.colours[i]).collect();
        self.buildings = kept.iter().map(|&i| self.buildings[i]).collect();
        self.surfaces = kept.iter().map(|&i| self.surfaces[i]).collect();
    }
}

/// A terrain with a picture on it; none if it has no triangle.
///
/// # Errors
/// If it points at vertices that it does not have.
pub fn terrain_content(terrain: &Terrain, texture: &GroundTexture) -> Result<Option<Content>, Error> {
    if terrain.triangles.is_empty() {
        return Ok(None);
    }
    let count = terrain.vertices.len();
    if terrain.triangles.iter().flatten().any(|&i| i as usize >= count)
        || terrain.vertices.iter().any(|p| !p.is_finite())
    {
        let reason = "the terrain has a vertex index out of range or a coordinate not finite";
        return Err(Error::object(&terrain.id, reason));
    }
    let mut normals = vec![DVec3::ZERO; count];
    for corners in &terrain.triangles {
        let [a, b, c] = corners.map(|i| terrain.vertices[i as usize]);
        corners.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
    }
    let normals: Vec<[f32; 3]> =
        normals.into_iter().map(|n| to_gltf(n.normalize_or(DVec3::Z)).as_vec3().to_array()).collect();
    let size = texture.bounds.size();
    let place: Vec<[f32; 2]> = (terrain.vertices.iter())
        .map(|p| {
            let u = (p.x - texture.bounds.min.x) / size.x;
            let v = (texture.bounds.max.y - p.y) / size.y;
            [u.clamp(0.0, 1.0) as f32, v.clamp(0.0, 1.0) as f32]
        })
        .collect();
    let mut glb = Glb::default();
    let (positions, translation, low, high) = centred(&terrain.vertices);
    let indices: Vec<u32> = terrain.triangles.concat();
    let document = json!({
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": translation }],
        "meshes": [{ "primitives": [{
            "attributes": {
                "POSITION": glb.vectors(&positions),
                "NORMAL": glb.vectors(&normals),
                "TEXCOORD_0": glb.vectors(&place),
            },
            "indices": glb.indices(&indices),
            "material": 0,
            "mode": 4,
        }] }],
        // The light is in the photographs already.
        "materials": [{
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0, "roughnessFactor": 1.0,
            },
            "extensions": { "KHR_materials_unlit": {} },
        }],
        "extensionsUsed": ["KHR_materials_unlit"],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 }],
        "images": [{ "bufferView": glb.view(&texture.jpeg, None), "mimeType": "image/jpeg" }],
    });
    Ok(Some(Content { glb: glb.finish(document), low, high }))
}

/// East, north, up as glTF has them: x east, y up, z south.
pub(crate) fn to_gltf(p: DVec3) -> DVec3 {
    dvec3(p.x, p.z, -p.y)
}

/// Positions in f32 about a whole metre, as glTF has them; what to add to them; and a box in local metres around what a reader gets.
pub(crate) fn centred(points: &[DVec3]) -> (Vec<[f32; 3]>, [f64; 3], DVec3, DVec3) {
    let (low, high) = points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    let centre = ((low + high) / 2.0).round();
    let positions: Vec<[f32; 3]> = points.iter().map(|&p| to_gltf(p - centre).as_vec3().to_array()).collect();
    (positions, (to_gltf(centre) + 0.0).to_array(), low - SLACK, high + SLACK)
}
