//! Boykov & Kolmogorov's maximum flow (2004): two trees that grow towards each other.

use crate::demand_flow::Capacity;
use crate::topology::Topology;
use std::cmp::Ordering;
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
struct Node<C> {
    /// What is left of the arc from the source (positive) or to the sink (negative).
    terminal: C,
    /// Arc to the parent, or one of the marks above.
    parent: u32,
    time: u32,
    distance: u32,
    tree: Tree,
    active: bool,
}

/// Boykov & Kolmogorov's algorithm (PAMI 2004, section 3): trees grow from both terminals until they touch, the path is
/// augmented, and the trees are mended instead of grown anew. Best where much flows everywhere; where little has to be
/// decided, [`crate::demand_flow::DemandFlow`] visits fewer nodes.
#[derive(Clone, Debug)]
pub(crate) struct TwoTrees<T, C> {
    topology: T,
    pub(crate) residual: Vec<C>,
    nodes: Vec<Node<C>>,
    queue: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
    flow: i64,
}

impl<T: Topology, C: Capacity> TwoTrees<T, C> {
    /// A graph whose arcs, in the order of the topology, have these capacities, with no terminals yet.
    pub(crate) fn new(topology: T, residual: Vec<C>) -> Self {
        debug_assert_eq!(residual.len(), topology.arcs());
        let blank =
            Node { terminal: C::default(), parent: ORPHAN, time: 0, distance: 0, tree: Tree::Free, active: false };
        let nodes = vec![blank; topology.nodes()];
        Self { topology, residual, nodes, queue: VecDeque::new(), orphans: VecDeque::new(), time: 0, flow: 0 }
    }

    /// Sets the capacity from the source (positive) or to the sink (negative).
    pub(crate) fn set_terminal(&mut self, node: u32, terminal: C) {
        self.nodes[node as usize].terminal = terminal;
    }

    /// What is left of the arc from the source (positive) or to the sink (negative).
    pub(crate) fn terminal(&self, node: u32) -> C {
        self.nodes[node as usize].terminal
    }

    /// The flow pushed since the graph was made.
    pub(crate) fn run(&mut self) -> i64 {
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

    /// Whether the minimum cut with the smallest sink side leaves this node with the sink.
    pub(crate) fn is_sink_side(&self, node: u32) -> bool {
        self.nodes[node as usize].tree == Tree::Sink
    }

    fn plant(&mut self) {
        self.queue.clear();
        self.time = 0;
        for (index, node) in self.nodes.iter_mut().enumerate() {
            let tree = match node.terminal.cmp(&C::default()) {
                Ordering::Equal => Tree::Free,
                Ordering::Greater => Tree::Source,
                Ordering::Less => Tree::Sink,
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
        for arc in self.topology.leaving(node) {
            let head = self.topology.head(node, arc);
            let back = self.topology.sister(arc, head);
            let open = if tree == Tree::Source { arc } else { back };
            if self.residual[open as usize] == C::default() {
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

    /// The arc that carries flow between a node and its parent, its sister, and the parent.
    fn feeding(&self, node: u32) -> (u32, u32, u32) {
        let Node { parent, tree, .. } = self.nodes[node as usize];
        let next = self.topology.head(node, parent);
        let back = self.topology.sister(parent, next);
        if tree == Tree::Source { (back, parent, next) } else { (parent, back, next) }
    }

    fn augment(&mut self, arc: u32, from: u32, to: u32) {
        let mut amount = self.residual[arc as usize];
        for start in [from, to] {
            let mut node = start;
            while self.nodes[node as usize].parent != TERMINAL {
                let (open, _, next) = self.feeding(node);
                amount = amount.min(self.residual[open as usize]);
                node = next;
            }
            let terminal = self.nodes[node as usize].terminal;
            amount = amount.min(terminal.max(-terminal));
        }
        self.residual[arc as usize] -= amount;
        self.residual[self.topology.sister(arc, to) as usize] += amount;
        for start in [from, to] {
            let mut node = start;
            while self.nodes[node as usize].parent != TERMINAL {
                let (open, back, next) = self.feeding(node);
                self.residual[open as usize] -= amount;
                self.residual[back as usize] += amount;
                if self.residual[open as usize] == C::default() {
                    self.nodes[node as usize].parent = ORPHAN;
                    self.orphans.push_front(node);
                }
                node = next;
            }
            let root = &mut self.nodes[node as usize];
            if root.terminal > C::default() {
                root.terminal -= amount;
            } else {
                root.terminal += amount;
            }
            if root.terminal == C::default() {
                root.parent = ORPHAN;
                self.orphans.push_front(node);
            }
        }
        self.flow += amount.into();
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
        for arc in self.topology.leaving(orphan) {
            let head = self.topology.head(orphan, arc);
            let open = if tree == Tree::Source { self.topology.sister(arc, head) } else { arc };
            if self.residual[open as usize] == C::default() || self.nodes[head as usize].tree != tree {
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
        for arc in self.topology.leaving(orphan) {
            let head = self.topology.head(orphan, arc);
            if self.nodes[head as usize].tree != tree {
                continue;
            }
            let back = self.topology.sister(arc, head);
            let open = if tree == Tree::Source { back } else { arc };
            if self.residual[open as usize] > C::default() {
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
                    node = self.topology.head(node, parent);
                }
            }
        };
        let (mut node, mut distance) = (start, found);
        while self.nodes[node as usize].time != self.time {
            let n = &mut self.nodes[node as usize];
            n.time = self.time;
            n.distance = distance;
            distance -= 1;
            node = self.topology.head(node, n.parent);
        }
        Some(found)
    }
}
