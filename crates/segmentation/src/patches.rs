//! Planar patches of what stands high: region growing on the height map.

use gable_geometry::{Covariance3, Plane, dvec3};
use gable_raster::{Raster, WindowPlane, sides, window_planes};

/// Side of the window that gives a pixel its plane, metres.
const WINDOW: f64 = 1.0;

/// A patch begins where the window's rms distance to its plane is at most this, metres.
const SEED: f32 = 0.12;

/// Largest distance of a pixel to its patch's plane, metres.
const DISTANCE: f64 = 0.2;

/// Largest difference of slope between a pixel's plane and its patch's, on a level patch.
const SLOPE: f64 = 0.25;

/// Least number of facets in a patch: fewer may be the flat side of a crown that the mesh shows coarsely.
const FACETS: f64 = 10.0;

/// The same where the mesh has at least [`FACETS`] in an area of [`DENSE_AREA`] m² on the mean: there a crown shows its
/// facets, and what has few is flat, and was simplified.
const DENSE_FACETS: f64 = 3.0;

/// See [`DENSE_FACETS`].
const DENSE_AREA: f64 = 6.0;

/// The area of the patch that each pixel lies in, m²; 0 in none, and in one of too few facets.
///
/// A patch grows from the flattest pixel that is left, over neighbours that lie near its plane and slope like it; the plane
/// is fitted anew each time the patch has doubled (Rabbani 2006 grows by normals alone). Only pixels of `grows` belong to
/// patches. `borders` is 1 where a pixel's facet is not that of the pixel to the east, see [`facets`]. Distances and
/// slopes may differ `noise` times as much as on a mesh of the usual noise.
///
/// O(pixels).
pub(crate) fn patch_areas(heights: &Raster<f32>, grows: &[bool], borders: &[f32], noise: f64) -> Vec<f32> {
    let (width, step) = (heights.width(), heights.window().step);
    let radius = ((WINDOW / step - 1.0) / 2.0).round().max(1.0) as usize;
    let fits = window_planes(heights.values(), width, heights.height(), radius, |fit| fit);
    let mut free = grows.to_vec();
    let mut areas = vec![0.0; free.len()];
    let all = || (0..grows.len()).filter(|&p| grows[p]);
    let dense = facets(all(), borders) * DENSE_AREA >= FACETS * all().count() as f64 * step * step;
    let least = if dense { DENSE_FACETS } else { FACETS };
    let mut patch = Vec::new();
    for seed in by_residual(&fits, SEED * noise as f32) {
        if !free[seed] {
            continue;
        }
        grow(seed, heights, &fits, noise, &mut free, &mut patch);
        if facets(patch.iter().copied(), borders) >= least {
            let area = (patch.len() as f64 * step * step) as f32;
            patch.iter().for_each(|&p| areas[p] = area);
        }
    }
    areas
}

/// How many facets there are on some pixels: about *b*²/2.3*n*, for *b* borders among *n* pixels and facets as wide as they
/// are high.
fn facets(pixels: impl Iterator<Item = usize>, borders: &[f32]) -> f64 {
    let (crossed, n) = pixels.fold((0.0, 0.0), |(crossed, n), p| (crossed + f64::from(borders[p]), n + 1.0));
    if n > 0.0 { crossed * crossed / (2.3 * n) } else { 0.0 }
}

/// The pixels of at most some residual, the flattest first, equal ones in their order; residuals are told apart by the millimetre.
fn by_residual(fits: &[WindowPlane], most: f32) -> Vec<usize> {
    let key = |fit: &WindowPlane| (fit.residual * 1000.0) as usize;
    let keys = (most * 1000.0) as usize + 1;
    let mut begin = vec![0; keys + 1];
    let seeds = || fits.iter().enumerate().filter(|(_, fit)| fit.residual <= most);
    seeds().for_each(|(_, fit)| begin[key(fit) + 1] += 1);
    for k in 0..keys {
        begin[k + 1] += begin[k];
    }
    let mut out = vec![0; begin[keys]];
    for (p, fit) in seeds() {
        let at = &mut begin[key(fit)];
        out[*at] = p;
        *at += 1;
    }
    out
}

