//! Where a facade stands: the mean of the steep surface along an outer wall.
//!
//! Seen from above, a wall ends where its outermost bump or the eave ends: matched walls waver by a decimetre, and the
//! outline of the height map is their envelope. The facets of the wall itself know better (Zhu 2018, §5.1 takes
//! facades from them, too).

use gable_geometry::{Box2, DVec2};
use gable_lines::LineSegment;
use gable_ortho::WallEvidence;
use gable_raster::{GridWindow, Raster};

/// Facets this far from the wall that was drawn may be its own, metres.
const REACH: f64 = 0.8;

/// Facets further than this from the middle of the others are bay windows, hedges or ledges, metres.
const SPREAD: f64 = 0.4;

/// The ends are rounded corners: what is left out there, metres.
const CORNER: f64 = 0.5;

/// Least cosine between a facet's normal on the ground and the wall's.
const FACING: f64 = 0.8;

/// Wall surface that must be seen, m² for each metre of wall.
const SEEN: f64 = 1.0;

/// Signed offset (metres, positive to the left, which is the inside) of the facade from an outer wall; `None` if too
/// little of it is seen. O(pixels around the wall).
pub(crate) fn offset(wall: &LineSegment, walls: &Raster<WallEvidence>) -> Option<f64> {
    let unit = wall.vector().try_normalize()?;
    let left = unit.perp();
    let usable = wall.length() - 2.0 * CORNER;
    let window = walls.window();
    let near = GridWindow::covering(Box2::of([wall.a, wall.b]).grown(REACH), window.step).intersection(&window);
    let mut facets: Vec<(f64, f64)> = Vec::new();
    for y in 0..near.height {
        // A long wall that runs askew has a large box: only what lies beside it in each row is looked at.
        let first = near.centre(0, y);
        let column = |across: f64| (wall.a.x + (across - (first.y - wall.a.y) * left.y) / left.x - first.x) / near.step;
        let (low, high) = (column(-REACH).min(column(REACH)), column(-REACH).max(column(REACH)));
        let beside = if left.x.abs() > 0.01 {
            ((low - 1.0).max(0.0) as usize).min(near.width)..((high + 2.0).max(0.0) as usize).min(near.width)
        } else {
            0..near.width
        };
        for x in beside {
            let at = near.centre(x, y);
            let (t, d) = ((at - wall.a).dot(unit) - CORNER, (at - wall.a).dot(left));
            if !(0.0..=usable).contains(&t) || d.abs() > REACH {
                continue;
            }
            let Some(evidence) = window.pixel(at).map(|pixel| walls[pixel]) else { continue };
            let normal = DVec2::from_array(evidence.normal.map(f64::from));
            if normal.dot(-left) >= FACING {
                facets.push((d, f64::from(evidence.area)));
            }
        }
    }
    let area: f64 = facets.iter().map(|f| f.1).sum();
    if usable <= 0.0 || area < SEEN * usable {
        return None;
    }
    facets.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let middle = facets.iter().find(|f| {
        below += f.1;
        below >= 0.5 * area
    })?;
    let own = facets.iter().filter(|f| (f.0 - middle.0).abs() <= SPREAD);
    let (sum, weight) = own.fold((0.0, 0.0), |(s, w), f| (s + f.0 * f.1, w + f.1));
    Some(sum / weight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;
    use gable_lines::Source;

    /// A wall along x = `at` from y = 0 to 10 that faces west, `area` m² in each metre.
    fn wall(at: f64, area: f32) -> Raster<WallEvidence> {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 50, height: 50 };
        let mut walls = Raster::filled(window, WallEvidence::default());
        for y in 0..50 {
            // Facets waver by a pixel.
            let x = (at / 0.2).floor() as usize + y % 2;
            let lean = (at / 0.2).fract() as f32;
            for (x, share) in [(x, 1.0 - lean), (x + 1, lean)] {
                walls[(x, y)] = WallEvidence { area: 0.2 * area * share, normal: [-1.0, 0.0], z_min: 0.0, z_max: 5.0 };
            }
        }
        walls
    }

    /// Drawn at x = 5, the inside to the east.
    fn drawn() -> LineSegment {
        LineSegment { a: dvec2(5.0, 9.0), b: dvec2(5.0, 1.0), weight: 8.0, source: Source::Outline }
    }

    #[test]
    fn a_wall_moves_to_its_facets() {
        for at in [4.8, 5.1, 5.33] {
            let found = offset(&drawn(), &wall(at, 4.0)).unwrap();
            // The mean of the wavering pixels' centres lies 0.2 m further east.
            assert!((found - (at + 0.2 - 5.0)).abs() < 0.03, "{at}: {found}");
        }
    }

    #[test]
    fn what_is_hardly_seen_moves_nothing() {
        assert_eq!(offset(&drawn(), &wall(5.1, 0.5)), None);
        let mut away = wall(5.1, 4.0);
        away.values_mut().iter_mut().for_each(|w| w.normal = [1.0, 0.0]);
        assert_eq!(offset(&drawn(), &away), None, "it faces the other way");
    }
}
