//! α-β swap (Boykov, Veksler & Zabih 2001, section 4).

use crate::demand_flow::{Capacity, DemandFlow, Supply};
use crate::labelling::Labelling;
use crate::potts::{Field, GraphField, GridField, Label};
use crate::topology::Topology;
use crate::{Error, GraphProblem, GridProblem, Options, Report};

/// Minimises the energy of a grid by α-β swaps, pairs of labels in ascending order, until a full cycle brings no gain.
///
/// # Errors
/// If sizes, costs, weights or the start are not what [`GridProblem`] asks for.
pub fn swap_grid(problem: GridProblem<'_>, start: Vec<u8>, options: &Options) -> Result<(Vec<u8>, Report), Error> {
    let field = GridField::new(problem)?;
    let topology = field.topology();
    run(&field, topology, topology, &start, options)
}

/// Minimises the energy of a graph by α-β swaps, pairs of labels in ascending order, until a full cycle brings no gain.
///
/// # Errors
/// If sizes, costs, weights or the start are not what [`GraphProblem`] asks for.
pub fn swap(problem: &GraphProblem, start: Vec<u16>, options: &Options) -> Result<(Vec<u16>, Report), Error> {
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
    let label = |l: usize| L::try_from(l).unwrap_or_else(|_| unreachable!("the field checked its labels"));
    let labels = field.labels();
    let pairs = labels * (labels - 1) / 2;
    let mut members = vec![Vec::new(); labels];
    for node in field.range() {
        members[labelling.labels[node].into()].push(node as u32);
    }
    let mut changed = Vec::new();
    let mut unchanged = 0;
    'cycles: for _ in 0..options.max_cycles {
        labelling.report.cycles += 1;
        for (alpha, beta) in (0..labels).flat_map(|a| (a + 1..labels).map(move |b| (a, b))) {
            if unchanged == pairs {
                break 'cycles;
            }
            flow.begin();
            let swap = Swap { labelling: &labelling, alpha: label(alpha), beta: label(beta) };
            for &node in members[alpha].iter().chain(&members[beta]) {
                if swap.balance(node) < F::Capacity::default() {
                    flow.reach(node, &swap);
                }
            }
            flow.run(&swap);
            labelling.report.flow_nodes += flow.reached().len() as u64;
            // Who stands on the sink's side gets β, all other members of the pair get α.
            changed.clear();
            let sink = |&n: &u32| flow.on_sink_side(n);
            changed.extend(members[alpha].iter().copied().filter(sink));
            changed.extend(members[beta].iter().copied().filter(|n| !sink(n)));
            if changed.is_empty() {
                unchanged += 1;
                continue;
            }
            let (from, to) = (label(alpha), label(beta));
            if labelling.apply(&changed, |l| if l == from { to } else { from }) {
                unchanged = 0;
                let mut both: Vec<u32> = members[alpha].iter().chain(&members[beta]).copied().collect();
                both.sort_unstable();
                members[alpha].clear();
                members[beta].clear();
                for node in both {
                    members[labelling.labels[node as usize].into()].push(node);
                }
            } else {
                unchanged += 1;
            }
        }
    }
    Ok(labelling.finish())
}

/// The binary problem "α or β" for the nodes that have one of the two; β is the sink's side.
struct Swap<'a, 'b, F: Field, L> {
    labelling: &'a Labelling<'b, F, L>,
    alpha: L,
    beta: L,
}

impl<F: Field, L: Label> Swap<'_, '_, F, L> {
    /// What β costs this node more than α.
    fn balance(&self, node: u32) -> F::Capacity {
        let Labelling { field, topology, .. } = self.labelling;
        let mut limit = F::Capacity::default();
        for arc in topology.leaving(node) {
            let half = field.half(node, arc);
            limit += half;
            limit += half;
        }
        // A cost beyond what all neighbours together can outweigh decides alone, however large it is.
        let cost = |label: L| field.cost(node as usize, label.into());
        field.fixed(cost(self.beta) - cost(self.alpha), F::Capacity::one_more(limit))
    }

    fn is_member(&self, node: u32) -> bool {
        let label = self.labelling.labels[node as usize];
        self.labelling.field.range().contains(&(node as usize)) && (label == self.alpha || label == self.beta)
    }
}

impl<F: Field, L: Label> Supply<F::Capacity> for Swap<'_, '_, F, L> {
    fn node(&self, node: u32, capacities: &mut [F::Capacity]) -> F::Capacity {
        let Labelling { field, topology, .. } = self.labelling;
        capacities.fill(F::Capacity::default());
        if !self.is_member(node) {
            return F::Capacity::default();
        }
        for (capacity, arc) in capacities.iter_mut().zip(topology.leaving(node)) {
            let half = field.half(node, arc);
            if half != F::Capacity::default() && self.is_member(topology.head(node, arc)) {
                *capacity += half;
                *capacity += half;
            }
        }
        self.balance(node)
    }
}
