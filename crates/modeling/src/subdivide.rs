//! From an arrangement whose faces have planes to a partition into regions.

use crate::partition::{Edge, Partition};
use gable_arrangement::Arrangement;
use gable_geometry::Plane;
use std::collections::BTreeMap;

/// The partition that remains when faces of one plane are joined: a region for each connected set of faces with the
/// same label. Returns the label of each region beside it.
pub(crate) fn dissolve(arrangement: &Arrangement, labels: &[Option<u16>]) -> (Partition, Vec<u16>) {
    let halves = arrangement.half_edges();
    let mut root: Vec<usize> = (0..labels.len()).collect();
    fn find(root: &mut [usize], mut i: usize) -> usize {
        while root[i] != i {
            root[i] = root[root[i]];
            i = root[i];
        }
        i
    }
    for e in arrangement.edges() {
        let (l, r) = (e.left as usize, e.right as usize);
        if labels[l].is_some() && labels[l] == labels[r] {
            let (a, b) = (find(&mut root, l), find(&mut root, r));
            root[a.max(b)] = a.min(b);
        }
    }
    let mut number = BTreeMap::new();
    let mut planes = Vec::new();
    let region: Vec<Option<usize>> = (0..labels.len())
        .map(|f| {
            let label = labels[f]?;
            let next = number.len();
            let n = *number.entry(find(&mut root, f)).or_insert(next);
            if n == next {
                planes.push(label);
            }
            Some(n)
        })
        .collect();
    let of = |h: u32| region[halves[h as usize].face as usize];
    let keeps = |h: u32| of(h).is_some() && of(halves[h as usize].twin) != of(h);
    let mut edge_number = vec![usize::MAX; halves.len()];
    let mut kept = Vec::new();
    for h in 0..halves.len() as u32 {
        if keeps(h) {
            edge_number[h as usize] = kept.len();
            kept.push(h);
        }
    }
    let edges = kept
        .iter()
        .map(|&h| {
            let mut next = halves[h as usize].next;
            while !keeps(next) {
                next = halves[halves[next as usize].twin as usize].next;
            }
            Edge {
                from: halves[h as usize].origin,
                to: arrangement.target(h),
                region: of(h).unwrap_or(0),
                next: edge_number[next as usize],
            }
        })
        .collect();
    (Partition { vertices: arrangement.vertices().to_vec(), edges, regions: planes.len() }.compacted(), planes)
}

/// Gives regions smaller than `smallest` m² to the neighbour (or the ground) with which they share most border, the
/// smallest first, until none is left. Returns the partition with its plane labels.
pub(crate) fn absorb_small(mut partition: Partition, mut labels: Vec<u16>, smallest: f64) -> (Partition, Vec<u16>) {
    loop {
        let areas = partition.areas();
        let small =
            (0..partition.regions).filter(|&r| areas[r] < smallest).min_by(|&a, &b| areas[a].total_cmp(&areas[b]));
        let Some(region) = small else { return (partition, labels) };
        let index = partition.index();
        let mut shared: BTreeMap<Option<usize>, f64> = BTreeMap::new();
        for e in partition.edges.iter().filter(|e| e.region == region) {
            let beyond = index.get(&(e.to, e.from)).map(|&t| partition.edges[t].region);
            let length = partition.vertices[e.from as usize].distance(partition.vertices[e.to as usize]);
            *shared.entry(beyond).or_insert(0.0) += length;
        }
        let heir = shared.iter().max_by(|a, b| a.1.total_cmp(b.1)).and_then(|(&r, _)| r);
        let mut group: Vec<Option<usize>> = (0..partition.regions).map(Some).collect();
        group[region] = heir;
        // Numbers close up over the region that goes.
        for g in group.iter_mut().flatten() {
            if *g > region {
                *g -= 1;
            }
        }
        partition = partition.joined(&group);
        labels.remove(region);
        partition.regions = labels.len();
    }
}

/// Turns regions whose plane comes under `lowest` at one of their vertices into level ones at their mean height, and
/// those whose mean is too low into ground. Returns the partition and a plane for each region.
pub(crate) fn clip_to_ground(partition: Partition, mut planes: Vec<Plane>, lowest: f64) -> (Partition, Vec<Plane>) {
    let mut least = vec![f64::INFINITY; partition.regions];
    let mut mean = vec![(0.0, 0.0); partition.regions];
    for e in &partition.edges {
        let z = planes[e.region].height(partition.vertices[e.from as usize]);
        least[e.region] = least[e.region].min(z);
        mean[e.region].0 += z;
        mean[e.region].1 += 1.0;
    }
    let mut group = Vec::with_capacity(partition.regions);
    let mut kept = Vec::new();
    for r in 0..partition.regions {
        let level = mean[r].0 / f64::max(mean[r].1, 1.0);
        if least[r] < lowest {
            planes[r] = Plane::horizontal(level);
        }
        if level < lowest {
            group.push(None);
        } else {
            group.push(Some(kept.len()));
            kept.push(planes[r]);
        }
    }
    let mut out = partition.joined(&group);
    out.regions = kept.len();
    (out, kept)
}
