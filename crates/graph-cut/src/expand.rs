//! α-expansion (Boykov, Veksler & Zabih 2001, section 5).

use crate::demand_flow::{Capacity, DemandFlow, Supply};
use crate::labelling::Labelling;
use crate::potts::{Field, GraphField, GridField, Label};
use crate::topology::Topology;
use crate::{Error, GraphProblem, GridProblem, Options, Report};

/// Minimises the energy of a grid by α-expansion, labels in ascending order, until a full cycle brings no gain. The
/// result is within twice the optimum, and optimal for two labels.
///
/// # Errors
/// If sizes, costs, weights or the start are not what [`GridProblem`] asks for.
pub fn expand_grid(problem: GridProblem<'_>, start: Vec<u8>, options: &Options) -> Result<(Vec<u8>, Report), Error> {
    let field = GridField::new(problem)?;
    let topology = field.topology();
    run(&field, topology, topology, &start, options)
}

/// Minimises the energy of a graph by α-expansion, labels in ascending order, until a full cycle brings no gain.
///
/// # Errors
/// If sizes, costs, weights or the start are not what [`GraphProblem`] asks for.
pub fn expand(problem: &GraphProblem, start: Vec<u16>, options: &Options) -> Result<(Vec<u16>, Report), Error> {
    let field = GraphField::new(problem)?;
    run(&field, field.topology(), field.topology(), &start, options)
}

fn run<F: Field, L: Label>(
    field: &F,
    topology: F::Topology,
    again: F::Topology,
    start: &[L],
    options: &Options,
) -> Result<(Vec<L>, Report), Error> {
    let mut labelling = Labelling::new(field, topology, start)?;
    let mut flow = DemandFlow::new(again);
    let mut changed = Vec::new();
    let mut unchanged = 0;
    'cycles: for _ in 0..options.max_cycles {
        labelling.report.cycles += 1;
        for alpha in 0..field.labels() {
            if unchanged == field.labels() {
                break 'cycles;
            }
            let alpha = L::try_from(alpha).unwrap_or_else(|_| unreachable!("the field checked its labels"));
            flow.begin();
            let expansion = Expansion { labelling: &labelling, alpha };
            for node in field.range() {
                if labelling.labels[node] != alpha
                    && (labelling.costly[node] || labelling.border[node] > F::Capacity::default())
                    && expansion.balance(node as u32) < F::Capacity::default()
                {
                    flow.reach(node as u32, &expansion);
                }
            }
            flow.run(&expansion);
            labelling.report.flow_nodes += flow.reached().len() as u64;
            changed.clear();
            changed.extend(flow.reached().iter().copied().filter(|&n| flow.on_sink_side(n)));
            let fell = !changed.is_empty() && labelling.apply(&changed, |_| alpha);
            unchanged = if fell { 0 } else { unchanged + 1 };
        }
    }
    Ok(labelling.finish())
}

/// The binary problem "keep the label or take α". Switching is the sink's side. An edge of weight w between labels
/// f and g costs, as a function of who switches: w·[one of two switches] if f = g; w·[not both switch] if f ≠ g, both
/// not α, which is −w/2 for each that switches and w/2 if just one does; and w for the other one to keep, if one is α.
struct Expansion<'a, 'b, F: Field, L> {
    labelling: &'a Labelling<'b, F, L>,
    alpha: L,
}

impl<F: Field, L: Label> Expansion<'_, '_, F, L> {
    /// What switching costs this node if nobody else switches, apart from the arcs.
    #[inline(always)]
    fn balance(&self, node: u32) -> F::Capacity {
        let Labelling { field, topology, labels, border, .. } = self.labelling;
        let own = labels[node as usize];
        let mut limit = F::Capacity::default();
        let mut gain = border[node as usize];
        for arc in topology.leaving(node) {
            let half = field.half(node, arc);
            limit += half;
            limit += half;
            if half != F::Capacity::default() && labels[topology.head(node, arc) as usize] == self.alpha {
                gain += half;
            }
        }
        // A cost beyond what all neighbours together can outweigh decides alone, however large it is.
        limit += limit;
        let mut balance = field.fixed(
            field.cost(node as usize, self.alpha.into()) - field.cost(node as usize, own.into()),
            F::Capacity::one_more(limit),
        );
        balance -= gain;
        balance
    }
}

impl<F: Field, L: Label> Supply<F::Capacity> for Expansion<'_, '_, F, L> {
    fn node(&self, node: u32, capacities: &mut [F::Capacity]) -> F::Capacity {
        let Labelling { field, topology, labels, .. } = self.labelling;
        let own = labels[node as usize];
        capacities.fill(F::Capacity::default());
        if own == self.alpha || !field.range().contains(&(node as usize)) {
            return F::Capacity::default();
        }
        for (capacity, arc) in capacities.iter_mut().zip(topology.leaving(node)) {
            let half = field.half(node, arc);
            if half == F::Capacity::default() {
                continue;
            }
            let other = labels[topology.head(node, arc) as usize];
            if other != self.alpha {
                *capacity += half;
                if other == own {
                    *capacity += half;
                }
            }
        }
        self.balance(node)
    }
}
