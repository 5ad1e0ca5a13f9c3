//! Walls as line segments on the ground, from regions of facets.

use crate::soup::{Mesh, Triangle};
use gable_geometry::{DVec2, DVec3};

/// A set of triangles that stands for one plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Indices of the triangles.
    pub triangles: Vec<u32>,
    /// Area-weighted mean normal, of unit length.
    pub normal: DVec3,
    /// Area-weighted centroid.
    pub centroid: DVec3,
    /// Area, m².
    pub area: f64,
}

impl Region {
    pub(crate) fn of(mesh: &Mesh, triangles: Vec<u32>) -> Self {
        let (mut normal, mut centroid, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for &t in &triangles {
            let a = mesh.areas[t as usize];
            normal += mesh.normals[t as usize] * a;
            centroid += mesh.centroids[t as usize] * a;
            area += a;
        }
        if area > 0.0 {
            centroid /= area;
        }
        Self { triangles, normal: normal.normalize_or_zero(), centroid, area }
    }
}

/// The nearly vertical regions projected to the ground (Zhu 2018, §5.2, "facade segments"): start, end and area.
///
/// A region counts if its normal is within `angle` degrees of the horizontal. Its segment is perpendicular to the
/// normal, goes through the centroid and is as long as the region; it runs so that the inside of the building
/// lies to its left. The weight is the area of the region in m².
#[must_use]
pub fn facade_segments(triangles: &[Triangle], regions: &[Region], angle: f64) -> Vec<(DVec2, DVec2, f64)> {
    let steepest = angle.to_radians().sin();
    let mut out = Vec::new();
    for region in regions.iter().filter(|r| r.normal.z.abs() <= steepest) {
        let Some(outward) = region.normal.truncate().try_normalize() else { continue };
        let (along, middle) = (outward.perp(), region.centroid.truncate());
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in region.triangles.iter().flat_map(|&t| triangles[t as usize]) {
            let s = along.dot(corner.truncate() - middle);
            from = from.min(s);
            to = to.max(s);
        }
        if from < to {
            out.push((middle + along * from, middle + along * to, region.area));
        }
    }
    out
}
