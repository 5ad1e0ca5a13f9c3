//! What stands on the ground and on buildings, and how glass is seen, in columns.

use super::{Columns, NONE, Slab};
use crate::noise::{hash, noise2, unit};
use crate::scene::Scene;
use crate::scene::building::Covering;
use crate::scene::objects::Thing;
use gable_geometry::{Box2, dvec2};

impl Columns {
    /// Matching looks through glass here and there, down to the floor: the surface that it finds sinks in.
    pub(super) fn glass(&mut self, scene: &Scene, b: usize) {
        let building = &scene.buildings[b];
        if building.style.covering != Covering::Glass {
            return;
        }
        let deepest = 0.25 + 0.7 * unit(hash(building.seed ^ 0x61a5, 0, 0, 0));
        self.each(&building.bounds.grown(0.5), |p, column| {
            if column.building == b as u32 && column.slab_kind == Slab::None {
                let seen_through = (0.35 + 1.3 * noise2(building.seed ^ 0x61a6, 4.5, p.x, p.y)).clamp(0.0, 1.0);
                column.solid -= (deepest * seen_through) as f32 * (column.solid - column.ground);
            }
        });
    }

    pub(super) fn clutter(&mut self, scene: &Scene, n: usize) {
        let thing = scene.clutter[n];
        self.each(&Box2::of(thing.plan.ring()), |p, column| {
            let Some(top) = thing.top(p) else { return };
            let top = top as f32;
            if thing.thing == Thing::Balcony {
                if column.slab_kind == Slab::None && column.building == NONE {
                    column.slab = (thing.low as f32, top);
                    column.slab_kind = Slab::Balcony;
                }
                // A second balcony above the first one closes the space between them for the sensor.
                if column.slab_kind == Slab::Balcony {
                    column.slab.0 = column.slab.0.min(thing.low as f32);
                    column.slab.1 = column.slab.1.max(top);
                }
                return;
            }
            if thing.thing.is_canopy() {
                if column.slab_kind == Slab::None && column.building == NONE {
                    column.slab = (thing.low as f32, top);
                    (column.slab_kind, column.canopy) = (Slab::Canopy, n as u32);
                }
                return;
            }
            if thing.thing.on_building() != column.is_built() {
                return;
            }
            if top > column.solid {
                column.solid = top;
                column.clutter = n as u32;
            }
        });
    }

    pub(super) fn tree(&mut self, scene: &Scene, n: usize) {
        let tree = scene.trees[n];
        let bounds = Box2 { min: tree.place, max: tree.place }.grown(tree.reach());
        self.each(&bounds, |p, column| {
            if p.distance(tree.place) < 0.25 && !column.is_built() {
                column.solid = column.solid.max((tree.ground + tree.clear + 0.5) as f32);
                column.tree = n as u32;
            }
            let Some((low, high)) = tree.crown(p) else { return };
            if high as f32 > column.crown.1 {
                column.tree = n as u32;
            }
            column.crown = (column.crown.0.min(low as f32), column.crown.1.max(high as f32));
        });
    }

    /// Blobs in the air: one in about 2,000 m², a little above what is there.
    pub(super) fn floaters(&mut self, seed: u64) {
        const CELL: f64 = 16.0;
        let window = self.window();
        let cell = |v: f64| (v / CELL).floor() as i64;
        for i in cell(window.min.x) - 1..=cell(window.max.x) {
            for j in cell(window.min.y) - 1..=cell(window.max.y) {
                let h = hash(seed ^ 0xf10a, i, j, 0);
                if unit(h) > 0.13 {
                    continue;
                }
                let draw = |k| unit(hash(seed ^ 0xf10a, i, j, k));
                let place = dvec2(i as f64 + draw(1), j as f64 + draw(2)) * CELL;
                let (radius, lift) = (0.45 + 0.6 * draw(3), 1.0 + 6.0 * draw(4));
                if !window.grown(-1.0).contains(place) {
                    continue;
                }
                let z = f64::from(self.at(place).top()) + lift;
                self.each(&Box2 { min: place, max: place }.grown(radius), |p, column| {
                    let rho = p.distance(place) / radius;
                    if rho < 1.0 && column.slab_kind == Slab::None {
                        let half = (0.6 * radius * (1.0 - rho * rho).sqrt()) as f32;
                        column.slab = (z as f32 - half, z as f32 + half);
                        column.slab_kind = Slab::Floater;
                    }
                });
            }
        }
    }
}
