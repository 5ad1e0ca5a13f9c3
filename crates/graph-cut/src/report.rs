//! How a minimisation is run and what it says about itself.

use crate::FORBIDDEN;

/// How long to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The most cycles (each tries every label, or every pair of labels, once). The minimisation ends
    /// earlier, as soon as a full cycle brings no gain; in practice after two to five.
    pub max_cycles: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_cycles: 100 }
    }
}

/// What a minimisation did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Energy of the labelling returned: costs and weights summed in f64.
    pub energy: f64,
    /// Energy of the labelling that it started from.
    pub start_energy: f64,
    /// Cycles begun.
    pub cycles: usize,
    /// Moves that lowered the energy.
    pub moves: usize,
    /// Nodes that took part in a flow, summed over all moves: the measure of the work done.
    pub flow_nodes: u64,
}

/// The label of least cost at every node, the first of equal ones: the start that converges fastest.
/// `unary` holds `labels` costs for each node; `L` is `u8` or `u16`.
///
/// # Panics
/// If `labels` is zero or does not fit `L`.
#[must_use]
pub fn data_optimum<L: TryFrom<usize>, C: PartialOrd + Copy>(labels: usize, unary: &[C]) -> Vec<L> {
    assert!(labels > 0, "a labelling needs at least one label");
    let best = |costs: &[C]| {
        let mut best = 0;
        for (label, cost) in costs.iter().enumerate().skip(1) {
            if *cost < costs[best] {
                best = label;
            }
        }
        L::try_from(best).unwrap_or_else(|_| panic!("{labels} labels do not fit the label type"))
    };
    unary.chunks_exact(labels).map(best).collect()
}

/// Whether a labelling's energy says that a forbidden label is in use.
#[must_use]
pub fn is_forbidden(energy: f64) -> bool {
    energy >= f64::from(FORBIDDEN) * 0.5
}
