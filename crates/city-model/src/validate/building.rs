//! All geometries of a building.

use super::{Issue, Tolerances, validate_parts, validate_solid, validate_surfaces};
use crate::Building;

/// A defect of one geometry of a building.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildingIssue {
    /// LOD of the geometry: 0, 1 or 2.
    pub lod: u8,
    /// Which solid of the LOD, or for LOD0 the footprint (0) or the roof edge (1); `None` for 601.
    pub part: Option<usize>,
    /// The defect.
    pub issue: Issue,
}

/// Checks LOD0 as surfaces, LOD1 and LOD2 as solids, and the solids of a LOD against each other.
/// To check what will be written, quantise the geometries first ([`crate::quantised`]).
#[must_use]
pub fn validate_building(building: &Building, tolerances: &Tolerances) -> Vec<BuildingIssue> {
    let mut out = Vec::new();
    let lods = &building.lods;
    for (part, surfaces) in [&lods.footprint, &lods.roof_edge].into_iter().enumerate() {
        let issues = surfaces.iter().flat_map(|surfaces| validate_surfaces(surfaces, tolerances));
        out.extend(issues.map(|issue| BuildingIssue { lod: 0, part: Some(part), issue }));
    }
    for (lod, solids) in [(1, &lods.lod1), (2, &lods.lod2)] {
        for (part, solid) in solids.iter().enumerate() {
            let issues = validate_solid(solid, tolerances);
            out.extend(issues.into_iter().map(|issue| BuildingIssue { lod, part: Some(part), issue }));
        }
        if solids.len() > 1 {
            let issues = validate_parts(solids, tolerances);
            out.extend(issues.into_iter().map(|issue| BuildingIssue { lod, part: None, issue }));
        }
    }
    out
}
