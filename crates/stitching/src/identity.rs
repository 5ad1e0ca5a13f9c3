//! Names of buildings, after the place where they stand.

use gable_geometry::{Counter, DVec2, DVec3, Frame};
use gable_raster::Raster;
use std::collections::BTreeMap;

/// An identifier for each centroid (local metres): the world coordinates in whole metres, as in `b-84512-446120`, so
/// that it is the same from run to run, whatever the tiling. It can be an XML name. Where two centroids share a
/// square metre, the later ones (in the order given, which must not depend on the tiling) get a suffix.
#[must_use]
pub fn building_ids(centroids: &[DVec2], frame: &Frame) -> Vec<String> {
    let mut taken: BTreeMap<String, usize> = BTreeMap::new();
    centroids
        .iter()
        .map(|&c| {
            let name = name(square(c, frame));
            let n = taken.entry(name.clone()).or_insert(0);
            *n += 1;
            if *n == 1 { name } else { format!("{name}.{n}") }
        })
        .collect()
}

/// The identifier of a building: one of the square metres of the world that it fills, so that no other building has the same
/// one. `None` if it fills none. O(pixels).
///
/// Of all that it fills it is the first in an order that is drawn by lot, once for the whole world (min-wise hashing, Broder 1997). A
/// building that changes keeps its name with the probability of the overlap of what it fills before and after; one that is named
/// after its middle loses it as soon as that moves over a border of squares.
#[must_use]
pub fn part_id(pixels: &Raster<bool>, frame: &Frame) -> Option<String> {
    let inner = pixels.window();
    // A square at the border of the window is only full if what lies beyond is, too.
    let window = inner.grown((1.0 / inner.step).ceil() as usize);
    let pixels = pixels.crop(window, false);
    let mut squares: BTreeMap<[i64; 2], bool> = BTreeMap::new();
    for (p, &inside) in pixels.values().iter().enumerate() {
        let at = window.centre(p % window.width, p / window.width);
        *squares.entry(square(at, frame)).or_insert(true) &= inside;
    }
    let full = squares.into_iter().filter(|(_, full)| *full).map(|(square, _)| square);
    full.min_by_key(|square| Counter::keyed(0, square).bits()).map(name)
}

/// The whole metres of the world in which a place lies.
fn square(at: DVec2, frame: &Frame) -> [i64; 2] {
    let world = frame.to_world(DVec3::new(at.x, at.y, 0.0));
    [world.x.floor() as i64, world.y.floor() as i64]
}

fn name([x, y]: [i64; 2]) -> String {
    format!("b{}{}", signed(x), signed(y))
}

/// `-12` for 12 and `-m12` for −12: a sign that cannot be taken for a separator.
fn signed(value: i64) -> String {
    if value < 0 { format!("-m{}", -value) } else { format!("-{value}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Crs, dvec2};
    use gable_raster::GridWindow;

    #[test]
    fn names_are_places_and_unique() {
        let frame = Frame { origin: [84_000.0, 446_000.0, 0.0], crs: Crs::Epsg(7415) };
        let ids = building_ids(&[dvec2(512.3, 120.9), dvec2(512.9, 120.1), dvec2(-85_000.5, 3.0)], &frame);
        assert_eq!(ids, ["b-84512-446120", "b-84512-446120.2", "b-m1001-446003"]);
    }

    #[test]
    fn a_part_is_named_after_a_square_that_it_fills() {
        let frame = Frame { origin: [100.0, 200.0, 0.0], crs: Crs::Epsg(7415) };
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 50, height: 50 };
        let of = |inside: &dyn Fn(DVec2) -> bool| {
            let pixels = (0..2500).map(|p| inside(window.centre(p % 50, p / 50))).collect();
            part_id(&Raster::new(window, pixels), &frame)
        };
        let fills = |id: Option<String>, inside: &dyn Fn(DVec2) -> bool| {
            let id = id.expect("it fills a square");
            let [_, x, y] = id.split('-').collect::<Vec<_>>()[..] else { panic!("{id}") };
            let corner = dvec2(x.parse::<f64>().unwrap() - 100.0, y.parse::<f64>().unwrap() - 200.0);
            [0.1, 0.9].iter().all(|&u| [0.1, 0.9].iter().all(|&v| inside(corner + dvec2(u, v))))
        };
        let shapes: [&dyn Fn(DVec2) -> bool; 3] =
            [&|p| p.x < 2.0 || p.y < 1.0, &|p| p.x >= 3.0 && p.y >= 3.0, &|p| p.x < 9.0 && p.y < 9.0];
        for inside in shapes {
            assert!(fills(of(inside), inside));
        }
        assert_eq!(of(&|p| p.x > 4.3 && p.x < 5.9), None, "it is nowhere as wide as a square");
    }

    #[test]
    fn a_building_that_changes_a_little_keeps_its_name() {
        let window = GridWindow { step: 0.5, x0: 0, y0: 0, width: 40, height: 30 };
        let of = |frame: &Frame, length: f64| {
            let inside = |p: DVec2| p.x > 1.0 && p.x < 1.0 + length && p.y > 1.0 && p.y < 11.0;
            let pixels = (0..window.len()).map(|p| inside(window.centre(p % 40, p / 40))).collect();
            part_id(&Raster::new(window, pixels), frame)
        };
        // 10 × 10 m in many places; a metre more of it, then half as much again.
        let kept = |length: f64| {
            let places =
                (0..500).map(|n| Frame { origin: [f64::from(n * 37), f64::from(n * n), 0.0], crs: Crs::Unknown });
            places.filter(|frame| of(frame, 10.0) == of(frame, length)).count()
        };
        assert_eq!(kept(10.0), 500);
        assert!((435..=475).contains(&kept(11.0)), "{} of 500", kept(11.0));
        assert!((300..=365).contains(&kept(15.0)), "{} of 500", kept(15.0));
    }
}
