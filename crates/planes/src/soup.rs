//! A triangle soup welded to a mesh with neighbours.

use gable_geometry::DVec3;

/// A triangle, counter-clockwise seen from outside.
pub type Triangle = [DVec3; 3];

/// Triangles that know their neighbours across edges.
pub(crate) struct Mesh {
    pub(crate) normals: Vec<DVec3>,
    pub(crate) areas: Vec<f64>,
    pub(crate) centroids: Vec<DVec3>,
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Mesh {
    /// Welds vertices that are equal bit for bit. Triangles that share an edge are neighbours, also where
    /// more than two do; degenerate ones keep area 0 and the normal 0.
    pub(crate) fn weld(triangles: &[Triangle]) -> Self {
        // Adding 0 makes −0 and 0 equal.
        let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
        let mut corners: Vec<([u64; 3], u32)> =
            triangles.iter().flatten().enumerate().map(|(i, &p)| (key(p), i as u32)).collect();
        corners.sort_unstable();
        let mut vertex = vec![0u32; corners.len()];
        let mut id = 0;
        for i in 0..corners.len() {
            id += u32::from(i > 0 && corners[i].0 != corners[i - 1].0);
            vertex[corners[i].1 as usize] = id;
        }
        let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(corners.len());
        for t in 0..triangles.len() {
            for k in 0..3 {
                let (u, v) = (vertex[3 * t + k], vertex[3 * t + (k + 1) % 3]);
                if u != v {
                    edges.push((u.min(v), u.max(v), t as u32));
                }
            }
        }
        edges.sort_unstable();
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(edges.len());
        for fan in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for a in fan {
                pairs.extend(fan.iter().filter(|b| b.2 != a.2).map(|b| (a.2, b.2)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0u32; triangles.len() + 1];
        for &(t, _) in &pairs {
            starts[t as usize + 1] += 1;
        }
        for t in 0..triangles.len() {
            starts[t + 1] += starts[t];
        }
        let cross = |t: &Triangle| (t[1] - t[0]).cross(t[2] - t[0]);
        Self {
            normals: triangles.iter().map(|t| cross(t).normalize_or_zero()).collect(),
            areas: triangles.iter().map(|t| 0.5 * cross(t).length()).collect(),
            centroids: triangles.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0).collect(),
            starts,
            neighbours: pairs.into_iter().map(|p| p.1).collect(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.areas.len()
    }

    pub(crate) fn neighbours(&self, triangle: usize) -> &[u32] {
        &self.neighbours[self.starts[triangle] as usize..self.starts[triangle + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn welds_equal_vertices_only() {
        let p = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(1.0, 1.0, 0.0), dvec3(-0.0, 1.0, 0.0)];
        let off = dvec3(1e-9, 0.0, 0.0);
        let soup = [[p[0], p[1], p[2]], [p[0], p[2], p[3]], [p[0] + off, p[3] + off, p[2]]];
        let mesh = Mesh::weld(&soup);
        assert_eq!((mesh.neighbours(0), mesh.neighbours(1), mesh.neighbours(2)), (&[1][..], &[0][..], &[][..]));
        assert_eq!(mesh.areas[0], 0.5);
    }
}
