//! The scene that is sensed: ground, buildings with known solids, trees and clutter.

mod builder;
pub(crate) mod building;
pub(crate) mod case;
mod closed;
mod cover_map;
mod details;
mod envelope;
mod fabric;
pub(crate) mod from_truth;
mod gardens;
mod growth;
mod house;
mod landform;
mod layout;
pub(crate) mod objects;
pub(crate) mod place;
mod plot;
pub(crate) mod primitive;
mod quarters;
pub(crate) mod relief;
pub(crate) mod site;
pub(crate) mod solid;
mod streets;
mod surroundings;

pub(crate) use layout::town;

use crate::bins::Bins;
use crate::sensing::faults::Faults;
use building::SceneBuilding;
use cover_map::CoverMap;
use gable_geometry::{Box2, DVec2};
use objects::{Clutter, Cover, Patch, Tree};
use relief::Relief;
use std::collections::BTreeSet;

/// A city with everything known.
pub struct Scene {
    /// Seed of everything drawn.
    pub seed: u64,
    /// What is sensed, local metres; its lower corner is the origin.
    pub extent: Box2,
    /// Bare ground.
    pub relief: Relief,
    /// Buildings.
    pub buildings: Vec<SceneBuilding>,
    /// Trees.
    pub trees: Vec<Tree>,
    /// Cars, walls, hedges, chimneys, …
    pub clutter: Vec<Clutter>,
    /// Ground cover, later over earlier.
    pub patches: Vec<Patch>,
    /// What covers the ground where no patch does; lawn if there is no map.
    covers: Option<CoverMap>,
    bins: [Bins; 4],
    /// Faults of the mesh.
    pub(crate) faults: Faults,
    /// Buildings of which the mesh has less than half: no truth names them.
    pub(crate) hidden: BTreeSet<usize>,
    /// Whether the terrain of the truth needs a fine grid.
    pub(crate) fine_ground: bool,
}

impl Scene {
    pub(crate) fn new(
        seed: u64,
        extent: Box2,
        relief: Relief,
        buildings: Vec<SceneBuilding>,
        trees: Vec<Tree>,
        clutter: Vec<Clutter>,
        patches: Vec<Patch>,
        covers: Option<CoverMap>,
    ) -> Self {
        let boxes = |list: Vec<Box2>| Bins::new(&list);
        let bins = [
            boxes(buildings.iter().map(|b| b.bounds.grown(1.0)).collect()),
            boxes(trees.iter().map(|t| Box2 { min: t.place, max: t.place }.grown(t.reach())).collect()),
            boxes(clutter.iter().map(|c| Box2::of(c.plan.ring())).collect()),
            boxes(patches.iter().map(|p| Box2::of(p.plan.ring())).collect()),
        ];
        Self {
            seed,
            extent,
            relief,
            buildings,
            trees,
            clutter,
            patches,
            covers,
            bins,
            faults: Faults::default(),
            hidden: BTreeSet::new(),
            fine_ground: false,
        }
    }

    /// The buildings that the truth names.
    pub(crate) fn buildings_of_truth(&self) -> impl Iterator<Item = &SceneBuilding> {
        self.buildings.iter().enumerate().filter(|(b, _)| !self.hidden.contains(b)).map(|(_, building)| building)
    }

    /// Indices of the buildings whose surroundings (1 m) touch a box, ascending.
    pub(crate) fn buildings_in(&self, window: &Box2) -> Vec<usize> {
        self.bins[0].touching(window)
    }

    pub(crate) fn trees_in(&self, window: &Box2) -> Vec<usize> {
        self.bins[1].touching(window)
    }

    pub(crate) fn clutter_in(&self, window: &Box2) -> Vec<usize> {
        self.bins[2].touching(window)
    }

    pub(crate) fn patches_in(&self, window: &Box2) -> Vec<usize> {
        self.bins[3].touching(window)
    }

    /// What covers the ground at a place if no patch does.
    pub(crate) fn cover(&self, p: DVec2) -> Cover {
        self.covers.as_ref().map_or(Cover::Grass, |map| map.cover(p))
    }

    /// Bare ground, or the surface of water, at a place, metres.
    #[must_use]
    pub fn ground(&self, p: DVec2) -> f64 {
        let here = self.patches_in(&Box2 { min: p, max: p });
        let last = here.into_iter().rev().map(|n| &self.patches[n]).find(|patch| patch.covers(p));
        last.and_then(|patch| patch.level).unwrap_or_else(|| self.relief.height(p))
    }

    /// The building over a place.
    #[must_use]
    pub fn building_at(&self, p: DVec2) -> Option<usize> {
        let here = self.buildings_in(&Box2 { min: p, max: p });
        here.into_iter().find(|&b| self.buildings[b].roof_at(p).is_some())
    }
}
