#![doc = include_str!("../README.md")]

mod identify;
mod metric;
mod projection;
mod read;
mod table;
mod wkt;

pub use metric::{Metric, NotMetric, metric};
pub use projection::{Geographic, Projection, undulation};
pub use read::{Unread, read};
pub use table::{Area, Heights, Kind, System, heights, horizontal, northing_first, system, vertical};
