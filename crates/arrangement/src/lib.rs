//! Planar subdivision by line segments.
//!
//! [`Arrangement::build`] slices the plane by segments, exactly: coordinates are rounded to a lattice of about
//! 1 mm, crossings are found in integer arithmetic, and what comes out is a half-edge structure whose edges meet
//! at vertices only. Around it: rules that [extend] segments before the cut, and [`Arrangement::face_raster`] to find
//! the pixels of each face.
//!
//! ```
//! use gable_arrangement::{Arrangement, Options};
//! use gable_geometry::dvec2;
//!
//! let corners = [dvec2(0.0, 0.0), dvec2(8.0, 0.0), dvec2(8.0, 6.0), dvec2(0.0, 6.0)];
//! let mut segments: Vec<_> = (0..4).map(|i| (corners[i], corners[(i + 1) % 4])).collect();
//! segments.push((dvec2(-1.0, 3.0), dvec2(9.0, 3.0))); // a ridge, with ends that dangle
//! let roof = Arrangement::build(&segments, &Options::default());
//! assert_eq!(roof.faces().len(), 3); // the unbounded face and two halves
//! assert_eq!(roof.faces()[1].area, 24.0);
//! ```

mod build;
pub mod extend;
mod face;
mod grid;
mod half_edge;
mod lattice;
mod link;
mod locate;
mod snap_round;

pub use build::Options;
pub use extend::{Extension, extend};
pub use half_edge::{Arrangement, Edge, Face, HalfEdge};
pub use link::link_loose_ends;
