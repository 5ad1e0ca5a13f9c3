//! Wall evidence: the area of steep triangles, spread over the pixels of their projection.

use crate::WallEvidence;
use crate::scan::floor;
use gable_blocks::BlockTriangle;
use gable_geometry::DVec3;
use gable_raster::{GridWindow, Raster};

/// Fixed-point units per m²: sums of whole numbers do not depend on the order of the triangles.
const UNITS: f64 = (1u32 << 20) as f64;

/// What is gathered over one pixel.
#[derive(Clone, Copy, Debug)]
struct Sum {
    area: i64,
    normal: [i64; 2],
    z_min: f32,
    z_max: f32,
}

/// Gathers wall evidence over a window.
pub(crate) struct WallCollector {
    window: GridWindow,
    /// Index into `sums` plus one, 0 for none: few pixels have a wall.
    slots: Vec<u32>,
    sums: Vec<Sum>,
}

impl WallCollector {
    pub(crate) fn new(window: GridWindow) -> Self {
        Self { window, slots: vec![0; window.len()], sums: Vec::new() }
    }

    /// Spreads a steep triangle. It is cut along the lattice lines, column by column and cell by cell, each cut
    /// starting from the triangle itself: a cell's share does not depend on the window. Shares add up to the
    /// triangle's area within 10⁻⁶ m² per cell. A triangle without area is ignored.
    pub(crate) fn add(&mut self, triangle: &BlockTriangle) {
        let corners = triangle.positions();
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let horizontal = cross.truncate().normalize_or_zero();
        let step = self.window.step;
        let cell = |v: f64| floor(v / step);
        let range = |axis: usize, polygon: &Clip, from: i64, count: usize| {
            let (low, high) = polygon.extent(axis);
            let (low, high) = (cell(low), cell(high));
            (low.max(from)..=high.min(from + count as i64 - 1), low == high)
        };
        let whole = Clip::new(&corners);
        let (columns, one_column) = range(0, &whole, self.window.x0, self.window.width);
        for x in columns {
            let strip = if one_column { whole } else { whole.between(0, x as f64 * step, (x + 1) as f64 * step) };
            if strip.count < 3 {
                continue;
            }
            let (rows, one_row) = range(1, &strip, self.window.y0, self.window.height);
            for y in rows {
                let part = if one_row { strip } else { strip.between(1, y as f64 * step, (y + 1) as f64 * step) };
                let area = part.area();
                if area > 0.0 {
                    let (low, high) = part.extent(2);
                    let index = (y - self.window.y0) as usize * self.window.width + (x - self.window.x0) as usize;
                    self.put(index, area, [area * horizontal.x, area * horizontal.y], low as f32, high as f32);
                }
            }
        }
    }

    fn put(&mut self, index: usize, area: f64, normal: [f64; 2], z_min: f32, z_max: f32) {
        let units = |v: f64| floor(v * UNITS + 0.5);
        if self.slots[index] == 0 {
            self.sums.push(Sum { area: 0, normal: [0; 2], z_min, z_max });
            self.slots[index] = self.sums.len() as u32;
        }
        let sum = &mut self.sums[self.slots[index] as usize - 1];
        sum.area += units(area);
        sum.normal[0] += units(normal[0]);
        sum.normal[1] += units(normal[1]);
        sum.z_min = sum.z_min.min(z_min);
        sum.z_max = sum.z_max.max(z_max);
    }

    /// The evidence of each pixel, row by row.
    pub(crate) fn finish(self) -> Raster<WallEvidence> {
        let evidence = |slot: &u32| {
            let Some(sum) = (*slot as usize).checked_sub(1).map(|i| &self.sums[i]).filter(|s| s.area > 0) else {
                return WallEvidence::default();
            };
            WallEvidence {
                area: (sum.area as f64 / UNITS) as f32,
                normal: sum.normal.map(|n| (n as f64 / sum.area as f64) as f32),
                z_min: sum.z_min,
                z_max: sum.z_max,
            }
        };
        Raster::new(self.window, self.slots.iter().map(evidence).collect())
    }
}

/// A convex planar polygon in space, in the course of being clipped (a triangle cut by four planes has at most seven
/// corners).
#[derive(Clone, Copy)]
struct Clip {
    corners: [DVec3; 8],
    count: usize,
}

impl Clip {
    fn new(triangle: &[DVec3; 3]) -> Self {
        let mut corners = [DVec3::ZERO; 8];
        corners[..3].copy_from_slice(triangle);
        Self { corners, count: 3 }
    }

