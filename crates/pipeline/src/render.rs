//! A small software renderer for the report's pictures: planar polygons under a parallel camera, with a
//! depth buffer, sun, cast shadows and darkened creases.
//!
//! Polygons with holes are filled by even-odd scan lines straight on the screen, so nothing is triangulated;
//! under a parallel projection the depth of a plane is affine on the screen. Shading is deferred: the canvas
//! keeps albedo, normal and depth, and light is computed once for each pixel. Memory is about 10 bytes for
//! each sample and does not depend on the number of polygons; time is linear in covered samples.

use gable_geometry::{Box2, DVec2, DVec3, dvec2, dvec3};
use image::{Rgba, RgbaImage};

/// Samples along each edge of a pixel.
const SUPERSAMPLING: usize = 2;

/// Shadow tests ignore occluders nearer than this, metres.
const SHADOW_BIAS: f64 = 0.35;

/// A parallel projection: where it looks, and which part of the picture plane it shows.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Picture-plane coordinates of the picture's left top corner, metres.
    corner: DVec2,
    /// Metres for each sample.
    scale: f64,
    /// Samples across and down.
    size: (usize, usize),
}

impl Camera {
    /// A camera that looks along `azimuth` (degrees clockwise from north) and down by `elevation` (degrees; 90
    /// looks straight down), and shows all of `points` in a picture of at most `width` × `height` pixels.
    #[must_use]
    pub fn showing(
        azimuth: f64,
        elevation: f64,
        points: impl IntoIterator<Item = DVec3>,
        width: usize,
        height: usize,
    ) -> Self {
        let (sa, ca) = azimuth.to_radians().sin_cos();
        let (se, ce) = elevation.to_radians().sin_cos();
        let right = dvec3(ca, -sa, 0.0);
        let forward = dvec3(sa * ce, ca * ce, -se);
        let up = right.cross(forward);
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in points {
            let q = dvec2(p.dot(right), p.dot(up));
            (low, high) = (low.min(q), high.max(q));
        }
        if !low.is_finite() || !high.is_finite() {
            (low, high) = (DVec2::ZERO, DVec2::ONE);
        }
        let extent = (high - low).max(DVec2::splat(1e-3));
        let (columns, rows) = ((width.max(1) * SUPERSAMPLING) as f64, (height.max(1) * SUPERSAMPLING) as f64);
        let scale = (extent.x / columns).max(extent.y / rows);
        let fit = |length: f64| ((length / scale / SUPERSAMPLING as f64).ceil() as usize).max(1) * SUPERSAMPLING;
        Self { right, up, forward, corner: dvec2(low.x, high.y), scale, size: (fit(extent.x), fit(extent.y)) }
    }

    /// Sample coordinates and depth (metres along the view, smaller is nearer) of a point.
    fn project(&self, p: DVec3) -> DVec3 {
        dvec3(
            (p.dot(self.right) - self.corner.x) / self.scale,
            (self.corner.y - p.dot(self.up)) / self.scale,
            p.dot(self.forward),
        )
    }

    /// The point at sample coordinates and depth.
    fn unproject(&self, x: f64, y: f64, depth: f64) -> DVec3 {
        self.right * (self.corner.x + x * self.scale)
            + self.up * (self.corner.y - y * self.scale)
            + self.forward * depth
    }

    /// Pixel coordinates of a point in the finished picture.
    #[must_use]
    pub fn pixel(&self, p: DVec3) -> DVec2 {
        self.project(p).truncate() / SUPERSAMPLING as f64
    }
}

/// How light falls.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Towards the sun, unit length.
    pub sun: DVec3,
    /// Share of the light that comes from everywhere, 0 to 1.
    pub ambient: f64,
    /// Whether creases and silhouettes are darkened.
    pub creases: bool,
}

impl Default for Light {
    fn default() -> Self {
        Self { sun: dvec3(-0.75, -0.3, 0.8).normalize(), ambient: 0.56, creases: true }
    }
}

/// A picture under way: polygons are filled in any order.
#[derive(Debug)]
pub struct Canvas {
    camera: Camera,
    albedo: Vec<[u8; 3]>,
    normal: Vec<[i8; 3]>,
    depth: Vec<f32>,
    shadow: Option<ShadowMap>,
    clip: Option<Box2>,
    crossings: Vec<f64>,
    projected: Vec<DVec3>,
}

#[derive(Debug)]
struct ShadowMap {
    camera: Camera,
    depth: Vec<f32>,
}

