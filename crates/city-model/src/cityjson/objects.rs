//! Buildings and terrain as CityObjects.

use super::schema::{Boundaries, CityObject, Entries, Geometry, Semantics, Values, VertexPool, attributes};
use crate::quantise::{STEPS_PER_METRE, lattice};
use crate::{Building, Error, Face, Semantic, Shell, Terrain, Value, quantised};

/// World coordinates of a lattice point: exact decimals for origins of whole metres.
pub(super) fn world(origin: [f64; 3], q: [i64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let value = origin[i] + q[i] as f64 / STEPS_PER_METRE;
        (value * STEPS_PER_METRE).round() / STEPS_PER_METRE + 0.0
    })
}

/// The objects of a building in the order in which they are written, parents first.
///
/// A LOD with one solid stands on the Building itself; a LOD with several has one BuildingPart for each, and part `k`
/// holds the k-th solid of every such LOD.
pub(super) fn building<'a>(
    building: &'a Building,
    origin: [f64; 3],
    pool: &mut VertexPool,
) -> Result<Vec<(String, CityObject<'a>)>, Error> {
    let id = building.id.as_str();
    let too_far = || Error::Range { id: id.to_owned(), origin };
    let lods = &building.lods;
    let parts = [&lods.lod1, &lods.lod2].into_iter().filter(|s| s.len() > 1).map(Vec::len).max().unwrap_or(0);
    let mut own = Vec::new();
    let mut low = [i64::MAX; 3];
    let mut high = [i64::MIN; 3];
    let mut add = |to: &mut Vec<Geometry>, shell: &Shell, lod: &'static str, solid: bool| -> Result<(), Error> {
        if !shell.is_well_formed() {
            let reason = format!("the geometry of LOD{lod} has a vertex index out of range or a coordinate not finite");
            return Err(Error::object(id, reason));
        }
        let written = quantised(shell);
        if written.faces.is_empty() {
            return Ok(());
        }
        for q in written.vertices.iter().map(|&p| lattice(p)) {
            for i in 0..3 {
                low[i] = low[i].min(q[i]);
                high[i] = high[i].max(q[i]);
            }
        }
        let surfaces = pool.surfaces(&written).ok_or_else(too_far)?;
        let (semantic, values) = semantics(id, &written.faces)?;
        to.push(if solid {
            let semantics = Some(Semantics { surfaces: semantic, values: Values::Shells([values]) });
            Geometry { kind: "Solid", lod, boundaries: Boundaries::Shells([surfaces]), semantics }
        } else {
            let semantics = Some(Semantics { surfaces: semantic, values: Values::Surfaces(values) });
            Geometry { kind: "MultiSurface", lod, boundaries: Boundaries::Surfaces(surfaces), semantics }
        });
        Ok(())
    };
    for surfaces in [&lods.footprint, &lods.roof_edge].into_iter().flatten() {
        add(&mut own, surfaces, "0", false)?;
    }
    for (lod, solids) in [("1", &lods.lod1), ("2", &lods.lod2)] {
        if let [solid] = solids.as_slice() {
            add(&mut own, solid, lod, true)?;
        }
    }
    let mut children = Vec::new();
    for k in 0..parts {
        let mut geometry = Vec::new();
        for (lod, solids) in [("1", &lods.lod1), ("2", &lods.lod2)] {
            if let (Some(solid), true) = (solids.get(k), solids.len() > 1) {
                add(&mut geometry, solid, lod, true)?;
            }
        }
        let part = CityObject {
            kind: "BuildingPart",
            extent: None,
            attributes: None,
            children: Vec::new(),
            parents: vec![id],
            geometry,
        };
        children.push((part_id(id, k), part));
    }
    let extent = (low[0] <= high[0]).then(|| {
        let ([a, b, c], [d, e, f]) = (world(origin, low), world(origin, high));
        [a, b, c, d, e, f]
    });
    let whole = CityObject {
        kind: "Building",
        extent,
        attributes: Some(attributes(id, &building.attributes)?),
        children: children.iter().map(|(name, _)| name.clone()).collect(),
        parents: Vec::new(),
        geometry: own,
    };
    Ok(std::iter::once((id.to_owned(), whole)).chain(children).collect())
}

/// Identifier of the k-th part of a building.
pub(crate) fn part_id(id: &str, k: usize) -> String {
    format!("{id}-{k}")
}

/// One semantic object for each different meaning and set of attributes, in the order of first use.
fn semantics(id: &str, faces: &[Face]) -> Result<(Vec<Entries>, Vec<u32>), Error> {
    let mut kinds: Vec<&Face> = Vec::new();
    let mut values = Vec::with_capacity(faces.len());
    for face in faces {
        let same = |kind: &&Face| kind.semantic == face.semantic && kind.attributes == face.attributes;
        let kind = kinds.iter().position(same).unwrap_or_else(|| {
            kinds.push(face);
            kinds.len() - 1
        });
        values.push(kind as u32);
    }
    let mut surfaces = Vec::with_capacity(kinds.len());
    for face in kinds {
        let mut surface = vec![("type".to_owned(), Value::Text(semantic_name(face.semantic).to_owned()))];
        let Entries(own) = attributes(id, &face.attributes)?;
        if let Some((name, _)) = own.iter().find(|(name, _)| ["type", "parent", "children"].contains(&name.as_str())) {
            return Err(Error::object(id, format!("a surface attribute may not be called {name}: rename it")));
        }
        surface.extend(own);
        surfaces.push(Entries(surface));
    }
    Ok((surfaces, values))
}

/// CityJSON's (and CityGML's) name of a surface.
pub(crate) fn semantic_name(semantic: Semantic) -> &'static str {
    match semantic {
        Semantic::GroundSurface => "GroundSurface",
        Semantic::WallSurface => "WallSurface",
        Semantic::RoofSurface => "RoofSurface",
    }
}

/// Terrain as a TINRelief with one CompositeSurface at LOD1. Triangles that rounding collapses are left out.
pub(super) fn terrain(
    terrain: &Terrain,
    origin: [f64; 3],
    pool: &mut VertexPool,
) -> Result<CityObject<'static>, Error> {
    let too_far = || Error::Range { id: terrain.id.clone(), origin };
    let count = terrain.vertices.len();
    if terrain.triangles.iter().flatten().any(|&i| i as usize >= count)
        || !terrain.vertices.iter().all(|p| p.is_finite())
    {
        return Err(Error::object(&terrain.id, "a triangle's index is out of range or a coordinate is not finite"));
    }
    let mut boundaries = Vec::with_capacity(terrain.triangles.len());
    for triangle in &terrain.triangles {
        let corners = triangle.map(|i| lattice(terrain.vertices[i as usize]));
        if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
            continue;
        }
        let mut ring = Vec::with_capacity(3);
        for &i in triangle {
            ring.push(pool.place(terrain.vertices[i as usize]).ok_or_else(too_far)?);
        }
        boundaries.push(vec![ring]);
    }
    let geometry =
        Geometry { kind: "CompositeSurface", lod: "1", boundaries: Boundaries::Surfaces(boundaries), semantics: None };
    let geometry = vec![geometry];
    Ok(CityObject { kind: "TINRelief", extent: None, attributes: None, children: vec![], parents: vec![], geometry })
}
