//! Roof planes that become equal: in slope, and level ones in height.

use crate::Planes;
use crate::merge::FEW;
use crate::plane_fit::PlaneFit;
use gable_geometry::{Box2, BoxTree, Plane};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Of more than [`FEW`] planes, those whose middles are further apart have no reason to share a slope, metres. It bounds the
/// pairs that are looked at.
const REACH: f64 = 100.0;

/// How far from opposite, parallel or at right angles two azimuths may be, radians (10°).
const ALIKE: f64 = 0.17;

/// How strongly symmetry is expected of two sloped planes, the strongest first: opposite, parallel, at right angles.
fn kind(a: &PlaneFit, b: &PlaneFit) -> Option<u8> {
    let between = (a.direction.to_angle() - b.direction.to_angle()).rem_euclid(TAU);
    let near = |angle: f64| (between - angle).abs() < ALIKE || (between - angle).abs() > TAU - ALIKE;
    if near(PI) {
        Some(0)
    } else if near(0.0) {
        Some(1)
    } else if near(FRAC_PI_2) || near(3.0 * FRAC_PI_2) {
        Some(2)
    } else {
        None
    }
}

/// Pairs of sloped planes that may become equal, in the order in which they try: slopes differ by `most` radians at most.
fn pairs(items: &[PlaneFit], most: f64) -> Vec<(usize, usize)> {
    let place = |item: &PlaneFit| Box2::of([item.moments.centroid().truncate()]);
    let reach = if items.len() <= FEW { f64::INFINITY } else { REACH };
    let tree = BoxTree::new(&items.iter().map(place).collect::<Vec<_>>());
    let mut pairs: Vec<(u8, f64, usize, usize)> = Vec::new();
    for (i, a) in items.iter().enumerate().filter(|(_, item)| item.slope > 0.0) {
        for j in tree.near(&place(a).grown(reach)).into_iter().filter(|&j| j > i && items[j].slope > 0.0) {
            let off = (a.slope.atan() - items[j].slope.atan()).abs();
            if off <= most
                && let Some(kind) = kind(a, &items[j])
            {
                pairs.push((kind, off, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then((a.2, a.3).cmp(&(b.2, b.3))));
    pairs.into_iter().map(|(_, _, i, j)| (i, j)).collect()
}

/// Classes of equal slope: pairs join in the order of how strongly symmetry is expected of them. Returns how many planes
/// share their slope with another. No slope changes by more than `most` radians.
pub(crate) fn equal_slopes(items: &mut [PlaneFit], most: f64) -> usize {
    // The members of each class, ascending, under the smallest; and the class of each plane.
    let mut classes: Vec<Vec<usize>> = (0..items.len()).map(|k| vec![k]).collect();
    let mut class: Vec<usize> = (0..items.len()).collect();
    // Classes that did not fit together, with their sizes: they do not as long as neither grows.
    let mut refused: BTreeSet<[(usize, usize); 2]> = BTreeSet::new();
    for (i, j) in pairs(items, most) {
        let (p, q) = (class[i].min(class[j]), class[i].max(class[j]));
        let both = [(p, classes[p].len()), (q, classes[q].len())];
        if p == q || refused.contains(&both) {
            continue;
        }
        let mut members = [classes[p].as_slice(), &classes[q]].concat();
        members.sort_unstable();
        match common_slope(items, &members, most) {
            Some(slope) => {
                for &k in &members {
                    class[k] = p;
                    items[k].slope = slope;
                }
                classes[q].clear();
                classes[p] = members;
            }
            None => {
                refused.insert(both);
            }
        }
    }
    classes.iter().map(Vec::len).filter(|&members| members > 1).sum()
}

/// The least-squares slope of some planes, if the pixels of each tolerate it and none turns by more than `most` radians.
fn common_slope(items: &[PlaneFit], members: &[usize], most: f64) -> Option<f64> {
    let (mut num, mut den) = (0.0, 0.0);
    for &k in members {
        let (n, d) = items[k].along(items[k].direction);
        // Orthogonal distances of steep planes are smaller than vertical ones.
        let weight = items[k].area / (1.0 + items[k].slope * items[k].slope);
        num += weight * n;
        den += weight * d;
    }
    let slope = num / den.max(1e-12);
    let fits = |item: &PlaneFit| {
        let change = (slope.atan() - item.free_slope.atan()).abs();
        change <= most && item.tolerates(item.direction * slope)
    };
    (slope > 0.0 && members.iter().all(|&k| fits(&items[k]))).then_some(slope)
}

/// Level planes of one height.
struct Group {
    /// Mean height, metres, and area, m².
    height: f64,
    area: f64,
    members: Vec<usize>,
    /// The groups below and above.
    below: Option<usize>,
    above: Option<usize>,
}

/// Joins level planes to groups of one height, the nearest two groups first, while they are nearer than `tolerance` metres.
/// Returns how many planes share their height with another.
pub(crate) fn equal_heights(planes: &mut Planes, items: &[PlaneFit], tolerance: f64) -> usize {
    let mut level: Vec<(f64, f64, usize)> = (0..items.len())
        .filter(|&k| items[k].slope == 0.0)
        .map(|k| (items[k].moments.centroid().z, items[k].area, k))
        .collect();
    level.sort_by(|a, b| a.0.total_cmp(&b.0));
    let last = level.len().saturating_sub(1);
    let mut groups: Vec<Group> = level
        .iter()
        .enumerate()
        .map(|(n, &(height, area, k))| Group {
            height,
            area,
            members: vec![k],
            below: n.checked_sub(1),
            above: (n < last).then_some(n + 1),
        })
        .collect();
    // Gaps above groups, the smallest first, then the lowest. Gaps are not negative, so that their bits are in their order.
    let gap =
        |groups: &[Group], n: usize| groups[n].above.map(|above| (groups[above].height - groups[n].height).max(0.0));
    let mut gaps: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
    gaps.extend((0..groups.len()).filter_map(|n| gap(&groups, n).map(|gap| Reverse((gap.to_bits(), n)))));
    while let Some(Reverse((bits, n))) = gaps.pop() {
        let Some(above) = groups[n].above.filter(|_| gap(&groups, n).map(f64::to_bits) == Some(bits)) else { continue };
        if f64::from_bits(bits) >= tolerance {
            break;
        }
        let members = std::mem::take(&mut groups[above].members);
        let (height, area, next) = (groups[above].height, groups[above].area, groups[above].above.take());
        let group = &mut groups[n];
        group.height = (group.height * group.area + height * area) / (group.area + area);
        group.area += area;
        group.members.extend(members);
        group.above = next;
        if let Some(next) = next {
            groups[next].below = Some(n);
        }
        for n in groups[n].below.into_iter().chain([n]) {
            gaps.extend(gap(&groups, n).map(|gap| Reverse((gap.to_bits(), n))));
        }
    }
    let mut equal = 0;
    for group in groups.iter().filter(|g| g.members.len() > 1) {
        for &k in &group.members {
            planes.planes[k].plane = Plane::horizontal(group.height);
            equal += 1;
        }
    }
    equal
}
