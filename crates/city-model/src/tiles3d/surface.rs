//! A coloured surface of very many triangles, such as a mesh from photographs, thinned out by vertex clustering (Rossignac and
//! Borrel 1993).
//!
//! 1. A triangle is cut at the borders of its tile.
//! 2. Its corners go to the cubes of a lattice that hangs on the local origin. All corners of a cube become one vertex, their mean in
//!    place and in light: on a plane, that stays on the plane.
//! 3. Triangles whose corners are no longer three, and repeated ones, are dropped.
//! 4. A coarser surface is made from the vertices of a finer one, each weighing as much as what it stands for.
//!
//! Corners on a border are clustered by themselves, and each stays on its border. Neighbours cut the same triangles at the same places,
//! so their surfaces of the same coarseness meet. Memory is that of the thinned surface; time is linear.

use super::content::{Content, centred};
use super::glb::Glb;
use gable_geometry::{Box2, DVec3};
use serde_json::json;
use std::collections::{HashMap, HashSet};
use std::sync::LazyLock;

/// Linear light for each sRGB byte.
static LIGHT: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let v = byte as f32 / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    })
});

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
struct Corner {
    place: DVec3,
    light: [f32; 3],
}

/// What fell into a cube.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    place: DVec3,
    light: [f32; 3],
    weight: f64,
    borders: u8,
}

