#![doc = include_str!("../README.md")]

mod collinear;
mod directions;
mod local_graph;
mod lsd;
mod outline;
mod polyline;
mod segment;

pub use collinear::merge_collinear;
pub use directions::snap_directions;
pub use local_graph::{LocalGraphParams, orthogonalise_local_graph, simplify_local_graph};
pub use lsd::{Detection, LsdParams, detect_segments, grey};
pub use outline::{Ring, trace_outline, trace_regions};
pub use polyline::{PolylineParams, fit_polyline};
pub use segment::{LineSegment, Source};
