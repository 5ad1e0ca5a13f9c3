//! Merging collinear segments.

use crate::LineSegment;
use gable_geometry::{Box2, BoxTree, DVec2};
use std::collections::BTreeSet;

/// Segments count as parallel within this angle, radians (0.5°): snapped ones are so exactly.
const PARALLEL: f64 = 0.008_726_646;

/// What the rounding of numbers may add to a distance, metres.
const ROUNDING: f64 = 1e-6;

/// A run of merged segments: a line, and the stretches of it that are covered.
struct Run {
    /// A point of the line and its unit direction.
    at: DVec2,
    along: DVec2,
    /// Range along the line.
    range: [f64; 2],
    /// Sum of length · offset across, and of lengths, for the weighted position.
    moment: f64,
    length: f64,
    members: Vec<LineSegment>,
}

impl Run {
    fn new(segment: LineSegment) -> Self {
        let length = segment.length();
        Self {
            at: segment.a,
            along: segment.direction(),
            range: [0.0, length],
            moment: 0.0,
            length,
            members: vec![segment],
        }
    }

    /// Offset of the weighted line from `at`, across.
    fn offset(&self) -> f64 {
        self.moment / self.length
    }

    fn extent(&self, s: &LineSegment) -> [f64; 2] {
        let (a, b) = (self.along.dot(s.a - self.at), self.along.dot(s.b - self.at));
        [a.min(b), a.max(b)]
    }

    fn across(&self, s: &LineSegment) -> f64 {
        self.along.perp_dot(s.middle() - self.at)
    }

    fn takes(&self, s: &LineSegment, distance: f64) -> bool {
        if self.along.perp_dot(s.direction()).abs() > PARALLEL.sin() {
            return false;
        }
        let [from, to] = self.extent(s);
        let gap = (from - self.range[1]).max(self.range[0] - to);
        // Against the first, longest segment as well as the mean, so that a staircase does not creep.
        (self.across(s) - self.offset()).abs() <= distance && self.across(s).abs() <= distance && gap <= distance
    }

    /// All segments that are not `taken` and that the run may take: none is longer than its first one, so that their middles
    /// tell where their ends are.
    fn near(&self, tree: &BoxTree, distance: f64, taken: &[bool]) -> BTreeSet<usize> {
        let aside = distance + PARALLEL * self.members[0].length() + ROUNDING;
        let ends = [self.range[0] - distance - ROUNDING, self.range[1] + distance + ROUNDING];
        let corner = |along: f64, across: f64| self.at + self.along * along + self.along.perp() * across;
        let corners = ends.iter().flat_map(|&along| [corner(along, -aside), corner(along, aside)]);
        tree.near(&Box2::of(corners)).into_iter().filter(|&i| !taken[i]).collect()
    }

    fn add(&mut self, s: LineSegment) {
        let [from, to] = self.extent(&s);
        let length = s.length();
        self.moment += length * self.across(&s);
        self.length += length;
        self.range = [self.range[0].min(from), self.range[1].max(to)];
        self.members.push(s);
    }

    fn merged(&self) -> LineSegment {
        let origin = self.at + self.along.perp() * self.offset();
        let point = |t: f64| origin + self.along * t;
        let longest = self.members[0];
        let weight = self.members.iter().map(|m| m.weight).sum();
        LineSegment { a: point(self.range[0]), b: point(self.range[1]), weight, source: longest.source }
    }
}

