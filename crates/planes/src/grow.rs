//! Detection of the roof planes of one building on its height map.

use crate::clean::clean;
use crate::divide::{Evidence, split};
use crate::local_fit::Field;
use crate::merge::merge;
use crate::partition::Partition;
use crate::roof_plane::{Planes, RoofPlane, UNASSIGNED};
use crate::seed_regions::{Limits, grow};
use gable_geometry::{Plane, dvec2, dvec3};
use gable_raster::Raster;

/// Parameters of [`detect`]. The defaults suit photogrammetry meshes with about 0.1 m of noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Half the width of the windows in which local planes are fitted, metres.
    pub radius: f64,
    /// Largest orthogonal distance to a growing plane, metres.
    pub distance: f64,
    /// Largest angle between a local normal and that of the growing plane, degrees.
    pub angle: f64,
    /// Distance beyond which a pixel belongs to no plane, metres.
    pub cut: f64,
    /// Smallest plane, m² on the ground.
    pub min_area: f64,
    /// Narrowest plane, metres.
    pub min_width: f64,
    /// Steepest roof plane, degrees.
    pub max_slope: f64,
    /// Area over which the noise of the height map is correlated, m².
    pub noise_area: f64,
    /// Least noise that is assumed, metres (rms).
    pub min_noise: f64,
    /// Most noise that is believed, metres (rms).
    pub max_noise: f64,
    /// How many times the gain that noise alone brings a second plane must bring to be believed.
    pub significance: f64,
    /// Two planes count as one if one plane misses the smaller of them by less than this, metres (rms).
    pub min_effect: f64,
    /// Most pairs of regions that are held against each other.
    pub most_pairs: usize,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            radius: 0.6,
            distance: 0.25,
            angle: 25.0,
            cut: 0.5,
            min_area: 3.0,
            min_width: 1.0,
            max_slope: 75.0,
            noise_area: 14.0,
            min_noise: 0.04,
            max_noise: 0.16,
            significance: 6.0,
            min_effect: 0.18,
            most_pairs: usize::MAX,
        }
    }
}

/// Rounds of splitting, merging and growing into what is left. Each round ends with a full competition, and most
/// buildings come to rest after two.
const MAX_ROUNDS: usize = 6;

/// The planes of the roof of one building, by deterministic region growing and model selection.
///
/// 1. A plane is fitted in a window of about 1 m around every pixel; beside edges, in the window that does not
///    cross them (after Kuwahara).
/// 2. Regions grow from the flattest windows (after Rabbani 2006), and the planes found compete for the
///    pixels at their borders and are fitted again, in turns (Cohen-Steiner 2004, with neighbours only).
/// 3. A region that two planes fit significantly better, divided by a straight line, is split (this is what finds
///    ridges of 5° under noise); neighbours that one plane fits as well are merged; regions that are too small,
///    too thin or too steep are dropped; new regions grow in what is left. Repeated until nothing changes.
///
/// `mask` tells the building's pixels; heights that are not finite count as outside. `normal`, if given, holds
/// unit normals of the mesh: pixels on walls (steeper than `max_slope`) then start no region. All rasters
/// must have the same window. Planes come in the coordinates of the rasters.
///
/// This replaces the RANSAC of Zhu 2018, §5.3 ([`crate::ransac`] is that one). O(pixels), apart from sorting, and O(p log p)
/// for p pairs of regions, of more than 2,000 those within 100 m of each other. Ends early where that would be more pairs than `most_pairs`.
///
/// # Panics
/// If the rasters differ in size.
#[must_use]
pub fn detect(height: &Raster<f32>, normal: Option<&Raster<[f32; 3]>>, mask: &Raster<bool>, params: &Params) -> Planes {
    let window = height.window();
    assert_eq!(window.len(), mask.window().len(), "height and mask need the same window");
    let mut field = Field::new(height, mask, params.radius);
    if let Some(normal) = normal {
        assert_eq!(window.len(), normal.window().len(), "height and normals need the same window");
        let least = params.max_slope.to_radians().cos() as f32;
        for (patch, n) in field.patches.iter_mut().zip(normal.values()) {
            if n[2].abs() < least {
                patch.residual = f32::INFINITY;
            }
        }
    }
    let pixel_area = window.step * window.step;
    let limits = Limits {
        distance: params.distance,
        cos_angle: params.angle.to_radians().cos(),
        seed_rms: params.distance,
        min_pixels: (params.min_area / pixel_area).ceil() as usize,
    };
    let evidence = Evidence {
        noise_area: params.noise_area,
        noise: params.min_noise..=params.max_noise.max(params.min_noise),
        significance: params.significance,
        min_effect: params.min_effect,
        min_area: params.min_area,
        min_width: params.min_width,
    };
    let max_slope = params.max_slope.to_radians().tan();
    let mut partition = Partition::new(&field, params.cut, 0.002);
    grow(&mut partition, &limits);
    partition.compete(4);
    clean(&mut partition, params.min_area, params.min_width, max_slope);
    let mut pairs_left = params.most_pairs;
    for _ in 0..MAX_ROUNDS {
        let mut changes = grow(&mut partition, &limits);
        changes += split(&mut partition, &evidence);
        partition.compete(6);
        changes += merge(&mut partition, &evidence, &mut pairs_left);
        changes += clean(&mut partition, params.min_area, params.min_width, max_slope);
        partition.compete(4);
        if changes == 0 || pairs_left == 0 {
            break;
        }
    }
    clean(&mut partition, params.min_area, params.min_width, max_slope);
    Planes { cut_short: pairs_left == 0, ..finish(&partition, height) }
}

/// Planes in the raster's coordinates, the largest first, with their figures.
pub(crate) fn finish(partition: &Partition<'_>, height: &Raster<f32>) -> Planes {
    let field = partition.field;
    let window = height.window();
    let counts = partition.counts();
    let mut order: Vec<usize> = (0..counts.len()).filter(|&k| counts[k] > 0).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(counts[k]));
    let mut index = vec![UNASSIGNED; counts.len()];
    for (new, &old) in order.iter().enumerate() {
        index[old] = new as u16;
    }
    let corner = window.centre(0, 0);
    let shift = -corner.extend(field.reference);
    let mut planes: Vec<RoofPlane> = order
        .iter()
        .map(|&k| {
            let [a, b, c] = partition.planes[k];
            RoofPlane {
                plane: Plane { a, b, c }.shifted(shift),
                inliers: counts[k],
                area: counts[k] as f64 * window.step * window.step,
                rms: 0.0,
                centroid: dvec3(0.0, 0.0, 0.0),
            }
        })
        .collect();
    let labels: Vec<u16> =
        partition.labels.iter().map(|&l| if l == UNASSIGNED { l } else { index[l as usize] }).collect();
    for (p, &label) in labels.iter().enumerate() {
        if label == UNASSIGNED {
            continue;
        }
        let (x, y) = field.position(p);
        let at = dvec2(x, y).extend(f64::from(field.z[p]));
        let [a, b, c] = partition.planes[order[label as usize]];
        let plane = &mut planes[label as usize];
        plane.rms += Plane { a, b, c }.distance(at).powi(2);
        plane.centroid += at;
    }
    for plane in &mut planes {
        let n = plane.inliers as f64;
        plane.rms = (plane.rms / n).sqrt();
        plane.centroid = plane.centroid / n - shift;
    }
    Planes { planes, labels: Raster::new(window, labels), cut_short: false }
}