    fn points(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Smallest and largest coordinate along an axis.
    fn extent(&self, axis: usize) -> (f64, f64) {
        let values = self.points().iter().map(|p| p[axis]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }

    fn area(&self) -> f64 {
        let p = self.points();
        let fan = (2..p.len()).map(|i| (p[i - 1] - p[0]).cross(p[i] - p[0]));
        0.5 * fan.fold(DVec3::ZERO, |sum, c| sum + c).length()
    }

    /// The part with coordinates from `low` to `high` along an axis.
    fn between(&self, axis: usize, low: f64, high: f64) -> Self {
        self.half(axis, low, 1.0).half(axis, high, -1.0)
    }

    /// Sutherland–Hodgman on one side of a plane.
    fn half(&self, axis: usize, at: f64, sign: f64) -> Self {
        let mut out = Self { corners: [DVec3::ZERO; 8], count: 0 };
        let inside = |p: DVec3| sign * (p[axis] - at);
        for (i, &p) in self.points().iter().enumerate() {
            let q = self.corners[(i + 1) % self.count];
            let (dp, dq) = (inside(p), inside(q));
            if dp >= 0.0 {
                out.push(p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                out.push(p + (q - p) * (dp / (dp - dq)));
            }
        }
        out
    }

    fn push(&mut self, p: DVec3) {
        // Rounding can make a corner more than geometry allows; it would lie on an edge.
        if self.count < self.corners.len() {
            self.corners[self.count] = p;
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_blocks::UNITS_PER_METRE;
    use proptest::prelude::*;

    fn triangle(corners: [[f64; 3]; 3]) -> BlockTriangle {
        BlockTriangle {
            corners: corners.map(|c| c.map(|v| (v * UNITS_PER_METRE).round() as i32)),
            ..Default::default()
        }
    }

    fn collect(t: &BlockTriangle, window: GridWindow) -> Raster<WallEvidence> {
        let mut walls = WallCollector::new(window);
        walls.add(t);
        walls.finish()
    }

    #[test]
    fn a_vertical_wall_keeps_its_area_and_faces_out() {
        // Two triangles of a wall 6 m long and 3 m high that faces south-east.
        let (a, b) = ([0.3, 0.1], [4.542_641, 4.342_641]);
        let at = |p: [f64; 2], z: f64| [p[0], p[1], z];
        let window = GridWindow { step: 0.2, x0: -5, y0: -5, width: 60, height: 60 };
        let mut walls = WallCollector::new(window);
        walls.add(&triangle([at(a, 1.0), at(b, 1.0), at(b, 4.0)]));
        walls.add(&triangle([at(a, 1.0), at(b, 4.0), at(a, 4.0)]));
        let walls = walls.finish();
        let total: f64 = walls.values().iter().map(|w| f64::from(w.area)).sum();
        assert!((total - 18.0).abs() < 1e-3, "{total}");
        for w in walls.values().iter().filter(|w| w.area > 0.01) {
            assert!((w.normal[0] - 0.5f32.sqrt()).abs() < 1e-3 && (w.normal[1] + 0.5f32.sqrt()).abs() < 1e-3);
            assert!(w.z_min >= 1.0 && w.z_max <= 4.0 && w.z_max > w.z_min);
        }
    }

    proptest! {
        #[test]
        fn shares_add_up_and_do_not_depend_on_the_window(
            c in prop::array::uniform3((-3.0..3.0f64, -3.0..3.0f64, 0.0..9.0f64)),
            flat in 0usize..3,
        ) {
            let mut corners = c.map(|(x, y, z)| [x, y, z]);
            // Also triangles that stand in a lattice plane.
            if flat < 2 {
                corners.iter_mut().for_each(|p| p[flat] = 1.0);
            }
            let t = triangle(corners);
            let p = t.positions();
            let area = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).length();
            let window = GridWindow { step: 0.5, x0: -8, y0: -8, width: 16, height: 16 };
            let all = collect(&t, window);
            let total: f64 = all.values().iter().map(|w| f64::from(w.area)).sum();
            prop_assert!((total - area).abs() < 3e-4, "{} of {}", total, area);
            let part = GridWindow { x0: -2, y0: -3, width: 5, height: 9, ..window };
            prop_assert_eq!(collect(&t, part), all.crop(part, WallEvidence::default()));
        }
    }
}
