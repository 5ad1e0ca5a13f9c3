//! Merging regions that hold the same plane: the most alike first, from a queue of pairs that could.

use crate::divide::Evidence;
use crate::partition::{Partition, residual_sum};
use crate::roof_plane::UNASSIGNED;
use gable_geometry::{Covariance3, DVec3, DisjointSets, Plane};
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Where there are more than [`FEW`] regions, those whose boxes are further apart than this do not merge across what lies
/// between them, metres: more than any cross gable or court that cuts one roof in two. So a region is held against what lies
/// around it, and the work grows with the area.
const REACH: f64 = 100.0;

/// So many regions are all held against each other, wherever they are.
pub(crate) const FEW: usize = 2000;

/// Two regions that one plane may fit. The queue gives the most alike first, of equals the pair with the smaller numbers.
#[derive(PartialEq)]
struct Candidate {
    ratio: f64,
    pair: (u16, u16),
    /// How often each of the two had changed when the ratio was found.
    versions: (u32, u32),
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.ratio.total_cmp(&other.ratio).then_with(|| (self.pair, self.versions).cmp(&(other.pair, other.versions)))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Merges regions that one plane fits as well as two, the least different first: neighbours where the test of
/// [`Evidence`] finds no second plane, others (see [`REACH`]) only where they are clearly coplanar (a roof that a cross
/// gable cuts in two). Returns how many were merged.
///
/// Pairs wait in a queue by how alike they are. Merging two regions makes the pairs of both out of date; those of the
/// region that stays are judged anew, and what is out of date is passed over when its turn comes. O(pixels + p log p) for
/// p pairs that are judged; ends early when `pairs_left`, which is counted down, is 0.
pub(crate) fn merge(partition: &mut Partition<'_>, evidence: &Evidence, pairs_left: &mut usize) -> usize {
    let mut regions = Regions::of(partition);
    let mut queue = BinaryHeap::new();
    for first in 0..regions.moments.len() as u16 {
        let around = &regions.around[first as usize];
        *pairs_left = pairs_left.saturating_sub(around.len());
        for &(second, touch) in around.iter().filter(|(second, _)| *second > first) {
            queue.extend(regions.candidate(first, second, touch, evidence).map(Reverse));
        }
    }
    let mut merged = 0;
    while let Some(Reverse(Candidate { pair: (first, second), versions, .. })) = queue.pop() {
        if versions != (regions.versions[first as usize], regions.versions[second as usize]) {
            continue;
        }
        if *pairs_left == 0 {
            break;
        }
        merged += 1;
        regions.join(first, second);
        *pairs_left = pairs_left.saturating_sub(regions.around[first as usize].len());
        for &(other, touch) in &regions.around[first as usize] {
            queue.extend(regions.candidate(first, other, touch, evidence).map(Reverse));
        }
    }
    if merged > 0 {
        for label in &mut partition.labels {
            if *label != UNASSIGNED {
                *label = regions.root(*label);
            }
        }
        let keep: Vec<bool> = (0..regions.into.len()).map(|k| regions.into.find(k) == k).collect();
        partition.retain(&keep);
        partition.refit();
    }
    merged
}

/// The regions while they merge.
struct Regions {
    moments: Vec<Covariance3>,
    /// What [`coplanar`] asks of each region.
    fits: Vec<Option<Fit>>,
    /// How often each region changed; gone ones never match a candidate again.
    versions: Vec<u32>,
    /// The regions that each one may merge with, and whether they touch. Some may be gone: [`Regions::root`] tells into which.
    around: Vec<Vec<(u16, bool)>>,
    /// The regions that went into one another; the one of the smallest number stays.
    into: DisjointSets,
    pixel_area: f64,
}

impl Regions {
    fn of(partition: &Partition<'_>) -> Self {
        let count = partition.planes.len();
        let mut around = vec![Vec::new(); count];
        for (a, b) in near(partition) {
            around[a as usize].push((b, false));
            around[b as usize].push((a, false));
        }
        for (a, b) in touching(partition) {
            around[a as usize].push((b, true));
            around[b as usize].push((a, true));
        }
        around.iter_mut().for_each(unite);
        let moments = partition.moments();
        Self {
            fits: moments.iter().map(Fit::of).collect(),
            moments,
            versions: vec![0; count],
            around,
            into: DisjointSets::new(count),
            pixel_area: partition.field.step * partition.field.step,
        }
    }

    /// Two regions, in the order of their numbers, if one plane fits both.
    fn candidate(&self, a: u16, b: u16, touch: bool, evidence: &Evidence) -> Option<Candidate> {
        let pair = (a.min(b), a.max(b));
        if !touch && !coplanar(self.fits[pair.0 as usize].as_ref()?, self.fits[pair.1 as usize].as_ref()?) {
            return None;
        }
        let [first, second] = [pair.0, pair.1].map(|region| &self.moments[region as usize]);
        let mut both = *first;
        both.merge(second);
        let apart = residual_sum(first) + residual_sum(second);
        let ratio = evidence.ratio(residual_sum(&both), apart, [first.weight(), second.weight()], self.pixel_area);
        let versions = (self.versions[pair.0 as usize], self.versions[pair.1 as usize]);
        (ratio < 1.0).then_some(Candidate { ratio, pair, versions })
    }

