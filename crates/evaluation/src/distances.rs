//! Distances between surfaces, sampled by area, exact from each point to the nearest triangle.

use crate::city::City;
use crate::objects::{COVERED, Coverage};
use crate::statistics::Spread;
use crate::triangles::{Sample, Triangles, sample};
use crate::{Error, budget};
use gable_city_model::Semantic;
use gable_geometry::{Box2, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Distances are cut off here, metres.
pub const CUT: f64 = 10.0;
/// Mesh triangles farther than this from every building are not looked at, metres.
const REACH: f64 = CUT;
/// Mesh points this near to a roof of the truth are points of that roof, metres.
const ON_ROOF: f64 = 1.0;
/// A mesh triangle belongs to a roof only if its unit normal's z is at least this.
const FACING_UP: f64 = 0.5;

/// Distances by direction, metres: from points spread over the first surface by area (option `density`, always the same for a
/// seed) to the nearest point of the second. Roofs and walls count; undersides, walls between two buildings of the same
/// model, and what of a wall lies under that model's terrain, which no camera sees, do not. Distances over 10 m count as 10 m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// From all buildings of the truth to the model.
    pub truth_to_model: Spread,
    /// The same from those of 50 m² or more that were found (half of them covered).
    pub truth_to_model_found_from_50: Spread,
    /// From the model to the truth.
    pub model_to_truth: Spread,
    /// From the model to the mesh that it was made from.
    pub model_to_mesh: Option<Spread>,
    /// From the roof surfaces of the model's LOD2 alone, to the mesh.
    pub lod2_roofs_to_mesh: Option<Spread>,
    /// From the truth to the mesh: what the model cannot know better.
    pub truth_to_mesh: Option<Spread>,
    /// From points of the mesh that face up and lie within 1 m of the truth's roofs, to the model's roofs.
    pub roof_points_to_roofs: Option<Spread>,
}

/// A building of the truth and what of the city's distance is its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Furthest {
    /// Identifier in the truth.
    pub id: String,
    /// Where most of that lies: the middle of a square of 4 m; world coordinates, metres.
    pub at: [f64; 2],
    /// RMS of its distances, metres.
    pub rms: f64,
    /// Its share of the sum of all squared distances, of the same buildings.
    pub share: f64,
}

/// Buildings that [`furthest`] names.
const NAMED: usize = 12;
/// A smaller share of the squares is rounding.
const ROUNDING: f64 = 1e-9;
/// Edge of the squares in which it looks for the place, metres.
const CELL: f64 = 4.0;

/// The found buildings that the RMS from truth to model comes from most, the largest share first.
fn furthest(
    truth: &City<'_>,
    origin: DVec3,
    found: &[usize],
    samples: &[Vec<Sample>],
    distances: &[Vec<f64>],
) -> Vec<Furthest> {
    let squares = |i: usize| distances[i].iter().map(|d| d * d).sum::<f64>();
    let all: f64 = found.iter().map(|&i| squares(i)).sum();
    let mut order: Vec<(f64, usize)> =
        found.iter().map(|&i| (squares(i), i)).filter(|(sum, _)| *sum > ROUNDING * all).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let one = |&(sum, i): &(f64, usize)| {
        let mut cells: BTreeMap<[i64; 2], f64> = BTreeMap::new();
        for (s, d) in samples[i].iter().zip(&distances[i]) {
            *cells.entry([s.position.x, s.position.y].map(|v| (v / CELL).floor() as i64)).or_default() += d * d;
        }
        let worst = cells.iter().rev().max_by(|a, b| a.1.total_cmp(b.1)).map_or([0; 2], |(&cell, _)| cell);
        Furthest {
            id: truth.objects[i].building.id.clone(),
            at: [origin.x + (worst[0] as f64 + 0.5) * CELL, origin.y + (worst[1] as f64 + 0.5) * CELL],
            rms: (sum / distances[i].len() as f64).sqrt(),
            share: sum / all,
        }
    };
    order.iter().take(NAMED).map(one).collect()
}

