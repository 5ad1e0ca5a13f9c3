//! How well roofs fit, on samples seen from above.

use crate::city::City;
use crate::footprints::BlockMatch;
use crate::height_raster::{HeightRaster, NONE};
use crate::planes::{PlaneMatches, RoofPlanes, match_planes, partners};
use crate::statistics::{Spread, mean, median, ratio};
use gable_city_model::Shell;
use gable_geometry::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A roof counts as matched if the result has a roof over at least this share of it.
const MATCHED: f64 = 0.5;
/// Directions are compared where both roofs are steeper than this, degrees.
const SLOPING_DEG: f64 = 3.0;

/// Fit of the roofs. Samples lie on a lattice of 0.25 m (option `roof_step`) over the truth's roofs, seen from above; the
/// highest roof counts. A building is matched if the result has a roof above at least half of its samples; all figures are
/// of matched buildings, over the samples where both have a roof.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Roofs {
    /// Matched buildings.
    pub matched: usize,
    /// Share of the truth's roof samples that have a roof in the result, over all buildings.
    pub covered: f64,
    /// Height RMSE of each matched building, their median, metres.
    pub height_rmse_median: f64,
    /// The same over buildings of 50 m² or more.
    pub height_rmse_median_from_50: f64,
    /// The same over the samples where a plane of the truth lies under a partner of its own (see [`PlaneMatches`]): without
    /// strips along walls that stand a little beside their place, where one roof is compared with another. Buildings
    /// of which no plane has a partner are left out.
    pub height_rmse_of_planes_median_from_50: f64,
    /// Height RMSE over all samples, metres.
    pub height_rmse: f64,
    /// Mean of result minus truth over all samples, metres.
    pub height_bias: f64,
    /// Mean difference of slope, degrees.
    pub slope_error_deg: f64,
    /// Mean difference of direction where both slope by more than 3°, degrees.
    pub azimuth_error_deg: f64,
    /// Difference of the highest samples of a building, metres.
    pub ridge_error: Spread,
    /// Mean of result minus truth of the highest samples, metres.
    pub ridge_bias: f64,
    /// Difference of the lowest samples of a building, metres.
    pub eave_error: Spread,
    /// Mean of result minus truth of the lowest samples, metres.
    pub eave_bias: f64,
    /// Volume of the result against that of the truth, over connected blocks that have both.
    pub volume_ratio: f64,
    /// Which planes stand for which.
    pub planes: PlaneMatches,
}

/// The fit of one building's roof.
#[derive(Clone, Debug, Default)]
pub(crate) struct RoofFit {
    /// Samples on the truth's roof.
    samples: usize,
    /// Result minus truth where both are.
    pub(crate) errors: Vec<f64>,
    slope: Vec<f64>,
    azimuth: Vec<f64>,
    /// Highest and lowest, truth and result.
    ridge: [f64; 2],
    eave: [f64; 2],
    /// Area in plan of pairs of planes (truth, result), m².
    shared: BTreeMap<(u32, u32), f64>,
    /// Sum of squares of the errors of these pairs, and their number.
    squares: BTreeMap<(u32, u32), (f64, usize)>,
    /// Area in plan of the truth's planes that is not under another roof, m².
    seen: BTreeMap<u32, f64>,
}

impl RoofFit {
    pub(crate) fn is_matched(&self) -> bool {
        self.samples > 0 && self.errors.len() as f64 >= MATCHED * self.samples as f64
    }

    pub(crate) fn rmse(&self) -> f64 {
        Spread::of(self.errors.iter().map(|e| e.abs()).collect()).rms
    }

    /// RMSE over the samples of some pairs of planes; `None` if there are none.
    fn rmse_of(&self, pairs: &BTreeSet<(u32, u32)>) -> Option<f64> {
        let these = self.squares.iter().filter(|(pair, _)| pairs.contains(pair));
        let (sum, count) = these.fold((0.0, 0), |(s, n), (_, &(sum, count))| (s + sum, n + count));
        (count > 0).then(|| (sum / count as f64).sqrt())
    }