/// The surface of a tile, thinned out.
#[derive(Debug)]
pub struct ColouredSurface {
    bounds: Box2,
    cell: f64,
    /// By cube, and by the borders of the tile that they lie on.
    known: HashMap<([i32; 3], u8), u32>,
    clusters: Vec<Cluster>,
    /// Sorted corners of the triangles.
    repeated: HashSet<[u32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl ColouredSurface {
    /// An empty surface within `bounds`, its cubes `cell` metres wide.
    #[must_use]
    pub fn new(bounds: Box2, cell: f64) -> Self {
        let (known, repeated) = (HashMap::new(), HashSet::new());
        Self { bounds, cell, known, clusters: Vec::new(), repeated, triangles: Vec::new() }
    }

    /// Adds a triangle: corners in local metres, sRGB colours. What is outside of the bounds is cut off.
    pub fn add(&mut self, corners: [DVec3; 3], colours: [[u8; 3]; 3]) {
        let light = |colour: [u8; 3]| colour.map(|byte| LIGHT[usize::from(byte)]);
        let polygon = [0, 1, 2].map(|i| Corner { place: corners[i], light: light(colours[i]) });
        let inside = |p: DVec3| {
            (self.bounds.min.x..=self.bounds.max.x).contains(&p.x)
                && (self.bounds.min.y..=self.bounds.max.y).contains(&p.y)
        };
        if corners.into_iter().all(inside) {
            let vertices = polygon.map(|corner| self.vertex(corner, 1.0, self.borders(corner.place)));
            return self.triangle(vertices);
        }
        let mut polygon = polygon.to_vec();
        for (axis, border, side) in self.sides() {
            polygon = cut(&polygon, axis, border, side);
        }
        let vertices: Vec<u32> =
            polygon.into_iter().map(|corner| self.vertex(corner, 1.0, self.borders(corner.place))).collect();
        for i in 2..vertices.len() {
            self.triangle([vertices[0], vertices[i - 1], vertices[i]]);
        }
    }

    /// The same surface with cubes `factor` times as wide.
    #[must_use]
    pub fn coarser(&self, factor: u32) -> Self {
        let mut coarse = Self::new(self.bounds, self.cell * f64::from(factor));
        let vertices: Vec<u32> =
            self.clusters.iter().map(|c| coarse.vertex(self.mean(c), c.weight, c.borders)).collect();
        for corners in &self.triangles {
            coarse.triangle(corners.map(|i| vertices[i as usize]));
        }
        coarse
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// As GLB; none if there is no triangle.
    #[must_use]
    pub fn content(&self) -> Option<Content> {
        // A vertex whose triangles were all dropped is not written.
        let mut number = vec![u32::MAX; self.clusters.len()];
        let (mut places, mut light, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        for &corner in self.triangles.iter().flatten() {
            let number = &mut number[corner as usize];
            if *number == u32::MAX {
                *number = places.len() as u32;
                let mean = self.mean(&self.clusters[corner as usize]);
                places.push(mean.place);
                light.push(mean.light.map(|v| (v * f32::from(u16::MAX)).round() as u16));
            }
            indices.push(*number);
        }
        if indices.is_empty() {
            return None;
        }
        let mut glb = Glb::default();
        let (positions, translation, low, high) = centred(&places);
        let document = json!({
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0, "translation": translation }],
            "meshes": [{ "primitives": [{
                "attributes": { "POSITION": glb.vectors(&positions), "COLOR_0": glb.light(&light) },
                "indices": glb.indices(&indices),
                "material": 0,
                "mode": 4,
            }] }],
            // The light is in the photographs already. What one sees of a mesh from below or inside is seen as well.
            "materials": [{
                "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
                "doubleSided": true,
                "extensions": { "KHR_materials_unlit": {} },
            }],
            "extensionsUsed": ["KHR_materials_unlit"],
        });
        Some(Content { glb: glb.finish(document), low, high })
    }

    /// Axis, place and inner side of the borders.
    fn sides(&self) -> [(usize, f64, f64); 4] {
        let Box2 { min, max } = self.bounds;
        [(0, min.x, 1.0), (0, max.x, -1.0), (1, min.y, 1.0), (1, max.y, -1.0)]
    }

    /// Which borders a place lies on, a bit for each.
    fn borders(&self, place: DVec3) -> u8 {
        let sides = self.sides().into_iter().enumerate();
        sides.map(|(i, (axis, border, _))| u8::from(place[axis] == border) << i).sum()
    }

    /// The vertex that stands for a cluster.
    fn mean(&self, cluster: &Cluster) -> Corner {
        let mut place = cluster.place / cluster.weight;
        for (i, (axis, border, _)) in self.sides().into_iter().enumerate() {
            // Not where the mean was rounded to.
            if cluster.borders >> i & 1 == 1 {
                place[axis] = border;
            }
        }
        Corner { place, light: cluster.light.map(|v| v / cluster.weight as f32) }
    }

    fn vertex(&mut self, corner: Corner, weight: f64, borders: u8) -> u32 {
        let cube = (corner.place / self.cell).floor().to_array().map(|v| v as i32);
        let next = self.clusters.len() as u32;
        let number = *self.known.entry((cube, borders)).or_insert(next);
        if number == next {
            self.clusters.push(Cluster { place: DVec3::ZERO, light: [0.0; 3], weight: 0.0, borders });
        }
        let cluster = &mut self.clusters[number as usize];
        cluster.place += corner.place * weight;
        cluster.weight += weight;
        (0..3).for_each(|i| cluster.light[i] += corner.light[i] * weight as f32);
        number
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        let mut sorted = corners;
        sorted.sort_unstable();
        if sorted[0] != sorted[1] && sorted[1] != sorted[2] && self.repeated.insert(sorted) {
            self.triangles.push(corners);
        }
    }
}

/// The part of a polygon on the inner side of a border.
fn cut(polygon: &[Corner], axis: usize, border: f64, side: f64) -> Vec<Corner> {
    let depth = |c: &Corner| (c.place[axis] - border) * side;
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, here) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        if depth(here) >= 0.0 {
            out.push(*here);
        }
        if (depth(here) > 0.0 && depth(next) < 0.0) || (depth(here) < 0.0 && depth(next) > 0.0) {
            out.push(crossing(here, next, axis, border));
        }
    }
    out
}

