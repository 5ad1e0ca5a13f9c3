//! Region growing over patches: the first guess of the planes.

use crate::local_fit::Field;
use crate::partition::{Coefficients, Partition};
use crate::roof_plane::UNASSIGNED;
use gable_geometry::{Covariance3, dvec3};
use gable_raster::sides;

/// Thresholds of region growing.
pub(crate) struct Limits {
    /// Largest distance of a patch to the growing plane, metres.
    pub(crate) distance: f64,
    /// Cosine of the largest angle between their normals.
    pub(crate) cos_angle: f64,
    /// Largest residual of a seed's window, metres (rms).
    pub(crate) seed_rms: f64,
    /// Fewest pixels of a region.
    pub(crate) min_pixels: usize,
}

/// Grows regions over the pixels that have no label, from the flattest patches on, and adds those that become
/// large enough. Returns how many were added.
///
/// A region takes neighbours (of four) whose patch lies close to its plane and has a similar normal; its plane is
/// fitted again whenever it has grown by half.
pub(crate) fn grow(partition: &mut Partition<'_>, limits: &Limits) -> usize {
    let field = partition.field;
    let (w, h) = (field.width, field.height);
    let largest = (limits.seed_rms * limits.seed_rms) as f32;
    let free = field.inside.iter().filter(|&&p| partition.labels[p as usize] == UNASSIGNED);
    // Residuals in steps of 5 mm: equal ones keep the raster's order.
    let mut seeds: Vec<(u16, u32)> = free
        .map(|&p| (field.patches[p as usize].residual, p))
        .filter(|&(residual, _)| residual <= largest)
        .map(|(residual, p)| ((residual.sqrt() * 200.0) as u16, p))
        .collect();
    seeds.sort_by_key(|s| s.0);
    let before = partition.planes.len();
    let mut failed = vec![false; field.z.len()];
    let mut region: Vec<u32> = Vec::new();
    for (_, seed) in seeds {
        if partition.labels[seed as usize] != UNASSIGNED || failed[seed as usize] {
            continue;
        }
        let label = partition.planes.len() as u16;
        if label == UNASSIGNED {
            break;
        }
        region.clear();
        region.push(seed);
        partition.labels[seed as usize] = label;
        let mut plane = patch_plane(field, seed as usize);
        let mut moments = Covariance3::default();
        let (mut next, mut fitted) = (0, 20);
        while next < region.len() {
            let p = region[next] as usize;
            next += 1;
            let (x, y) = field.position(p);
            moments.add(dvec3(x, y, f64::from(field.z[p])), 1.0);
            if next == fitted {
                fitted += fitted / 2;
                if let Some(q) = moments.height_plane() {
                    plane = [q.a, q.b, q.c];
                }
            }
            for q in sides(p, w, h).into_iter().flatten() {
                if partition.labels[q] == UNASSIGNED && !field.z[q].is_nan() && fits(field, q, plane, limits) {
                    partition.labels[q] = label;
                    region.push(q as u32);
                }
            }
        }
        if region.len() >= limits.min_pixels {
            let fit = moments.height_plane().map_or(plane, |q| [q.a, q.b, q.c]);
            partition.planes.push(fit);
        } else {
            for &p in &region {
                partition.labels[p as usize] = UNASSIGNED;
            }
            // Pixels near the seed would only repeat the failure.
            for &p in region.iter().take(limits.min_pixels / 4 + 1) {
                failed[p as usize] = true;
            }
        }
    }
    partition.planes.len() - before
}

fn patch_plane(field: &Field, pixel: usize) -> Coefficients {
    let p = &field.patches[pixel];
    let (x, y) = field.position(pixel);
    let (a, b) = (f64::from(p.a), f64::from(p.b));
    [a, b, f64::from(p.h) - a * x - b * y]
}

fn fits(field: &Field, pixel: usize, [a, b, c]: Coefficients, limits: &Limits) -> bool {
    let p = &field.patches[pixel];
    let (pa, pb) = (f64::from(p.a), f64::from(p.b));
    let (x, y) = field.position(pixel);
    let d = f64::from(p.h) - (a * x + b * y + c);
    let norm2 = 1.0 + a * a + b * b;
    d * d <= limits.distance * limits.distance * norm2
        && 1.0 + a * pa + b * pb >= limits.cos_angle * (norm2 * (1.0 + pa * pa + pb * pb)).sqrt()
}
