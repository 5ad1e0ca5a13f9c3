//! A scene from a city model: its LOD2 buildings on other ground, repeated if wanted.

use super::Scene;
use super::builder::Builder;
use super::building::{RoofFace, SceneBuilding, attributes, roof_faces, roof_vertices};
use super::cover_map::{CoverMap, Placement};
use super::details::{details, style};
use super::surroundings::surroundings;
use crate::error::SynthError;
use gable_city_model::{Building, CityModel, Lods, Shell};
use gable_geometry::{Box2, Counter, DVec2, DVec3, dvec2};

/// Free ground around the buildings, metres.
const BORDER: f64 = 20.0;

/// How a copy of the city lies.
struct Copy {
    placement: Placement,
    /// Factor of heights above the eave.
    steepness: f64,
}

/// Builds the scene: `repeat` × `repeat` copies of the model.
pub(crate) fn scene(model: &CityModel, repeat: u32, seed: u64, slope: f64) -> Result<Scene, SynthError> {
    let usable: Vec<&Building> = model.buildings.iter().filter(|b| !b.lods.lod2.is_empty()).collect();
    let around = Box2::of(usable.iter().flat_map(|b| &b.lods.lod2).flat_map(|s| &s.vertices).map(|v| v.truncate()));
    if around.is_empty() {
        return Err(SynthError::EmptyTruth);
    }
    let centre = (around.min + around.max) / 2.0;
    // Copies are turned by right angles, so each has a square place.
    let side = ((around.size().max_element() + 2.0 * BORDER) / 0.4).ceil() * 0.4;
    let size = if repeat == 1 {
        ((around.size() + 2.0 * BORDER) / 0.4).ceil() * 0.4
    } else {
        DVec2::splat(side * f64::from(repeat))
    };
    let mut builder = Builder::new(seed, Box2 { min: DVec2::ZERO, max: size }, slope);
    let mut placements = Vec::new();
    for n in 0..repeat * repeat {
        let (i, j) = (n % repeat, n / repeat);
        let mut c = Counter::keyed(seed, &[20, i64::from(n)]);
        let shift = if repeat == 1 { size / 2.0 } else { (dvec2(f64::from(i), f64::from(j)) + 0.5) * side };
        let copy = if n == 0 {
            Copy { placement: Placement { turn: 0, mirror: false, shift }, steepness: 1.0 }
        } else {
            let placement = Placement { turn: c.index(4), mirror: c.unit() < 0.5, shift };
            Copy { placement, steepness: c.range(0.9, 1.1) }
        };
        placements.push(copy.placement);
        for building in &usable {
            let id = if n == 0 { building.id.clone() } else { format!("{}-copy{n}", building.id) };
            place(&mut builder, building, id, &copy, centre, &mut c);
        }
    }
    if builder.buildings.is_empty() {
        return Err(SynthError::EmptyTruth);
    }
    let plans: Vec<Vec<DVec2>> = usable.iter().flat_map(|b| plans(b, centre)).collect();
    let place_side = if repeat == 1 { f64::INFINITY } else { side };
    builder.covers = Some(CoverMap::new(&plans, seed, place_side, placements));
    surroundings(&mut builder);
    Ok(builder.finish())
}

/// Plans of the roofs of a building relative to the centre of the model.
fn plans(building: &Building, centre: DVec2) -> Vec<Vec<DVec2>> {
    let roofs = building.lods.lod2.iter().flat_map(roof_faces);
    roofs.map(|f| f.polygon.outer.iter().map(|p| *p - centre).collect()).collect()
}

impl Copy {
    fn apply(&self, p: DVec3, centre: DVec2) -> DVec3 {
        self.placement.apply(p.truncate() - centre).extend(p.z)
    }

    /// A mirrored shell has its rings turned about, so that they still face outside.
    fn shell(&self, shell: &Shell, centre: DVec2, height: &dyn Fn(f64) -> f64) -> Shell {
        let vertices = shell.vertices.iter().map(|v| self.apply(DVec3::new(v.x, v.y, height(v.z)), centre)).collect();
        let mut faces = shell.faces.clone();
        if self.placement.mirror {
            faces.iter_mut().flat_map(|f| &mut f.rings).for_each(|r| r.reverse());
        }
        Shell { vertices, faces }
    }
}

/// A roof that is at least as high as this over its own ground stays so over a slope, metres.
const CLEARANCE: f64 = 2.2;

