#![doc = include_str!("../README.md")]

mod lsd;
mod outline;
mod polyline;
mod refine;
mod segment;

pub use lsd::{Detection, LsdParams, detect_segments, grey};
pub use outline::{Ring, trace_outline};
pub use polyline::{PolylineParams, fit_polyline};
pub use refine::{RefineParams, refine_ring};
pub use segment::{LineSegment, Source};