    fn new(object: usize, truth: &City<'_>, result: &City<'_>, planes: [&RoofPlanes; 2], step: f64) -> Self {
        let own = &truth.objects[object];
        let bounds = gable_geometry::Box2::of(own.roof().flat_map(|f| f.corners).map(|p| p.truncate()));
        let mut ours = HeightRaster::covering(bounds, step);
        let mut theirs = ours.clone();
        let draw = |raster: &mut HeightRaster, city: &City<'_>, planes: &RoofPlanes| {
            for i in city.near(bounds) {
                for (facet, &plane) in city.objects[i].facets.iter().zip(&planes.of_facet[i]) {
                    if plane != NONE {
                        raster.draw(facet.corners, plane);
                    }
                }
            }
        };
        draw(&mut ours, truth, planes[0]);
        draw(&mut theirs, result, planes[1]);
        let mut out = Self { ridge: [f64::NEG_INFINITY; 2], eave: [f64::INFINITY; 2], ..Self::default() };
        for at in 0..ours.tag.len() {
            if ours.tag[at] == NONE || planes[0].planes[ours.tag[at] as usize].object != object {
                continue;
            }
            out.samples += 1;
            *out.seen.entry(ours.tag[at]).or_default() += step * step;
            if theirs.tag[at] == NONE {
                continue;
            }
            let z = [ours.z[at], theirs.z[at]];
            out.errors.push(z[1] - z[0]);
            for k in 0..2 {
                out.ridge[k] = out.ridge[k].max(z[k]);
                out.eave[k] = out.eave[k].min(z[k]);
            }
            let pair = (ours.tag[at], theirs.tag[at]);
            *out.shared.entry(pair).or_default() += step * step;
            let sums = out.squares.entry(pair).or_default();
            *sums = (sums.0 + (z[1] - z[0]).powi(2), sums.1 + 1);
        }
        // Directions are the same for all samples of a pair of planes.
        for (&(t, r), area) in &out.shared {
            let samples = (area / (step * step)).round() as usize;
            let [a, b] = [planes[0].planes[t as usize].normal, planes[1].planes[r as usize].normal];
            let difference = (slope_deg(a) - slope_deg(b)).abs();
            out.slope.extend(std::iter::repeat_n(difference, samples));
            if slope_deg(a) > SLOPING_DEG && slope_deg(b) > SLOPING_DEG {
                let turn = a.truncate().angle_to(b.truncate()).abs().to_degrees();
                out.azimuth.extend(std::iter::repeat_n(turn, samples));
            }
        }
        out
    }
}

fn slope_deg(normal: DVec3) -> f64 {
    normal.truncate().length().atan2(normal.z.abs()).to_degrees()
}

/// The fits of all buildings of the truth.
pub(crate) fn roof_fits(truth: &City<'_>, result: &City<'_>, planes: [&RoofPlanes; 2], step: f64) -> Vec<RoofFit> {
    (0..truth.objects.len()).into_par_iter().map(|i| RoofFit::new(i, truth, result, planes, step)).collect()
}

pub(crate) fn roofs(
    truth: &City<'_>,
    result: &City<'_>,
    fits: &[RoofFit],
    planes: [&RoofPlanes; 2],
    matches: &[BlockMatch],
) -> Roofs {
    let matched: Vec<(usize, &RoofFit)> = fits.iter().enumerate().filter(|(_, f)| f.is_matched()).collect();
    let errors = || matched.iter().flat_map(|(_, f)| f.errors.iter().copied());
    let rmse: Vec<(f64, f64)> = matched.iter().map(|&(i, f)| (truth.objects[i].area, f.rmse())).collect();
    let differences = |part: fn(&RoofFit) -> [f64; 2]| -> Vec<f64> {
        matched.iter().map(|(_, f)| part(f)).map(|[t, r]| r - t).collect()
    };
    let (ridge, eave) = (differences(|f| f.ridge), differences(|f| f.eave));
    let absolute = |v: &[f64]| Spread::of(v.iter().map(|e| e.abs()).collect());
    let mut shared = BTreeMap::new();
    for fit in fits {
        for (&pair, area) in &fit.shared {
            *shared.entry(pair).or_default() += area;
        }
    }
    let seen = fits.iter().flat_map(|f| f.seen.iter().map(|(&p, &a)| (p, a))).collect();
    let partners = partners(planes, &seen, &shared);
    let large = matched.iter().filter(|(i, _)| truth.objects[*i].area >= 50.0);
    let of_planes = large.filter_map(|(_, f)| f.rmse_of(&partners.pairs)).collect();
    let samples: usize = fits.iter().map(|f| f.samples).sum();
    let covered: usize = fits.iter().map(|f| f.errors.len()).sum();
    Roofs {
        matched: matched.len(),
        covered: ratio(covered as f64, samples as f64),
        height_rmse_median: median(rmse.iter().map(|p| p.1).collect()),
        height_rmse_median_from_50: median(rmse.iter().filter(|p| p.0 >= 50.0).map(|p| p.1).collect()),
        height_rmse_of_planes_median_from_50: median(of_planes),
        height_rmse: Spread::of(errors().map(f64::abs).collect()).rms,
        height_bias: mean(errors()),
        slope_error_deg: mean(matched.iter().flat_map(|(_, f)| f.slope.iter().copied())),
        azimuth_error_deg: mean(matched.iter().flat_map(|(_, f)| f.azimuth.iter().copied())),
        ridge_error: absolute(&ridge),
        ridge_bias: mean(ridge),
        eave_error: absolute(&eave),
        eave_bias: mean(eave),
        volume_ratio: volume_ratio(truth, result, matches),
        planes: match_planes(planes, &partners),
    }
}

fn volume_ratio(truth: &City<'_>, result: &City<'_>, matches: &[BlockMatch]) -> f64 {
    let volume = |city: &City<'_>, i: usize| volume(&city.objects[i].building.lods.lod2);
    let both = || matches.iter().filter(|m| !m.partners.is_empty());
    let ours: f64 = both().flat_map(|m| &truth.blocks[m.block].members).map(|&i| volume(truth, i)).sum();
    let partners: BTreeSet<usize> = both().flat_map(|m| m.partners.iter().copied()).collect();
    ratio(partners.into_iter().map(|j| volume(result, j)).sum(), ours)
}

/// Volume of solids, m³.
pub(crate) fn volume(solids: &[Shell]) -> f64 {
    solids.iter().map(|s| s.volume().abs()).sum()
}
