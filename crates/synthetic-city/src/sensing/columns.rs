//! The scene in columns on an absolute lattice of 0.2 m: what is solid over each place.
//!
//! Every object is solid between a lower and an upper height over each place, so a column is the
//! ground with what stands on it, one slab (eave, balcony) and one crown.

mod things;

use super::COLUMN;

use crate::scene::Scene;
use crate::scene::objects::Cover;
use gable_geometry::{Box2, DVec2, DVec3, dvec2, ring_contains};

/// No object.
pub(crate) const NONE: u32 = u32::MAX;

/// Classes of label rasters and mesh faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Class {
    /// Streets, yards, soil.
    Ground = 0,
    /// Lawn.
    Grass = 1,
    /// Trees and hedges.
    Tree = 2,
    /// Buildings with everything on them.
    Building = 3,
    /// Cars, garden walls and what matching invents.
    Clutter = 4,
}

/// What a slab is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slab {
    None,
    Eave,
    Balcony,
    Floater,
    /// A bridge, a pergola, a cloth: no building.
    Canopy,
}

/// A column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    /// Bare ground.
    pub(crate) ground: f32,
    /// Upper end of what stands on the ground.
    pub(crate) solid: f32,
    pub(crate) slab: (f32, f32),
    pub(crate) crown: (f32, f32),
    /// Building that stands here, or whose eave hangs here.
    pub(crate) building: u32,
    pub(crate) face: u16,
    pub(crate) slab_kind: Slab,
    pub(crate) cover: Cover,
    pub(crate) tree: u32,
    /// Clutter at the top of the solid.
    pub(crate) clutter: u32,
    pub(crate) patch: u32,
    /// Clutter that is the slab.
    pub(crate) canopy: u32,
}

impl Column {
    /// Upper end of everything.
    pub(crate) fn top(&self) -> f32 {
        self.solid.max(self.slab.1).max(self.crown.1)
    }

    /// Upper end of what hides other things; blobs in the air hide nothing.
    pub(crate) fn opaque_top(&self) -> f32 {
        let slab = if self.slab_kind == Slab::Floater { f32::NEG_INFINITY } else { self.slab.1 };
        self.solid.max(slab).max(self.crown.1)
    }

    /// Whether a building stands here (its eaves do not count).
    pub(crate) fn is_built(&self) -> bool {
        self.building != NONE && self.slab_kind != Slab::Eave
    }
}

/// Columns of a window of the lattice; column (i, j) has its centre at ((i + ½)·0.2, (j + ½)·0.2).
pub(crate) struct Columns {
    pub(crate) x0: i64,
    pub(crate) y0: i64,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<Column>,
}

impl Columns {
    /// Samples the scene in a window of lattice indices.
    pub(crate) fn sample(scene: &Scene, x0: i64, y0: i64, width: usize, height: usize) -> Self {
        let empty = Column {
            ground: 0.0,
            solid: 0.0,
            slab: (f32::INFINITY, f32::NEG_INFINITY),
            crown: (f32::INFINITY, f32::NEG_INFINITY),
            building: NONE,
            face: 0,
            slab_kind: Slab::None,
            cover: Cover::Grass,
            tree: NONE,
            clutter: NONE,
            patch: NONE,
            canopy: NONE,
        };
        let mut columns = Self { x0, y0, width, height, data: vec![empty; width * height] };
        columns.ground(scene);
        let window = columns.window();
        columns.patches(scene, &window);
        for b in scene.buildings_in(&window) {
            columns.roofs(scene, b);
        }
        for b in scene.buildings_in(&window) {
            columns.parapet(scene, b);
            columns.eaves(scene, b);
            columns.glass(scene, b);
        }
        for t in scene.clutter_in(&window) {
            columns.clutter(scene, t);
        }
        for t in scene.trees_in(&window) {
            columns.tree(scene, t);
        }
        columns.floaters(scene.seed);
        columns
    }

    /// Whether a place of the surface is water.
    pub(crate) fn is_water(&self, p: DVec3) -> bool {
        let column = self.at(p.truncate());
        column.cover == Cover::Water && (p.z as f32) < column.ground + 0.6
    }

    /// The window on the ground.
    pub(crate) fn window(&self) -> Box2 {
        let min = dvec2(self.x0 as f64, self.y0 as f64) * COLUMN;
        Box2 { min, max: min + dvec2(self.width as f64, self.height as f64) * COLUMN }
    }

