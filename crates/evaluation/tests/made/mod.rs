//! Small cities made by hand.

use gable_city_model::{Attributes, Building, CityModel, Face, Lods, Semantic, Shell, Terrain};
use gable_geometry::{Crs, DVec3, dvec3};

pub(crate) fn face(ring: &[u32], semantic: Semantic) -> Face {
    Face { rings: vec![ring.to_vec()], semantic, attributes: Attributes::new() }
}

/// A prism over a ring that runs counter-clockwise.
pub(crate) fn prism(ring: &[(f64, f64)], low: f64, high: f64) -> Shell {
    let n = ring.len() as u32;
    let at = |z: f64| ring.iter().map(move |&(x, y)| dvec3(x, y, z));
    let mut faces = vec![
        face(&(0..n).rev().collect::<Vec<_>>(), Semantic::GroundSurface),
        face(&(n..2 * n).collect::<Vec<_>>(), Semantic::RoofSurface),
    ];
    faces.extend((0..n).map(|k| face(&[k, (k + 1) % n, n + (k + 1) % n, n + k], Semantic::WallSurface)));
    Shell { vertices: at(low).chain(at(high)).collect(), faces }
}

pub(crate) fn rectangle(x: f64, y: f64, width: f64, depth: f64) -> [(f64, f64); 4] {
    [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
}

/// Ground 10 m × 8 m, eaves at 4 m, ridge along x at 6 m.
pub(crate) fn gable() -> Shell {
    let vertices = vec![
        dvec3(0., 0., 0.),
        dvec3(10., 0., 0.),
        dvec3(10., 8., 0.),
        dvec3(0., 8., 0.),
        dvec3(0., 0., 4.),
        dvec3(10., 0., 4.),
        dvec3(10., 8., 4.),
        dvec3(0., 8., 4.),
        dvec3(0., 4., 6.),
        dvec3(10., 4., 6.),
    ];
    let faces = vec![
        face(&[3, 2, 1, 0], Semantic::GroundSurface),
        face(&[4, 5, 9, 8], Semantic::RoofSurface),
        face(&[6, 7, 8, 9], Semantic::RoofSurface),
        face(&[0, 1, 5, 4], Semantic::WallSurface),
        face(&[1, 2, 6, 9, 5], Semantic::WallSurface),
        face(&[2, 3, 7, 6], Semantic::WallSurface),
        face(&[3, 0, 4, 8, 7], Semantic::WallSurface),
    ];
    Shell { vertices, faces }
}

/// A building whose LOD1 and LOD2 are `solid` and whose LOD0 is its ground.
pub(crate) fn building(id: &str, solid: Shell) -> Building {
    let ground = solid.faces.iter().find(|f| f.semantic == Semantic::GroundSurface).unwrap();
    let footprint = Shell { vertices: solid.vertices.clone(), faces: vec![ground.clone()] };
    let lods = Lods { footprint: Some(footprint), roof_edge: None, lod1: vec![solid.clone()], lod2: vec![solid] };
    Building { id: id.to_owned(), attributes: Attributes::new(), lods }
}

/// A box on the ground.
pub(crate) fn house(id: &str, x: f64, y: f64, width: f64, depth: f64, height: f64) -> Building {
    building(id, prism(&rectangle(x, y, width, depth), 0.0, height))
}

pub(crate) fn city(buildings: Vec<Building>) -> CityModel {
    CityModel {
        title: "made <by> hand".to_owned(),
        metadata: Default::default(),
        origin: [0.0; 3],
        crs: Crs::Unknown,
        buildings,
        terrain: None,
    }
}

pub(crate) fn moved(model: &CityModel, by: DVec3) -> CityModel {
    let mut out = model.clone();
    for building in &mut out.buildings {
        let lods = &mut building.lods;
        let shells = lods.footprint.iter_mut().chain(&mut lods.roof_edge).chain(&mut lods.lod1).chain(&mut lods.lod2);
        shells.flat_map(|s| &mut s.vertices).for_each(|v| *v += by);
    }
    if let Some(terrain) = &mut out.terrain {
        terrain.vertices.iter_mut().for_each(|v| *v += by);
    }
    out
}

/// Level ground around the origin, 40 m wide.
pub(crate) fn ground(z: f64) -> Terrain {
    let vertices = vec![dvec3(-20., -20., z), dvec3(20., -20., z), dvec3(20., 20., z), dvec3(-20., 20., z)];
    Terrain { id: "ground".to_owned(), vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }
}
