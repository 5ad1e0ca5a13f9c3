//! What can be wrong with a problem.

/// A problem that cannot be solved as it stands.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// An array has the wrong length.
    #[error("{what} has {found} values, expected {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that the other sizes ask for.
        expected: usize,
    },
    /// The number of labels does not fit the label type, or there is none.
    #[error("{labels} labels, give between 1 and {most}")]
    Labels {
        /// Labels asked for.
        labels: usize,
        /// The most that the label type holds.
        most: usize,
    },
    /// A cost is not a number or infinite: forbid a label with [`crate::FORBIDDEN`].
    #[error("the cost of label {label} at node {node} is {value}, costs have to be finite")]
    Cost {
        /// Node or pixel.
        node: usize,
        /// Label.
        label: usize,
        /// The cost.
        value: f64,
    },
    /// A weight is negative, not a number or infinite.
    #[error("the weight of edge {edge} is {value}, weights have to be finite and not negative")]
    Weight {
        /// Index of the edge (of the pixel that it starts from, on a grid).
        edge: usize,
        /// The weight.
        value: f64,
    },
    /// An edge leads to a node that does not exist, or from a node to itself.
    #[error("edge {edge} joins nodes {from} and {to}, nodes are numbered below {nodes} and differ")]
    Edge {
        /// Index of the edge.
        edge: usize,
        /// First node.
        from: u32,
        /// Second node.
        to: u32,
        /// Nodes of the graph.
        nodes: usize,
    },
    /// A label of the start does not exist.
    #[error("node {node} starts with label {label}, labels are numbered below {labels}")]
    Start {
        /// Node or pixel.
        node: usize,
        /// The label.
        label: usize,
        /// Labels of the problem.
        labels: usize,
    },
    /// More nodes or arcs than 32-bit indices can name.
    #[error("{size} nodes or arcs are too many, split the problem below {most}")]
    Size {
        /// Nodes or arcs asked for.
        size: usize,
        /// The most that can be handled.
        most: usize,
    },
}