    /// Lets the region `second` go into `first`, whose number is smaller, with all that it may merge with.
    fn join(&mut self, first: u16, second: u16) {
        let gone = self.moments[second as usize];
        self.moments[first as usize].merge(&gone);
        self.fits[first as usize] = Fit::of(&self.moments[first as usize]);
        for region in [first, second] {
            self.versions[region as usize] += 1;
        }
        self.into.join(first as usize, second as usize);
        let mut around = std::mem::take(&mut self.around[first as usize]);
        around.append(&mut self.around[second as usize]);
        around.iter_mut().for_each(|(other, _)| *other = self.root(*other));
        around.retain(|(other, _)| *other != first);
        unite(&mut around);
        self.around[first as usize] = around;
    }

    /// The region that holds what was `region`.
    fn root(&mut self, region: u16) -> u16 {
        self.into.find(region as usize) as u16
    }
}

/// Lists each region once, as touching if it is anywhere, in the order of their numbers.
fn unite(around: &mut Vec<(u16, bool)>) {
    around.sort_unstable();
    around.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        kept.1 |= same && next.1;
        same
    });
}

/// Pairs of labels that are neighbours somewhere, the smaller one first.
fn touching(partition: &Partition<'_>) -> Vec<(u16, u16)> {
    let width = partition.field.width;
    let mut pairs = BTreeSet::new();
    for p in 0..partition.labels.len() {
        let own = partition.labels[p];
        for q in [p + 1, p + width] {
            let Some(&other) = partition.labels.get(q) else { continue };
            if own != other && own != UNASSIGNED && other != UNASSIGNED {
                pairs.insert((own.min(other), own.max(other)));
            }
        }
    }
    pairs.into_iter().collect()
}

/// Columns and rows, in pixels, from and to.
type PixelBox = [[usize; 2]; 2];

/// Pairs of labels that may merge across what lies between them, by the distance of their boxes, each once: in the first of the cells of that size that
/// both reach.
fn near(partition: &Partition<'_>) -> Vec<(u16, u16)> {
    let width = partition.field.width;
    let few = partition.planes.len() <= FEW;
    let reach = if few { width.max(partition.field.height) } else { (REACH / partition.field.step).ceil() as usize };
    let mut boxes: Vec<PixelBox> = vec![[[usize::MAX, 0]; 2]; partition.planes.len()];
    for (p, &label) in partition.labels.iter().enumerate() {
        if label != UNASSIGNED {
            for (range, at) in boxes[label as usize].iter_mut().zip([p % width, p / width]) {
                *range = [range[0].min(at), range[1].max(at)];
            }
        }
    }
    let mut cells: BTreeMap<[usize; 2], Vec<u16>> = BTreeMap::new();
    for (label, [columns, rows]) in boxes.iter().enumerate().filter(|(_, b)| b[0][0] <= b[0][1]) {
        for row in rows[0] / reach..=(rows[1] + reach) / reach {
            for column in columns[0] / reach..=(columns[1] + reach) / reach {
                cells.entry([column, row]).or_default().push(label as u16);
            }
        }
    }
    let mut pairs = Vec::new();
    for (cell, labels) in &cells {
        for (k, &a) in labels.iter().enumerate() {
            for &b in &labels[k + 1..] {
                let (own, other) = (&boxes[a as usize], &boxes[b as usize]);
                let meet = (0..2).all(|axis| {
                    let (from, to) = (own[axis][0].max(other[axis][0]), own[axis][1].min(other[axis][1]));
                    from <= to + reach && from / reach == cell[axis]
                });
                if meet {
                    pairs.push((a, b));
                }
            }
        }
    }
    pairs
}

/// The plane of a set of points.
struct Fit {
    plane: Plane,
    normal: DVec3,
    centroid: DVec3,
    weight: f64,
}

impl Fit {
    fn of(moments: &Covariance3) -> Option<Self> {
        let plane = moments.height_plane()?;
        Some(Self { normal: plane.normal(), plane, centroid: moments.centroid(), weight: moments.weight() })
    }
}

/// Whether two sets of points that do not touch lie on one plane: normals within 12° (noise turns small
/// sets by that much), and the centroid of the smaller set within 0.2 m of the plane of the larger one.
fn coplanar(a: &Fit, b: &Fit) -> bool {
    let (large, small) = if a.weight >= b.weight { (a, b) } else { (b, a) };
    large.plane.distance(small.centroid).abs() < 0.2 && large.normal.dot(small.normal) > SAME_NORMAL
}

