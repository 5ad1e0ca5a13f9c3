//! Places with what real ones have and the Dutch town has not: a quarter, features on it, all drawn from the seed.
//!
//! 1. The ground: a slope, then landforms, which take their ground.
//! 2. What needs much room: long halls, mosques, fields.
//! 3. The quarter, on what is left.
//! 4. Small constructions, materials, plants.
//! 5. Faults of the mesh, which change no truth: what they hide is left out of it.

mod campus;
mod farm;
mod high_rise;
mod industry;
mod village;

pub(crate) use industry::containers;

use super::Scene;
use super::builder::Builder;
use super::building::SceneBuilding;
use super::layout::{build_town, nothing_in_water};
use super::objects::Cover;
use super::primitive::Oblong;
use super::site::Site;
use super::{fabric, growth, landform};
use crate::look::Season;
use crate::sensing::faults::Faults;
use gable_geometry::{Box2, Counter, DVec2, dvec2};

/// Kinds of quarters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quarter {
    /// The Dutch town of the default city.
    Town,
    /// Houses and sheds along winding lanes, gardens.
    Village,
    /// Barns, silos, a farmhouse, fields and hedges.
    Farm,
    /// Long flat blocks with lawns and paths.
    Campus,
    /// Halls with yards, containers and trailers.
    Industry,
    /// Towers on podiums and slabs.
    HighRise,
    /// Fields and meadows without any house.
    Open,
}

impl Quarter {
    /// Every quarter.
    pub const ALL: [Self; 7] =
        [Self::Town, Self::Village, Self::Farm, Self::Campus, Self::Industry, Self::HighRise, Self::Open];

    /// Its name at the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Town => "town",
            Self::Village => "village",
            Self::Farm => "farm",
            Self::Campus => "campus",
            Self::Industry => "industry",
            Self::HighRise => "high-rise",
            Self::Open => "open",
        }
    }
}