/// The mesh near buildings.
///
/// # Errors
/// If the buildings lie too far apart, or a triangle is larger than any city has.
pub(crate) fn mesh_near(
    mesh: impl Iterator<Item = [DVec3; 3]>,
    cities: &[&City<'_>],
) -> Result<Vec<[DVec3; 3]>, Error> {
    let mask = Mask::new(cities)?;
    let mut near = Vec::new();
    for triangle in mesh.filter(|t| t.iter().all(|p| p.is_finite()) && mask.touches(t)) {
        let area = budget::area(triangle);
        if area > budget::MESH_TRIANGLE {
            return Err(Error::NoCity { what: format!("a triangle of the mesh has {:.1} km²", area / 1e6) });
        }
        near.push(triangle);
    }
    Ok(near)
}

/// Square cells near a building.
struct Mask {
    bounds: Box2,
    width: usize,
    cells: Vec<bool>,
}

impl Mask {
    const CELL: f64 = 4.0;

    fn new(cities: &[&City<'_>]) -> Result<Self, Error> {
        let plans: Vec<Box2> = cities.iter().flat_map(|c| &c.objects).map(|o| o.plan().grown(REACH)).collect();
        let bounds = Box2::of(plans.iter().filter(|b| !b.is_empty()).flat_map(|b| [b.min, b.max]));
        if bounds.is_empty() {
            return Ok(Self { bounds, width: 0, cells: Vec::new() });
        }
        let size = (bounds.size() / Self::CELL).ceil() + 1.0;
        let cells = size.x * size.y;
        if cells > budget::MASK_CELLS || cells.is_nan() {
            let (width, height) = (bounds.size().x / 1e3, bounds.size().y / 1e3);
            let what = format!("the buildings lie up to {width:.1} × {height:.1} km apart");
            return Err(Error::NoCity { what });
        }
        let (width, height) = (size.x as usize, size.y as usize);
        let mut mask = Self { bounds, width, cells: vec![false; width * height] };
        for plan in plans.into_iter().filter(|b| !b.is_empty()) {
            let (low, high) = mask.range(plan);
            for row in low[1]..=high[1] {
                mask.cells[row * width + low[0]..=row * width + high[0]].fill(true);
            }
        }
        Ok(mask)
    }

    fn range(&self, plan: Box2) -> ([usize; 2], [usize; 2]) {
        let cell = |p: gable_geometry::DVec2| {
            let at = (p.clamp(self.bounds.min, self.bounds.max) - self.bounds.min) / Self::CELL;
            [at.x as usize, at.y as usize]
        };
        (cell(plan.min), cell(plan.max))
    }

    fn touches(&self, triangle: &[DVec3; 3]) -> bool {
        let plan = Box2::of(triangle.iter().map(|p| p.truncate()));
        if !plan.intersects(&self.bounds) {
            return false;
        }
        let (low, high) = self.range(plan);
        (low[1]..=high[1]).any(|row| self.cells[row * self.width + low[0]..=row * self.width + high[0]].contains(&true))
    }
}

/// Points on the outside of each building.
fn outside(city: &City<'_>, density: f64, seed: u64) -> Vec<Vec<Sample>> {
    let one = |(i, object): (usize, &crate::city::Object<'_>)| {
        let mut out = Vec::new();
        for (k, facet) in object.facets.iter().enumerate().filter(|(_, f)| f.semantic != Semantic::GroundSurface) {
            let first = out.len();
            sample(facet.corners, density, seed, &[i as i64, k as i64], &mut out);
            if facet.semantic == Semantic::WallSurface {
                let kept: Vec<Sample> = out.drain(first..).filter(|s| city.is_outside(s.position, s.normal)).collect();
                out.extend(kept);
            }
        }
        out
    };
    city.objects.par_iter().enumerate().map(one).collect()
}

/// Points on the roof surfaces of each building that has a LOD2.
fn on_lod2_roofs(city: &City<'_>, density: f64, seed: u64) -> Vec<Vec<Sample>> {
    let one = |(i, object): (usize, &crate::city::Object<'_>)| {
        let mut out = Vec::new();
        if !object.building.lods.lod2.is_empty() {
            let roofs = object.facets.iter().enumerate().filter(|(_, f)| f.semantic == Semantic::RoofSurface);
            roofs.for_each(|(k, facet)| sample(facet.corners, density, seed, &[i as i64, k as i64], &mut out));
        }
        out
    };
    city.objects.par_iter().enumerate().map(one).collect()
}

/// From a model's outside, and from its LOD2 roofs alone, to the mesh.
pub(crate) fn to_mesh(model: &City<'_>, mesh: Vec<[DVec3; 3]>, density: f64, seed: u64) -> [Spread; 2] {
    let mesh = Triangles::new(mesh);
    [outside(model, density, seed), on_lod2_roofs(model, density, seed)].map(|s| spread(&measure(&s, &mesh)))
}

fn triangles(city: &City<'_>, keep: impl Fn(Semantic) -> bool) -> Triangles {
    let facets = city.objects.iter().flat_map(|o| &o.facets);
    Triangles::new(facets.filter(|f| keep(f.semantic)).map(|f| f.corners).collect())
}

/// Distances of each group of samples.
fn measure(samples: &[Vec<Sample>], to: &Triangles) -> Vec<Vec<f64>> {
    samples.par_iter().map(|g| g.iter().map(|s| to.distance(s.position, CUT)).collect()).collect()
}

fn spread(distances: &[Vec<f64>]) -> Spread {
    Spread::of(distances.concat())
}

/// Distances between two cities, and the buildings that they come from most. `origin` is that of the truth.
pub(crate) fn distances(
    truth: &City<'_>,
    origin: DVec3,
    result: &City<'_>,
    coverage: &Coverage,
    mesh: Option<Vec<[DVec3; 3]>>,
    density: f64,
    seed: u64,
) -> (Distances, Vec<Furthest>) {
    let (ours, theirs) = (outside(truth, density, seed), outside(result, density, seed));
    let (truth_triangles, model) = (triangles(truth, |_| true), triangles(result, |_| true));
    let is_found = |i: &usize| truth.objects[*i].area >= 50.0 && coverage.truth[*i] >= COVERED;
    let found: Vec<usize> = (0..truth.objects.len()).filter(is_found).collect();
    let to_model = measure(&ours, &model);
    let mut out = Distances {
        truth_to_model: spread(&to_model),
        truth_to_model_found_from_50: Spread::of(found.iter().flat_map(|&i| &to_model[i]).copied().collect()),
        model_to_truth: spread(&measure(&theirs, &truth_triangles)),
        ..Distances::default()
    };
    if let Some(mesh) = mesh {
        let is_roof = |s: Semantic| s == Semantic::RoofSurface;
        let (truth_roofs, model_roofs) = (triangles(truth, is_roof), triangles(result, is_roof));
        let on_roof = |(k, &t): (usize, &[DVec3; 3])| {
            let mut points = Vec::new();
            sample(t, density, seed, &[-1, k as i64], &mut points);
            points.retain(|s| s.normal.z >= FACING_UP && truth_roofs.distance(s.position, 2.0 * ON_ROOF) <= ON_ROOF);
            points
        };
        let roof_points: Vec<Vec<Sample>> =
            mesh.par_iter().enumerate().map(on_roof).filter(|p| !p.is_empty()).collect();
        out.roof_points_to_roofs = Some(spread(&measure(&roof_points, &model_roofs)));
        let mesh = Triangles::new(mesh);
        out.model_to_mesh = Some(spread(&measure(&theirs, &mesh)));
        out.lod2_roofs_to_mesh = Some(spread(&measure(&on_lod2_roofs(result, density, seed), &mesh)));
        out.truth_to_mesh = Some(spread(&measure(&ours, &mesh)));
    }
    (out, furthest(truth, origin, &found, &ours, &to_model))
}
