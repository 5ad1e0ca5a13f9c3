//! From an arrangement whose faces have planes to a partition into regions.

use crate::partition::{Edge, Partition};
use gable_arrangement::Arrangement;
use gable_geometry::{DisjointSets, Plane};
use std::collections::BTreeMap;

/// The partition that remains when faces of one plane are joined: a region for each connected set of faces with the
/// same label. Returns the label of each region beside it.
pub(crate) fn dissolve(arrangement: &Arrangement, labels: &[Option<u16>]) -> (Partition, Vec<u16>) {
    let halves = arrangement.half_edges();
    let mut sets = DisjointSets::new(labels.len());
    for e in arrangement.edges() {
        let (l, r) = (e.left as usize, e.right as usize);
        if labels[l].is_some() && labels[l] == labels[r] {
            sets.join(l, r);
        }
    }
    let mut number = BTreeMap::new();
    let mut planes = Vec::new();
    let region: Vec<Option<usize>> = (0..labels.len())
        .map(|f| {
            let label = labels[f]?;
            let next = number.len();
            let n = *number.entry(sets.find(f)).or_insert(next);
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
/// smallest first, until none is left. Works in passes, in which no small region takes part twice. Returns the partition with
/// its plane labels. O(edges · log) for each pass; passes are few, since each halves what is left of a cluster.
pub(crate) fn absorb_small(mut partition: Partition, mut labels: Vec<u16>, smallest: f64) -> (Partition, Vec<u16>) {
    loop {
        let areas = partition.areas();
        let mut small: Vec<usize> = (0..partition.regions).filter(|&r| areas[r] < smallest).collect();
        if small.is_empty() {
            return (partition, labels);
        }
        small.sort_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(a.cmp(&b)));
        let index = partition.index();
        let mut shared: Vec<BTreeMap<Option<usize>, f64>> = vec![BTreeMap::new(); partition.regions];
        for e in partition.edges.iter().filter(|e| areas[e.region] < smallest) {
            let beyond = index.get(&(e.to, e.from)).map(|&t| partition.edges[t].region);
            let length = partition.vertices[e.from as usize].distance(partition.vertices[e.to as usize]);
            *shared[e.region].entry(beyond).or_insert(0.0) += length;
        }
        let mut target: Vec<Option<usize>> = (0..partition.regions).map(Some).collect();
        let mut busy = vec![false; partition.regions];
        // Regions beside a small one that came before them: what becomes of it may matter to them.
        let mut unsettled = vec![false; partition.regions];
        for region in small {
            let heir = shared[region].iter().max_by(|a, b| a.1.total_cmp(b.1)).and_then(|(&r, _)| r);
            // A heir that is not small itself may take in several at once.
            let waits = |h: usize| busy[h] && (areas[h] < smallest || unsettled[region]);
            let stays = busy[region] || heir.is_some_and(waits);
            for &beside in shared[region].keys().flatten() {
                unsettled[beside] = true;
            }
            if stays {
                continue;
            }
            target[region] = heir;
            busy[region] = true;
            if let Some(h) = heir {
                busy[h] = true;
            }
        }
        // Numbers close up over the regions that go.
        let stays: Vec<bool> = (0..partition.regions).map(|r| target[r] == Some(r)).collect();
        let mut number = vec![0; partition.regions];
        for r in 1..partition.regions {
            number[r] = number[r - 1] + usize::from(stays[r - 1]);
        }
        let group: Vec<Option<usize>> = target.iter().map(|t| t.map(|t| number[t])).collect();
        partition = partition.joined(&group);
        labels = labels.into_iter().zip(&stays).filter(|(_, stays)| **stays).map(|(l, _)| l).collect();
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
