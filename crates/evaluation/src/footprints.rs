//! How well footprints fit.

use crate::city::{Block, City, Outline};
use crate::region::{Region, iou};
use crate::statistics::{Spread, mean, median, ratio};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Distance between points along outlines, metres.
const STEP: f64 = 0.25;
/// A corner is where an outline turns by at least this, degrees.
const CORNER_DEG: f64 = 20.0;
/// A corner farther than this from any other has no partner, metres.
const CORNER_REACH: f64 = 2.0;

/// Intersection over union, summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// How many footprints of the truth.
    pub count: usize,
    /// Mean; missing ones count 0.
    pub mean_iou: f64,
    /// Median; missing ones count 0.
    pub median_iou: f64,
    /// Share with at least 0.9.
    pub above_90: f64,
}

impl Overlap {
    fn of(ious: Vec<f64>) -> Self {
        let above = ious.iter().filter(|&&v| v >= 0.9).count();
        Self {
            count: ious.len(),
            mean_iou: mean(ious.iter().copied()),
            above_90: ratio(above as f64, ious.len() as f64),
            median_iou: median(ious),
        }
    }
}

/// Fit of the footprints. Outlines and corners are those of connected blocks with an IoU of at least 0.5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Footprints {
    /// Each building of the truth with the one building of the result that fits it best.
    pub buildings: Overlap,
    /// The same for buildings of 50 m² or more.
    pub buildings_from_50: Overlap,
    /// Each connected block of the truth (touching buildings united) with all buildings of the result that share with it at
    /// least half of the smaller of the two areas.
    pub blocks: Overlap,
    /// The same for blocks of 50 m² or more.
    pub blocks_from_50: Overlap,
    /// Distance of points on the truth's outlines, each 0.25 m, to the result's, metres.
    pub outline_truth_to_result: Spread,
    /// And the other way.
    pub outline_result_to_truth: Spread,
    /// Distance of the truth's corners to the nearest corner of the result, where that is within 2 m, metres.
    pub corner_offset: Spread,
    /// Share of the truth's corners with a corner of the result within 2 m.
    pub corners_found: f64,
    /// Corners of the result for each corner of the truth.
    pub corner_ratio: f64,
}

/// A block of the truth with what stands for it in the result.
#[derive(Debug)]
pub(crate) struct BlockMatch {
    /// Index of the truth's block.
    pub(crate) block: usize,
    /// Buildings of the result.
    pub(crate) partners: Vec<usize>,
    pub(crate) region: Region,
    pub(crate) iou: f64,
}

pub(crate) fn match_blocks(truth: &City<'_>, result: &City<'_>) -> Vec<BlockMatch> {
    let one = |(index, block): (usize, &Block)| {
        let mut partners = result.near(block.region.bounds());
        partners.retain(|&j| {
            let other = &result.objects[j];
            other.footprint.intersection(&block.region).area() >= 0.5 * other.area.min(block.area)
        });
        let region = Region::union(partners.iter().map(|&j| &result.objects[j].footprint));
        let iou = iou(block.area, region.area(), region.intersection(&block.region).area());
        BlockMatch { block: index, partners, region, iou }
    };
    truth.blocks.par_iter().enumerate().map(one).collect()
}

pub(crate) fn footprints(truth: &City<'_>, result: &City<'_>, matches: &[BlockMatch]) -> Footprints {
    let best: Vec<(f64, f64)> = truth
        .objects
        .par_iter()
        .filter(|o| o.area > 0.0)
        .map(|o| {
            let near = result.near(o.footprint.bounds());
            let others = near.iter().map(|&j| &result.objects[j]);
            let ious = others.map(|r| iou(o.area, r.area, o.footprint.intersection(&r.footprint).area()));
            (o.area, ious.fold(0.0, f64::max))
        })
        .collect();
    let blocks: Vec<(f64, f64)> = matches.iter().map(|m| (truth.blocks[m.block].area, m.iou)).collect();
    let overlap =
        |pairs: &[(f64, f64)], from: f64| Overlap::of(pairs.iter().filter(|p| p.0 >= from).map(|p| p.1).collect());
    let outlines: Vec<OutlineFit> = matches
        .par_iter()
        .filter(|m| m.iou >= 0.5)
        .map(|m| OutlineFit::new(&truth.blocks[m.block].region, &m.region))
        .collect();
    let all = |part: fn(&OutlineFit) -> &Vec<f64>| outlines.iter().flat_map(part).copied().collect::<Vec<f64>>();
    let corners = all(|o| &o.corners);
    let near: Vec<f64> = corners.iter().copied().filter(|&d| d <= CORNER_REACH).collect();
    let result_corners: usize = outlines.iter().map(|o| o.result_corners).sum();
    Footprints {
        buildings: overlap(&best, 0.0),
        buildings_from_50: overlap(&best, 50.0),
        blocks: overlap(&blocks, 0.0),
        blocks_from_50: overlap(&blocks, 50.0),
        outline_truth_to_result: Spread::of(all(|o| &o.there)),
        outline_result_to_truth: Spread::of(all(|o| &o.back)),
        corners_found: ratio(near.len() as f64, corners.len() as f64),
        corner_ratio: ratio(result_corners as f64, corners.len() as f64),
        corner_offset: Spread::of(near),
    }
}

struct OutlineFit {
    there: Vec<f64>,
    back: Vec<f64>,
    /// For each corner of the truth the distance to the nearest of the result.
    corners: Vec<f64>,
    result_corners: usize,
}

impl OutlineFit {
    fn new(truth: &Region, result: &Region) -> Self {
        let (t, r) = (Outline::new(truth), Outline::new(result));
        let angle = CORNER_DEG.to_radians();
        let partners = result.corners(angle);
        let nearest = |p| partners.iter().map(|&q| gable_geometry::DVec2::distance(p, q)).fold(f64::INFINITY, f64::min);
        Self {
            there: t.points(STEP).into_iter().map(|p| r.distance(p)).collect(),
            back: r.points(STEP).into_iter().map(|p| t.distance(p)).collect(),
            corners: truth.corners(angle).into_iter().map(nearest).collect(),
            result_corners: partners.len(),
        }
    }
}
