//! One building: from rasters to LOD0, LOD1 and LOD2.

mod extrude;
mod junctions;
mod partition;
