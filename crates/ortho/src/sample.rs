//! Orthographic sampling (Zhu 2018, §4) by z-buffer rasterisation instead of rays.

use crate::orthograph::quantised_normal;
use crate::scan::{Gradients, ScanTriangle};
use crate::texture::Footprint;
use crate::walls::WallCollector;
use crate::{Orthograph, TextureSource};
use gable_blocks::{BlockMesh, BlockTriangle};
use gable_geometry::{DVec2, DVec3};
use gable_raster::{GridWindow, Raster};
use rayon::prelude::*;
use std::cmp::Ordering;

/// No triangle.
const NONE: u32 = u32::MAX;
/// Rows of a band, at least: bands are the unit of parallel work.
const MIN_BAND: usize = 64;

/// Parameters of [`sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleParams {
    /// Triangles that stand within this angle of the vertical are walls, radians (default 25°).
    pub wall_angle: f64,
}

impl Default for SampleParams {
    fn default() -> Self {
        Self { wall_angle: 25f64.to_radians() }
    }
}

/// What a mesh looks like from straight above, on one window.
///
/// 1. Each triangle is scanned into a z-buffer; the highest surface at a pixel's centre wins. Equal heights are
///    decided by content (the flatter triangle, then corners, texture coordinates, material).
/// 2. Visible triangles are scanned again, material by material, and their pixels get normal and colour: the texture
///    averaged over the pixel's footprint, vertex colours, or the material's colour.
/// 3. The area of steep triangles, seen or not, is spread over the pixels of their projection.
///
/// The value of a pixel depends only on the triangles over it: not on the window, the order of the triangles or the
/// number of threads. Cost: O(triangles + covered pixels).
pub fn sample(mesh: &BlockMesh, window: GridWindow, textures: &dyn TextureSource, params: &SampleParams) -> Orthograph {
    if window.is_empty() {
        return Orthograph::empty(window);
    }
    let bands = (2 * rayon::current_num_threads()).min(window.height.div_ceil(MIN_BAND)).max(1);
    // One thread gains nothing from bands and would look at each triangle more than once.
    let bands = if rayon::current_num_threads() == 1 { 1 } else { bands };
    let rows = window.height.div_ceil(bands);
    let parts: Vec<_> = (0..window.height)
        .step_by(rows)
        .map(|row| GridWindow { y0: window.y0 + row as i64, height: rows.min(window.height - row), ..window })
        .collect();
    let sampled: Vec<_> = parts.into_par_iter().map(|part| sample_band(mesh, part, textures, params)).collect();
    let mut sampled = sampled;
    if sampled.len() == 1
        && let Some(whole) = sampled.pop()
    {
        return whole;
    }
    let mut out = Orthograph::empty(window);
    for part in &sampled {
        out.paste(part);
    }
    out
}

fn sample_band(
    mesh: &BlockMesh,
    window: GridWindow,
    textures: &dyn TextureSource,
    params: &SampleParams,
) -> Orthograph {
    let flattest_wall = params.wall_angle.sin();
    let reach = Reach::new(&window);
    let mut top = Top { height: vec![f32::NEG_INFINITY; window.len()], triangle: vec![NONE; window.len()] };
    let mut walls = WallCollector::new(window);
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        if !reach.touches(triangle) {
            continue;
        }
        top.draw(mesh, index as u32, &window);
        let [a, b, c] = triangle.positions();
        let cross = (b - a).cross(c - a);
        if cross.z * cross.z < flattest_wall * flattest_wall * cross.length_squared() {
            walls.add(triangle);
        }
    }
    let mut out = Orthograph {
        height: Raster::filled(window, 0.0),
        colour: Raster::filled(window, [0; 3]),
        photographed: Raster::filled(window, false),
        normal: Raster::filled(window, [0.0; 3]),
        walls: walls.finish(),
    };
    top.shade(mesh, textures, &mut out);
    let height = top.height.into_iter().map(|z| if z > f32::NEG_INFINITY { z } else { f32::NAN });
    out.height = Raster::new(window, height.collect());
    out
}

/// A window and a pixel around it, in units of the coordinate lattice.
struct Reach([[i32; 2]; 2]);

impl Reach {
    fn new(window: &GridWindow) -> Self {
        let bounds = window.bounds().grown(window.step);
        // The cast saturates, which is what is wanted beyond the lattice.
        let unit = |v: f64| (v * gable_blocks::UNITS_PER_METRE) as i32;
        Self([[unit(bounds.min.x), unit(bounds.max.x)], [unit(bounds.min.y), unit(bounds.max.y)]])
    }

    fn touches(&self, triangle: &BlockTriangle) -> bool {
        let [a, b, c] = &triangle.corners;
        let overlaps = |axis: usize| {
            let [low, high] = self.0[axis];
            a[axis].max(b[axis]).max(c[axis]) >= low && a[axis].min(b[axis]).min(c[axis]) <= high
        };
        overlaps(1) && overlaps(0)
    }
}

/// The z-buffer: height and triangle on top of each pixel.
struct Top {
    height: Vec<f32>,
    triangle: Vec<u32>,
}

