//! Regularisation on local graphs (Han et al. 2021, §III-C.3): no global frame is assumed.

use crate::LineSegment;
use crate::collinear::sort_longest_first;
use gable_geometry::{Box2, BoxTree, DVec2};
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeSet, BinaryHeap};

/// Parameters of [`simplify_local_graph`] and [`orthogonalise_local_graph`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalGraphParams {
    /// Segments closer than this belong together, metres (published: 0.3).
    pub distance: f64,
    /// Segments that differ by less than this from parallel (or perpendicular) do, radians (published: 15°).
    pub angle: f64,
    /// No end of a segment moves farther than this across its own direction, metres (default 0.6). The publication has
    /// no cap: a chain of merges can carry a segment away.
    pub max_drift: f64,
    /// Perpendicular relations reach this far, metres (default 30). The publication relates all segments of a building.
    pub radius: f64,
}

impl Default for LocalGraphParams {
    fn default() -> Self {
        Self { distance: 0.3, angle: 15f64.to_radians(), max_drift: 0.6, radius: 30.0 }
    }
}

/// A candidate merge; the heap gives the most similar pair first, then the earliest.
struct Candidate {
    similarity: f64,
    pair: (usize, usize),
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.similarity.total_cmp(&other.similarity).then_with(|| other.pair.cmp(&self.pair))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A vertex of the simplification graph.
struct Vertex {
    segment: LineSegment,
    /// The ends of the input segments that went into it.
    ends: Vec<DVec2>,
    neighbours: BTreeSet<usize>,
    alive: bool,
}

/// Merges neighbouring segments of similar direction, the most similar pair first (Eq. 3–7).
///
/// An edge joins two segments that are closer than `distance` and differ by less than `angle`. Collapsing the edge of the
/// highest |cosine| gives a segment through the length-weighted mean of the middles, along the sum of the directions,
/// that covers the projections of both; the neighbours of both become its own where the conditions still hold.
///
/// Departures: directions are signed alike before they are added and weighted by length (a short piece does not turn a
/// long one); a merge that would carry an end of an input segment farther than `max_drift` from the new line is refused.
/// The merged segment keeps the sense and the source of the longer one and the sum of the weights. The result does not
/// depend on the order of the input; longest first. Cost: O(n log n + e log e) for e pairs of segments that are near each other.
#[must_use]
pub fn simplify_local_graph(mut segments: Vec<LineSegment>, params: &LocalGraphParams) -> Vec<LineSegment> {
    segments.retain(|s| s.length() > 0.0);
    sort_longest_first(&mut segments);
    let joined = |a: &LineSegment, b: &LineSegment| {
        a.direction().dot(b.direction()).abs() > params.angle.cos() && a.distance(b) < params.distance
    };
    let vertex = |segment: LineSegment| Vertex {
        segment,
        ends: vec![segment.a, segment.b],
        neighbours: BTreeSet::new(),
        alive: true,
    };
    let mut graph: Vec<_> = segments.into_iter().map(vertex).collect();
    let mut heap = BinaryHeap::new();
    let boxes: Vec<_> = graph.iter().map(|v| Box2::of([v.segment.a, v.segment.b]).grown(params.distance)).collect();
    let tree = BoxTree::new(&boxes);
    for j in 0..graph.len() {
        for i in tree.near(&boxes[j]).into_iter().take_while(|&i| i < j) {
            if joined(&graph[i].segment, &graph[j].segment) {
                connect(&mut graph, &mut heap, i, j);
            }
        }
    }
    while let Some(Candidate { pair: (i, j), .. }) = heap.pop() {
        if !graph[i].alive || !graph[j].alive {
            continue;
        }
        let Some(segment) = merged(&graph[i], &graph[j], params.max_drift) else { continue };
        graph[i].alive = false;
        graph[j].alive = false;
        let ends = [graph[i].ends.as_slice(), &graph[j].ends].concat();
        let around: BTreeSet<_> = graph[i].neighbours.union(&graph[j].neighbours).copied().collect();
        let new = graph.len();
        graph.push(Vertex { ends, ..vertex(segment) });
        for k in around {
            if graph[k].alive && joined(&graph[k].segment, &segment) {
                connect(&mut graph, &mut heap, k, new);
            }
        }
    }
    let mut out: Vec<_> = graph.into_iter().filter(|v| v.alive).map(|v| v.segment).collect();
    sort_longest_first(&mut out);
    out
}

fn connect(graph: &mut [Vertex], heap: &mut BinaryHeap<Candidate>, i: usize, j: usize) {
    graph[i].neighbours.insert(j);
    graph[j].neighbours.insert(i);
    let similarity = graph[i].segment.direction().dot(graph[j].segment.direction()).abs();
    heap.push(Candidate { similarity, pair: (i, j) });
}

/// Eq. 6 and 7; `None` if an end would drift too far.
fn merged(first: &Vertex, second: &Vertex, max_drift: f64) -> Option<LineSegment> {
    let (a, b) = (&first.segment, &second.segment);
    let (la, lb) = (a.length(), b.length());
    let long = if la >= lb { a } else { b };
    let signed = |s: &LineSegment| if s.vector().dot(long.vector()) < 0.0 { -s.vector() } else { s.vector() };
    let along = (signed(a) + signed(b)).try_normalize()?;
    let middle = (a.middle() * la + b.middle() * lb) / (la + lb);
    let ends = || first.ends.iter().chain(&second.ends);
    if ends().any(|&p| along.perp_dot(p - middle).abs() > max_drift) {
        return None;
    }
    let reach = [a.a, a.b, b.a, b.b].map(|p| along.dot(p - middle));
    let (from, to) = reach.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(f, t), &v| (f.min(v), t.max(v)));
    Some(LineSegment {
        a: middle + along * from,
        b: middle + along * to,
        weight: a.weight + b.weight,
        source: long.source,
    })
}

