#![doc = include_str!("../README.md")]

mod identify;
mod metric;
mod projection;
mod read;
mod table;
mod tangent;
mod wkt;

pub use metric::{Metric, NotMetric, metric};
pub use projection::{Geographic, Projection, undulation, well_known_text};
pub use read::{Unread, read};
pub use table::{Area, Heights, Kind, System, heights, horizontal, northing_first, system, vertical};
