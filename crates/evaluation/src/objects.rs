//! Which buildings were found (ISPRS benchmark: Rutzinger, Rottensteiner & Pfeifer 2009, *A comparison of evaluation
//! techniques for building extraction*, sections III-B and III-C).

use crate::city::{City, Object};
use crate::region::Region;
use crate::statistics::ratio;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A building counts as found, or as correct, if the other model covers at least this share of it.
pub const COVERED: f64 = 0.5;

/// Completeness, correctness and quality, each in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// What was found of the truth.
    pub completeness: f64,
    /// What is true of the result.
    pub correctness: f64,
    /// Both: 1 / (1 / completeness + 1 / correctness − 1). For areas without a size limit this is the intersection over
    /// the union.
    pub quality: f64,
}

impl Rates {
    fn new(completeness: f64, correctness: f64) -> Self {
        let product = completeness * correctness;
        Self { completeness, correctness, quality: ratio(product, completeness + correctness - product) }
    }
}

/// Detection among the buildings from some footprint area upwards. The other model's buildings count whatever their
/// size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Least footprint area of the buildings counted, m².
    pub from_m2: f64,
    /// Buildings of the truth.
    pub truth: usize,
    /// Those of which at least half is covered by the result.
    pub found: usize,
    /// Buildings of the result.
    pub result: usize,
    /// Those of which at least half is covered by the truth.
    pub correct: usize,
    /// Rates by number of buildings.
    pub per_object: Rates,
    /// Rates by area.
    pub per_area: Rates,
}

/// Shares of all buildings that the other model covers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Coverage {
    pub(crate) truth: Vec<f64>,
    pub(crate) result: Vec<f64>,
}

impl Coverage {
    pub(crate) fn new(truth: &City<'_>, result: &City<'_>) -> Self {
        let one = |a: &City<'_>, b: &City<'_>| a.objects.par_iter().map(|o| covered(o, b)).collect();
        Self { truth: one(truth, result), result: one(result, truth) }
    }
}

/// The share of a footprint that the buildings of a city cover together.
fn covered(object: &Object<'_>, city: &City<'_>) -> f64 {
    let near = city.near(object.footprint.bounds());
    let cover = Region::union(near.iter().map(|&j| &city.objects[j].footprint));
    ratio(object.footprint.intersection(&cover).area(), object.area).min(1.0)
}

pub(crate) fn detection(truth: &City<'_>, result: &City<'_>, coverage: &Coverage, from_m2: f64) -> Detection {
    // Count, covered count, area and covered area.
    let sums = |city: &City<'_>, shares: &[f64]| {
        let large = city.objects.iter().zip(shares).filter(|(o, _)| o.area >= from_m2 && o.area > 0.0);
        large.fold((0, 0, 0.0, 0.0), |(n, k, area, shared), (o, &share)| {
            (n + 1, k + usize::from(share >= COVERED), area + o.area, shared + share * o.area)
        })
    };
    let (t, found, t_area, t_shared) = sums(truth, &coverage.truth);
    let (r, correct, r_area, r_shared) = sums(result, &coverage.result);
    Detection {
        from_m2,
        truth: t,
        found,
        result: r,
        correct,
        per_object: Rates::new(ratio(found as f64, t as f64), ratio(correct as f64, r as f64)),
        per_area: Rates::new(ratio(t_shared, t_area), ratio(r_shared, r_area)),
    }
}