/// What the rounding of numbers may add to a distance, metres.
const ROUNDING: f64 = 1e-6;

/// A line that several perpendicular segments were put on.
struct Representative {
    /// Weighted sum of middles, and of lengths.
    moment: DVec2,
    length: f64,
    members: Vec<usize>,
}

/// Makes segments perpendicular, parallel and collinear where they nearly are (Eq. 8–10), from long to short.
///
/// Each segment, the longest first and those that were set before those that were not, turns the segments within
/// `radius` that are within `angle` of its perpendicular and not set yet, about their middles; those of them whose
/// lines are closer than `distance` are moved onto one line, at the length-weighted mean of their middles. Parallel ones
/// follow through a common perpendicular.
///
/// Departures: what was set goes on before the next free segment starts a frame of its own (else the two long sides of
/// a house would each keep their direction); relations reach only `radius` far; a segment whose end would move by more
/// than `max_drift` stays as it is (for a long segment `angle` alone allows metres). The result does not depend on the
/// order of the input; longest first. Cost: O(n log n + p) for p pairs of segments within `radius` of each other.
#[must_use]
pub fn orthogonalise_local_graph(mut segments: Vec<LineSegment>, params: &LocalGraphParams) -> Vec<LineSegment> {
    segments.retain(|s| s.length() > 0.0);
    sort_longest_first(&mut segments);
    let before = segments.clone();
    // Only those that are not set are looked for, and they lie where they were.
    let tree = BoxTree::new(&segments.iter().map(|s| Box2::of([s.a, s.b])).collect::<Vec<_>>());
    let mut set = vec![false; segments.len()];
    // Those that were set wait for their turn; the others come in their order.
    let mut waiting: BinaryHeap<Reverse<usize>> = BinaryHeap::new();
    let mut free = 0..segments.len();
    while let Some(i) = waiting.pop().map(|Reverse(i)| i).or_else(|| free.find(|&i| !set[i])) {
        let base = segments[i];
        let across = base.direction().perp();
        set[i] = true;
        let mut table: Vec<Representative> = Vec::new();
        for j in tree.near(&Box2::of([base.a, base.b]).grown(params.radius + ROUNDING)) {
            let s = segments[j];
            if set[j] || s.direction().dot(across).abs() < params.angle.cos() || base.distance(&s) > params.radius {
                continue;
            }
            let along = if s.vector().dot(across) < 0.0 { -across } else { across };
            let (middle, half) = (s.middle(), 0.5 * s.vector().dot(along));
            let turned = LineSegment { a: middle - along * half, b: middle + along * half, ..s };
            if drift(&turned, &before[j]) > params.max_drift {
                continue;
            }
            segments[j] = turned;
            set[j] = true;
            waiting.push(Reverse(j));
            // Signed distance of parallel lines, along the base.
            let apart = |r: &Representative| across.perp_dot(r.moment / r.length - middle).abs();
            let close = table.iter_mut().filter(|r| apart(r) < params.distance);
            let length = turned.length();
            match close.min_by(|a, b| apart(a).total_cmp(&apart(b))) {
                Some(r) => {
                    r.moment += middle * length;
                    r.length += length;
                    r.members.push(j);
                }
                None => table.push(Representative { moment: middle * length, length, members: vec![j] }),
            }
        }
        for r in table {
            let on = r.moment / r.length;
            for j in r.members {
                let s = segments[j];
                let shift = base.direction() * base.direction().dot(on - s.middle());
                let moved = LineSegment { a: s.a + shift, b: s.b + shift, ..s };
                if drift(&moved, &before[j]) <= params.max_drift {
                    segments[j] = moved;
                }
            }
        }
    }
    sort_longest_first(&mut segments);
    segments
}