impl Top {
    #[inline]
    fn draw(&mut self, mesh: &BlockMesh, index: u32, window: &GridWindow) {
        let triangle = &mesh.triangles[index as usize];
        let Some(scan) = ScanTriangle::new(triangle) else { return };
        let corners = sorted_positions(triangle);
        let z = corners.map(|c| c.z);
        let slope = Gradients::new(&corners).slope(z);
        let (low, high) = (z[0].min(z[1]).min(z[2]), z[0].max(z[1]).max(z[2]));
        scan.spans(window, |row, y, columns| {
            let base = z[0] + (y - corners[0].y) * slope.y;
            for column in columns {
                let x = ((window.x0 + column as i64) as f64 + 0.5) * window.step;
                let z = (base + (x - corners[0].x) * slope.x).clamp(low, high) as f32;
                let at = row * window.width + column;
                let old = self.height[at];
                if z > old || (z == old && beats(triangle, &mesh.triangles[self.triangle[at] as usize])) {
                    self.height[at] = z;
                    self.triangle[at] = index;
                }
            }
        });
    }

    fn shade(&self, mesh: &BlockMesh, textures: &dyn TextureSource, out: &mut Orthograph) {
        let window = out.window();
        let mut seen = vec![false; mesh.triangles.len()];
        self.triangle.iter().filter(|&&t| t != NONE).for_each(|&t| seen[t as usize] = true);
        let mut visible: Vec<_> = (0..mesh.triangles.len() as u32).filter(|&t| seen[t as usize]).collect();
        visible.sort_by_key(|&t| mesh.triangles[t as usize].material);
        let mut texture = None;
        let mut plain = [0; 3];
        let mut material = None;
        for index in visible {
            let triangle = &mesh.triangles[index as usize];
            if material != Some(triangle.material) {
                material = Some(triangle.material);
                texture = textures.texture(triangle.material);
                plain = textures.colour(triangle.material);
            }
            let Some(scan) = ScanTriangle::new(triangle) else { continue };
            let corners = triangle.positions();
            let normal = quantised_normal((corners[1] - corners[0]).cross(corners[2] - corners[0]));
            let gradients = Gradients::new(&corners);
            let paint = match &texture {
                Some(texture) => Paint::texture(texture, triangle, &gradients, window.step),
                None if triangle.colours.iter().all(|c| c[3] != 0) => Paint::Vertices(&triangle.colours),
                None => Paint::Plain(plain),
            };
            let photographed = !matches!(paint, Paint::Plain(_));
            let (colours, normals) = (out.colour.values_mut(), out.normal.values_mut());
            let photographs = out.photographed.values_mut();
            scan.spans(&window, |row, y, columns| {
                for column in columns {
                    let at = row * window.width + column;
                    if self.triangle[at] == index {
                        let x = ((window.x0 + column as i64) as f64 + 0.5) * window.step;
                        colours[at] = paint.at(gradients.weights(DVec2::new(x, y)));
                        photographs[at] = photographed;
                        normals[at] = normal;
                    }
                }
            });
        }
    }
}

/// What the pixels of one triangle are painted with.
enum Paint<'a> {
    Plain([u8; 3]),
    Vertices(&'a [[u8; 4]; 3]),
    Texture { texture: &'a crate::Texture, origin: DVec2, first: DVec2, second: DVec2, footprint: Footprint },
}

impl<'a> Paint<'a> {
    fn texture(texture: &'a crate::Texture, triangle: &BlockTriangle, gradients: &Gradients, step: f64) -> Self {
        let size = texture.size();
        // Texture files start at the top, v at the bottom.
        let [origin, b, c] = triangle.uv.map(|[u, v]| DVec2::new(f64::from(u), 1.0 - f64::from(v)) * size);
        let (along_x, along_y) = (gradients.slope([origin.x, b.x, c.x]), gradients.slope([origin.y, b.y, c.y]));
        let east = DVec2::new(along_x.x, along_y.x) * step;
        let north = DVec2::new(along_x.y, along_y.y) * step;
        // Only what leaves the image is meant to be repeated: an atlas must not bleed in from its other side.
        let repeat = triangle.uv.iter().flatten().any(|t| !(-0.001..=1.001).contains(t));
        let footprint = Footprint::new(east, north, repeat);
        Self::Texture { texture, origin, first: b - origin, second: c - origin, footprint }
    }

    #[inline]
    fn at(&self, (first, second): (f64, f64)) -> [u8; 3] {
        match self {
            Self::Plain(colour) => *colour,
            Self::Vertices([a, b, c]) => std::array::from_fn(|i| {
                let [a, b, c] = [a[i], b[i], c[i]].map(f64::from);
                (a + (b - a) * first + (c - a) * second).round().clamp(0.0, 255.0) as u8
            }),
            Self::Texture { texture, origin, first: u, second: v, footprint } => {
                texture.sample(*origin + *u * first + *v * second, footprint)
            }
        }
    }
}

/// Corners in a fixed order, so that the same triangle has the same heights however its corners are listed.
fn sorted_positions(triangle: &BlockTriangle) -> [DVec3; 3] {
    let mut sorted = *triangle;
    sorted.corners.sort_unstable();
    sorted.positions()
}

/// Whether a triangle comes before another one of the same height: the flatter one (a roof before the wall below
/// it), then by content.
#[cold]
fn beats(new: &BlockTriangle, old: &BlockTriangle) -> bool {
    let flatness = |t: &BlockTriangle| {
        let [a, b, c] = sorted_positions(t);
        (b - a).cross(c - a).normalize_or_zero().z.abs()
    };
    let content = |t: &BlockTriangle| (t.corners, t.uv.map(|uv| uv.map(f32::to_bits)), t.material, t.colours);
    let order = flatness(new).total_cmp(&flatness(old)).then_with(|| content(old).cmp(&content(new)));
    order == Ordering::Greater
}

#[cfg(test)]
mod tests;
