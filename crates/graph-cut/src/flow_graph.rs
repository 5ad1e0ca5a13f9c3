//! Maximum flow on general graphs (Boykov & Kolmogorov 2004).

use crate::Error;
use crate::topology::{Rows, Topology};
use std::collections::VecDeque;

/// Whose tree a node is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

/// The parent of a node that the terminal itself feeds.
const TERMINAL: u32 = u32::MAX;
/// The parent of a node that has lost its parent.
const ORPHAN: u32 = u32::MAX - 1;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// What is left of the arc from the source (positive) or to the sink (negative).
    terminal: i64,
    /// Arc to the parent, or one of the marks above.
    parent: u32,
    time: u32,
    distance: u32,
    tree: Tree,
    active: bool,
}

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
    rows: Rows,
    residual: Vec<i64>,
    nodes: Vec<Node>,
    queue: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
    flow: i64,
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
        let blank = Node { terminal: 0, parent: ORPHAN, time: 0, distance: 0, tree: Tree::Free, active: false };
        Ok(Self {
            rows,
            residual,
            nodes: vec![blank; nodes],
            queue: VecDeque::new(),
            orphans: VecDeque::new(),
            time: 0,
            flow: 0,
        })
    }

    /// Adds capacity ≥ 0 from the source to a node and from it to the sink. What the two have in common flows at once.
    ///
    /// # Panics
    /// If the node does not exist or a capacity is negative.
    pub fn set_terminals(&mut self, node: u32, from_source: i64, to_sink: i64) {
        assert!(from_source >= 0 && to_sink >= 0, "capacities must not be negative");
        let terminal = &mut self.nodes[node as usize].terminal;
        let (source, sink) = (from_source + (*terminal).max(0), to_sink + (-*terminal).max(0));
        self.flow += source.min(sink);
        *terminal = source - sink;
    }

    /// The maximum flow from the source to the sink.
    pub fn max_flow(&mut self) -> i64 {
        self.plant();
        let mut current = None;
        while let Some(node) = current.take().or_else(|| self.next_active()) {
            match self.grow(node) {
                None => self.nodes[node as usize].active = false,
                Some((arc, from, to)) => {
                    self.augment(arc, from, to);
                    self.adopt_orphans();
                    // The same node goes on growing as long as it is in a tree.
                    if self.nodes[node as usize].tree == Tree::Free {
                        self.nodes[node as usize].active = false;
                    } else {
                        current = Some(node);
                    }
                }
            }
        }
        self.flow
    }

    /// After [`FlowGraph::max_flow`]: whether the minimum cut leaves this node with the sink. Nodes that could be on either
    /// side count to the source, so the sink's side is the smallest of all minimum cuts.
    #[must_use]
    pub fn is_sink_side(&self, node: u32) -> bool {
        self.nodes[node as usize].tree == Tree::Sink
    }

    fn plant(&mut self) {
        self.queue.clear();
        self.time = 0;
        for (index, node) in self.nodes.iter_mut().enumerate() {
            let tree = match node.terminal {
                0 => Tree::Free,
                1.. => Tree::Source,
                _ => Tree::Sink,
            };
            let active = tree != Tree::Free;
            *node = Node { terminal: node.terminal, parent: TERMINAL, time: 0, distance: 1, tree, active };
            if active {
                self.queue.push_back(index as u32);
            }
        }
    }

    fn next_active(&mut self) -> Option<u32> {
        while let Some(node) = self.queue.pop_front() {
            if self.nodes[node as usize].tree != Tree::Free {
                return Some(node);
            }
            self.nodes[node as usize].active = false;
        }
        None
    }

    fn activate(&mut self, node: u32) {
        let n = &mut self.nodes[node as usize];
        if !n.active {
            n.active = true;
            self.queue.push_back(node);
        }
    }

    /// Takes free neighbours into the node's tree; gives the arc (from the source's tree to the sink's) that touches the
    /// other tree, if one does.
    fn grow(&mut self, node: u32) -> Option<(u32, u32, u32)> {
        let Node { tree, time, distance, .. } = self.nodes[node as usize];
        for arc in self.rows.leaving(node) {
            let head = self.rows.head(node, arc);
            let back = self.rows.sister(arc, head);
            let open = if tree == Tree::Source { arc } else { back };
            if self.residual[open as usize] == 0 {
                continue;
            }
            let other = &mut self.nodes[head as usize];
            if other.tree == Tree::Free {
                other.tree = tree;
                other.parent = back;
                other.time = time;
                other.distance = distance + 1;
                self.activate(head);
            } else if other.tree != tree {
                return Some(if tree == Tree::Source { (arc, node, head) } else { (back, head, node) });
            } else if other.time <= time && other.distance > distance + 1 && other.parent != TERMINAL {
                other.parent = back;
                other.time = time;
                other.distance = distance + 1;
            }
        }
        None
    }

    /// The arc that carries flow between a node and its parent.
    fn feeding(&self, node: u32) -> (u32, u32) {
        let n = &self.nodes[node as usize];
        let next = self.rows.head(node, n.parent);
        let open = if n.tree == Tree::Source { self.rows.sister(n.parent, next) } else { n.parent };
        (open, next)
    }

    fn augment(&mut self, arc: u32, from: u32, to: u32) {
        let mut amount = self.residual[arc as usize];
        for start in [from, to] {
            let mut node = start;
            while self.nodes[node as usize].parent != TERMINAL {
                let (open, next) = self.feeding(node);
                amount = amount.min(self.residual[open as usize]);
                node = next;
            }
            amount = amount.min(self.nodes[node as usize].terminal.abs());
        }
        self.residual[arc as usize] -= amount;
        self.residual[self.rows.sister(arc, to) as usize] += amount;
        for start in [from, to] {
            let mut node = start;
            while self.nodes[node as usize].parent != TERMINAL {
                let (open, next) = self.feeding(node);
                self.residual[open as usize] -= amount;
                self.residual[self.rows.sister(open, next) as usize] += amount;
                if self.residual[open as usize] == 0 {
                    self.nodes[node as usize].parent = ORPHAN;
                    self.orphans.push_front(node);
                }
                node = next;
            }
            let root = &mut self.nodes[node as usize];
            root.terminal -= amount * root.terminal.signum();
            if root.terminal == 0 {
                root.parent = ORPHAN;
                self.orphans.push_front(node);
            }
        }
        self.flow += amount;
    }

    fn adopt_orphans(&mut self) {
        self.time += 1;
        while let Some(orphan) = self.orphans.pop_front() {
            self.adopt(orphan);
        }
    }

    fn adopt(&mut self, orphan: u32) {
        let tree = self.nodes[orphan as usize].tree;
        let (mut best, mut best_distance) = (None, u32::MAX);
        for arc in self.rows.leaving(orphan) {
            let head = self.rows.head(orphan, arc);
            let open = if tree == Tree::Source { self.rows.sister(arc, head) } else { arc };
            if self.residual[open as usize] == 0 || self.nodes[head as usize].tree != tree {
                continue;
            }
            if let Some(distance) = self.terminal_distance(head)
                && distance < best_distance
            {
                (best, best_distance) = (Some(arc), distance);
            }
        }
        if let Some(parent) = best {
            let n = &mut self.nodes[orphan as usize];
            n.parent = parent;
            n.time = self.time;
            n.distance = best_distance + 1;
            return;
        }
        self.nodes[orphan as usize].tree = Tree::Free;
        for arc in self.rows.leaving(orphan) {
            let head = self.rows.head(orphan, arc);
            if self.nodes[head as usize].tree != tree {
                continue;
            }
            let back = self.rows.sister(arc, head);
            let open = if tree == Tree::Source { back } else { arc };
            if self.residual[open as usize] > 0 {
                self.activate(head);
            }
            let n = &mut self.nodes[head as usize];
            if n.parent == back {
                n.parent = ORPHAN;
                self.orphans.push_back(head);
            }
        }
    }

    /// Arcs to the terminal, `None` if the way ends at an orphan. Marks the way.
    fn terminal_distance(&mut self, start: u32) -> Option<u32> {
        let mut node = start;
        let mut steps = 0;
        let found = loop {
            let n = &mut self.nodes[node as usize];
            if n.time == self.time {
                break n.distance + steps;
            }
            match n.parent {
                TERMINAL => {
                    n.time = self.time;
                    n.distance = 1;
                    break steps + 1;
                }
                ORPHAN => return None,
                parent => {
                    steps += 1;
                    node = self.rows.head(node, parent);
                }
            }
        };
        let (mut node, mut distance) = (start, found);
        while self.nodes[node as usize].time != self.time {
            let n = &mut self.nodes[node as usize];
            n.time = self.time;
            n.distance = distance;
            distance -= 1;
            node = self.rows.head(node, n.parent);
        }
        Some(found)
    }
}
