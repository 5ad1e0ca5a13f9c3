//! How much there is of a model.

use crate::city::City;
use crate::footprints::BlockMatch;
use crate::statistics::ratio;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Size of LOD2 (LOD1 where a building has no LOD2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Buildings.
    pub buildings: usize,
    /// Polygons.
    pub polygons: usize,
    /// Those of them that are roof. Walls between houses of a row, which a model of the whole row does not have, do not
    /// count here.
    pub roof_polygons: usize,
    /// Triangles of their triangulation.
    pub triangles: usize,
    /// Different positions (to 0.1 mm) in each building.
    pub vertices: usize,
}

/// Means for one building.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PerBuilding {
    /// Polygons.
    pub polygons: f64,
    /// Those of them that are roof.
    pub roof_polygons: f64,
    /// Triangles.
    pub triangles: f64,
    /// Vertices.
    pub vertices: f64,
}

/// Complexity against the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Complexity {
    /// The whole truth.
    pub truth: Size,
    /// The whole result.
    pub result: Size,
    /// Means of the truth.
    pub truth_per_building: PerBuilding,
    /// Means of the result.
    pub result_per_building: PerBuilding,
    /// Result against truth, over connected blocks that have both.
    pub against_truth: PerBuilding,
}

fn size<'a>(city: &City<'_>, members: impl IntoIterator<Item = &'a usize>) -> Size {
    let mut out = Size::default();
    for &i in members {
        let object = &city.objects[i];
        let polygons: BTreeSet<u32> = object.facets.iter().map(|f| f.face).collect();
        let key = |p: gable_geometry::DVec3| [p.x, p.y, p.z].map(|v| (v * 10_000.0).round() as i64);
        let vertices: BTreeSet<[i64; 3]> = object.facets.iter().flat_map(|f| f.corners).map(key).collect();
        out.buildings += 1;
        out.polygons += polygons.len();
        out.roof_polygons += object.roof().map(|f| f.face).collect::<BTreeSet<u32>>().len();
        out.triangles += object.facets.len();
        out.vertices += vertices.len();
    }
    out
}

fn against(part: Size, whole: [f64; 4]) -> PerBuilding {
    PerBuilding {
        polygons: ratio(part.polygons as f64, whole[0]),
        roof_polygons: ratio(part.roof_polygons as f64, whole[1]),
        triangles: ratio(part.triangles as f64, whole[2]),
        vertices: ratio(part.vertices as f64, whole[3]),
    }
}

/// All of a model, and its means.
pub(crate) fn whole(city: &City<'_>) -> (Size, PerBuilding) {
    let all = size(city, &(0..city.objects.len()).collect::<Vec<_>>());
    (all, against(all, [all.buildings as f64; 4]))
}

pub(crate) fn complexity(truth: &City<'_>, result: &City<'_>, matches: &[BlockMatch]) -> Complexity {
    let both = || matches.iter().filter(|m| !m.partners.is_empty());
    let ours = size(truth, both().flat_map(|m| &truth.blocks[m.block].members));
    let partners: BTreeSet<usize> = both().flat_map(|m| m.partners.iter().copied()).collect();
    let ((t, truth_per_building), (r, result_per_building)) = (whole(truth), whole(result));
    Complexity {
        truth_per_building,
        result_per_building,
        against_truth: against(
            size(result, &partners),
            [ours.polygons, ours.roof_polygons, ours.triangles, ours.vertices].map(|n| n as f64),
        ),
        truth: t,
        result: r,
    }
}
