//! A city model made ready for measuring: footprints, triangles, connected blocks.

use crate::height_raster::HeightRaster;
use crate::region::{Region, Ring};
use crate::tree::{Bounds, Tree};
use crate::{Error, budget};
use gable_city_model::{Building, CityModel, Semantic, Shell, Terrain, triangulate};
use gable_geometry::{Box2, DVec2, DVec3, point_segment_distance};
use rayon::prelude::*;

/// Footprints nearer than this to each other belong to one connected block, metres.
const TOUCHING: f64 = 0.1;

/// How far outside a wall a point is taken to see whether the wall is between two buildings, metres.
const OUTSIDE: f64 = 0.05;

/// Lattice on which the ground is known, metres.
const GROUND_STEP: f64 = 1.0;

/// A wall is under the ground where it lies further than this below the terrain, metres.
const BURIED: f64 = 0.3;

/// A triangle of a building's LOD2 (LOD1 if it has no LOD2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub(crate) corners: [DVec3; 3],
    pub(crate) semantic: Semantic,
    /// Face that it comes from, counted through all shells of the building.
    pub(crate) face: u32,
}

/// A building.
#[derive(Debug)]
pub(crate) struct Object<'a> {
    pub(crate) building: &'a Building,
    pub(crate) footprint: Region,
    /// Area of the footprint, m².
    pub(crate) area: f64,
    pub(crate) facets: Vec<Facet>,
    pub(crate) bounds: Bounds,
}

impl<'a> Object<'a> {
    fn new(building: &'a Building, shift: DVec3) -> Self {
        let lods = &building.lods;
        let shells = if lods.lod2.is_empty() { &lods.lod1 } else { &lods.lod2 };
        let mut facets = Vec::new();
        let mut faces = 0;
        for shell in shells.iter().filter(|s| s.is_well_formed()) {
            facets.extend(triangulate(shell).into_iter().map(|t| {
                let face = &shell.faces[t.face as usize];
                let corners = t.corners.map(|i| shell.vertices[i as usize] + shift);
                Facet { corners, semantic: face.semantic, face: faces + t.face }
            }));
            faces += shell.faces.len() as u32;
        }
        let footprint = footprint(building, shift);
        let flat = footprint.bounds();
        let corners = [flat.min.extend(f64::INFINITY), flat.max.extend(f64::NEG_INFINITY)];
        let bounds = Bounds::of(facets.iter().flat_map(|f| f.corners).chain(corners));
        Self { building, area: footprint.area(), footprint, facets, bounds }
    }

    /// Triangles of the roof.
    pub(crate) fn roof(&self) -> impl Iterator<Item = &Facet> {
        self.facets.iter().filter(|f| f.semantic == Semantic::RoofSurface)
    }

    /// Extent on the ground.
    pub(crate) fn plan(&self) -> Box2 {
        Box2 { min: self.bounds.low.truncate(), max: self.bounds.high.truncate() }
    }
}

/// The ground that a building stands on: its LOD0 footprint, else the ground surfaces of LOD2 or LOD1, else its LOD0 roof edge,
/// else whatever lies under its LOD2.
pub(crate) fn footprint(building: &Building, shift: DVec3) -> Region {
    let lods = &building.lods;
    let ground = |shells: &[Shell]| region(shells, shift, |s| s == Semantic::GroundSurface);
    let any = |shells: &[Shell]| region(shells, shift, |_| true);
    let choices: [&dyn Fn() -> Region; 5] = [
        &|| any(lods.footprint.as_slice()),
        &|| ground(&lods.lod2),
        &|| ground(&lods.lod1),
        &|| any(lods.roof_edge.as_slice()),
        &|| any(&lods.lod2),
    ];
    choices.iter().map(|choice| choice()).find(|region| !region.is_empty()).unwrap_or_default()
}

/// The terrain as heights; `shift` is added to its coordinates.
fn ground(terrain: &Terrain, shift: DVec3) -> HeightRaster {
    let bounds = Box2::of(terrain.vertices.iter().map(|&p| (p + shift).truncate()));
    let mut raster = HeightRaster::covering(bounds, GROUND_STEP);
    raster.draw_terrain(terrain, shift);
    raster
}

