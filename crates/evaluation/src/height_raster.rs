//! The highest of a set of triangles above each pixel of a window.

use gable_city_model::Terrain;
use gable_geometry::{Box2, DVec2, DVec3, dvec2};

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// Heights seen from above. Pixels lie on the absolute lattice of `step` and stand for their centres; row 0 is the
/// southern one.
#[derive(Clone, Debug)]
pub(crate) struct HeightRaster {
    pub(crate) step: f64,
    pub(crate) x0: i64,
    pub(crate) y0: i64,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Height of the highest triangle, where [`HeightRaster::tag`] is not [`NONE`].
    pub(crate) z: Vec<f64>,
    /// Tag of the highest triangle.
    pub(crate) tag: Vec<u32>,
}

impl HeightRaster {
    /// An empty raster that covers a box.
    pub(crate) fn covering(bounds: Box2, step: f64) -> Self {
        let low = (bounds.min / step).floor();
        let high = (bounds.max / step).ceil();
        let size = (high - low).max(dvec2(0.0, 0.0));
        let (width, height) = if bounds.is_empty() { (0, 0) } else { (size.x as usize, size.y as usize) };
        Self {
            step,
            x0: low.x as i64,
            y0: low.y as i64,
            width,
            height,
            z: vec![f64::NEG_INFINITY; width * height],
            tag: vec![NONE; width * height],
        }
    }

    /// Draws the triangles of a terrain; `shift` is added to its coordinates.
    pub(crate) fn draw_terrain(&mut self, terrain: &Terrain, shift: DVec3) {
        for triangle in &terrain.triangles {
            let corner = |i: u32| terrain.vertices.get(i as usize).copied();
            if let [Some(a), Some(b), Some(c)] = triangle.map(corner) {
                self.draw([a, b, c].map(|p| p + shift), 0);
            }
        }
    }

    /// Height of the pixel that holds a place, if a triangle covers it.
    pub(crate) fn at(&self, p: DVec2) -> Option<f64> {
        let cell = (p / self.step).floor() - dvec2(self.x0 as f64, self.y0 as f64);
        let inside = cell.x >= 0.0 && cell.y >= 0.0 && cell.x < self.width as f64 && cell.y < self.height as f64;
        let at = if inside { cell.y as usize * self.width + cell.x as usize } else { return None };
        (self.tag[at] != NONE).then_some(self.z[at])
    }

    /// Draws a triangle; vertical ones leave nothing.
    pub(crate) fn draw(&mut self, corners: [DVec3; 3], tag: u32) {
        let [a, b, c] = corners.map(|p| {
            let at = p.truncate() / self.step - dvec2(self.x0 as f64 + 0.5, self.y0 as f64 + 0.5);
            at.extend(p.z)
        });
        let det = (b - a).truncate().perp_dot((c - a).truncate());
        if det.abs() < 1e-9 || !det.is_finite() {
            return;
        }
        let row = |y: f64, up: bool| if up { y.ceil() } else { y.floor() };
        let first = row(a.y.min(b.y).min(c.y), true).max(0.0) as usize;
        let last = row(a.y.max(b.y).max(c.y), false).min(self.height as f64 - 1.0);
        if last < 0.0 {
            return;
        }
        let slope = {
            let (u, v) = (b - a, c - a);
            dvec2(u.z * v.y - v.z * u.y, v.z * u.x - u.z * v.x) / det
        };
        for j in first..=last as usize {
            let y = j as f64;
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if (p.y - y) * (q.y - y) <= 0.0 {
                    if p.y == q.y {
                        low = low.min(p.x.min(q.x));
                        high = high.max(p.x.max(q.x));
                    } else {
                        let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
                        low = low.min(x);
                        high = high.max(x);
                    }
                }
            }
            let from = low.ceil().max(0.0);
            let to = high.floor().min(self.width as f64 - 1.0);
            if from > to {
                continue;
            }
            for i in from as usize..=to as usize {
                let z = a.z + slope.x * (i as f64 - a.x) + slope.y * (y - a.y);
                let at = j * self.width + i;
                if self.tag[at] == NONE || z > self.z[at] {
                    self.z[at] = z;
                    self.tag[at] = tag;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::city::height_at;
    use gable_geometry::{Counter, dvec3};

    #[test]
    fn agrees_with_the_height_above_every_centre() {
        let mut random = Counter::new(2);
        for _ in 0..50 {
            let mut point = || dvec3(random.range(-3., 9.), random.range(-3., 9.), random.range(0., 5.));
            let triangles = [[point(), point(), point()], [point(), point(), point()]];
            let mut raster = HeightRaster::covering(Box2 { min: dvec2(0., 0.), max: dvec2(6., 6.) }, 0.25);
            for (tag, t) in triangles.iter().enumerate() {
                raster.draw(*t, tag as u32);
            }
            let mut different = 0;
            for j in 0..raster.height {
                for i in 0..raster.width {
                    let at = dvec2(i as f64 + 0.5, j as f64 + 0.5) * 0.25;
                    let exact = triangles.iter().filter_map(|&t| height_at(t, at)).reduce(f64::max);
                    let found = (raster.tag[j * 24 + i] != NONE).then_some(raster.z[j * 24 + i]);
                    match (exact, found) {
                        (Some(e), Some(f)) => assert!((e - f).abs() < 1e-6, "{e} {f}"),
                        (None, None) => {}
                        // Centres on a side may fall either way.
                        _ => different += 1,
                    }
                }
            }
            assert!(different <= 1);
        }
    }

    #[test]
    fn shared_sides_leave_no_gap() {
        let mut raster = HeightRaster::covering(Box2 { min: dvec2(0., 0.), max: dvec2(2., 2.) }, 0.25);
        let [a, b, c, d] = [dvec3(0., 0., 1.), dvec3(2., 0., 1.), dvec3(2., 2., 1.), dvec3(0., 2., 1.)];
        raster.draw([a, b, c], 0);
        raster.draw([a, c, d], 1);
        assert_eq!((raster.width, raster.height), (8, 8));
        assert!(raster.z.iter().all(|&z| z == 1.0));
    }
}