macro_rules! features {
    ($($(#[$doc:meta])* $kind:ident $name:literal,)*) => {
        /// What a place has besides its quarter.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Feature {
            $($(#[$doc])* $kind,)*
        }

        impl Feature {
            /// Every feature.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Its name at the command line.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }
        }
    };
}

features! {
    /// A hillside in terraces with retaining walls.
    Terraces "terraces",
    /// A road or railway on an embankment.
    Embankment "embankment",
    /// Sunken courts.
    Court "court",
    /// Ponds.
    Pond "pond",
    /// A canal or harbour with quay walls.
    Quay "quay",
    /// A road in a cutting.
    Cutting "cutting",
    /// The same with bridges over it.
    Bridge "bridge",
    /// A plaza on two levels with flights of stairs.
    Stairs "stairs",
    /// Groves that hide the ground.
    Grove "grove",
    /// Fields with crops in rows.
    Crops "crops",
    /// Groves of bananas.
    Bananas "bananas",
    /// Palms.
    Palms "palms",
    /// Hedges against walls.
    Hedges "hedges",
    /// Corrugated sheets and lean-tos.
    Sheets "sheets",
    /// Cloths on poles and heaps under sheets.
    Tarpaulins "tarpaulins",
    /// Glass halls.
    GlassHall "glass-hall",
    /// A mosque with minarets.
    Minarets "minarets",
    /// Stacks.
    Stacks "stacks",
    /// Pergolas and open frames.
    Pergolas "pergolas",
    /// Green roofs.
    GreenRoofs "green-roofs",
    /// Halls with battered walls.
    Battered "battered",
    /// Eaves of about a metre.
    Eaves "eaves",
    /// A hall of 100 to 180 m.
    LongHall "long-hall",
    /// A mesh cut along a curve, with skirts and webs.
    Rim "rim",
    /// Holes of 5 to 50 m.
    Holes "holes",
    /// Pits 3 to 20 m under the ground.
    Pits "pits",
    /// Holes that were filled, without texture.
    Fill "fill",
}

/// A place.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Its quarter.
    pub quarter: Quarter,
    /// What it has besides.
    pub features: Vec<Feature>,
    /// Side of its square, metres; 40 to 1000.
    pub side: f64,
}

impl Place {
    /// A place of which everything is drawn: quarter, two to six features, size.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let mut c = Counter::keyed(seed, &[40]);
        let quarter = Quarter::ALL[c.index(Quarter::ALL.len())];
        let mut features: Vec<Feature> =
            (0..2 + c.index(5)).map(|_| Feature::ALL[c.index(Feature::ALL.len())]).collect();
        features.sort_unstable();
        features.dedup();
        let side = (c.range(100.0, 300.0) / 0.4).round() * 0.4;
        Self { quarter, features, side }
    }

    fn has(&self, feature: Feature) -> bool {
        self.features.contains(&feature)
    }
}

/// Makes the scene of a place; `slope` is that of the ground, at least 15 % under terraces.
pub(crate) fn scene(place: &Place, seed: u64, slope: f64, season: Season) -> Scene {
    let side = (place.side / 0.4).round() * 0.4;
    let extent = Box2 { min: DVec2::ZERO, max: DVec2::splat(side) };
    let mut c = Counter::keyed(seed, &[41]);
    let steep = if place.has(Feature::Terraces) { slope.max(c.range(0.15, 0.45)) } else { slope };
    let mut site = Site::new(Builder::new(seed, extent, steep), &mut c);
    // Every feature draws from a counter of its own, so that adding one moves none of the others' draws.
    for &feature in &place.features {
        shape_ground(&mut site, feature, &mut Counter::keyed(seed, &[42, feature as i64]));
    }
    for &feature in &place.features {
        claim_room(&mut site, feature, &mut Counter::keyed(seed, &[43, feature as i64]));
    }
    // What covers these stays over what covers the quarter.
    let mut claimed = std::mem::take(&mut site.town.patches);
    let mut draw = Counter::keyed(seed, &[44]);
    match place.quarter {
        Quarter::Town => town(&mut site, seed),
        Quarter::Village => village::fill(&mut site, &mut draw),
        Quarter::Farm => farm::fill(&mut site, &mut draw),
        Quarter::Campus => campus::fill(&mut site, &mut draw),
        Quarter::Industry => industry::fill(&mut site, &mut draw),
        Quarter::HighRise => high_rise::fill(&mut site, &mut draw),
        Quarter::Open => farm::fields(&mut site, &mut draw),
    }
    site.town.patches.append(&mut claimed);
    for &feature in &place.features {
        furnish(&mut site, feature, &mut Counter::keyed(seed, &[45, feature as i64]));
    }
    tidy(&mut site, season);
    let faults = Faults::draw(&site, &place.features, seed);
    let mut scene = site.town.finish();
    let seen = |b: &SceneBuilding| faults.share_left(b) >= 0.5;
    scene.hidden = (0..scene.buildings.len()).filter(|&b| !seen(&scene.buildings[b])).collect();
    scene.faults = faults;
    scene.fine_ground = true;
    scene
}

fn shape_ground(site: &mut Site, feature: Feature, c: &mut Counter) {
    match feature {
        Feature::Terraces => landform::terraces::place(site, c),
        Feature::Embankment => landform::embankment::place(site, c),
        Feature::Court => landform::court::place(site, c),
        Feature::Pond => landform::pond::place(site, c),
        Feature::Quay => landform::quay::place(site, c),
        Feature::Cutting => landform::cutting::place(site, false, c),
        Feature::Bridge => landform::cutting::place(site, true, c),
        Feature::Stairs => landform::stairs::place(site, c),
        _ => {}
    }
}

fn claim_room(site: &mut Site, feature: Feature, c: &mut Counter) {
    match feature {
        Feature::LongHall => fabric::long_hall::place(site, c),
        Feature::Minarets => fabric::towers::minarets(site, c),
        Feature::Battered => fabric::battered::place(site, c),
        Feature::GlassHall => fabric::glass::place(site, c),
        Feature::Crops => growth::crops::place(site, c),
        _ => {}
    }
}

fn furnish(site: &mut Site, feature: Feature, c: &mut Counter) {
    match feature {
        Feature::Stacks => fabric::towers::stacks(site, c),
        Feature::Pergolas => fabric::pergolas::place(site, c),
        Feature::Tarpaulins => fabric::tarpaulins::place(site, c),
        Feature::Sheets => fabric::sheets::place(site, c),
        Feature::GreenRoofs => fabric::green_roofs::place(site, c),
        Feature::Eaves => fabric::eaves::place(site, c),
        Feature::Hedges => growth::hedges::place(site, c),
        Feature::Grove => growth::grove::place(site, c),
        Feature::Bananas => growth::tropics::bananas(site, c),
        Feature::Palms => growth::tropics::palms(site, c),
        _ => {}
    }
}

/// The default town on the site's ground; what stands on the ground of landforms and of others goes.
fn town(site: &mut Site, seed: u64) {
    let relief = site.town.relief.clone();
    let mut other = Builder::new(seed, site.town.extent, 0.0);
    other.relief = relief;
    build_town(&mut other);
    let taken = |p: DVec2| {
        site.is_reserved(p)
            || !site.is_free(&Oblong { centre: p, axis: DVec2::X, half_length: 0.1, half_width: 0.1 }, 0.0)
    };
    let clear = |b: &SceneBuilding| {
        let size = b.bounds.size();
        let lattice = (0..=6).flat_map(|i| (0..=6).map(move |j| dvec2(f64::from(i), f64::from(j)) / 6.0));
        b.rims.iter().all(|r| !taken(r.from))
            && lattice.map(|s| b.bounds.min + size * s).all(|p| b.roof_at(p).is_none() || !taken(p))
    };
    let kept: Vec<SceneBuilding> = other.buildings.drain(..).filter(clear).collect();
    let on_kept = |p: DVec2| kept.iter().any(|b| b.roof_at(p).is_some());
    other.clutter.retain(|t| if t.thing.on_building() { on_kept(t.plan.centre) } else { !taken(t.plan.centre) });
    other.trees.retain(|t| !taken(t.place));
    site.town.patches.append(&mut other.patches);
    site.town.clutter.append(&mut other.clutter);
    site.town.trees.append(&mut other.trees);
    for mut building in kept {
        building.truth.id = format!("synthetic-{:06}", site.town.buildings.len());
        site.town.buildings.push(building);
    }
}

/// Nothing stands in water, in walls or beyond the rim; bare crowns are thinner for matching.
fn tidy(site: &mut Site, season: Season) {
    let probe = site.town.probe();
    let free = |p: DVec2| {
        let around = [dvec2(0.5, 0.0), dvec2(-0.5, 0.0), dvec2(0.0, 0.5), dvec2(0.0, -0.5)];
        around.iter().all(|d| probe.building_at(p + *d).is_none())
    };
    let inside = site.town.extent.grown(-1.0);
    site.town.trees.retain(|t| inside.contains(t.place) && free(t.place));
    site.town.clutter.retain(|t| t.thing.on_building() || (inside.contains(t.plan.centre) && free(t.plan.centre)));
    site.town.buildings = probe.buildings;
    let canopies: Vec<_> = site.town.clutter.iter().copied().filter(|t| t.thing.is_canopy()).collect();
    nothing_in_water(&mut site.town);
    // Bridges hang over it.
    let lost = canopies.into_iter().filter(|t| !site.town.clutter.iter().any(|k| k.seed == t.seed)).collect::<Vec<_>>();
    site.town.clutter.extend(lost);
    if season.is_bare() {
        for tree in site.town.trees.iter_mut().filter(|t| !t.species.is_evergreen()) {
            (tree.radius, tree.height) = (0.62 * tree.radius, 0.86 * tree.height);
        }
    }
}

/// Ground cover over the whole site, under everything that comes later.
pub(super) fn whole(site: &mut Site, cover: Cover) {
    let size = site.size();
    let plan = Oblong { centre: site.middle(), axis: DVec2::X, half_length: size.x, half_width: size.y };
    site.town.patch(cover, plan);
}
