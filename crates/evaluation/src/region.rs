//! Areas on the ground: union, intersection and outline, exact to the integer lattice of the overlay.

use gable_geometry::{Box2, DVec2, dvec2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

/// A ring, not closed.
pub(crate) type Ring = Vec<[f64; 2]>;

/// A set of polygons that do not overlap, each an outer ring (counter-clockwise) and holes (clockwise).
///
/// Overlays run on an integer lattice of 2⁻³⁰ of the extent of what is overlaid: under a micrometre for a block, so areas of
/// buildings are right to about 10⁻⁴ m².
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Region {
    shapes: Vec<Vec<Ring>>,
}

impl Region {
    /// The union of polygons given by their rings, the outer one first; orientation does not matter.
    pub(crate) fn of(polygons: impl IntoIterator<Item = Vec<Ring>>) -> Self {
        let mut shapes = Vec::new();
        for mut rings in polygons {
            for (k, ring) in rings.iter_mut().enumerate() {
                if (signed_area(ring) > 0.0) != (k == 0) {
                    ring.reverse();
                }
            }
            rings.retain(|ring| ring.len() > 2);
            if !rings.is_empty() {
                shapes.push(rings);
            }
        }
        Self { shapes }.united()
    }

    fn united(&self) -> Self {
        let nothing: Vec<Vec<Ring>> = Vec::new();
        Self { shapes: self.shapes.overlay(&nothing, OverlayRule::Union, FillRule::NonZero) }
    }

    /// The union of regions, which may overlap.
    pub(crate) fn union<'a>(regions: impl IntoIterator<Item = &'a Self>) -> Self {
        Self { shapes: regions.into_iter().flat_map(|r| r.shapes.iter().cloned()).collect() }.united()
    }

    /// What two regions share.
    pub(crate) fn intersection(&self, other: &Self) -> Self {
        if self.shapes.is_empty() || other.shapes.is_empty() || !self.bounds().intersects(&other.bounds()) {
            return Self::default();
        }
        Self { shapes: self.shapes.overlay(&other.shapes, OverlayRule::Intersect, FillRule::NonZero) }
    }

    /// Area, m².
    pub(crate) fn area(&self) -> f64 {
        self.rings().map(|r| signed_area(r)).sum()
    }

    /// Whether nothing is covered.
    pub(crate) fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// All rings.
    pub(crate) fn rings(&self) -> impl Iterator<Item = &Ring> {
        self.shapes.iter().flatten()
    }

    /// All sides of all rings.
    pub(crate) fn segments(&self) -> impl Iterator<Item = [DVec2; 2]> {
        self.rings().flat_map(|ring| {
            (0..ring.len()).map(move |k| [DVec2::from(ring[k]), DVec2::from(ring[(k + 1) % ring.len()])])
        })
    }

    /// The smallest box around it.
    pub(crate) fn bounds(&self) -> Box2 {
        Box2::of(self.rings().flatten().map(|&p| p.into()))
    }

    /// Whether a point is inside.
    pub(crate) fn contains(&self, p: DVec2) -> bool {
        let mut inside = false;
        for [a, b] in self.segments() {
            if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
                inside = !inside;
            }
        }
        inside
    }

    /// Corners where the outline turns by at least `angle` radians.
    pub(crate) fn corners(&self, angle: f64) -> Vec<DVec2> {
        let mut out = Vec::new();
        for ring in self.rings() {
            let n = ring.len();
            for k in 0..n {
                let [a, b, c] = [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]].map(DVec2::from);
                if (b - a).angle_to(c - b).abs() >= angle {
                    out.push(b);
                }
            }
        }
        out
    }
}

/// Intersection over union of two areas that share `shared`; 0 if both are empty.
pub(crate) fn iou(a: f64, b: f64, shared: f64) -> f64 {
    let union = a + b - shared;
    if union > 0.0 { (shared / union).clamp(0.0, 1.0) } else { 0.0 }
}

fn signed_area(ring: &[[f64; 2]]) -> f64 {
    let ring: Vec<DVec2> = ring.iter().map(|&[x, y]| dvec2(x, y)).collect();
    gable_geometry::ring_area(&ring)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Ring {
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    #[test]
    fn overlays_have_the_areas_of_hand_calculation() {
        let mut hole = rectangle(1.0, 1.0, 2.0, 2.0);
        let a = Region::of([vec![rectangle(0.0, 0.0, 4.0, 4.0), hole.clone()]]);
        hole.reverse();
        let same = Region::of([vec![rectangle(0.0, 0.0, 4.0, 4.0), hole]]);
        let b = Region::of([vec![rectangle(3.0, 0.0, 6.0, 4.0)]]);
        assert!((a.area() - 15.0).abs() < 1e-6 && (same.area() - 15.0).abs() < 1e-6);
        assert!((a.intersection(&b).area() - 4.0).abs() < 1e-6);
        assert!((Region::union([&a, &b]).area() - 23.0).abs() < 1e-6);
        assert!(a.intersection(&Region::of([vec![rectangle(9.0, 9.0, 10.0, 10.0)]])).is_empty());
        assert!((iou(15.0, 12.0, 4.0) - 4.0 / 23.0).abs() < 1e-12);
        assert!(a.contains(dvec2(3.0, 3.0)) && !a.contains(dvec2(1.5, 1.5)) && !a.contains(dvec2(-1.0, 3.0)));
        assert_eq!(a.corners(0.3).len(), 8);
    }

    #[test]
    fn large_coordinates_keep_their_areas() {
        let (x, y) = (85_000.0, 446_000.0);
        let a = Region::of([vec![rectangle(x, y, x + 10.0, y + 10.0)]]);
        let b = Region::of([vec![rectangle(x + 5.0, y, x + 15.0, y + 10.0)]]);
        assert!((a.intersection(&b).area() - 50.0).abs() < 1e-4);
    }
}
