//! How finely coordinates are written: those of 32 bits or of six digits step by metres at the size of UTM coordinates.

use gable_geometry::DVec3;

/// Steps that cannot be seen in a model, metres.
const FINE: f64 = 0.05;
/// How many steps a coordinate is from zero where it was rounded for want of digits: fewer are a mesh made on a grid.
const ROUNDED: f64 = 1.0e5;
/// Vertices from which on a lattice is no chance.
const MANY: u64 = 100;

/// Powers of two and of ten, coarse ones first, down to the last above [`FINE`].
const TWO: [f64; 12] = [128.0, 64.0, 32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625];
const TEN: [f64; 5] = [1000.0, 100.0, 10.0, 1.0, 0.1];

/// The coarsest lattice that holds all coordinates of an axis so far.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    two: usize,
    ten: usize,
    largest: f64,
}

impl Axis {
    #[inline]
    fn add(&mut self, value: f64) {
        if self.two == TWO.len() && self.ten == TEN.len() {
            return;
        }
        self.refine(value);
    }

    #[cold]
    fn refine(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        // Decimal fractions are no exact multiples of anything.
        let slack = 1e-9 + value.abs() * 1e-14;
        let holds = |step: f64| (value / step - (value / step).round()).abs() * step <= slack;
        while self.two < TWO.len() && !holds(TWO[self.two]) {
            self.two += 1;
        }
        while self.ten < TEN.len() && !holds(TEN[self.ten]) {
            self.ten += 1;
        }
        self.largest = self.largest.max(value.abs());
    }

    fn step(&self) -> Option<f64> {
        let two = TWO.get(self.two).copied().unwrap_or(0.0);
        let step = two.max(TEN.get(self.ten).copied().unwrap_or(0.0));
        (step > FINE && self.largest / step >= ROUNDED).then_some(step)
    }
}

/// The lattices of the three axes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lattice {
    axes: [Axis; 3],
    vertices: u64,
}

impl Lattice {
    /// Takes a vertex as the file has it.
    #[inline]
    pub(crate) fn add(&mut self, vertex: DVec3) {
        self.vertices += 1;
        self.axes[0].add(vertex.x);
        self.axes[1].add(vertex.y);
        self.axes[2].add(vertex.z);
    }

    /// What there is to say: the axis with its step.
    pub(crate) fn coarse(&self) -> Vec<String> {
        let named = ["x", "y", "z"].into_iter().zip(&self.axes);
        let said = |(name, axis): (&str, &Axis)| {
            let step = axis.step()?;
            Some(format!("all {name} are multiples of {step} m, up to {:.0}", axis.largest))
        };
        if self.vertices < MANY { Vec::new() } else { named.filter_map(said).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(of: impl Fn(f64) -> DVec3) -> Vec<String> {
        let mut lattice = Lattice::default();
        (0..500).for_each(|i| lattice.add(of(f64::from(i))));
        lattice.coarse()
    }

    fn short(value: f64) -> f64 {
        format!("{value:.5e}").parse().unwrap()
    }

    #[test]
    fn rounded_coordinates_are_seen() {
        let at = |i: f64| DVec3::new(691_000.0 + i * 0.2371, 5_334_000.0 + i * 0.1713, 40.0 + i * 0.0137);
        assert_eq!(said(at), [] as [String; 0]);
        let single = said(|i| at(i).as_vec3().as_dvec3());
        assert_eq!(
            single,
            ["all x are multiples of 0.0625 m, up to 691118", "all y are multiples of 0.5 m, up to 5334086"]
        );
        let six = said(|i| DVec3::from_array(at(i).to_array().map(short)));
        assert_eq!(six, ["all x are multiples of 1 m, up to 691118", "all y are multiples of 10 m, up to 5334090"]);
    }

    #[test]
    fn a_mesh_on_a_grid_near_its_origin_is_none() {
        assert!(said(|i| DVec3::new(i, 0.5 * i, 0.0)).is_empty());
        assert!(said(|i| DVec3::new(i, 0.5 * i, 0.0).as_vec3().as_dvec3()).is_empty());
        let mut few = Lattice::default();
        (0..50).for_each(|i| few.add(DVec3::new(691_000.0 + f64::from(i), 5_334_000.0, 0.0)));
        assert!(few.coarse().is_empty());
    }
}