/// Cosine of 12°.
const SAME_NORMAL: f64 = 0.978_147_600_733_805_7;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_fit::Field;
    use gable_geometry::Counter;
    use gable_raster::{GridWindow, Raster};

    const EVIDENCE: Evidence = Evidence {
        noise_area: 14.0,
        noise: 0.04..=0.16,
        significance: 6.0,
        min_effect: 0.18,
        min_area: 3.0,
        min_width: 1.0,
    };

    /// Square roofs of 15 m side by side, each level or sloped at one of some heights, under noise.
    fn roofs(seed: u64, columns: usize, levels: usize) -> Raster<f32> {
        let (step, side) = (2.5, 6);
        let window = GridWindow { step, x0: 0, y0: 0, width: columns * side + 2, height: columns * side + 2 };
        let mut rng = Counter::new(seed);
        let kinds: Vec<(f64, f64)> =
            (0..columns * columns).map(|_| (rng.index(levels) as f64, 0.3 * rng.index(2) as f64)).collect();
        let mut height = Raster::filled(window, f32::NAN);
        for y in 0..columns * side {
            for x in 0..columns * side {
                let (level, slope) = kinds[y / side * columns + x / side];
                let z = level + slope * (x % side) as f64 * step + 0.05 * rng.normal();
                height[(x + 1, y + 1)] = z as f32;
            }
        }
        height
    }

    /// A partition of such a field into its squares, each with a region of its own.
    fn squares(field: &Field, columns: usize) -> Partition<'_> {
        let side = (field.width - 2) / columns;
        let mut partition = Partition::new(field, 0.5, 0.002);
        for &p in &field.inside {
            let (x, y) = (p as usize % field.width - 1, p as usize / field.width - 1);
            partition.labels[p as usize] = (y / side * columns + x / side) as u16;
        }
        partition.planes = vec![[0.0; 3]; columns * columns];
        partition.refit();
        partition
    }

    fn field(height: &Raster<f32>) -> Field {
        Field::new(height, &height.map(|z| z.is_finite()), 0.6)
    }

    /// The regions that are left when all pairs are looked through before each merge: into which each one went.
    fn by_looking_through(partition: &Partition<'_>) -> Vec<u16> {
        let mut regions = Regions::of(partition);
        let count = regions.moments.len() as u16;
        loop {
            let stays: Vec<u16> = (0..count).filter(|&k| regions.root(k) == k).collect();
            let touching: BTreeSet<(u16, u16)> = touching(partition)
                .into_iter()
                .map(|(a, b)| (regions.root(a), regions.root(b)))
                .map(|(a, b)| (a.min(b), a.max(b)))
                .collect();
            let pairs = stays.iter().flat_map(|&a| stays.iter().filter(move |&&b| b > a).map(move |&b| (a, b)));
            let best = pairs
                .filter_map(|(a, b)| regions.candidate(a, b, touching.contains(&(a, b)), &EVIDENCE))
                .min_by(|p, q| p.ratio.total_cmp(&q.ratio).then(p.pair.cmp(&q.pair)));
            let Some(best) = best else { break };
            regions.join(best.pair.0, best.pair.1);
        }
        (0..count).map(|k| regions.root(k)).collect()
    }

    #[test]
    fn the_queue_merges_what_a_search_of_all_pairs_merges() {
        for seed in 0..12 {
            // Within the reach of each other.
            let columns = 7;
            let height = roofs(seed, columns, 4);
            let field = field(&height);
            let mut partition = squares(&field, columns);
            let before = partition.labels.clone();
            let expected = by_looking_through(&partition);
            let merged = merge(&mut partition, &EVIDENCE, &mut usize::MAX.clone());
            let left: BTreeSet<u16> = expected.iter().copied().collect();
            assert_eq!(merged, columns * columns - left.len(), "seed {seed}");
            assert!(merged > 10 && left.len() > 4, "seed {seed}: {merged}");
            let number: BTreeMap<u16, u16> = left.iter().enumerate().map(|(n, &k)| (k, n as u16)).collect();
            for &p in &field.inside {
                let was = before[p as usize];
                assert_eq!(partition.labels[p as usize], number[&expected[was as usize]], "seed {seed}");
            }
        }
    }

    #[test]
    fn the_pairs_that_are_judged_grow_with_the_area() {
        let pairs = |columns: usize| {
            let height = roofs(1, columns, 100);
            let field = field(&height);
            let mut left = usize::MAX;
            assert!(merge(&mut squares(&field, columns), &EVIDENCE, &mut left) > 10);
            (usize::MAX - left) as f64
        };
        // More than few, and most beyond the reach of each other: four times as many regions.
        let growth = pairs(120) / pairs(60);
        assert!(growth < 8.0, "all pairs would be sixteen times as many, not {growth}");
    }

    #[test]
    fn no_more_pairs_are_judged_than_allowed() {
        let height = roofs(3, 20, 4);
        let field = field(&height);
        let all = merge(&mut squares(&field, 20), &EVIDENCE, &mut usize::MAX.clone());
        let mut left = 1000;
        let some = merge(&mut squares(&field, 20), &EVIDENCE, &mut left);
        assert!(some < all && left == 0, "{some} of {all}");
    }
}