/// The faces of shells seen from above.
pub(crate) fn region(shells: &[Shell], shift: DVec3, keep: impl Fn(Semantic) -> bool) -> Region {
    let mut polygons = Vec::new();
    for shell in shells.iter().filter(|s| s.is_well_formed()) {
        for face in shell.faces.iter().filter(|f| keep(f.semantic) && !is_steep(shell.vector_area(f))) {
            let ring = |ring: &Vec<u32>| -> Ring {
                ring.iter().map(|&i| (shell.vertices[i as usize] + shift).truncate().into()).collect()
            };
            polygons.push(face.rings.iter().map(ring).collect());
        }
    }
    Region::of(polygons)
}

fn is_steep(vector_area: DVec3) -> bool {
    vector_area.z.abs() <= 1e-3 * vector_area.length()
}

/// Buildings that touch, directly or through others.
#[derive(Debug)]
pub(crate) struct Block {
    /// Objects, ascending.
    pub(crate) members: Vec<usize>,
    pub(crate) region: Region,
    pub(crate) area: f64,
}

/// All buildings of a model, in its order.
#[derive(Debug)]
pub(crate) struct City<'a> {
    pub(crate) objects: Vec<Object<'a>>,
    pub(crate) blocks: Vec<Block>,
    tree: Tree,
    /// Triangles of all roofs with their objects, and a tree over them.
    roofs: Vec<([DVec3; 3], u32)>,
    roof_tree: Tree,
    /// The model's terrain, if it has one.
    ground: Option<HeightRaster>,
}

