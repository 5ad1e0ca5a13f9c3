//! Divides faces in four until there are enough of them: for meshes finer than the voxels are.

use super::TriMesh;
use std::collections::BTreeMap;

/// Divides all faces at the middles of their edges, as often as it takes to have at least `wanted` of them.
pub(crate) fn refine(mesh: &mut TriMesh, wanted: usize) {
    while !mesh.faces.is_empty() && mesh.faces.len() < wanted {
        let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * mesh.faces.len());
        for [a, b, c] in std::mem::take(&mut mesh.faces) {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(u, v)| {
                *middles.entry((u.min(v), u.max(v))).or_insert_with(|| {
                    mesh.vertices.push((mesh.vertices[u as usize] + mesh.vertices[v as usize]) / 2.0);
                    mesh.vertices.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        mesh.faces = finer;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn faces_are_divided_and_neighbours_keep_their_corners() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let vertices = corners.map(|(x, y)| dvec3(x, y, 0.0)).to_vec();
        let mut mesh = TriMesh { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] };
        refine(&mut mesh, 3);
        assert_eq!((mesh.faces.len(), mesh.vertices.len()), (8, 9));
        let area: f64 = (0..8).map(|f| mesh.area_normal(f).z / 2.0).sum();
        assert!((area - 4.0).abs() < 1e-12);
        refine(&mut mesh, 8);
        assert_eq!(mesh.faces.len(), 8, "enough");
    }
}
