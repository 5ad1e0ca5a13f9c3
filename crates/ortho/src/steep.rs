//! Steep facets of a block, for methods that work on the walls themselves.

use gable_blocks::{BlockMesh, UNITS_PER_METRE};
use gable_geometry::{Box2, DVec2, DVec3};

/// One steep triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Corners, local metres.
    pub corners: [DVec3; 3],
    /// Unit normal, outward.
    pub normal: DVec3,
    /// Area, m².
    pub area: f64,
}

/// The triangles that stand within `angle` (radians) of the vertical and whose centroid is in `core`, the western
/// and southern borders included. Each triangle of a city so belongs to one block. Sorted by corners, hence
/// independent of the order of the mesh.
#[must_use]
pub fn steep_facets(mesh: &BlockMesh, core: Box2, angle: f64) -> Vec<Facet> {
    let flattest = angle.sin();
    let mut found: Vec<_> = mesh
        .triangles
        .iter()
        .filter_map(|t| {
            let sum = |axis: usize| t.corners.iter().map(|c| i64::from(c[axis])).sum::<i64>() as f64;
            let centroid = DVec2::new(sum(0), sum(1)) / (3.0 * UNITS_PER_METRE);
            if !(core.min.cmple(centroid).all() && centroid.cmplt(core.max).all()) {
                return None;
            }
            let corners = t.positions();
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let normal = cross.try_normalize()?;
            (normal.z.abs() < flattest).then(|| (t.corners, Facet { corners, normal, area: 0.5 * cross.length() }))
        })
        .collect();
    found.sort_by_key(|f| f.0);
    found.into_iter().map(|f| f.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_blocks::BlockTriangle;

    #[test]
    fn each_facet_belongs_to_one_core() {
        let m = UNITS_PER_METRE as i32;
        let wall = BlockTriangle { corners: [[0, 0, 0], [6 * m, 0, 0], [6 * m, 0, 3 * m]], ..Default::default() };
        let roof = BlockTriangle { corners: [[0, 0, 0], [m, 0, 0], [0, m, 0]], ..Default::default() };
        let mesh = BlockMesh { triangles: vec![wall, roof] };
        let core = |x: f64| Box2 { min: DVec2::new(x, 0.0), max: DVec2::new(x + 4.0, 1.0) };
        assert!(steep_facets(&mesh, core(0.0), 0.4).is_empty());
        let found = steep_facets(&mesh, core(4.0), 0.4);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].area, found[0].normal), (9.0, DVec3::new(0.0, -1.0, 0.0)));
    }
}
