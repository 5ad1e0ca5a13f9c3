//! What is placed in a scene, with the ground under it.

use super::Scene;
use super::building::{SceneBuilding, Style};
use super::cover_map::CoverMap;
use super::details::{alike, details, style};
use super::house::{Form, primitives};
use super::objects::{Clutter, Cover, Patch, Species, Thing, Tree};
use super::plot::around;
use super::primitive::{Oblong, Primitive};
use super::relief::Relief;
use gable_geometry::{Box2, Counter, DVec2};

/// Share of the houses of a row that look like the first one.
const ALIKE: f64 = 0.55;

/// What is placed, with the ground under it.
pub(crate) struct Builder {
    pub(crate) seed: u64,
    pub(crate) extent: Box2,
    pub(crate) relief: Relief,
    pub(crate) buildings: Vec<SceneBuilding>,
    pub(crate) trees: Vec<Tree>,
    pub(crate) clutter: Vec<Clutter>,
    pub(crate) patches: Vec<Patch>,
    pub(crate) covers: Option<CoverMap>,
    /// Looks of the row that is being built, pitched and flat.
    row: [Option<Style>; 2],
}

impl Builder {
    pub(crate) fn new(seed: u64, extent: Box2, slope: f64) -> Self {
        let relief = Relief::new(seed, slope, 1.5);
        Self {
            seed,
            extent,
            relief,
            buildings: Vec::new(),
            trees: Vec::new(),
            clutter: Vec::new(),
            patches: Vec::new(),
            covers: None,
            row: [None, None],
        }
    }

    pub(crate) fn finish(self) -> Scene {
        let Self { seed, extent, relief, buildings, trees, clutter, patches, covers, .. } = self;
        Scene::new(seed, extent, relief, buildings, trees, clutter, patches, covers)
    }

    /// The buildings so far as a scene of their own, to be asked where they stand; they are taken out.
    pub(crate) fn probe(&mut self) -> Scene {
        let buildings = std::mem::take(&mut self.buildings);
        Scene::new(0, self.extent, self.relief.clone(), buildings, vec![], vec![], vec![], None)
    }

    pub(crate) fn patch(&mut self, cover: Cover, plan: Oblong) {
        self.patches.push(Patch { cover, plan, outline: Vec::new(), level: None });
    }

    /// Ground cover inside a convex ring, counter-clockwise.
    pub(crate) fn area(&mut self, cover: Cover, ring: &[DVec2], axis: DVec2) {
        if ring.len() >= 3 {
            self.patches.push(Patch { cover, plan: around(ring, axis), outline: ring.to_vec(), level: None });
        }
    }