/// Where an edge crosses a border: the same whichever way the edge is given.
fn crossing(a: &Corner, b: &Corner, axis: usize, border: f64) -> Corner {
    let (a, b) = if a.place[axis] < b.place[axis] { (a, b) } else { (b, a) };
    let part = (border - a.place[axis]) / (b.place[axis] - a.place[axis]);
    let mut place = a.place.lerp(b.place, part);
    place[axis] = border;
    Corner { place, light: [0, 1, 2].map(|i| a.light[i] + (b.light[i] - a.light[i]) * part as f32) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{dvec2, dvec3};

    fn bounds(min: (f64, f64), max: (f64, f64)) -> Box2 {
        Box2 { min: dvec2(min.0, min.1), max: dvec2(max.0, max.1) }
    }

    /// A slope of fine triangles from 0 to 40 m, grey in the west and white in the east, as two tiles that meet at 16.3 m.
    fn slope(tiles: &mut [ColouredSurface]) {
        let at = |x: u32, y: u32| {
            let (x, y) = (f64::from(x) * 0.4, f64::from(y) * 0.4);
            dvec3(x, y, 0.25 * x + 0.1 * y + 3.0)
        };
        let grey = |p: DVec3| [(50.0 + 5.0 * p.x) as u8; 3];
        for (x, y) in (0..100).flat_map(|x| (0..100).map(move |y| (x, y))) {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            for corners in [[a, b, c], [a, c, d]] {
                tiles.iter_mut().for_each(|tile| tile.add(corners, corners.map(grey)));
            }
        }
    }

    fn places(surface: &ColouredSurface) -> Vec<DVec3> {
        surface.clusters.iter().map(|c| surface.mean(c).place).collect()
    }

    #[test]
    fn a_thinned_plane_is_the_plane_and_tiles_meet() {
        let [west, east] = [bounds((0.0, 0.0), (16.3, 40.0)), bounds((16.3, 0.0), (40.0, 40.0))];
        let mut tiles = [west, east].map(|b| ColouredSurface::new(b, 1.0));
        slope(&mut tiles);
        let coarse = tiles.each_ref().map(|tile| tile.coarser(4));
        assert!(tiles[0].triangles() > 4 * coarse[0].triangles());
        for pair in [&tiles, &coarse] {
            let mut area = 0.0;
            let mut shared = [Vec::new(), Vec::new()];
            for (surface, shared) in pair.iter().zip(&mut shared) {
                let places = places(surface);
                for p in &places {
                    assert!((p.z - (0.25 * p.x + 0.1 * p.y + 3.0)).abs() < 1e-9, "{p}");
                    assert!(surface.bounds.min.x <= p.x && p.x <= surface.bounds.max.x);
                }
                for t in &surface.triangles {
                    let [a, b, c] = t.map(|i| places[i as usize]);
                    area += (b - a).cross(c - a).length() / 2.0;
                }
                shared.extend(places.iter().filter(|p| p.x == 16.3).map(|p| (p.y * 1e6).round() as i64));
                shared.sort_unstable();
            }
            assert!(shared[0].len() >= 10, "{}", shared[0].len());
            assert_eq!(shared[0], shared[1], "the same places on both sides of the border");
            // Without gap or overlap, and up to the borders of the city.
            let whole = 40.0 * 40.0 * dvec3(0.25, 0.1, 1.0).length();
            assert!((area - whole).abs() < 1e-6 * whole, "{area} of {whole}");
        }
    }

    #[test]
    fn what_falls_together_is_dropped() {
        let mut surface = ColouredSurface::new(bounds((0.0, 0.0), (100.0, 100.0)), 10.0);
        let [a, b, c] = [dvec3(1.0, 1.0, 1.0), dvec3(12.0, 1.0, 1.0), dvec3(1.0, 12.0, 1.0)];
        let red = [[200, 0, 0]; 3];
        surface.add([a, b, c], red);
        surface.add([b, a, c], red);
        surface.add([a, a + 1.0, a + 2.0], red);
        surface.add([b, b + 200.0, b + 300.0], red);
        assert_eq!(surface.triangles(), 1);
        let content = surface.content().unwrap();
        assert!(content.low.cmple(a).all() && content.high.cmpge(c).all());
        assert!(ColouredSurface::new(surface.bounds, 1.0).content().is_none());
    }
}