impl Canvas {
    /// An empty picture. With `shadows_over`, the corners of the scene's bounding box, shadows are cast.
    #[must_use]
    pub fn new(camera: Camera, light: &Light, shadows_over: Option<[DVec3; 2]>) -> Self {
        let samples = camera.size.0 * camera.size.1;
        let shadow = shadows_over.map(|[low, high]| {
            let elevation = light.sun.z.clamp(-1.0, 1.0).asin().to_degrees();
            let azimuth = (-light.sun.x).atan2(-light.sun.y).to_degrees();
            let corners = (0..8).map(|i| {
                let pick = |bit: usize, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
                dvec3(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
            });
            let (width, height) = (camera.size.0 / SUPERSAMPLING, camera.size.1 / SUPERSAMPLING);
            let side = width.max(height);
            let camera = Camera::showing(azimuth, elevation, corners, side, side);
            ShadowMap { camera, depth: vec![f32::INFINITY; camera.size.0 * camera.size.1] }
        });
        Self {
            camera,
            albedo: vec![[0; 3]; samples],
            normal: vec![[0; 3]; samples],
            depth: vec![f32::INFINITY; samples],
            shadow,
            clip: None,
            crossings: Vec::new(),
            projected: Vec::new(),
        }
    }

    /// Shows from now on only what stands over `bounds`.
    pub fn clip(&mut self, bounds: Box2) {
        self.clip = Some(bounds);
    }

    /// Fills a planar polygon: rings of points, inside by the even-odd rule. Both sides are shown.
    pub fn fill(&mut self, rings: &[&[DVec3]], colour: [u8; 3]) {
        let mut normal = newell(rings);
        if normal == DVec3::ZERO {
            return;
        }
        if normal.dot(self.camera.forward) > 0.0 {
            normal = -normal;
        }
        let packed = (normal * 127.0).to_array().map(|v| v.round() as i8);
        let (camera, width) = (self.camera, self.camera.size.0);
        // Most polygons lie wholly inside and need no test for each sample.
        let clip = self.clip.filter(|b| !rings.iter().flat_map(|r| r.iter()).all(|p| b.contains(p.truncate())));
        let hidden = |camera: &Camera, x: usize, y: usize, depth: f32| {
            clip.is_some_and(|b| {
                !b.contains(camera.unproject(x as f64 + 0.5, y as f64 + 0.5, f64::from(depth)).truncate())
            })
        };
        let mut scan = Scan { crossings: &mut self.crossings, projected: &mut self.projected };
        let (albedo, normals, depths) = (&mut self.albedo, &mut self.normal, &mut self.depth);
        scan.polygon(&camera, rings, |x, y, depth| {
            let i = y * width + x;
            if depth < depths[i] && !hidden(&camera, x, y, depth) {
                (depths[i], albedo[i], normals[i]) = (depth, colour, packed);
            }
        });
        if let Some(ShadowMap { camera, depth: map }) = &mut self.shadow {
            let width = camera.size.0;
            scan.polygon(camera, rings, |x, y, depth| {
                let value = &mut map[y * width + x];
                if depth < *value && !hidden(camera, x, y, depth) {
                    *value = depth;
                }
            });
        }
    }

    /// The finished picture; transparent where nothing was drawn.
    #[must_use]
    pub fn finish(&self, light: &Light) -> RgbaImage {
        let (columns, rows) = self.camera.size;
        let mut picture = RgbaImage::new((columns / SUPERSAMPLING) as u32, (rows / SUPERSAMPLING) as u32);
        for (px, py, out) in picture.enumerate_pixels_mut() {
            let mut sum = [0.0; 3];
            let mut covered = 0;
            for dy in 0..SUPERSAMPLING {
                for dx in 0..SUPERSAMPLING {
                    let (x, y) = (px as usize * SUPERSAMPLING + dx, py as usize * SUPERSAMPLING + dy);
                    if let Some(colour) = self.shade(x, y, light) {
                        covered += 1;
                        (0..3).for_each(|c| sum[c] += colour[c]);
                    }
                }
            }
            if covered > 0 {
                let [r, g, b] = sum.map(|v| (v / f64::from(covered)).round().clamp(0.0, 255.0) as u8);
                let alpha = (255 * covered / (SUPERSAMPLING * SUPERSAMPLING) as i32) as u8;
                *out = Rgba([r, g, b, alpha]);
            }
        }
        picture
    }

    /// Colour of one sample in the light, 0 to 255; `None` where nothing was drawn.
    fn shade(&self, x: usize, y: usize, light: &Light) -> Option<[f64; 3]> {
        let i = y * self.camera.size.0 + x;
        let depth = self.depth[i];
        if depth == f32::INFINITY {
            return None;
        }
        let normal = self.normal_at(i);
        let facing = normal.dot(light.sun).max(0.0);
        let lit = if facing > 0.0 && self.in_shadow(x, y, f64::from(depth), normal) { 0.0 } else { facing };
        let sky = 0.85 + 0.15 * normal.z;
        let mut strength = light.ambient * sky + (1.15 - light.ambient) * lit;
        if light.creases && self.crease(x, y) {
            strength *= 0.72;
        }
        Some(self.albedo[i].map(|v| f64::from(v) * strength))
    }

    fn normal_at(&self, i: usize) -> DVec3 {
        let [x, y, z] = self.normal[i].map(f64::from);
        dvec3(x, y, z) / 127.0
    }

    /// Whether something stands between the sample and the sun.
    fn in_shadow(&self, x: usize, y: usize, depth: f64, normal: DVec3) -> bool {
        let Some(ShadowMap { camera, depth: map }) = &self.shadow else { return false };
        let p = self.camera.unproject(x as f64 + 0.5, y as f64 + 0.5, depth) + normal * camera.scale;
        let q = camera.project(p);
        if q.x < 0.0 || q.y < 0.0 || q.x >= camera.size.0 as f64 || q.y >= camera.size.1 as f64 {
            return false;
        }
        q.z > f64::from(map[q.y as usize * camera.size.0 + q.x as usize]) + SHADOW_BIAS + camera.scale
    }

    /// Whether the sample lies beside another surface: a fold of over 20° or a step in depth.
    fn crease(&self, x: usize, y: usize) -> bool {
        let (columns, rows) = self.camera.size;
        let i = y * columns + x;
        let here = self.normal_at(i);
        let step = (6.0 * self.camera.scale).max(0.5);
        let differs = |j: usize| {
            let gap = f64::from(self.depth[j]) - f64::from(self.depth[i]);
            gap > step || (gap.abs() <= step && self.normal_at(j).dot(here) < 0.94)
        };
        (x + 1 < columns && differs(i + 1)) || (y + 1 < rows && differs(i + columns))
    }
}

/// Unit normal of a planar polygon by Newell's method; zero if it has no area.
fn newell(rings: &[&[DVec3]]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for ring in rings.iter().filter(|r| !r.is_empty()) {
        let origin = ring[0];
        for k in 1..ring.len().saturating_sub(1) {
            sum += (ring[k] - origin).cross(ring[k + 1] - origin);
        }
    }
    sum.normalize_or_zero()
}

/// Scan conversion with buffers that are used again.
struct Scan<'a> {
    crossings: &'a mut Vec<f64>,
    projected: &'a mut Vec<DVec3>,
}

