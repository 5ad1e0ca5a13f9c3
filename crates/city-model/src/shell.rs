//! Measures of faces and shells.

use crate::{Face, Semantic, Shell};
use gable_geometry::{Box2, DVec3};

/// Vector area of a ring about its first corner: half the sum of the cross products of a fan (Newell's normal).
/// Its length is the area of the ring in its plane, its direction the normal from which the ring runs
/// counter-clockwise.
pub(crate) fn ring_vector_area(points: &[DVec3], ring: &[u32]) -> DVec3 {
    let Some(&first) = ring.first() else { return DVec3::ZERO };
    let origin = points[first as usize];
    let mut twice = DVec3::ZERO;
    for pair in ring.windows(2) {
        twice += (points[pair[0] as usize] - origin).cross(points[pair[1] as usize] - origin);
    }
    0.5 * twice
}

impl Shell {
    /// Corners of the smallest box around the vertices; `None` if there are none.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
    }

    /// The bounds on the ground, empty without vertices.
    #[must_use]
    pub fn ground_box(&self) -> Box2 {
        Box2::of(self.vertices.iter().map(|p| p.truncate()))
    }

    /// Vector area of a face, holes taken off: its length is the area in m², its direction the outward normal.
    /// Indices must be in range.
    #[must_use]
    pub fn vector_area(&self, face: &Face) -> DVec3 {
        face.rings.iter().map(|ring| ring_vector_area(&self.vertices, ring)).sum()
    }

    /// Area of all faces, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.faces.iter().map(|face| self.vector_area(face).length()).sum()
    }

    /// Area of the faces of one meaning, m².
    #[must_use]
    pub fn area_of(&self, semantic: Semantic) -> f64 {
        let faces = self.faces.iter().filter(|face| face.semantic == semantic);
        faces.map(|face| self.vector_area(face).length()).sum()
    }

    /// Area that the ground surfaces cover in plan, m².
    #[must_use]
    pub fn footprint_area(&self) -> f64 {
        let ground = self.faces.iter().filter(|face| face.semantic == Semantic::GroundSurface);
        ground.map(|face| self.vector_area(face).z.abs()).sum()
    }

    /// Signed volume in m³ by the divergence theorem: positive if the shell is closed and its faces look outward.
    /// Without a closed shell the number means nothing. Sums are taken about the first vertex, so that a shell far
    /// from the origin loses no digits.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let Some(&origin) = self.vertices.first() else { return 0.0 };
        let mut six = 0.0;
        for ring in self.faces.iter().flat_map(|face| &face.rings) {
            let Some((&first, rest)) = ring.split_first() else { continue };
            let a = self.vertices[first as usize] - origin;
            for pair in rest.windows(2) {
                let b = self.vertices[pair[0] as usize] - origin;
                let c = self.vertices[pair[1] as usize] - origin;
                six += a.dot(b.cross(c));
            }
        }
        six / 6.0
    }

    /// The shell with every ring reversed: inside becomes outside.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut shell = self.clone();
        for ring in shell.faces.iter_mut().flat_map(|face| &mut face.rings) {
            ring.reverse();
        }
        shell
    }

    /// Whether every index points at a vertex and every vertex is finite.
    #[must_use]
    pub fn is_well_formed(&self) -> bool {
        let count = self.vertices.len();
        self.vertices.iter().all(|p| p.is_finite())
            && self.faces.iter().flat_map(|face| &face.rings).flatten().all(|&i| (i as usize) < count)
    }
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;
    use crate::Attributes;
    use gable_geometry::dvec3;

    pub(crate) fn face(rings: &[&[u32]], semantic: Semantic) -> Face {
        Face { rings: rings.iter().map(|ring| ring.to_vec()).collect(), semantic, attributes: Attributes::new() }
    }

    /// An axis-parallel box.
    pub(crate) fn cuboid(low: DVec3, high: DVec3) -> Shell {
        let at = |i: usize| {
            let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
            dvec3(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
        };
        let faces = vec![
            face(&[&[0, 2, 3, 1]], Semantic::GroundSurface),
            face(&[&[4, 5, 7, 6]], Semantic::RoofSurface),
            face(&[&[0, 1, 5, 4]], Semantic::WallSurface),
            face(&[&[1, 3, 7, 5]], Semantic::WallSurface),
            face(&[&[3, 2, 6, 7]], Semantic::WallSurface),
            face(&[&[2, 0, 4, 6]], Semantic::WallSurface),
        ];
        Shell { vertices: (0..8).map(at).collect(), faces }
    }

    /// A prism over polygon rings (outer counter-clockwise, holes clockwise) between two heights.
    pub(crate) fn prism(rings: &[&[(f64, f64)]], low: f64, high: f64) -> Shell {
        let mut shell = Shell::default();
        let (mut floor, mut roof) = (Vec::new(), Vec::new());
        let mut walls = Vec::new();
        for ring in rings {
            let start = shell.vertices.len() as u32;
            let n = ring.len() as u32;
            shell.vertices.extend(ring.iter().map(|&(x, y)| dvec3(x, y, low)));
            shell.vertices.extend(ring.iter().map(|&(x, y)| dvec3(x, y, high)));
            floor.push((start..start + n).rev().collect::<Vec<_>>());
            roof.push((start + n..start + 2 * n).collect::<Vec<_>>());
            for i in 0..n {
                let (a, b) = (start + i, start + (i + 1) % n);
                walls.push(face(&[&[a, b, b + n, a + n]], Semantic::WallSurface));
            }
        }
        let with = |rings, semantic| Face { rings, semantic, attributes: Attributes::new() };
        shell.faces.push(with(floor, Semantic::GroundSurface));
        shell.faces.push(with(roof, Semantic::RoofSurface));
        shell.faces.extend(walls);
        shell
    }

    /// A gabled house of 8 × 10 m, eaves at 3 m, ridge at 6 m along y, with its low corner at `at`.
    pub(crate) fn gabled(at: DVec3) -> Shell {
        let corners =
            [(0., 0., 0.), (8., 0., 0.), (8., 10., 0.), (0., 10., 0.), (0., 0., 3.), (8., 0., 3.), (8., 10., 3.)];
        let more = [(0., 10., 3.), (4., 0., 6.), (4., 10., 6.)];
        Shell {
            vertices: corners.iter().chain(&more).map(|&(x, y, z)| at + dvec3(x, y, z)).collect(),
            faces: vec![
                face(&[&[3, 2, 1, 0]], Semantic::GroundSurface),
                face(&[&[0, 1, 5, 8, 4]], Semantic::WallSurface),
                face(&[&[1, 2, 6, 5]], Semantic::WallSurface),
                face(&[&[2, 3, 7, 9, 6]], Semantic::WallSurface),
                face(&[&[3, 0, 4, 7]], Semantic::WallSurface),
                face(&[&[5, 6, 9, 8]], Semantic::RoofSurface),
                face(&[&[7, 4, 8, 9]], Semantic::RoofSurface),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn measures_of_a_house_by_hand() {
        let house = samples::gabled(dvec3(85_000.0, 446_000.0, -3.0));
        assert!((house.volume() - (8.0 * 10.0 * 3.0 + 0.5 * 8.0 * 3.0 * 10.0)).abs() < 1e-6);
        assert!((house.area_of(Semantic::RoofSurface) - 2.0 * 5.0 * 10.0).abs() < 1e-9);
        assert!((house.area() - (100.0 + 80.0 + 2.0 * 30.0 + 2.0 * (24.0 + 12.0))).abs() < 1e-6);
        assert_eq!(house.footprint_area(), 80.0);
        assert!((house.reversed().volume() + house.volume()).abs() < 1e-9);
        assert_eq!(house.bounds().unwrap().1, dvec3(85_008.0, 446_010.0, 3.0));
    }

    #[test]
    fn holes_are_taken_off() {
        let outer = [(0., 0.), (4., 0.), (4., 4.), (0., 4.)];
        let hole = [(1., 1.), (1., 2.), (2., 2.), (2., 1.)];
        let shell = samples::prism(&[&outer, &hole], 0.0, 2.0);
        assert_eq!(shell.volume(), 30.0);
        assert_eq!(shell.footprint_area(), 15.0);
    }
}