impl<'a> City<'a> {
    /// `shift` is added to all coordinates.
    ///
    /// # Errors
    /// If the model is larger than any city.
    pub(crate) fn new(model: &'a CityModel, shift: DVec3) -> Result<Self, Error> {
        budget::check(model)?;
        let objects: Vec<Object<'a>> = model.buildings.par_iter().map(|b| Object::new(b, shift)).collect();
        let boxes: Vec<Bounds> = objects.iter().map(|o| o.bounds).collect();
        let of_object = |(i, o): (usize, &Object<'_>)| o.roof().map(|f| (f.corners, i as u32)).collect::<Vec<_>>();
        let roofs: Vec<([DVec3; 3], u32)> = objects.iter().enumerate().flat_map(of_object).collect();
        let roof_boxes: Vec<Bounds> = roofs.iter().map(|r| Bounds::of(r.0)).collect();
        let (tree, roof_tree) = (Tree::new(&boxes), Tree::new(&roof_boxes));
        let ground = model.terrain.as_ref().map(|terrain| ground(terrain, shift));
        let mut city = Self { objects, blocks: Vec::new(), tree, roofs, roof_tree, ground };
        city.blocks = city.connected()?;
        Ok(city)
    }

    /// Objects whose boxes overlap a box on the ground, ascending.
    pub(crate) fn near(&self, plan: Box2) -> Vec<usize> {
        let bounds = Bounds { low: plan.min.extend(f64::NEG_INFINITY), high: plan.max.extend(f64::INFINITY) };
        let mut found = Vec::new();
        self.tree.near(&bounds, |i| found.push(i));
        found.retain(|&i| self.objects[i].plan().intersects(&plan));
        found.sort_unstable();
        found
    }

    fn connected(&self) -> Result<Vec<Block>, Error> {
        let plan = |object: &Object<'_>| object.footprint.bounds().grown(TOUCHING);
        let pairs: usize = self.objects.par_iter().map(|object| self.near(plan(object)).len()).sum();
        if pairs > budget::NEIGHBOURS {
            let what = format!("{pairs} pairs of buildings lie one upon the other");
            return Err(Error::NoCity { what });
        }
        let links: Vec<Vec<usize>> = (0..self.objects.len())
            .into_par_iter()
            .map(|i| {
                let object = &self.objects[i];
                let mut near = self.near(plan(object));
                near.retain(|&j| j > i && touch(&object.footprint, &self.objects[j].footprint));
                near
            })
            .collect();
        let pairs = links.iter().enumerate().flat_map(|(i, js)| js.iter().map(move |&j| (i, j)));
        let groups = groups(self.objects.len(), pairs);
        let block = |members: Vec<usize>| {
            let region = Region::union(members.iter().map(|&i| &self.objects[i].footprint));
            Block { area: region.area(), region, members }
        };
        Ok(groups.into_par_iter().map(block).filter(|b| b.area > 0.0).collect())
    }

    /// Whether a surface sample is on the outside of the city: no roof of any building hangs over a point just in front of
    /// it that is inside that building's footprint, and it is not under the terrain. Walls between two houses, and what of
    /// a wall stands in a slope, which no camera sees, are not.
    pub(crate) fn is_outside(&self, position: DVec3, normal: DVec3) -> bool {
        let p = position + normal * OUTSIDE;
        let at = p.truncate();
        if self.ground.as_ref().and_then(|g| g.at(at)).is_some_and(|z| p.z < z - BURIED) {
            return false;
        }
        let above = Bounds { low: p, high: at.extend(f64::INFINITY) };
        !self.roof_tree.any(&above, |k| {
            let (corners, object) = self.roofs[k];
            height_at(corners, at).is_some_and(|z| z > p.z) && self.objects[object as usize].footprint.contains(at)
        })
    }
}

/// Height of a triangle above a place, if it is above it and not vertical.
pub(crate) fn height_at([a, b, c]: [DVec3; 3], at: DVec2) -> Option<f64> {
    let (u, v, w) = ((b - a).truncate(), (c - a).truncate(), at - a.truncate());
    let det = u.perp_dot(v);
    if det.abs() < 1e-12 {
        return None;
    }
    let (s, t) = (w.perp_dot(v) / det, u.perp_dot(w) / det);
    (s >= 0.0 && t >= 0.0 && s + t <= 1.0).then_some(a.z + s * (b.z - a.z) + t * (c.z - a.z))
}

/// Whether two regions overlap or come within [`TOUCHING`].
fn touch(a: &Region, b: &Region) -> bool {
    let mut segments = a.segments().map(|s| (s, Box2::of(s).grown(TOUCHING)));
    let others: Vec<_> = b.segments().map(|s| (s, Box2::of(s))).collect();
    let meet = segments.any(|(p, near)| {
        others.iter().any(|&(q, bounds)| near.intersects(&bounds) && segment_distance(p, q) <= TOUCHING)
    });
    meet || !a.intersection(b).is_empty()
}

fn segment_distance(p: [DVec2; 2], q: [DVec2; 2]) -> f64 {
    let side = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    let crossing =
        side(p[0], p[1], q[0]) * side(p[0], p[1], q[1]) < 0.0 && side(q[0], q[1], p[0]) * side(q[0], q[1], p[1]) < 0.0;
    if crossing {
        return 0.0;
    }
    let ends = [
        point_segment_distance(p[0], q[0], q[1]),
        point_segment_distance(p[1], q[0], q[1]),
        point_segment_distance(q[0], p[0], p[1]),
        point_segment_distance(q[1], p[0], p[1]),
    ];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Connected groups of `0..count`, each ascending, in the order of their first members.
pub(crate) fn groups(count: usize, links: impl IntoIterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    fn find(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let mut parent: Vec<usize> = (0..count).collect();
    for (i, j) in links {
        let (a, b) = (find(&mut parent, i), find(&mut parent, j));
        parent[a.max(b)] = a.min(b);
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); count];
    for i in 0..count {
        groups[find(&mut parent, i)].push(i);
    }
    groups.retain(|g| !g.is_empty());
    groups
}

/// Distance from a point to a polyline's sides, at most `limit`, by a tree over the sides.
#[derive(Debug)]
pub(crate) struct Outline {
    segments: Vec<[DVec2; 2]>,
    tree: Tree,
}

impl Outline {
    pub(crate) fn new(region: &Region) -> Self {
        let segments: Vec<_> = region.segments().collect();
        let boxes: Vec<Bounds> = segments.iter().map(|s| Bounds::of(s.map(|p| p.extend(0.0)))).collect();
        Self { tree: Tree::new(&boxes), segments }
    }

    pub(crate) fn distance(&self, p: DVec2) -> f64 {
        let distance = |i: usize| point_segment_distance(p, self.segments[i][0], self.segments[i][1]).powi(2);
        self.tree.nearest_squared(p.extend(0.0), f64::INFINITY, distance).sqrt()
    }

    /// Points in the middle of pieces of at most `step` along all sides.
    pub(crate) fn points(&self, step: f64) -> Vec<DVec2> {
        let mut out = Vec::new();
        for [a, b] in &self.segments {
            let pieces = (a.distance(*b) / step).ceil().max(1.0) as usize;
            out.extend((0..pieces).map(|k| a.lerp(*b, (k as f64 + 0.5) / pieces as f64)));
        }
        out
    }
}