fn place(builder: &mut Builder, building: &Building, id: String, copy: &Copy, centre: DVec2, c: &mut Counter) {
    let shells = &building.lods.lod2;
    let low = shells.iter().flat_map(|s| &s.vertices).map(|v| v.z).fold(f64::INFINITY, f64::min);
    let eave = shells.iter().flat_map(roof_vertices).map(|v| v.z).fold(f64::INFINITY, f64::min);
    let plan = Box2::of(shells.iter().flat_map(|s| &s.vertices).map(|v| copy.apply(*v, centre).truncate()));
    let corners = [plan.min, plan.max, dvec2(plan.min.x, plan.max.y), dvec2(plan.max.x, plan.min.y)];
    let ground = corners.iter().map(|p| builder.relief.height(*p)).fold(f64::INFINITY, f64::min);
    let ground = (ground * 1e3).floor() / 1e3;
    // Walls grow as the ground falls; roofs keep their height over the middle of the plan, but none is dug in where the ground
    // rises: a long hall on a slope stands on the upper end.
    let lift = builder.relief.height((plan.min + plan.max) / 2.0) - low;
    let steep = |z: f64| z + (z - eave).max(0.0) * (copy.steepness - 1.0);
    let sunk = shells.iter().flat_map(roof_vertices).filter(|v| v.z - low > 1e-6).map(|v| {
        let free = (v.z - low).min(CLEARANCE);
        builder.relief.height(copy.apply(v, centre).truncate()) + free - (lift + steep(v.z))
    });
    let lift = lift + sunk.fold(0.0, f64::max);
    let height = |z: f64| if (z - low).abs() < 1e-6 { ground } else { lift + steep(z) };
    let move_all = |list: &[Shell]| list.iter().map(|s| copy.shell(s, centre, &height)).collect::<Vec<_>>();
    let flat = |shell: &Option<Shell>| shell.as_ref().map(|s| copy.shell(s, centre, &height));
    let lods = Lods {
        footprint: flat(&building.lods.footprint),
        roof_edge: flat(&building.lods.roof_edge),
        lod1: move_all(&building.lods.lod1),
        lod2: move_all(shells),
    };
    let roof: Vec<RoofFace> = lods.lod2.iter().flat_map(roof_faces).collect();
    if roof.is_empty() {
        return;
    }
    let sloped = roof.iter().any(|f| f.plane.slope() > 0.15);
    let facts = attributes(if sloped { "slanted" } else { "flat" }, &lods.lod2[0], ground);
    let mut look = style(!sloped, c);
    look.overhang = if sloped { look.overhang.min(0.2) } else { 0.0 };
    let truth = Building { id, attributes: facts, lods };
    let made = SceneBuilding::from_truth(truth, ground, roof, look, c.bits());
    details(&made, c, &mut builder.clutter);
    builder.buildings.push(made);
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_city_model::{Face, Semantic};

    /// A box with its corner at the origin.
    fn hall(length: f64, height: f64) -> Building {
        let plan = [dvec2(0.0, 0.0), dvec2(length, 0.0), dvec2(length, 20.0), dvec2(0.0, 20.0)];
        let vertices = [0.0, height].iter().flat_map(|&z| plan.map(|p| p.extend(z))).collect();
        let face =
            |ring: [u32; 4], semantic| Face { rings: vec![ring.to_vec()], semantic, attributes: Default::default() };
        let mut faces = vec![face([0, 3, 2, 1], Semantic::GroundSurface), face([4, 5, 6, 7], Semantic::RoofSurface)];
        faces.extend((0..4).map(|i| face([i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4], Semantic::WallSurface)));
        let lods = Lods { lod2: vec![Shell { vertices, faces }], ..Lods::default() };
        Building { id: format!("{length}"), attributes: Default::default(), lods }
    }

    #[test]
    fn no_roof_is_dug_into_a_slope() {
        let buildings = vec![hall(200.0, 5.0), hall(10.0, 5.0), hall(150.0, 1.0)];
        let model = CityModel {
            title: String::new(),
            metadata: Default::default(),
            origin: [0.0; 3],
            crs: gable_geometry::Crs::Unknown,
            buildings,
            terrain: None,
        };
        for slope in [0.0, 0.05, 0.15] {
            let scene = scene(&model, 1, 3, slope).expect("a scene");
            let free = |b: &SceneBuilding| {
                let roofs = b.truth.lods.lod2.iter().flat_map(roof_vertices);
                roofs.map(|v| v.z - scene.relief.height(v.truncate())).fold(f64::INFINITY, f64::min)
            };
            let found: Vec<f64> = scene.buildings.iter().map(free).collect();
            assert!(found[0] > CLEARANCE - 1e-6 && found[2] > 1.0 - 1e-6, "{slope}: {found:?}");
            // A small one stands as it stood.
            assert!(found[1] > 3.0, "{slope}: {found:?}");
        }
    }
}
