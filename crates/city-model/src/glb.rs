//! GLB of a model for modelling programs: a node for each building, named after it, with its attributes, and a material for each kind of
//! surface.

use crate::surface_kinds::{KINDS, TERRAIN, kind, linear};
use crate::tiles3d::content::{centred, to_gltf};
use crate::tiles3d::glb::Glb;
use crate::{CityModel, Error, Shell, Terrain, Value, quantised, triangulate};
use gable_geometry::DVec3;
use serde_json::{Map, Value as Json, json};

/// Positions and normals of a kind of surface, in the order of its triangles.
#[derive(Default)]
struct Part {
    positions: Vec<DVec3>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

/// The best level of detail of each building of a model, and its terrain, as GLB (glTF 2.0); none if the model is empty.
///
/// Coordinates are those of the local frame, turned to y up, x east and z south as glTF has them. The scene's `extras` name the origin
/// (easting, northing, height) and the reference system. A building is a node of its name; its attributes are the node's `extras`.
///
/// # Errors
/// If a geometry is malformed.
pub fn write_glb(model: &CityModel) -> Result<Option<Vec<u8>>, Error> {
    let mut glb = Glb::default();
    let (mut nodes, mut meshes) = (Vec::new(), Vec::new());
    if let Some(terrain) = model.terrain.as_ref().filter(|terrain| !terrain.triangles.is_empty()) {
        let part = surface(terrain)?;
        node(&mut glb, &mut nodes, &mut meshes, &terrain.id, json!({}), vec![(KINDS.len(), part)]);
    }
    for building in &model.buildings {
        let (lod, shells) = building.best();
        let mut parts: [Part; KINDS.len()] = Default::default();
        for shell in shells {
            if !shell.is_well_formed() {
                let reason = "a geometry has a vertex index out of range or a coordinate not finite";
                return Err(Error::object(&building.id, reason));
            }
            add(&quantised(shell), &mut parts);
        }
        let parts: Vec<(usize, Part)> = parts.into_iter().enumerate().filter(|(_, p)| !p.indices.is_empty()).collect();
        if parts.is_empty() {
            continue;
        }
        let mut extras = Map::new();
        extras.insert("lod".to_owned(), json!(lod));
        for (name, value) in &building.attributes {
            let value = match value {
                Value::Bool(b) => json!(b),
                Value::Integer(n) => json!(n),
                Value::Number(n) => json!(crate::cityjson::clean(*n)),
                Value::Text(text) => json!(text),
            };
            extras.insert(name.clone(), value);
        }
        node(&mut glb, &mut nodes, &mut meshes, &building.id, Json::Object(extras), parts);
    }
    if nodes.is_empty() {
        return Ok(None);
    }
    let material = |(name, colour): (&str, [u8; 4])| {
        let [r, g, b] = linear(colour);
        let plain = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        json!({ "name": name, "pbrMetallicRoughness": plain })
    };
    let materials: Vec<Json> = KINDS.into_iter().chain([TERRAIN]).map(material).collect();
    let children: Vec<usize> = (0..nodes.len()).collect();
    let document = json!({
        "scene": 0,
        "scenes": [{
            "name": model.title,
            "nodes": children,
            "extras": { "origin": model.origin, "crs": model.crs.to_string() },
        }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
    });
    Ok(Some(glb.finish(document)))
}

/// Adds a node of a mesh with a primitive for each part; `parts` have the numbers of their materials.
fn node(
    glb: &mut Glb,
    nodes: &mut Vec<Json>,
    meshes: &mut Vec<Json>,
    name: &str,
    extras: Json,
    parts: Vec<(usize, Part)>,
) {
    let all: Vec<DVec3> = parts.iter().flat_map(|(_, part)| part.positions.iter().copied()).collect();
    // About the middle of the node: far from the origin 32 bits would not do.
    let (positions, translation, _, _) = centred(&all);
    let (mut primitives, mut first) = (Vec::new(), 0);
    for (material, part) in parts {
        let end = first + part.positions.len();
        primitives.push(json!({
            "attributes": {
                "POSITION": glb.vectors(&positions[first..end]),
                "NORMAL": glb.vectors(&part.normals),
            },
            "indices": glb.indices(&part.indices),
            "material": material,
            "mode": 4,
        }));
        first = end;
    }
    nodes.push(json!({ "name": name, "mesh": meshes.len(), "translation": translation, "extras": extras }));
    meshes.push(json!({ "name": name, "primitives": primitives }));
}

/// Adds the triangles of a quantised shell; corners are shared within a face.
fn add(shell: &Shell, parts: &mut [Part; KINDS.len()]) {
    let mut known: Vec<Option<(u32, u32)>> = vec![None; shell.vertices.len()];
    for triangle in triangulate(shell) {
        let face = &shell.faces[triangle.face as usize];
        let part = &mut parts[usize::from(kind(face.semantic))];
        let normal = to_gltf(shell.vector_area(face).normalize_or(DVec3::Z)).as_vec3().to_array();
        for corner in triangle.corners {
            let place = &mut known[corner as usize];
            let number = match *place {
                Some((owner, number)) if owner == triangle.face => number,
                _ => {
                    part.positions.push(shell.vertices[corner as usize]);
                    part.normals.push(normal);
                    part.positions.len() as u32 - 1
                }
            };
            *place = Some((triangle.face, number));
            part.indices.push(number);
        }
    }
}

/// The terrain, smoothly lit.
fn surface(terrain: &Terrain) -> Result<Part, Error> {
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
    let light = |n: DVec3| to_gltf(n.normalize_or(DVec3::Z)).as_vec3().to_array();
    Ok(Part {
        positions: terrain.vertices.clone(),
        normals: normals.into_iter().map(light).collect(),
        indices: terrain.triangles.concat(),
    })
}
