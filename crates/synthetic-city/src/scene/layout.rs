//! A procedural town: streets around blocks of different kinds, each with its own azimuth.

use super::Scene;
use super::building::SceneBuilding;
use super::details::{details, style};
use super::house::{Form, part, primitives, row_units, turned};
use super::objects::{Clutter, Cover, Patch, Species, Thing, Tree};
use super::primitive::Oblong;
use super::relief::Relief;
use gable_geometry::{Box2, Counter, DVec2, dvec2};

/// Share of the trees that stand at walls or under eaves.
const TREES_AT_WALLS: f64 = 0.22;

/// What is placed, with the ground under it.
pub(crate) struct Builder {
    pub(crate) seed: u64,
    pub(crate) extent: Box2,
    pub(crate) relief: Relief,
    pub(crate) buildings: Vec<SceneBuilding>,
    pub(crate) trees: Vec<Tree>,
    pub(crate) clutter: Vec<Clutter>,
    pub(crate) patches: Vec<Patch>,
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
        }
    }

    pub(crate) fn finish(self) -> Scene {
        Scene::new(self.seed, self.extent, self.relief, self.buildings, self.trees, self.clutter, self.patches)
    }

    pub(crate) fn patch(&mut self, cover: Cover, plan: Oblong) {
        self.patches.push(Patch { cover, plan, level: None });
    }

    /// Water on a plan, level, a little below the lowest ground around it.
    pub(crate) fn water(&mut self, plan: Oblong) {
        let border = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 0.0)].map(|(s, t)| plan.at(s, t));
        let lowest = border.iter().map(|p| self.relief.height(*p)).fold(f64::INFINITY, f64::min);
        self.patches.push(Patch { cover: Cover::Water, plan, level: Some(lowest - 0.7) });
    }

    fn fits(&self, plan: &Oblong) -> bool {
        plan.ring().iter().all(|p| self.extent.grown(-2.0).contains(*p))
    }

    /// Adds a building if it is inside the extent and valid; says whether it was added.
    pub(crate) fn house(&mut self, form: Form, plan: &Oblong, eave: f64, slope: f64, c: &mut Counter) -> bool {
        let flat = matches!(form, Form::Flat | Form::Terraces);
        if !self.fits(plan) {
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
    pub(crate) fn add(
        &mut self,
        kind: &str,
        shape: &[super::primitive::Primitive],
        flat: bool,
        c: &mut Counter,
    ) -> bool {
        let id = format!("synthetic-{:06}", self.buildings.len());
        let look = style(flat, c);
        let made = SceneBuilding::from_primitives(&id, kind, shape, &self.relief, look, c.bits());
        let Some(building) = made else { return false };
        details(&building, c, &mut self.clutter);
        self.buildings.push(building);
        true
    }

    pub(crate) fn tree(&mut self, place: DVec2, c: &mut Counter) {
        let species = match c.unit() {
            d if d < 0.5 => Species::Broadleaf,
            d if d < 0.62 => Species::Copper,
            d if d < 0.76 => Species::Conifer,
            d if d < 0.84 => Species::Poplar,
            _ => Species::Fruit,
        };
        let (height, ratio) = match species {
            Species::Broadleaf | Species::Copper => (c.range(6.0, 15.0), c.range(0.27, 0.38)),
            Species::Conifer => (c.range(7.0, 17.0), c.range(0.17, 0.24)),
            Species::Poplar => (c.range(10.0, 18.0), c.range(0.1, 0.14)),
            Species::Fruit => (c.range(3.0, 5.0), c.range(0.35, 0.5)),
        };
        let clear = if species == Species::Conifer { 0.8 } else { height * c.range(0.18, 0.3) };
        let ground = self.relief.height(place);
        self.trees.push(Tree { place, ground, height, radius: height * ratio, clear, species, seed: c.bits() });
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
            let axis = if crossways { along.perp() } else { along };
            let plan = Oblong { centre, axis, half_length: c.range(1.9, 2.4), half_width: 0.9 };
            let low = self.relief.height(centre);
            self.clutter.push(Clutter {
                thing: Thing::Car,
                plan,
                low: low - 0.3,
                high: low + c.range(1.35, 1.9),
                seed: c.bits(),
            });
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
}

/// Makes a town of about the given area, km².
pub(crate) fn town(seed: u64, area_km2: f64, slope: f64) -> Scene {
    let side = (area_km2.sqrt() * 1000.0 / 0.4).round() * 0.4;
    let extent = Box2 { min: DVec2::ZERO, max: DVec2::splat(side) };
    let mut town = Builder::new(seed, extent, slope);
    let mut c = Counter::keyed(seed, &[1]);
    let heading = c.range(0.0, 90.0).to_radians();
    let (along, across) = (DVec2::from_angle(heading), DVec2::from_angle(heading).perp());
    let (pitch_u, pitch_v) = (74.0, 62.0);
    let reach = (side / 2.0 * std::f64::consts::SQRT_2 / pitch_v).ceil() as i64 + 1;
    let cell = |i: i64, j: i64| {
        let centre = extent.max / 2.0 + along * ((i as f64 + 0.5) * pitch_u) + across * ((j as f64 + 0.5) * pitch_v);
        Oblong { centre, axis: along, half_length: pitch_u / 2.0, half_width: pitch_v / 2.0 }
    };
    let mut blocks = Vec::new();
    for i in -reach..=reach {
        for j in -reach..=reach {
            let plan = cell(i, j);
            if Box2::of(plan.ring()).intersects(&extent) {
                blocks.push((i, j, plan));
            }
        }
    }
    // One street in six is a canal.
    let canal = Counter::keyed(seed, &[6]).index(6) as i64;
    for (i, j, plan) in &blocks {
        streets(&mut town, plan, j.rem_euclid(6) == canal, &mut Counter::keyed(seed, &[2, *i, *j]));
    }
    for (i, j, plan) in &blocks {
        fill_block(&mut town, plan, &mut Counter::keyed(seed, &[3, *i, *j]));
    }
    trees_at_walls(&mut town);
    let inside = town.extent.grown(-1.0);
    town.trees.retain(|t| inside.contains(t.place));
    town.clutter.retain(|t| inside.contains(t.plan.centre));
    nothing_in_water(&mut town);
    town.finish()
}

/// Takes away what would stand in water.
pub(crate) fn nothing_in_water(town: &mut Builder) {
    let water: Vec<Oblong> = town.patches.iter().filter(|p| p.cover == Cover::Water).map(|p| p.plan).collect();
    let boxes: Vec<Box2> = water.iter().map(|w| Box2::of(w.ring())).collect();
    let bins = crate::bins::Bins::new(&boxes);
    let dry = |p: DVec2| bins.touching(&Box2 { min: p, max: p }).into_iter().all(|n| !water[n].contains(p));
    town.trees.retain(|t| dry(t.place));
    town.clutter.retain(|t| t.thing.on_building() || dry(t.plan.centre));
}

/// Half of a street on each side of a cell, with pavement, cars and street trees. The first may be a canal, whose level
/// falls from weir to weir, and which ends at the streets that cross it.
fn streets(town: &mut Builder, cell: &Oblong, canal: bool, c: &mut Counter) {
    for (plan, half) in [(*cell, 4.0), (turned(cell), 3.4)] {
        let edge = Oblong { centre: plan.at(0.0, -1.0), half_width: half, ..plan };
        town.patch(Cover::Pavement, Oblong { half_width: half + 1.8, half_length: plan.half_length + half, ..edge });
    }
    for (n, (plan, half)) in [(*cell, 4.0), (turned(cell), 3.4)].into_iter().enumerate() {
        if canal && n == 0 {
            let whole =
                Oblong { half_length: plan.half_length - 5.4, half_width: 3.6, centre: plan.at(0.0, -1.0), ..plan };
            for k in 0..4 {
                let s = (f64::from(k) - 1.5) / 2.0;
                town.water(Oblong { centre: whole.at(s, 0.0), half_length: whole.half_length / 4.0, ..whole });
            }
            continue;
        }
        let edge =
            Oblong { centre: plan.at(0.0, -1.0), half_width: half, half_length: plan.half_length + half, ..plan };
        town.patch(Cover::Asphalt, edge);
        let side = |s: f64, t: f64| edge.centre + edge.axis * (s * (plan.half_length - 6.0)) + edge.axis.perp() * t;
        town.cars(side(-1.0, half - 1.1), side(1.0, half - 1.1), 6.2, 0.45, false, c);
        if c.unit() < 0.6 {
            for k in -3..=3 {
                if c.unit() < 0.7 {
                    town.tree(side(f64::from(k) / 3.3, half + 1.0), c);
                }
            }
        }
    }
}

fn fill_block(town: &mut Builder, cell: &Oblong, c: &mut Counter) {
    let lot = Oblong { half_length: cell.half_length - 6.2, half_width: cell.half_width - 6.8, ..*cell };
    let place = (lot.centre * 10.0).round();
    let draw = Counter::keyed(town.seed, &[8, place.x as i64, place.y as i64]).unit();
    town.patch(
        if draw < 0.6 {
            Cover::Grass
        } else if draw < 0.8 {
            Cover::Pavement
        } else {
            Cover::Yard
        },
        lot,
    );
    let turn = c.range(-14.0, 14.0) * if c.unit() < 0.6 { 1.0 } else { 0.0 };
    let shrink = 1.0 - 0.0125 * turn.abs();
    let plan = Oblong {
        axis: DVec2::from_angle(cell.axis.to_angle() + turn.to_radians()),
        half_length: lot.half_length * shrink,
        half_width: lot.half_width * shrink,
        ..lot
    };
    match c.unit() {
        d if d < 0.34 => detached(town, &plan, c),
        d if d < 0.56 => rows(town, &plan, c),
        d if d < 0.72 => perimeter(town, &plan, c),
        d if d < 0.86 => flats(town, &plan, c),
        d if d < 0.94 => old_town(town, &plan, c),
        _ => park(town, &plan, c),
    }
}

const DETACHED: [Form; 12] = [
    Form::Gable,
    Form::Hip,
    Form::HalfHip,
    Form::Mansard,
    Form::Shed,
    Form::Pyramid,
    Form::CrossGable,
    Form::LShape,
    Form::TShape,
    Form::Flat,
    Form::Skew,
    Form::Gable,
];

/// Single houses on parcels.
fn detached(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    let columns = 3;
    for i in 0..columns {
        for j in 0..2 {
            let s = (f64::from(i) * 2.0 + 1.0) / f64::from(columns) - 1.0;
            let t = f64::from(j) - 0.5;
            let parcel = part(plan, s - 0.33, s + 0.33, t - 0.5, t + 0.5);
            let form = DETACHED[c.index(DETACHED.len())];
            let wide = matches!(form, Form::LShape | Form::TShape);
            let (length, width) =
                if wide { (c.range(6.0, 8.0), c.range(5.6, 7.4)) } else { (c.range(5.0, 7.5), c.range(3.8, 5.4)) };
            let house = Oblong {
                centre: parcel.at(c.range(-0.15, 0.15), c.range(-0.2, 0.2)),
                axis: DVec2::from_angle(parcel.axis.to_angle() + c.range(-0.07, 0.07)),
                half_length: length.min(parcel.half_length - 1.5),
                half_width: width.min(parcel.half_width - 2.0),
            };
            let house = if c.unit() < 0.3 && !wide { turned(&house) } else { house };
            town.house(form, &house, c.range(3.2, 6.4), c.range(0.5, 1.0), c);
            let thing = if c.unit() < 0.5 { Thing::Hedge } else { Thing::Wall };
            let height = if thing == Thing::Hedge { c.range(1.0, 2.0) } else { c.range(0.8, 1.8) };
            town.fence(parcel.at(1.0, -0.95), parcel.at(1.0, 0.95), thing, height, c);
            if c.unit() < 0.5 {
                let shed = Oblong {
                    centre: parcel.at(-0.72, 0.8 * (2.0 * t)),
                    axis: parcel.axis,
                    half_length: 1.6,
                    half_width: 1.3,
                };
                town.house(if c.unit() < 0.5 { Form::Flat } else { Form::Shed }, &shed, 2.3, 0.2, c);
            }
            for _ in 0..3 {
                let corner = parcel.at(c.range(-0.95, 0.95), if c.unit() < 0.5 { -0.88 } else { 0.88 });
                town.tree(corner, c);
            }
        }
    }
}

/// Two rows of houses with party walls and different eaves.
fn rows(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    for side in [-1.0, 1.0] {
        let depth = c.range(4.6, 5.6);
        let row = Oblong {
            centre: plan.at(0.0, side * (1.0 - depth / plan.half_width)),
            half_width: depth,
            half_length: plan.half_length * 0.94,
            ..*plan
        };
        let n = (row.half_length * 2.0 / c.range(6.0, 8.5)) as usize;
        let (eave, slope, flat) = (c.range(5.0, 8.5), c.range(0.55, 0.95), c.unit() < 0.15);
        for unit in row_units(&row, n.max(2), c) {
            let step = if c.unit() < 0.5 { c.range(-1.2, 1.2) } else { 0.0 };
            let form = if flat { Form::Flat } else { Form::Gable };
            let steeper = slope * if c.unit() < 0.3 { c.range(0.85, 1.15) } else { 1.0 };
            town.house(form, &unit, eave + step, steeper, c);
            if c.unit() < 0.7 {
                let at = unit.centre - plan.axis.perp() * (side * (depth + c.range(4.0, 9.0)));
                town.tree(at, c);
            }
            let a = unit.at(1.0, -side);
            let b = a - plan.axis.perp() * (side * (plan.half_width - 2.0 * depth).max(1.0));
            if c.unit() < 0.6 {
                town.fence(a, b, if c.unit() < 0.6 { Thing::Hedge } else { Thing::Wall }, c.range(1.0, 1.9), c);
            }
        }
    }
}

/// One building around a yard, or four wings of several houses.
fn perimeter(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    let yard = Oblong { half_length: plan.half_length - 9.0, half_width: plan.half_width - 9.0, ..*plan };
    town.patch(if c.unit() < 0.5 { Cover::Yard } else { Cover::Grass }, yard);
    if c.unit() < 0.5 {
        let small = c.range(0.7, 0.95);
        let body = Oblong { half_length: plan.half_length * small, half_width: plan.half_width * small, ..*plan };
        town.house(Form::Courtyard, &body, c.range(8.0, 14.0), c.range(0.5, 0.8), c);
        town.tree(plan.at(c.range(-0.15, 0.15), c.range(-0.15, 0.15)), c);
        return;
    }
    let wing = c.range(5.0, 6.0);
    let (s, t) = (2.0 * wing / plan.half_length, 2.0 * wing / plan.half_width);
    let sides = [
        (part(plan, -1.0, 1.0, -1.0, -1.0 + t), 4),
        (part(plan, -1.0, 1.0, 1.0 - t, 1.0), 4),
        (turned(&part(plan, -1.0, -1.0 + s, -1.0 + t, 1.0 - t)), 2),
        (turned(&part(plan, 1.0 - s, 1.0, -1.0 + t, 1.0 - t)), 2),
    ];
    let slope = c.range(0.6, 1.0);
    for (side, n) in sides {
        for unit in row_units(&side, n, c) {
            let form = [Form::Gable, Form::Gable, Form::Mansard, Form::Flat][c.index(4)];
            let eave = c.range(9.0, 14.0);
            if form == Form::Mansard {
                // Between party walls a mansard has its steep planes on the two open sides only.
                let ring = unit.ring();
                let rise = |edge, eave, slope| super::primitive::Rise { edge, eave, slope };
                let knee = eave + 2.5 - 0.4 * 2.5 / 2.1;
                let rises = [rise(0, eave, 2.1), rise(2, eave, 2.1), rise(0, knee, 0.4), rise(2, knee, 0.4)];
                if town.fits(&unit) {
                    town.add(form.name(), &[super::primitive::Primitive::rising(ring, &rises)], false, c);
                }
            } else {
                town.house(form, &unit, eave, slope, c);
            }
        }
    }
    for _ in 0..4 {
        town.tree(yard.at(c.range(-0.6, 0.6), c.range(-0.6, 0.6)), c);
    }
}

/// Large flat roofs, terraces, halls and a car park.
fn flats(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    town.patch(Cover::Parking, *plan);
    let body = part(plan, -0.95, 0.3, -0.9, 0.2);
    let form = [Form::Flat, Form::Terraces, Form::LShape, Form::Gable][c.index(4)];
    let slope = if form == Form::Gable { 0.25 } else { 0.5 };
    town.house(form, &body, c.range(6.0, 18.0), slope, c);
    town.house(Form::Flat, &part(plan, 0.3, 0.75, -0.7, 0.05), c.range(3.5, 6.0), 0.0, c);
    for t in [0.45, 0.8] {
        town.cars(plan.at(-0.9, t), plan.at(0.9, t), 2.7, 0.5, true, c);
    }
    for i in 0..5 {
        town.tree(plan.at(-0.85 + 0.42 * f64::from(i), 0.62), c);
    }
}

/// A hall with a tower and odd houses about it.
fn old_town(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    town.patch(Cover::Yard, *plan);
    town.house(Form::Tower, &part(plan, -0.55, 0.45, -0.3, 0.45), c.range(7.0, 10.0), c.range(0.8, 1.1), c);
    for (s, t) in [(-0.78, -0.72), (0.0, -0.78), (0.75, -0.6), (0.78, 0.55), (-0.78, 0.7)] {
        let form = [Form::Skew, Form::HalfHip, Form::CrossGable, Form::LShape, Form::Pyramid][c.index(5)];
        let house = Oblong {
            centre: plan.at(s, t),
            axis: DVec2::from_angle(plan.axis.to_angle() + c.range(-0.3, 0.3)),
            half_length: 4.6,
            half_width: c.range(3.6, 4.2),
        };
        town.house(form, &house, c.range(4.0, 7.0), c.range(0.7, 1.1), c);
    }
    for _ in 0..6 {
        town.tree(plan.at(c.range(-0.4, 0.4), c.range(0.6, 0.95)), c);
    }
}

/// Lawn, trees and a pavilion.
fn park(town: &mut Builder, plan: &Oblong, c: &mut Counter) {
    for _ in 0..26 {
        let place = plan.at(c.range(-0.95, 0.95), c.range(-0.95, 0.95));
        if place.distance(plan.centre) > 9.0 {
            town.tree(place, c);
        }
    }
    let path = Oblong { half_width: 1.5, ..*plan };
    town.patch(Cover::Soil, path);
    town.water(part(plan, 0.3, 0.85, 0.25, 0.85));
    let pavilion = Oblong { half_length: 4.0, half_width: 4.0, ..*plan };
    town.house(Form::Pyramid, &pavilion, 3.2, 0.6, c);
}

/// Drops trees that stand in buildings and puts some at walls, so that their crowns touch.
fn trees_at_walls(town: &mut Builder) {
    let probe =
        Scene::new(0, town.extent, town.relief.clone(), std::mem::take(&mut town.buildings), vec![], vec![], vec![]);
    let mut c = Counter::keyed(town.seed, &[4]);
    let mut kept = Vec::new();
    for mut tree in std::mem::take(&mut town.trees) {
        if c.unit() < TREES_AT_WALLS && !probe.buildings.is_empty() {
            let near = probe.buildings_in(&Box2 { min: tree.place, max: tree.place }.grown(25.0));
            if !near.is_empty() {
                let rims = &probe.buildings[near[c.index(near.len())]].rims;
                let rim = rims[c.index(rims.len())];
                if let Some(along) = (rim.to - rim.from).try_normalize() {
                    let at = rim.from.lerp(rim.to, c.range(0.15, 0.85));
                    tree.place = at - along.perp() * (tree.radius * c.range(0.45, 0.95)).max(0.7);
                    tree.ground = town.relief.height(tree.place);
                }
            }
        }
        let around = [dvec2(0.6, 0.0), dvec2(-0.6, 0.0), dvec2(0.0, 0.6), dvec2(0.0, -0.6)];
        if around.iter().all(|d| probe.building_at(tree.place + *d).is_none()) {
            kept.push(tree);
        }
    }
    town.trees = kept;
    town.buildings = probe.buildings;
}