    /// Centre of a column.
    pub(crate) fn centre(&self, i: usize, j: usize) -> DVec2 {
        dvec2((self.x0 + i as i64) as f64 + 0.5, (self.y0 + j as i64) as f64 + 0.5) * COLUMN
    }

    /// The column over a place, the nearest one outside the window.
    pub(crate) fn at(&self, p: DVec2) -> &Column {
        &self.data[self.index(p)]
    }

    /// Number of the column over a place, the nearest one outside the window.
    pub(crate) fn index(&self, p: DVec2) -> usize {
        let clamp = |v: f64, origin: i64, n: usize| (((v / COLUMN).floor() as i64 - origin).max(0) as usize).min(n - 1);
        clamp(p.y, self.y0, self.height) * self.width + clamp(p.x, self.x0, self.width)
    }

    /// Calls `f` with the number and the centre of each column with its centre in a box.
    pub(crate) fn each_index(&self, bounds: &Box2, mut f: impl FnMut(usize, DVec2)) {
        let range = |lo: f64, hi: f64, origin: i64, n: usize| {
            let a = ((lo / COLUMN - 0.5).ceil() as i64 - origin).clamp(0, n as i64) as usize;
            let b = ((hi / COLUMN - 0.5).floor() as i64 + 1 - origin).clamp(0, n as i64) as usize;
            a..b.max(a)
        };
        for j in range(bounds.min.y, bounds.max.y, self.y0, self.height) {
            for i in range(bounds.min.x, bounds.max.x, self.x0, self.width) {
                f(j * self.width + i, self.centre(i, j));
            }
        }
    }

    /// Calls `f` for each column with its centre in a box.
    fn each(&mut self, bounds: &Box2, mut f: impl FnMut(DVec2, &mut Column)) {
        let mut data = std::mem::take(&mut self.data);
        self.each_index(bounds, |k, p| f(p, &mut data[k]));
        self.data = data;
    }

    /// The relief is smooth: it is computed at every eighth column of an absolute lattice and interpolated; forms on it are not.
    fn ground(&mut self, scene: &Scene) {
        const EVERY: i64 = 8;
        let (i0, j0) = (self.x0.div_euclid(EVERY), self.y0.div_euclid(EVERY));
        let nx = ((self.x0 + self.width as i64).div_euclid(EVERY) - i0 + 2) as usize;
        let ny = ((self.y0 + self.height as i64).div_euclid(EVERY) - j0 + 2) as usize;
        let pitch = EVERY as f64 * COLUMN;
        let formed = scene.relief.has_forms();
        let mut coarse = Vec::with_capacity(nx * ny);
        for j in 0..ny {
            for i in 0..nx {
                let p = dvec2((i0 + i as i64) as f64, (j0 + j as i64) as f64) * pitch;
                coarse.push(scene.relief.smooth(p) as f32);
            }
        }
        for j in 0..self.height {
            for i in 0..self.width {
                let (x, y) = (self.x0 + i as i64, self.y0 + j as i64);
                let (u, v) = ((x.rem_euclid(EVERY) as f32 + 0.5) / 8.0, (y.rem_euclid(EVERY) as f32 + 0.5) / 8.0);
                let (a, b) = ((x.div_euclid(EVERY) - i0) as usize, (y.div_euclid(EVERY) - j0) as usize);
                let at = |di: usize, dj: usize| coarse[(b + dj) * nx + a + di];
                let low = at(0, 0) * (1.0 - u) + at(1, 0) * u;
                let high = at(0, 1) * (1.0 - u) + at(1, 1) * u;
                let smooth = low * (1.0 - v) + high * v;
                let z = match formed {
                    true => scene.relief.formed(self.centre(i, j), f64::from(smooth)) as f32,
                    false => smooth,
                };
                let column = &mut self.data[j * self.width + i];
                column.ground = z;
                column.solid = z;
            }
        }
    }

    fn patches(&mut self, scene: &Scene, window: &Box2) {
        for j in 0..self.height {
            for i in 0..self.width {
                self.data[j * self.width + i].cover = scene.cover(self.centre(i, j));
            }
        }
        for n in scene.patches_in(window) {
            let patch = &scene.patches[n];
            self.each(&Box2::of(patch.plan.ring()), |p, column| {
                if patch.covers(p) {
                    column.cover = patch.cover;
                    column.patch = n as u32;
                }
            });
        }
        for column in &mut self.data {
            if let Some(level) = scene.patches.get(column.patch as usize).and_then(|p| p.level) {
                column.ground = level as f32;
                column.solid = column.ground;
            }
        }
    }