/// How far the ends of a segment lie from the line that it had.
fn drift(now: &LineSegment, before: &LineSegment) -> f64 {
    let along = before.direction();
    let off = |p: DVec2| along.perp_dot(p - before.a).abs();
    off(now.a).max(off(now.b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use gable_geometry::{Counter, dvec2};
    use proptest::prelude::*;

    fn line(ax: f64, ay: f64, bx: f64, by: f64) -> LineSegment {
        let (a, b) = (dvec2(ax, ay), dvec2(bx, by));
        LineSegment { a, b, weight: a.distance(b), source: Source::Image }
    }

    #[test]
    fn overlapping_pieces_become_one_line() {
        // Two detections of one edge, in opposite senses, and a parallel one that is too far away.
        let params = LocalGraphParams::default();
        let out = simplify_local_graph(
            vec![line(0.0, 0.0, 6.0, 0.0), line(9.0, 0.2, 5.0, 0.0), line(0.0, 1.0, 6.0, 1.1)],
            &params,
        );
        assert_eq!(out.len(), 2);
        assert!(out[0].length() > 8.9 && out[0].b.x > out[0].a.x && (out[0].weight - 10.005).abs() < 0.01);
        assert!(out[0].direction().y.abs() < 0.03);
    }

    #[test]
    fn a_chain_of_merges_does_not_drift() {
        // An arc of short pieces: without the cap all of it would become one chord.
        let arc: Vec<_> = (0..20)
            .map(|i| {
                let p = |k: f64| 10.0 * DVec2::from_angle(k * 0.15);
                let (a, b) = (p(f64::from(i)), p(f64::from(i + 1)));
                line(a.x, a.y, b.x, b.y)
            })
            .collect();
        let out = simplify_local_graph(arc.clone(), &LocalGraphParams::default());
        assert!((4..15).contains(&out.len()), "{}", out.len());
        for s in &arc {
            for p in [s.a, s.b] {
                let off = out.iter().map(|m| gable_geometry::point_segment_distance(p, m.a, m.b));
                assert!(off.fold(f64::INFINITY, f64::min) < 0.65);
            }
        }
    }

    #[test]
    fn right_angles_come_from_the_longest() {
        let out = orthogonalise_local_graph(
            vec![
                line(0.0, 0.0, 20.0, 0.0),
                line(0.1, 0.0, -0.1, 5.0),
                line(0.2, 6.0, 0.2, 9.0),
                line(10.0, 3.0, 13.0, 6.0),
                line(0.0, 10.0, 8.0, 10.3),
            ],
            &LocalGraphParams::default(),
        );
        let find =
            |p: DVec2| out.iter().min_by(|a, b| a.middle().distance(p).total_cmp(&b.middle().distance(p))).unwrap();
        let (low, high) = (find(dvec2(0.0, 2.5)), find(dvec2(0.2, 7.5)));
        assert!(low.direction().x.abs() < 1e-9 && low.direction().y > 0.0);
        assert!((low.a.x - high.a.x).abs() < 1e-9, "two pieces of one wall are collinear");
        assert!((find(dvec2(11.5, 4.5)).direction().x - 0.5f64.sqrt()).abs() < 1e-9, "a diagonal stays");
        assert!(find(dvec2(4.0, 10.15)).direction().y.abs() < 1e-9, "parallel by way of the common perpendicular");
    }

    proptest! {
        #[test]
        fn order_does_not_matter_and_nothing_drifts(
            lines in prop::collection::vec((0.0..10.0f64, 0.0..10.0f64, 0.0..6.2f64, 0.3..6.0f64), 1..25),
            seed in any::<u64>(),
        ) {
            let params = LocalGraphParams::default();
            let segments: Vec<_> = lines
                .iter()
                .map(|&(x, y, t, l)| line(x, y, x + l * t.cos(), y + l * t.sin()))
                .collect();
            let mut shuffled = segments.clone();
            let mut rng = Counter::new(seed);
            for i in (1..shuffled.len()).rev() {
                shuffled.swap(i, rng.index(i + 1));
            }
            let simple = simplify_local_graph(segments.clone(), &params);
            prop_assert_eq!(&simplify_local_graph(shuffled.clone(), &params), &simple);
            for s in &segments {
                for p in [s.a, s.b] {
                    let near = simple.iter().map(|m| gable_geometry::point_segment_distance(p, m.a, m.b));
                    prop_assert!(near.fold(f64::INFINITY, f64::min) <= params.max_drift + 1e-9);
                }
            }
            let square = orthogonalise_local_graph(segments.clone(), &params);
            prop_assert_eq!(&orthogonalise_local_graph(shuffled, &params), &square);
            prop_assert_eq!(square.len(), segments.len());
        }
    }
}
