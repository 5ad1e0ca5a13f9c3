//! Maximum flow on general graphs.

use crate::Error;
use crate::topology::Rows;
use crate::two_trees::TwoTrees;

/// A graph with a source and a sink, of which the maximum flow and the minimum cut are wanted.
///
/// Capacities are integers, so that flow and cut are equal exactly; a caller with real costs multiplies them by a power
/// of two. The sum of all capacities has to stay below 2^62.
///
/// Boykov & Kolmogorov's algorithm (PAMI 2004, section 3): two trees grow from the terminals until they touch, the path
/// is augmented, and the trees are mended instead of grown anew. Time O(edges · nodes² · cut) at worst, near linear on
/// the sparse graphs of vision.
///
/// ```
/// use gable_graph_cut::FlowGraph;
/// let mut graph = FlowGraph::new(2, &[(0, 1, 3, 0)])?;
/// graph.set_terminals(0, 5, 0);
/// graph.set_terminals(1, 0, 4);
/// assert_eq!(graph.max_flow(), 3);
/// assert!(!graph.is_sink_side(0) && graph.is_sink_side(1));
/// # Ok::<(), gable_graph_cut::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FlowGraph {
    trees: TwoTrees<Rows, i64>,
    /// What flows from the source over a single node to the sink.
    direct: i64,
}

impl FlowGraph {
    /// A graph of `nodes` nodes and the edges (from, to, capacity, capacity back).
    ///
    /// # Errors
    /// If an edge leads to a node that does not exist or from a node to itself, if a capacity is negative, or if there are
    /// more than 2³¹ edges.
    pub fn new(nodes: usize, edges: &[(u32, u32, i64, i64)]) -> Result<Self, Error> {
        let (rows, origin) = Rows::new(nodes, edges.iter().map(|&(from, to, _, _)| (from, to)))?;
        if let Some(edge) = edges.iter().position(|e| e.2 < 0 || e.3 < 0) {
            return Err(Error::Weight { edge, value: edges[edge].2.min(edges[edge].3) as f64 });
        }
        let capacity = |&arc: &u32| {
            let (_, _, there, back) = edges[arc as usize / 2];
            if arc % 2 == 0 { there } else { back }
        };
        let residual = origin.iter().map(capacity).collect();
        Ok(Self { trees: TwoTrees::new(rows, residual), direct: 0 })
    }

    /// Adds capacity ≥ 0 from the source to a node and from it to the sink. What the two have in common flows at once.
    ///
    /// # Panics
    /// If the node does not exist or a capacity is negative.
    pub fn set_terminals(&mut self, node: u32, from_source: i64, to_sink: i64) {
        assert!(from_source >= 0 && to_sink >= 0, "capacities must not be negative");
        let terminal = self.trees.terminal(node);
        let (source, sink) = (from_source + terminal.max(0), to_sink + (-terminal).max(0));
        self.direct += source.min(sink);
        self.trees.set_terminal(node, source - sink);
    }

    /// The maximum flow from the source to the sink.
    pub fn max_flow(&mut self) -> i64 {
        self.direct + self.trees.run()
    }

    /// After [`FlowGraph::max_flow`]: whether the minimum cut leaves this node with the sink. Nodes that could be on either
    /// side count to the source, so the sink's side is the smallest of all minimum cuts.
    #[must_use]
    pub fn is_sink_side(&self, node: u32) -> bool {
        self.trees.is_sink_side(node)
    }
}
