//! From the scene to a mesh with the defects of multi-view stereo, tile by tile.

pub(crate) mod columns;
pub(crate) mod contour;
pub(crate) mod decimate;
pub(crate) mod defects;
pub(crate) mod faults;
pub(crate) mod field;
pub(crate) mod horizon;
pub(crate) mod refine;

use gable_geometry::DVec3;

/// Pitch of the voxels of the field, metres.
pub(crate) const VOXEL: f64 = 0.4;
/// Pitch of the columns that sample the scene, metres: half a voxel.
pub(crate) const COLUMN: f64 = 0.2;

/// A triangle mesh.
#[derive(Clone, Debug, Default)]
pub struct TriMesh {
    /// Corners, local metres.
    pub vertices: Vec<DVec3>,
    /// Triangles, counter-clockwise from outside.
    pub faces: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Corners of a face.
    #[must_use]
    pub fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    /// Normal of a face, its length twice the area.
    #[must_use]
    pub fn area_normal(&self, face: usize) -> DVec3 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a)
    }

    /// Drops vertices that no face uses.
    pub(crate) fn compact(&mut self) {
        let mut index = vec![u32::MAX; self.vertices.len()];
        let mut kept = Vec::new();
        for face in &mut self.faces {
            for v in face {
                if index[*v as usize] == u32::MAX {
                    index[*v as usize] = kept.len() as u32;
                    kept.push(self.vertices[*v as usize]);
                }
                *v = index[*v as usize];
            }
        }
        self.vertices = kept;
    }
}
