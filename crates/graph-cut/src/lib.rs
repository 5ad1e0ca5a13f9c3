//! Maximum flow (Boykov & Kolmogorov 2004) and moves on Markov random fields with Potts interaction
//! (Boykov, Veksler & Zabih 2001), on grids and on general graphs.

mod demand_flow;
mod error;
mod expand;
mod flow_graph;
mod grid_flow;
mod labelling;
mod potts;
mod report;
mod swap;
mod topology;

pub use error::Error;
pub use expand::{expand, expand_grid};
pub use flow_graph::FlowGraph;
pub use grid_flow::{GridCapacities, max_flow_grid};
pub use potts::{FORBIDDEN, GraphProblem, GridProblem};
pub use report::{Options, Report, data_optimum, is_forbidden};
pub use swap::{swap, swap_grid};