    /// Water on a plan, level, a little below the lowest ground around it.
    pub(crate) fn water(&mut self, plan: Oblong) {
        let border = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 0.0)].map(|(s, t)| plan.at(s, t));
        let lowest = border.iter().map(|p| self.relief.height(*p)).fold(f64::INFINITY, f64::min);
        self.patches.push(Patch { cover: Cover::Water, plan, outline: Vec::new(), level: Some(lowest - 0.7) });
    }

    /// Whether a patch of anything but lawn lies there.
    pub(crate) fn is_paved(&self, p: DVec2) -> bool {
        self.patches.iter().any(|patch| patch.cover != Cover::Grass && patch.covers(p))
    }

    /// Whether a ring lies inside what is sensed.
    pub(crate) fn fits(&self, ring: &[DVec2]) -> bool {
        ring.iter().all(|p| self.extent.grown(-2.0).contains(*p))
    }

    /// The next houses are a row: about half of them look alike.
    pub(crate) fn begin_row(&mut self) {
        self.row = [None, None];
    }

    /// Adds a building if it is inside the extent and valid; says whether it was added.
    pub(crate) fn house(&mut self, form: Form, plan: &Oblong, eave: f64, slope: f64, c: &mut Counter) -> bool {
        let flat = matches!(form, Form::Flat | Form::Terraces);
        if !self.fits(&plan.ring()) {
            return false;
        }
        for _ in 0..3 {
            let shape = primitives(form, plan, eave, slope, c);
            if self.add(form.name(), &shape, flat, c) {
                return true;
            }
        }
        self.add(Form::Gable.name(), &primitives(Form::Gable, plan, eave, slope, c), false, c)
    }

    /// Adds a building from primitives.
    pub(crate) fn add(&mut self, kind: &str, shape: &[Primitive], flat: bool, c: &mut Counter) -> bool {
        let id = format!("synthetic-{:06}", self.buildings.len());
        let look = match &self.row[usize::from(flat)] {
            Some(first) if c.unit() < ALIKE => alike(first, c),
            _ => style(flat, c),
        };
        let made = SceneBuilding::from_primitives(&id, kind, shape, &self.relief, look, c.bits());
        let Some(building) = made else { return false };
        self.row[usize::from(flat)].get_or_insert_with(|| building.style.clone());
        details(&building, c, &mut self.clutter);
        self.buildings.push(building);
        true
    }

    /// A tree of some species.
    pub(crate) fn tree(&mut self, place: DVec2, c: &mut Counter) {
        let species = species(c);
        self.tree_of(species, c.unit(), place, c);
    }

    /// A tree of a species; `size` is 0 for the smallest and 1 for the largest.
    pub(crate) fn tree_of(&mut self, species: Species, size: f64, place: DVec2, c: &mut Counter) {
        let between = |low: f64, high: f64| low + (high - low) * size;
        let (height, ratio) = match species {
            Species::Broadleaf | Species::Copper => (between(6.0, 16.0), c.range(0.27, 0.38)),
            Species::Conifer => (between(6.0, 17.0), c.range(0.17, 0.24)),
            Species::Poplar => (between(9.0, 18.0), c.range(0.1, 0.14)),
            Species::Fruit => (between(2.4, 5.0), c.range(0.35, 0.5)),
            Species::Palm => (between(4.0, 14.0), 3.4 / between(4.0, 14.0) * c.range(0.6, 1.0)),
            Species::Banana => (between(2.5, 6.0), c.range(0.3, 0.5)),
        };
        let clear = match species {
            Species::Conifer => 0.8,
            Species::Palm => (height - c.range(1.2, 2.2)).max(1.0),
            _ => height * c.range(0.18, 0.3),
        };
        let ground = self.relief.height(place);
        self.trees.push(Tree { place, ground, height, radius: height * ratio, clear, species, seed: c.bits() });
    }

    /// A row of trees of one species and about one size.
    pub(crate) fn tree_row(&mut self, from: DVec2, to: DVec2, pitch: f64, c: &mut Counter) {
        let (species, size) = (avenue(c), c.unit());
        let count = (from.distance(to) / pitch) as usize;
        for i in 0..count {
            // Some are missing, some were planted later.
            let draw = c.unit();
            if draw < 0.12 {
                continue;
            }
            let size = if draw < 0.22 { 0.3 * size } else { (size + c.range(-0.1, 0.1)).clamp(0.0, 1.0) };
            let at = from.lerp(to, (i as f64 + 0.5 + c.range(-0.1, 0.1)) / count as f64);
            self.tree_of(species, size, at, c);
        }
    }

    /// Trees whose crowns meet.
    pub(crate) fn grove(&mut self, centre: DVec2, count: usize, c: &mut Counter) {
        let main = avenue(c);
        for i in 0..count {
            let kind = if c.unit() < 0.6 { main } else { species(c) };
            // Sunflower seeds: evenly spread, no two at one place.
            let angle = i as f64 * 2.4 + c.range(-0.3, 0.3);
            let place = centre + DVec2::from_angle(angle) * (2.6 * (i as f64 + 0.3).sqrt() * c.range(0.85, 1.15));
            self.tree_of(kind, c.range(0.15, 1.0), place, c);
        }
    }

    /// Cars along a line.
    pub(crate) fn cars(&mut self, from: DVec2, to: DVec2, pitch: f64, share: f64, crossways: bool, c: &mut Counter) {
        let length = from.distance(to);
        let Some(along) = (to - from).try_normalize() else { return };
        for i in 0..(length / pitch) as usize {
            if c.unit() > share {
                continue;
            }
            let centre = from + along * ((i as f64 + 0.5) * pitch + c.range(-0.2, 0.2));
            let axis = DVec2::from_angle(c.range(-0.04, 0.04)).rotate(if crossways { along.perp() } else { along });
            // One in twelve is a van.
            let van = c.unit() < 0.08;
            let half_length = if van { c.range(2.5, 3.0) } else { c.range(1.9, 2.4) };
            let plan = Oblong { centre, axis, half_length, half_width: if van { 1.0 } else { 0.9 } };
            let low = self.relief.height(centre);
            let height = if van { c.range(2.1, 2.6) } else { c.range(1.35, 1.9) };
            self.clutter.push(Clutter { thing: Thing::Car, plan, low: low - 0.3, high: low + height, seed: c.bits() });
        }
    }

    /// A hedge or wall along a line.
    pub(crate) fn fence(&mut self, from: DVec2, to: DVec2, thing: Thing, height: f64, c: &mut Counter) {
        let pieces = (from.distance(to) / 6.0).ceil().max(1.0);
        for i in 0..pieces as usize {
            let (a, b) = (from.lerp(to, i as f64 / pieces), from.lerp(to, (i as f64 + 1.0) / pieces));
            let Some(axis) = (b - a).try_normalize() else { continue };
            let half_width = if thing == Thing::Hedge { 0.5 } else { 0.15 };
            let centre = a.midpoint(b);
            let plan = Oblong { centre, axis, half_length: a.distance(b) / 2.0 + 0.05, half_width };
            let low = self.relief.height(centre);
            self.clutter.push(Clutter { thing, plan, low: low - 0.5, high: low + height, seed: c.bits() });
        }
    }

    /// A hedge, a wall or nothing along the border of a garden.
    pub(crate) fn border(&mut self, from: DVec2, to: DVec2, c: &mut Counter) {
        match c.unit() {
            d if d < 0.42 => self.fence(from, to, Thing::Hedge, c.range(1.0, 2.4), c),
            d if d < 0.78 => self.fence(from, to, Thing::Wall, c.range(0.8, 1.9), c),
            _ => {}
        }
    }
}

fn species(c: &mut Counter) -> Species {
    match c.unit() {
        d if d < 0.5 => Species::Broadleaf,
        d if d < 0.62 => Species::Copper,
        d if d < 0.76 => Species::Conifer,
        d if d < 0.82 => Species::Poplar,
        _ => Species::Fruit,
    }
}

/// A species that is planted in rows and groups.
fn avenue(c: &mut Counter) -> Species {
    match c.unit() {
        d if d < 0.66 => Species::Broadleaf,
        d if d < 0.8 => Species::Copper,
        d if d < 0.92 => Species::Conifer,
        _ => Species::Poplar,
    }
}
