//! Types and kernels in f64 that every room of gable shares: the local frame and its reference
//! system, polygons, planes, covariance, predicates, and seeded counters for randomness.
//!
//! Lengths are metres, z is up, x east and y north, angles are radians inside the code and degrees
//! at the surface. "World" coordinates are those of the input's reference system; "local"
//! coordinates are world minus [`Frame::origin`].

mod box_tree;
mod covariance;
mod crs;
mod disjoint_sets;
mod frame;
mod plane;
mod polygon;
mod predicates;
mod random;

pub use box_tree::BoxTree;
pub use covariance::{Covariance3, least_squares_slopes, symmetric_eigen_2, symmetric_eigen_3};
pub use crs::{Crs, CrsError};
pub use disjoint_sets::DisjointSets;
pub use frame::Frame;
pub use glam::{DVec2, DVec3, dvec2, dvec3};
pub use plane::Plane;
pub use polygon::{Box2, Polygon, ring_area, ring_contains, ring_perimeter};
pub use predicates::{Orientation, orientation, point_segment_distance};
pub use random::Counter;