impl Scan<'_> {
    /// Calls `plot(column, row, depth)` for each sample whose centre the polygon covers.
    fn polygon(&mut self, camera: &Camera, rings: &[&[DVec3]], mut plot: impl FnMut(usize, usize, f32)) {
        self.projected.clear();
        self.projected.extend(rings.iter().flat_map(|r| r.iter()).map(|&p| camera.project(p)));
        let Some(&first) = self.projected.first() else { return };
        let (mut low, mut high) = (first.y, first.y);
        for p in &*self.projected {
            (low, high) = (low.min(p.y), high.max(p.y));
        }
        if !(low.is_finite() && high.is_finite()) {
            return;
        }
        // The plane on the screen: depth = first.z + slope · (x − first.x, y − first.y).
        let mut n = DVec3::ZERO;
        let mut start = 0;
        for ring in rings {
            let ring = &self.projected[start..start + ring.len()];
            start += ring.len();
            for k in 1..ring.len().saturating_sub(1) {
                n += (ring[k] - ring[0]).cross(ring[k + 1] - ring[0]);
            }
        }
        if n.z.abs() < 1e-12 {
            return;
        }
        let slope = dvec2(-n.x / n.z, -n.y / n.z);
        let rows = camera.size.1 as f64;
        let top = (low - 0.5).ceil().clamp(0.0, rows) as usize;
        let bottom = ((high - 0.5).floor() + 1.0).clamp(0.0, rows) as usize;
        for row in top..bottom {
            let y = row as f64 + 0.5;
            self.crossings.clear();
            let mut start = 0;
            for ring in rings {
                let ring = &self.projected[start..start + ring.len()];
                start += ring.len();
                let Some(mut a) = ring.last() else { continue };
                for b in ring {
                    if (a.y <= y) != (b.y <= y) {
                        self.crossings.push(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
                    }
                    a = b;
                }
            }
            self.crossings.sort_unstable_by(f64::total_cmp);
            for pair in self.crossings.chunks_exact(2) {
                let columns = camera.size.0 as f64;
                let left = (pair[0] - 0.5).ceil().clamp(0.0, columns) as usize;
                let right = ((pair[1] - 0.5).ceil()).clamp(0.0, columns) as usize;
                for column in left..right {
                    let x = column as f64 + 0.5;
                    let depth = first.z + slope.x * (x - first.x) + slope.y * (y - first.y);
                    plot(column, row, depth as f32);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64, z: f64) -> Vec<DVec3> {
        vec![dvec3(0.0, 0.0, z), dvec3(side, 0.0, z), dvec3(side, side, z), dvec3(0.0, side, z)]
    }

    fn from_above(side: f64, pixels: usize) -> Camera {
        Camera::showing(0.0, 90.0, square(side, 0.0), pixels, pixels)
    }

    const FLAT: Light = Light { sun: DVec3::Z, ambient: 0.12, creases: false };

    #[test]
    fn the_nearer_surface_is_seen_whatever_the_order() {
        for swap in [false, true] {
            let mut canvas = Canvas::new(from_above(10.0, 20), &FLAT, None);
            let (low, high) = (square(10.0, 0.0), square(5.0, 3.0));
            let mut order = [(&low, [200, 0, 0]), (&high, [0, 200, 0])];
            if swap {
                order.reverse();
            }
            for (ring, colour) in order {
                canvas.fill(&[ring], colour);
            }
            let picture = canvas.finish(&FLAT);
            // The higher square covers the south-western quarter: the lower left one of the picture.
            assert!(picture.get_pixel(4, 15).0[1] > 100 && picture.get_pixel(4, 15).0[0] == 0);
            assert!(picture.get_pixel(15, 4).0[0] > 100 && picture.get_pixel(15, 4).0[1] == 0);
        }
    }

    #[test]
    fn holes_stay_open() {
        let mut canvas = Canvas::new(from_above(10.0, 20), &FLAT, None);
        let hole: Vec<_> = square(4.0, 0.0).into_iter().map(|p| p + dvec3(3.0, 3.0, 0.0)).collect();
        canvas.fill(&[&square(10.0, 0.0), &hole], [255; 3]);
        let picture = canvas.finish(&FLAT);
        assert_eq!((picture.get_pixel(10, 10).0[3], picture.get_pixel(2, 2).0[3]), (0, 255));
        let open = picture.pixels().filter(|p| p.0[3] == 0).count();
        assert_eq!(open, 64, "a hole of 4 m × 4 m has 8 × 8 pixels of 0.5 m");
    }

    #[test]
    fn what_stands_outside_is_not_shown() {
        let mut canvas = Canvas::new(from_above(10.0, 20), &FLAT, None);
        canvas.clip(Box2 { min: dvec2(0.0, 0.0), max: dvec2(5.0, 20.0) });
        canvas.fill(&[&square(10.0, 2.0)], [255; 3]);
        let picture = canvas.finish(&FLAT);
        assert_eq!((picture.get_pixel(8, 10).0[3], picture.get_pixel(12, 10).0[3]), (255, 0));
    }

    #[test]
    fn a_roof_casts_its_shadow() {
        let light = Light { sun: dvec3(-1.0, 0.0, 1.0).normalize(), ambient: 0.5, creases: false };
        let mut canvas = Canvas::new(from_above(10.0, 20), &light, Some([DVec3::ZERO, dvec3(10.0, 10.0, 4.0)]));
        canvas.fill(&[&square(10.0, 0.0)], [200; 3]);
        let roof: Vec<_> = square(2.0, 4.0).into_iter().map(|p| p + dvec3(1.0, 4.0, 0.0)).collect();
        canvas.fill(&[&roof], [200; 3]);
        let picture = canvas.finish(&light);
        // The sun is in the west at 45°: the shadow of the roof at x 1–3 m falls on x 5–7 m.
        let at = |x: f64, y: f64| picture.get_pixel((x * 2.0) as u32, (20.0 - y * 2.0) as u32).0[0];
        assert!(at(6.0, 5.0) < at(8.5, 5.0), "{} {}", at(6.0, 5.0), at(8.5, 5.0));
        assert_eq!(at(8.5, 5.0), at(6.0, 8.5));
        assert_eq!(at(2.0, 5.0), at(8.5, 5.0), "the roof itself is lit");
    }

    #[test]
    fn degenerate_polygons_draw_nothing() {
        let mut canvas = Canvas::new(from_above(10.0, 20), &FLAT, None);
        canvas.fill(&[], [255; 3]);
        canvas.fill(&[&[]], [255; 3]);
        canvas.fill(&[&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0]], [255; 3]);
        canvas.fill(&[&[DVec3::ZERO, DVec3::NAN, DVec3::Y]], [255; 3]);
        assert!(canvas.finish(&FLAT).pixels().all(|p| p.0[3] == 0));
    }
}
