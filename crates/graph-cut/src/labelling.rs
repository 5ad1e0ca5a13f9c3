//! The labelling that moves work on, with what they need to know about borders between labels.

use crate::potts::{Field, Label, check_length};
use crate::topology::Topology;
use crate::{Error, Report};

/// A labelling of a field. Nodes of the margin have the label of their number 0, and no weight.
pub(crate) struct Labelling<'a, F: Field, L> {
    pub(crate) field: &'a F,
    pub(crate) topology: F::Topology,
    pub(crate) labels: Vec<L>,
    /// Sum of the half weights to neighbours of another label.
    pub(crate) border: Vec<F::Capacity>,
    /// Whether some label costs less here than the node's own.
    pub(crate) costly: Vec<bool>,
    /// Nodes of the move under test.
    moving: Vec<bool>,
    /// What happened so far.
    pub(crate) report: Report,
}

impl<'a, F: Field, L: Label> Labelling<'a, F, L> {
    pub(crate) fn new(field: &'a F, topology: F::Topology, start: &[L]) -> Result<Self, Error> {
        let range = field.range();
        check_length("start", start.len(), range.len())?;
        if let Some(node) = start.iter().position(|&l| l.into() >= field.labels()) {
            return Err(Error::Start { node, label: start[node].into(), labels: field.labels() });
        }
        let zero = L::try_from(0).unwrap_or_else(|_| unreachable!("every label type holds 0"));
        let mut labels = vec![zero; topology.nodes()];
        labels[range.clone()].copy_from_slice(start);
        let mut out = Self {
            field,
            labels,
            border: vec![F::Capacity::default(); topology.nodes()],
            costly: vec![false; topology.nodes()],
            moving: vec![false; topology.nodes()],
            report: Report::default(),
            topology,
        };
        for node in range {
            out.refresh_cost(node);
            out.refresh_border(node as u32);
        }
        out.report.start_energy = out.energy();
        Ok(out)
    }

    /// Brings `costly` of a node up to date.
    fn refresh_cost(&mut self, node: usize) {
        let cost = self.field.cost(node, self.labels[node].into());
        self.costly[node] = (0..self.field.labels()).any(|l| self.field.cost(node, l) < cost);
    }

    /// Brings `border` of a node up to date.
    fn refresh_border(&mut self, node: u32) {
        let own = self.labels[node as usize];
        let mut sum = F::Capacity::default();
        for arc in self.topology.leaving(node) {
            let half = self.field.half(node, arc);
            if half != F::Capacity::default() && self.labels[self.topology.head(node, arc) as usize] != own {
                sum += half;
            }
        }
        self.border[node as usize] = sum;
    }

    /// Energy in f64, each edge once.
    pub(crate) fn energy(&self) -> f64 {
        let range = self.field.range();
        let (mut costs, mut weights) = (0.0, 0.0);
        for node in range {
            let own = self.labels[node];
            costs += self.field.cost(node, own.into());
            for arc in self.topology.leaving(node as u32) {
                let head = self.topology.head(node as u32, arc);
                if head as usize > node && self.labels[head as usize] != own {
                    weights += self.field.weight(node as u32, arc);
                }
            }
        }
        costs + weights
    }

    /// Gives the `changed` nodes the label that `target` makes of theirs, if that lowers the energy in f64; otherwise
    /// leaves everything as it is. Returns whether it did.
    pub(crate) fn apply(&mut self, changed: &[u32], target: impl Fn(L) -> L) -> bool {
        for &node in changed {
            self.moving[node as usize] = true;
        }
        let gain = self.gain(changed, &target);
        for &node in changed {
            self.moving[node as usize] = false;
        }
        if gain <= 0.0 {
            return false;
        }
        for &node in changed {
            self.labels[node as usize] = target(self.labels[node as usize]);
        }
        for &node in changed {
            self.refresh_cost(node as usize);
            self.refresh_border(node);
            for arc in self.topology.leaving(node) {
                if self.field.half(node, arc) != F::Capacity::default() {
                    self.refresh_border(self.topology.head(node, arc));
                }
            }
        }
        self.report.moves += 1;
        true
    }

    /// What a change of labels gains, in f64.
    fn gain(&self, changed: &[u32], target: impl Fn(L) -> L) -> f64 {
        let mut gain = 0.0;
        for &node in changed {
            let own = self.labels[node as usize];
            let new = target(own);
            let at = node as usize;
            gain += self.field.cost(at, own.into()) - self.field.cost(at, new.into());
            for arc in self.topology.leaving(node) {
                let head = self.topology.head(node, arc);
                let other = self.labels[head as usize];
                // An edge between two nodes that move is counted at the first of them.
                let (after, count) =
                    if self.moving[head as usize] { (target(other), head > node) } else { (other, true) };
                if count && (own != other) != (new != after) {
                    let weight = self.field.weight(node, arc);
                    gain += if own != other { weight } else { -weight };
                }
            }
        }
        gain
    }

    /// The labelling without the margin, and the report with its energy.
    pub(crate) fn finish(mut self) -> (Vec<L>, Report) {
        self.report.energy = self.energy();
        let range = self.field.range();
        self.labels.truncate(range.end);
        self.labels.drain(..range.start);
        (self.labels, self.report)
    }
}
