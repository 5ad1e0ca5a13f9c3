#![doc = include_str!("../README.md")]

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
mod two_trees;

pub use error::Error;
pub use expand::{expand, expand_grid};
pub use flow_graph::FlowGraph;
pub use grid_flow::{GridCapacities, max_flow_grid};
pub use potts::{FORBIDDEN, GraphProblem, GridProblem};
pub use report::{Options, Report, data_optimum, is_forbidden};
pub use swap::{swap, swap_grid};
