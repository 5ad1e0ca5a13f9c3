//! What makes a mesh look like photogrammetry, in figures: the same code measures real and synthetic meshes.
//!
//! 1. **Planes** are grown over faces with smoothed normals from the largest faces on; those of at least
//!    [`PLANE_AREA`] m² and a slope of 8° to 75° count (ground is not flat enough to tell noise from
//!    shape, facades have windows).
//! 2. **Noise** is the distance of the inner vertices of a plane from its least-squares plane: its rms
//!    (median over planes), and its autocorrelation over the distance between vertices.
//! 3. **Corners**: where two grown regions of any slope meet at 50° or more, the distance from their
//!    line to the mesh.
//! 4. **Edges**: percentiles of length; share of edges that have one face only.

mod corners;
mod regions;

use crate::sensing::TriMesh;
use gable_geometry::DVec3;
use regions::{Region, grow};
use std::collections::BTreeMap;

/// Least area of a plane, m².
pub const PLANE_AREA: f64 = 25.0;
/// Width of the bins of the autocorrelation, metres.
const BIN: f64 = 0.4;
const BINS: usize = 20;

/// Figures of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshFigures {
    /// Faces for each m² of surface.
    pub density: f64,
    /// Planes that were found.
    pub planes: usize,
    /// Median over planes of the rms distance of their vertices, metres.
    pub plane_rms: f64,
    /// Autocorrelation of the residuals at 1.3 m.
    pub correlation_1_3: f64,
    /// Autocorrelation of the residuals at 4.5 m.
    pub correlation_4_5: f64,
    /// Distance at which the autocorrelation has fallen to 1/e, metres.
    pub correlation_length: f64,
    /// 10th, 50th and 90th percentile of the lengths of edges, metres.
    pub edge_lengths: [f64; 3],
    /// Lines between planes that were measured.
    pub corners: usize,
    /// Median distance from the line of two planes to the mesh, metres.
    pub corner_cut_back: f64,
    /// Share of edges with one face.
    pub boundary_share: f64,
}

/// Measures a mesh. O(n log n), pairs of vertices within 8 m apart.
#[must_use]
pub fn measure(mesh: &TriMesh) -> MeshFigures {
    let regions = grow(mesh);
    let roofs: Vec<&Region> = regions.iter().filter(|r| r.area >= PLANE_AREA && r.is_roof()).collect();
    let mut rms: Vec<f64> = Vec::new();
    let mut sums = vec![(0.0, 0.0); BINS];
    for region in &roofs {
        let residuals = region.residuals(mesh);
        let variance = residuals.iter().map(|(_, r)| r * r).sum::<f64>() / residuals.len().max(1) as f64;
        if residuals.len() < 20 || variance == 0.0 {
            continue;
        }
        rms.push(variance.sqrt());
        correlate(&residuals, variance, &mut sums);
    }
    let correlation: Vec<f64> = sums.iter().map(|(s, n)| if *n > 0.0 { s / n } else { 0.0 }).collect();
    let at = |d: f64| {
        let x = d / BIN - 0.5;
        let i = (x.max(0.0) as usize).min(BINS - 2);
        let t = x - i as f64;
        correlation[i] * (1.0 - t) + correlation[i + 1] * t
    };
    let fall = 1.0 / std::f64::consts::E;
    let length = (1..800).map(|k| f64::from(k) * 0.01).find(|d| *d > 0.5 * BIN && at(*d) < fall).unwrap_or(8.0);
    let (lengths, boundary_share) = edges(mesh);
    let cut = corners::cut_backs(mesh, &regions);
    let area: f64 = (0..mesh.faces.len()).map(|f| mesh.area_normal(f).length() / 2.0).sum();
    MeshFigures {
        density: mesh.faces.len() as f64 / area.max(1e-9),
        planes: rms.len(),
        plane_rms: percentile(rms, 0.5),
        correlation_1_3: at(1.3),
        correlation_4_5: at(4.5),
        correlation_length: length,
        edge_lengths: [0.1, 0.5, 0.9].map(|q| percentile(lengths.clone(), q)),
        corners: cut.len(),
        corner_cut_back: percentile(cut, 0.5),
        boundary_share,
    }
}

/// Adds the products of residuals, divided by their variance, to the bins of distance.
fn correlate(residuals: &[(DVec3, f64)], variance: f64, sums: &mut [(f64, f64)]) {
    // At most 1,500 vertices of a plane against all others: enough for a correlation to ±0.02.
    let stride = residuals.len().div_ceil(1500);
    for (i, (p, r)) in residuals.iter().enumerate().step_by(stride) {
        for (j, (q, s)) in residuals.iter().enumerate() {
            let bin = (p.distance(*q) / BIN) as usize;
            if i != j && bin < BINS {
                sums[bin].0 += r * s / variance;
                sums[bin].1 += 1.0;
            }
        }
    }
}

fn edges(mesh: &TriMesh) -> (Vec<f64>, f64) {
    let mut count: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for face in &mesh.faces {
        for k in 0..3 {
            let (u, v) = (face[k], face[(k + 1) % 3]);
            *count.entry((u.min(v), u.max(v))).or_default() += 1;
        }
    }
    let length = |&(u, v): &(u32, u32)| mesh.vertices[u as usize].distance(mesh.vertices[v as usize]);
    let single = count.values().filter(|c| **c == 1).count();
    (count.keys().map(length).collect(), single as f64 / count.len().max(1) as f64)
}

/// Value below which a share of the values lies; 0 for none.
pub(crate) fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (values.len().saturating_sub(1)) as f64 * share;
    values.get(at.round() as usize).copied().unwrap_or(0.0)
}
