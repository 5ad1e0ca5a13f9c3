//! Closing the gaps that are left between segments after they were lengthened.

use gable_geometry::{Box2, BoxTree, DVec2, point_segment_distance};

/// Segments from loose ends to the nearest point of another segment, for ends that have one within `reach` metres.
///
/// An end is loose if it touches no other segment, to within `touch` metres. Two walls whose lines miss each other at a
/// corner, as where a jog too short to be a segment lies between them, leave the corner open, and the face behind it would run
/// out into the unbounded one. Only ends of the first `count` segments are looked at. The links come in the order of the segments;
/// of points as near as each other, the one on the first segment counts. O(n log n) and the segments
/// near each end.
#[must_use]
pub fn link_loose_ends(segments: &[(DVec2, DVec2)], count: usize, reach: f64, touch: f64) -> Vec<(DVec2, DVec2)> {
    let boxes: Vec<Box2> = segments.iter().map(|&(a, b)| Box2::of([a, b]).grown(reach)).collect();
    let tree = BoxTree::new(&boxes);
    let mut links = Vec::new();
    for (i, &(a, b)) in segments.iter().enumerate().take(count) {
        for end in [a, b] {
            let others = tree.near(&Box2::of([end])).into_iter().filter(|&j| j != i).map(|j| segments[j]);
            let nearest =
                others.map(|(p, q)| (point_segment_distance(end, p, q), p, q)).min_by(|x, y| x.0.total_cmp(&y.0));
            if let Some((distance, p, q)) = nearest.filter(|n| n.0 > touch && n.0 <= reach) {
                let along = q - p;
                let t = ((end - p).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
                debug_assert!((end.distance(p + t * along) - distance).abs() < 1e-6);
                links.push((end, p + t * along));
            }
        }
    }
    links
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Arrangement, Options};
    use gable_geometry::dvec2;

    fn square(jog: f64) -> Vec<(DVec2, DVec2)> {
        let corners = [dvec2(0.0, 0.0), dvec2(10.0, 0.0), dvec2(10.0, 8.0), dvec2(0.0, 8.0)];
        let mut walls: Vec<_> = (0..4).map(|i| (corners[i], corners[(i + 1) % 4])).collect();
        // The upper wall stops short of the corner, and lies beyond the eastern one's end.
        walls[2] = (dvec2(9.8, 8.0 + jog), dvec2(0.0, 8.0 + jog));
        walls[3].0.y += jog;
        walls
    }

    #[test]
    fn an_open_corner_is_closed() {
        let walls = square(0.5);
        assert_eq!(Arrangement::build(&walls, &Options::default()).faces().len(), 1, "it leaks");
        let links = link_loose_ends(&walls, 4, 1.0, 1e-3);
        assert_eq!(links.len(), 2, "both ends at the gap");
        let closed: Vec<_> = walls.iter().chain(&links).copied().collect();
        let found = Arrangement::build(&closed, &Options::default());
        assert_eq!(found.faces().len(), 2);
        assert!((found.faces()[1].area - 84.95).abs() < 0.1, "{}", found.faces()[1].area);
    }

    #[test]
    fn what_touches_or_is_far_away_stays() {
        assert!(link_loose_ends(&square(0.0)[..2], 1, 5.0, 1e-3).is_empty());
        assert!(link_loose_ends(&square(0.5), 4, 0.3, 1e-3).is_empty());
        assert!(link_loose_ends(&square(0.5), 0, 1.0, 1e-3).is_empty());
    }
}
