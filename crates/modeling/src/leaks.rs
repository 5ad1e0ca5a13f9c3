//! Where the faces cannot follow the mask, because a wall between them is missing.
//!
//! A wall that is curved, ragged or short leaves no segment, or one that was merged with another, and the face behind it reaches
//! from the roof out into the street. Whichever label it gets, a piece of it is wrong.

use gable_arrangement::Arrangement;
use gable_lines::LineSegment;
use gable_raster::{Raster, square_cores};

/// What is wrong over less than this in width is the straightness of walls, metres.
const WIDE: f64 = 1.0;

/// How far from the outline it is looked for, metres.
const BESIDE: f64 = 0.8;

/// The parts of the outline that part roof from ground where the labelled faces do not: those beside which a place `WIDE` metres
/// wide is on the wrong side. `mask` is the building, `roof` tells for each face whether it is one. O(pixels).
pub(crate) fn missing_walls(
    outline: Vec<LineSegment>,
    arrangement: &Arrangement,
    roof: &[bool],
    mask: &Raster<bool>,
) -> Vec<LineSegment> {
    let window = mask.window();
    let faces = arrangement.face_raster(window.x0, window.y0, window.width, window.height, window.step);
    let wrong: Vec<bool> =
        faces.iter().zip(mask.values()).map(|(&face, &inside)| roof[face as usize] != inside).collect();
    let wide = square_cores(&wrong, window.width, window.height, (0.5 * WIDE / window.step) as usize, false);
    let wide = Raster::new(window, wide);
    let part = |s: LineSegment| {
        let across = s.vector().normalize_or_zero().perp();
        let count = (s.length() / window.step).ceil().max(1.0);
        let place = |i: f64| s.a + s.vector() * (i / count).clamp(0.0, 1.0);
        let reach = (BESIDE / window.step).ceil() as i32;
        let beside: Vec<f64> = (0..count as u32)
            .map(f64::from)
            .filter(|i| {
                (-reach..=reach).any(|k| wide.at(place(i + 0.5) + across * window.step * f64::from(k)) == Some(&true))
            })
            .collect();
        let (first, last) = (beside.first()?, beside.last()?);
        let more = f64::from(reach);
        Some(LineSegment { a: place(first - more), b: place(last + 1.0 + more), ..s })
    };
    outline.into_iter().filter_map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{DVec2, dvec2};
    use gable_lines::Source;
    use gable_raster::GridWindow;

    fn wall(a: DVec2, b: DVec2) -> LineSegment {
        LineSegment { a, b, weight: a.distance(b), source: Source::Outline }
    }

    #[test]
    fn a_missing_wall_is_found() {
        // A mask of 8 × 8 m; the faces reach 2 m further east, or as far as the mask.
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 80, height: 60 };
        let inside = |p: DVec2, east: f64| (2.0..east).contains(&p.x) && (2.0..10.0).contains(&p.y);
        let mask =
            Raster::new(window, (0..window.len()).map(|p| inside(window.centre(p % 80, p / 80), 10.0)).collect());
        let corners = |east: f64| [dvec2(2.0, 2.0), dvec2(east, 2.0), dvec2(east, 10.0), dvec2(2.0, 10.0)];
        let outline: Vec<LineSegment> = (0..4).map(|i| wall(corners(10.0)[i], corners(10.0)[(i + 1) % 4])).collect();
        for (east, expected) in [(10.0, vec![]), (10.8, vec![]), (12.0, vec![1]), (8.0, vec![0, 1, 2])] {
            let lines: Vec<_> = (0..4).map(|i| (corners(east)[i], corners(east)[(i + 1) % 4])).collect();
            let arrangement = Arrangement::build(&lines, &gable_arrangement::Options::default());
            let roof: Vec<bool> = (0..arrangement.faces().len()).map(|f| f > 0).collect();
            let missing = missing_walls(outline.clone(), &arrangement, &roof, &mask);
            let sides: Vec<_> =
                missing.iter().map(|m| outline.iter().position(|s| s.direction() == m.direction())).collect();
            assert_eq!(sides, expected.iter().map(|&side| Some(side)).collect::<Vec<_>>(), "{east}");
            // Of the other sides only what lies beyond the faces.
            assert!(missing.iter().all(|m| m.a.x.min(m.b.x) > 7.0), "{missing:?}");
        }
    }
}