/// Takes the patch of a seed out of `free`.
fn grow(
    seed: usize,
    heights: &Raster<f32>,
    fits: &[WindowPlane],
    noise: f64,
    free: &mut [bool],
    patch: &mut Vec<usize>,
) {
    let (width, rows, step) = (heights.width(), heights.height(), heights.window().step);
    let z = heights.values();
    // Metres from the seed, east, north and up: small numbers, so that sums of squares keep their digits.
    let from_seed = |p: usize| {
        let (column, row) = ((p % width) as f64 - (seed % width) as f64, (p / width) as f64 - (seed / width) as f64);
        dvec3(column * step, row * step, f64::from(z[p]) - f64::from(z[seed]))
    };
    let slope = |p: usize| fits[p].slope.map(|s| f64::from(s) / step);
    let distance = DISTANCE * noise;
    let [east, north] = slope(seed);
    let mut plane = Plane { a: east, b: north, c: 0.0 };
    let mut moments = Covariance3::default();
    patch.clear();
    patch.push(seed);
    free[seed] = false;
    let (mut head, mut next_fit) = (0, 16);
    while head < patch.len() {
        let p = patch[head];
        head += 1;
        moments.add(from_seed(p), 1.0);
        if head == next_fit {
            next_fit *= 2;
            plane = moments.undamped_height_plane().unwrap_or(plane);
        }
        let Plane { a, b, c } = plane;
        let turn = (SLOPE * noise).powi(2) * (1.0 + a * a + b * b);
        let [west, east, south, north] = sides(p, width, rows);
        for q in [east, west, north, south].into_iter().flatten() {
            let (at, [u, v]) = (from_seed(q), slope(q));
            let near = (at.z - c - a * at.x - b * at.y).abs() <= distance;
            let alike = (u - a).powi(2) + (v - b).powi(2) <= turn;
            if free[q] && near && alike {
                free[q] = false;
                patch.push(q);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: 80, height: 60 };

    // Areas of the patches of a surface under 0.05 m of noise, every pixel a facet.
    fn found(height: impl Fn(f64, f64) -> f64) -> Vec<f32> {
        found_under(1.0, 1.0, height)
    }

    // The same under `rough` times the noise, on a mesh that is said to have `noise` times the usual.
    fn found_under(rough: f64, noise: f64, height: impl Fn(f64, f64) -> f64) -> Vec<f32> {
        let mut random = Counter::new(3);
        let at = |p: usize| WINDOW.centre(p % 80, p / 80) - WINDOW.centre(40, 30);
        let z = (0..WINDOW.len())
            .map(|p| (height(at(p).x, at(p).y) + 0.1 * rough * (random.unit() - 0.5)) as f32)
            .collect();
        let all = vec![true; WINDOW.len()];
        patch_areas(&Raster::new(WINDOW, z), &all, &vec![1.0; WINDOW.len()], noise)
    }

    #[test]
    fn both_sides_of_a_narrow_gable_are_patches() {
        let gable = |x: f64, y: f64| if x.abs() < 2.0 && y.abs() < 5.0 { 9.0 - 0.8 * x.abs() } else { 0.0 };
        let areas = found(gable);
        let on_roof = |p: usize| {
            let d = WINDOW.centre(p % 80, p / 80) - WINDOW.centre(40, 30);
            d.x.abs() < 2.0 && d.y.abs() < 5.0
        };
        let roof: Vec<usize> = (0..areas.len()).filter(|&p| on_roof(p)).collect();
        let share = roof.iter().filter(|&&p| areas[p] >= 4.0).count() as f64 / roof.len() as f64;
        assert!(share > 0.6, "{share}");
    }

    #[test]
    fn on_a_noisy_mesh_a_roof_has_patches_if_the_noise_is_known() {
        let shed = |x: f64, y: f64| if x.abs().max(y.abs()) < 4.0 { 5.0 + 0.3 * x } else { 0.0 };
        let middle = |noise: f64| {
            let areas = found_under(7.0, noise, shed);
            let near = |p: &usize| (WINDOW.centre(p % 80, p / 80) - WINDOW.centre(40, 30)).abs().max_element() < 3.0;
            let near: Vec<usize> = (0..areas.len()).filter(near).collect();
            near.iter().filter(|&&p| areas[p] >= 8.0).count() as f64 / near.len() as f64
        };
        let (unknown, known) = (middle(1.0), middle(2.0));
        assert!(unknown < 0.4 && known > 0.8, "{unknown} {known}");
    }

    #[test]
    fn a_crown_has_no_large_one() {
        let crown =
            |x: f64, y: f64| 4.0 + (16.0 - x * x - y * y).max(0.0).sqrt() + 0.3 * ((3.0 * x).sin() + (3.0 * y).cos());
        let areas = found(crown);
        let high = |p: usize| (WINDOW.centre(p % 80, p / 80) - WINDOW.centre(40, 30)).length() < 4.0;
        assert_eq!((0..areas.len()).filter(|&p| high(p) && areas[p] >= 6.0).count(), 0);
    }

    #[test]
    fn a_plane_of_a_few_facets_counts_where_the_rest_has_many() {
        let flat = Raster::filled(WINDOW, 5.0_f32);
        let all = vec![true; WINDOW.len()];
        let middle = 30 * 80 + 20;
        // Two halves apart in height; the western one has one facet for each 2.4 m, the eastern one, a crown, many or few.
        let areas = |crown: f32| {
            let mut heights = flat.clone();
            let mut borders = vec![0.0_f32; WINDOW.len()];
            for (p, (z, border)) in heights.values_mut().iter_mut().zip(&mut borders).enumerate() {
                let (x, y) = (p % 80, p / 80);
                if x >= 40 {
                    *z += ((x * 7 + y * 13) % 11) as f32 * 0.4;
                    *border = crown;
                } else if x % 12 == 11 {
                    *border = 1.0;
                }
            }
            patch_areas(&heights, &all, &borders, 1.0)[middle]
        };
        assert!(areas(1.0) > 80.0);
        assert_eq!(areas(0.02), 0.0);
    }
}