    /// Scan conversion of each roof face (even–odd), the highest roof holds.
    fn roofs(&mut self, scene: &Scene, b: usize) {
        let (y0, height) = (self.y0, self.height as i64);
        for (face, roof) in scene.buildings[b].roof.iter().enumerate() {
            let bounds = roof.polygon.bounds();
            let row = |y: f64| (y / COLUMN - 0.5).ceil() as i64 - y0;
            for j in row(bounds.min.y).clamp(0, height)..row(bounds.max.y).clamp(0, height) {
                let y = ((y0 + j) as f64 + 0.5) * COLUMN;
                let mut crossings = Vec::new();
                for ring in roof.polygon.rings() {
                    for k in 0..ring.len() {
                        let (p, q) = (ring[k], ring[(k + 1) % ring.len()]);
                        if (p.y > y) != (q.y > y) {
                            crossings.push(p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x));
                        }
                    }
                }
                crossings.sort_by(f64::total_cmp);
                for span in crossings.chunks_exact(2) {
                    let at = |x: f64| ((x / COLUMN - 0.5).ceil() as i64 - self.x0).clamp(0, self.width as i64) as usize;
                    for i in at(span[0])..at(span[1]) {
                        let z = roof.plane.height(self.centre(i, j as usize)) as f32;
                        let column = &mut self.data[j as usize * self.width + i];
                        if column.building == NONE || z > column.solid {
                            column.building = b as u32;
                            column.face = face as u16;
                            column.solid = column.solid.max(z);
                        }
                    }
                }
            }
        }
    }

    fn parapet(&mut self, scene: &Scene, b: usize) {
        let building = &scene.buildings[b];
        if building.style.parapet == 0.0 {
            return;
        }
        for rim in &building.rims {
            let Some(along) = (rim.to - rim.from).try_normalize() else { continue };
            let length = rim.from.distance(rim.to);
            let plane = building.roof[rim.face].plane;
            self.each(&Box2::of([rim.from, rim.to]).grown(0.35), |p, column| {
                let d = p - rim.from;
                let (s, t) = (d.dot(along), d.dot(along.perp()));
                let near = (-0.1..length + 0.1).contains(&s) && (0.0..0.32).contains(&t);
                if near && column.building == b as u32 {
                    column.solid = column.solid.max((plane.height(p) + building.style.parapet) as f32);
                }
            });
        }
    }

    /// Slabs of 0.25 m that continue the roof beyond the walls, where no other building stands.
    fn eaves(&mut self, scene: &Scene, b: usize) {
        let building = &scene.buildings[b];
        let out = building.style.overhang;
        if out == 0.0 {
            return;
        }
        for rim in &building.rims {
            let Some(along) = (rim.to - rim.from).try_normalize() else { continue };
            let length = rim.from.distance(rim.to);
            let ring = [
                rim.from - along * out,
                rim.from - along * out - along.perp() * out,
                rim.to + along * out - along.perp() * out,
                rim.to + along * out,
            ];
            let plane = building.roof[rim.face].plane;
            self.each(&Box2::of(ring), |p, column| {
                let s = (p - rim.from).dot(along);
                if !ring_contains(&ring, p) || (column.building != NONE && column.slab_kind != Slab::Eave) {
                    return;
                }
                // Beyond the ends of the edge the roof goes on, but never higher than its corner does.
                let over = plane.height(
                    rim.from + along * s.clamp(-out, length + out) + along.perp() * (p - rim.from).dot(along.perp()),
                );
                let top = over as f32;
                if column.slab_kind == Slab::None || top < column.slab.1 {
                    column.slab = (top - 0.25, top);
                    column.slab_kind = Slab::Eave;
                    column.building = b as u32;
                    column.face = rim.face as u16;
                }
            });
        }
    }

    /// Class of what is uppermost, blobs in the air left aside.
    pub(crate) fn label(&self, scene: &Scene, column: &Column) -> Class {
        let slab = if column.slab_kind == Slab::Floater { f32::NEG_INFINITY } else { column.slab.1 };
        if column.crown.1 > column.solid.max(slab) {
            return Class::Tree;
        }
        if column.slab_kind == Slab::Canopy && slab > column.solid {
            return Class::Clutter;
        }
        if slab > column.solid || column.is_built() {
            return Class::Building;
        }
        if let Some(thing) = scene.clutter.get(column.clutter as usize) {
            return match thing {
                plant if plant.is_plant() => Class::Tree,
                crop if crop.is_low_crop() => Class::Grass,
                _ => Class::Clutter,
            };
        }
        if column.cover.is_grass() { Class::Grass } else { Class::Ground }
    }
}