/// Merges parallel segments that lie within `distance` (metres) of one line and, along it, within `distance` of each
/// other: the second step of Zhu's regularisation (2018, §5.2, threshold 0.5 m).
///
/// The longest segment comes first and collects shorter ones until none fits; the merged segment runs at the
/// length-weighted mean position, over all that was covered, in the sense and with the source of the longest one, and
/// with the sum of the weights. Longer segments come first in the result; equal lengths are ordered by position, so the
/// order of the input does not matter. Cost: O(n log n + p) for p segments within `distance` of the runs, each counted for
/// each member of the run.
#[must_use]
pub fn merge_collinear(mut segments: Vec<LineSegment>, distance: f64) -> Vec<LineSegment> {
    segments.retain(|s| s.length() > 0.0);
    sort_longest_first(&mut segments);
    let tree = BoxTree::new(&segments.iter().map(|s| Box2::of([s.a, s.b])).collect::<Vec<_>>());
    let mut taken = vec![false; segments.len()];
    let mut merged = Vec::new();
    for first in 0..segments.len() {
        if std::mem::replace(&mut taken[first], true) {
            continue;
        }
        let mut run = Run::new(segments[first]);
        let mut near: BTreeSet<usize> = run.near(&tree, distance, &taken);
        // A run grows in length: what was too far along may fit after others have joined.
        loop {
            let before = run.members.len();
            let mut from = 0;
            while let Some(&i) = near.range(from..).next() {
                from = i + 1;
                if run.takes(&segments[i], distance) {
                    run.add(segments[i]);
                    taken[i] = true;
                    near.remove(&i);
                    near.extend(run.near(&tree, distance, &taken));
                }
            }
            if run.members.len() == before {
                break;
            }
        }
        merged.push(run.merged());
    }
    sort_longest_first(&mut merged);
    merged
}

/// Longest first; equal ones by position.
pub(crate) fn sort_longest_first(segments: &mut [LineSegment]) {
    let key = |s: &LineSegment| [-s.length(), s.a.x, s.a.y, s.b.x, s.b.y, -s.weight];
    segments.sort_by(|a, b| {
        let (a, b) = ((key(a), a.source), (key(b), b.source));
        let numbers = a.0.iter().zip(&b.0).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
        numbers.unwrap_or(std::cmp::Ordering::Equal).then(a.1.cmp(&b.1))
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use gable_geometry::{Counter, dvec2};
    use proptest::prelude::*;

    fn line(x: (f64, f64), y: f64) -> LineSegment {
        LineSegment { a: dvec2(x.0, y), b: dvec2(x.1, y), weight: (x.1 - x.0).abs(), source: Source::Height }
    }

    #[test]
    fn pieces_of_a_wall_become_one() {
        let merged = merge_collinear(
            vec![line((0.0, 4.0), 0.0), line((8.0, 4.2), 0.3), line((8.3, 9.0), 0.1), line((20.0, 22.0), 0.0)],
            0.5,
        );
        assert_eq!(merged.len(), 2);
        let wall = merged[0];
        assert!((wall.a.x, wall.b.x) == (0.0, 9.0) && (wall.weight - 8.5).abs() < 1e-9);
        assert!((wall.a.y - (3.8 * 0.3 + 0.7 * 0.1) / 8.5).abs() < 1e-9, "the weighted position");
        let apart = merge_collinear(vec![line((0.0, 4.0), 0.0), line((0.0, 4.0), 0.6)], 0.5);
        assert_eq!(apart.len(), 2);
        let crossing = LineSegment { a: dvec2(1.0, -1.0), b: dvec2(1.5, 1.0), ..line((0.0, 0.0), 0.0) };
        assert_eq!(merge_collinear(vec![line((0.0, 4.0), 0.0), crossing], 0.5).len(), 2);
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_order_does_not_matter(
            lines in prop::collection::vec((0.0..20.0f64, 0.5..6.0f64, 0.0..3.0f64, any::<bool>()), 1..30),
            seed in any::<u64>(),
        ) {
            let segments: Vec<_> = lines
                .iter()
                .map(|&(x, l, y, flip)| line(if flip { (x + l, x) } else { (x, x + l) }, y))
                .collect();
            let mut shuffled = segments.clone();
            let mut rng = Counter::new(seed);
            for i in (1..shuffled.len()).rev() {
                shuffled.swap(i, rng.index(i + 1));
            }
            let merged = merge_collinear(segments.clone(), 0.5);
            prop_assert_eq!(&merge_collinear(shuffled, 0.5), &merged);
            let weight = |s: &[LineSegment]| s.iter().map(|s| s.weight).sum::<f64>();
            prop_assert!((weight(&merged) - weight(&segments)).abs() < 1e-9);
            for s in &segments {
                for p in [s.a, s.b] {
                    let near = |m: &LineSegment| gable_geometry::point_segment_distance(p, m.a, m.b);
                    prop_assert!(merged.iter().map(near).fold(f64::INFINITY, f64::min) <= 1.0 + 1e-9);
                }
            }
        }
    }
}
