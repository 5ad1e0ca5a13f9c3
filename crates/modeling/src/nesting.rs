//! Which of many rings holds a point, without asking each edge of each ring.

use gable_geometry::{Box2, BoxTree, DVec2, ring_area, ring_contains};
use std::cell::OnceCell;

/// Rings with fewer corners are asked as they are.
const SMALL: usize = 64;

/// Outer rings in which holes are looked for.
pub(crate) struct Nest {
    rings: Vec<Ring>,
    boxes: BoxTree,
}

struct Ring {
    points: Vec<DVec2>,
    area: f64,
    /// The edges by where they are; each goes back from the corner of its number. Made when first asked for.
    edges: OnceCell<BoxTree>,
}

impl Nest {
    pub(crate) fn of(rings: Vec<Vec<DVec2>>) -> Self {
        let boxes: Vec<Box2> = rings.iter().map(|ring| Box2::of(ring.iter().copied())).collect();
        let ring = |points: Vec<DVec2>| Ring { area: ring_area(&points), points, edges: OnceCell::new() };
        Self { rings: rings.into_iter().map(ring).collect(), boxes: BoxTree::new(&boxes) }
    }

    /// The smallest ring that holds a point, the first of equal ones; as [`ring_contains`] tells.
    pub(crate) fn smallest_around(&self, p: DVec2) -> Option<usize> {
        let near = self.boxes.near(&Box2::of([p]));
        let holds = near.into_iter().filter(|&i| self.rings[i].contains(p));
        holds.min_by(|&a, &b| self.rings[a].area.total_cmp(&self.rings[b].area))
    }
}

impl Ring {
    fn contains(&self, p: DVec2) -> bool {
        let points = &self.points;
        if points.len() < SMALL {
            return ring_contains(points, p);
        }
        let before = |i: usize| points[(i + points.len() - 1) % points.len()];
        let edges = self.edges.get_or_init(|| {
            BoxTree::new(&(0..points.len()).map(|i| Box2::of([points[i], before(i)])).collect::<Vec<_>>())
        });
        // The edges that a ray to the east may cross.
        let ray = Box2 { min: p, max: DVec2::new(f64::INFINITY, p.y) };
        let mut inside = false;
        edges.visit(&ray, |i| inside ^= crossed_by_ray(points[i], before(i), p));
        inside
    }
}

/// Whether a ray from `p` to the east crosses an edge: the rule of [`ring_contains`].
pub(crate) fn crossed_by_ray(a: DVec2, b: DVec2, p: DVec2) -> bool {
    (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, dvec2};

    #[test]
    fn finds_the_ring_that_a_scan_finds() {
        let star = |middle: DVec2, size: f64, corners: usize| -> Vec<DVec2> {
            let mut rng = Counter::new(corners as u64);
            let corner = |k| {
                let angle = std::f64::consts::TAU * f64::from(k) / corners as f64;
                middle + size * rng.range(0.3, 1.0) * DVec2::from_angle(angle)
            };
            (0..corners as u32).map(corner).collect()
        };
        let rings = vec![
            star(DVec2::ZERO, 10.0, 500),
            star(dvec2(2.0, 1.0), 4.0, 9),
            star(dvec2(-3.0, 0.0), 6.0, 100),
            star(dvec2(30.0, 0.0), 5.0, 70),
        ];
        let nest = Nest::of(rings.clone());
        let mut rng = Counter::new(1);
        let mut held = 0;
        for _ in 0..3000 {
            let p = dvec2(rng.range(-12.0, 36.0), rng.range(-12.0, 12.0));
            let scan = (0..rings.len()).filter(|&i| ring_contains(&rings[i], p));
            let scan = scan.min_by(|&a, &b| ring_area(&rings[a]).total_cmp(&ring_area(&rings[b])));
            held += usize::from(scan.is_some());
            assert_eq!(nest.smallest_around(p), scan);
        }
        assert!(held > 300);
    }
}
