//! What the cameras would have seen at a place of the mesh: material, light, shadow.

use super::patterns::{self, Rgb, blend, scale};
use crate::look::Look;
use crate::noise::{hash, lattice_unit, noise2, unit};
use crate::scene::Scene;
use crate::scene::building::{Rim, SceneBuilding};
use crate::sensing::COLUMN;
use crate::sensing::columns::{Class, Column, Columns, NONE, Slab};
use crate::sensing::horizon::{Heights, directed_horizon};
use gable_geometry::{Box2, DVec2, DVec3, point_segment_distance};

/// Direction to the sun: azimuth 214° (south-south-west), elevation 43°.
const SUN: DVec3 = DVec3::new(-0.409, -0.606, 0.682);

/// Where the camera's curve bends, and what is left above it, of 255.
const SHOULDER: f32 = 170.0;
const ROOM: f32 = 255.0 - SHOULDER;

/// Rims are known to columns up to this distance, metres: more than facades show at the eaves, and a column's size.
const NEAR: f64 = 0.8;

/// Kinds of surface.
#[derive(Clone, Copy)]
enum Surface {
    Ground,
    Leaves,
    Roof,
    Facade,
    Thing,
    Eave,
    Balcony,
    Canopy,
}

/// Paints places of one tile.
pub(crate) struct Painter<'a> {
    scene: &'a Scene,
    columns: &'a Columns,
    /// For each column the height above which the sun shines.
    sun: Vec<f32>,
    /// For each column the building and the number of the rim that is nearest, within [`NEAR`].
    rims: Vec<(u32, u32)>,
    look: Look,
}

impl<'a> Painter<'a> {
    pub(crate) fn new(scene: &'a Scene, columns: &'a Columns, look: Look) -> Self {
        let top = Heights {
            width: columns.width,
            height: columns.height,
            data: columns.data.iter().map(Column::opaque_top).collect(),
        };
        let ground = SUN.truncate().length();
        let direction = [(SUN.x / ground) as f32, (SUN.y / ground) as f32];
        let sun = directed_horizon(&top, direction, (SUN.z / ground) as f32, COLUMN as f32);
        Self { scene, columns, sun, rims: nearest_rims(scene, columns), look }
    }

    /// Class of the object that a face of the mesh stands for.
    pub(crate) fn class(&self, p: DVec3, normal: DVec3) -> Class {
        let (column, surface) = self.surface(p, normal);
        match surface {
            Surface::Leaves => Class::Tree,
            Surface::Roof | Surface::Facade | Surface::Eave | Surface::Balcony => Class::Building,
            Surface::Canopy => Class::Clutter,
            Surface::Thing => match &self.scene.clutter[column.clutter as usize] {
                plant if plant.is_plant() => Class::Tree,
                crop if crop.is_low_crop() => Class::Grass,
                part if part.thing.on_building() => Class::Building,
                _ => Class::Clutter,
            },
            Surface::Ground if column.slab_kind == Slab::Floater && p.z > f64::from(column.solid) + 0.8 => {
                Class::Clutter
            }
            Surface::Ground if column.cover.is_grass() => Class::Grass,
            Surface::Ground => Class::Ground,
        }
    }

    /// Colour (sRGB 0–255) of a place on a face; `image` is the gain of the picture it comes from.
    pub(crate) fn colour(&self, p: DVec3, normal: DVec3, image: Rgb) -> Rgb {
        let (column, surface) = self.surface(p, normal);
        let scene = self.scene;
        let q = p.truncate();
        let building = scene.buildings.get(column.building as usize);
        let season = self.look.season;
        let mut light = normal;
        let mut albedo = match surface {
            Surface::Ground => {
                light = DVec3::Z;
                let patch = scene.patches.get(column.patch as usize);
                season.ground(column.cover, patterns::ground(scene.seed, column.cover, patch, q))
            }
            Surface::Leaves => match scene.trees.get(column.tree as usize) {
                Some(tree) => {
                    let away = (p - tree.place.extend(tree.ground + 0.55 * tree.height)).normalize_or(DVec3::Z);
                    light = (away + 0.6 * normal).normalize_or(DVec3::Z);
                    season.leaves(tree.species, lattice_unit(tree.seed, 5, 6, 7), patterns::leaves(tree, p))
                }
                None => [80.0, 100.0, 50.0],
            },
            Surface::Roof | Surface::Eave => match building {
                Some(b) => {
                    light = b.roof.get(column.face as usize).map_or(normal, |f| f.plane.normal());
                    let roof = season.roof(patterns::roof(b, column.face as usize, q));
                    self.edge_leak(b, column.building, q, roof)
                }
                None => [150.0, 150.0, 150.0],
            },
            Surface::Facade | Surface::Balcony => match building {
                Some(b) => {
                    let near = self.nearest_rim(b, column.building, q).or_else(|| full_search(b, q));
                    let (u, corner, wall, outward) = wall_place(b, near, q);
                    light = outward.extend(0.0);
                    patterns::facade(b, u, corner, p.z, wall)
                }
                None => [170.0, 165.0, 158.0],
            },
            Surface::Canopy => match scene.clutter.get(column.canopy as usize) {
                Some(canopy) => {
                    light = DVec3::Z;
                    patterns::canopy(canopy, p)
                }
                None => [150.0, 150.0, 150.0],
            },
            Surface::Thing => {
                patterns::thing(building, &scene.clutter[column.clutter as usize], p, normal.z.abs() < 0.5)
            }
        };
        // Dust and wear over everything, the same from all sides.
        albedo = scale(albedo, 1.0 + 0.05 * noise2(scene.seed ^ 0xd, 23.0, q.x, q.y));
        // Steep places are asked a little before the surface, where the object's own roof is no obstacle.
        let before = p + (normal.truncate().normalize_or_zero() * (1.0 - normal.z.abs()) * 0.5).extend(0.0);
        let lit = f64::from(self.lit(before)) * light.dot(SUN).max(0.0);
        let sky = 0.5 + 0.14 * light.z;
        let shine = [sky * 0.94 + 0.66 * lit, sky * 0.98 + 0.62 * lit, sky * 1.06 + 0.55 * lit];
        let seen = self.developed(std::array::from_fn(|k| albedo[k] * image[k] * shine[k] as f32));
        std::array::from_fn(|k| seen[k] * self.look.cast[k] as f32)
    }

    /// What the camera makes of light: haze takes colour away, more in one city than in another, and bright places are
    /// compressed and not clipped, which would turn tiles orange and lawns yellow.
    fn developed(&self, light: Rgb) -> Rgb {
        let haze = 0.12 + 0.3 * unit(hash(self.scene.seed ^ 0x4a2e, 0, 0, 0)) as f32;
        let grey = 0.3 * light[0] + 0.59 * light[1] + 0.11 * light[2];
        light.map(|x| {
            let x = x + haze * (grey - x);
            if x > SHOULDER { SHOULDER + ROOM * (1.0 - (-(x - SHOULDER) / ROOM).exp()) } else { x }
        })
    }

    /// Facades show through within a hand of the roof's edge: pictures from the side see them there.
    fn edge_leak(&self, building: &SceneBuilding, number: u32, q: DVec2, roof: Rgb) -> Rgb {
        let Some(near) = self.nearest_rim(building, number, q) else { return roof };
        let reach = 0.28 + 0.22 * noise2(building.seed ^ 0x1eaf, 2.2, q.x, q.y);
        let rim = building.rims[near];
        let near = point_segment_distance(q, rim.from, rim.to);
        if near < reach { blend(roof, building.style.facade, 0.75 * (1.0 - near / reach)) } else { roof }
    }

    /// The rim of a building nearest to a place; `None` if none is within [`NEAR`].
    fn nearest_rim(&self, building: &SceneBuilding, number: u32, q: DVec2) -> Option<usize> {
        match self.rims[self.columns.index(q)] {
            (NONE, _) => None,
            (found, rim) if found == number => Some(rim as usize),
            _ => full_search(building, q),
        }
    }

    /// Share of the sun that reaches a place, soft over half a metre.
    fn lit(&self, p: DVec3) -> f32 {
        let c = self.columns;
        let at = |v: f64, o: i64, n: usize| (((v / COLUMN).floor() as i64 - o).max(0) as usize).min(n - 1);
        let k = at(p.y, c.y0, c.height) * c.width + at(p.x, c.x0, c.width);
        // The mesh lies up to two decimetres under the true surface, which must not shade it.
        let z = (p.z as f32).max(c.data[k].solid.min(p.z as f32 + 0.5));
        ((z + 0.35 - self.sun[k]) / 0.5).clamp(0.0, 1.0)
    }

    /// The object that a place of the mesh stands for: what is just behind the surface.
    fn surface(&self, p: DVec3, normal: DVec3) -> (&Column, Surface) {
        let flat = normal.truncate().normalize_or(DVec2::ZERO);
        let steep = normal.z.abs() < 0.5;
        let wobble = 0.12 * noise2(self.scene.seed ^ 0x3b, 1.7, p.x + p.z, p.y - p.z);
        let depths: &[f64] = if steep { &[0.3, 0.7, 0.0] } else { &[0.0] };
        let mut last = None;
        for depth in depths {
            let column = self.columns.at(p.truncate() - flat * (depth + wobble));
            let surface = within(column, p.z as f32, steep);
            if !matches!(surface, Surface::Ground) {
                return (column, surface);
            }
            last = Some((column, surface));
        }
        last.unwrap_or((self.columns.at(p.truncate()), Surface::Ground))
    }
}

fn within(column: &Column, z: f32, steep: bool) -> Surface {
    let near = |(low, high): (f32, f32)| z > low - 0.35 && z < high + 0.6;
    let in_crown = near(column.crown);
    if in_crown && z > column.solid + 0.3 {
        return Surface::Leaves;
    }
    if near(column.slab) && z > column.solid + 0.3 {
        match column.slab_kind {
            Slab::Eave => return Surface::Eave,
            Slab::Balcony => return Surface::Balcony,
            Slab::Canopy => return Surface::Canopy,
            Slab::Floater | Slab::None => {}
        }
    }
    if column.is_built() {
        let roof = z > column.solid - if steep { 0.25 } else { 1.5 };
        if column.clutter != NONE && z > column.solid - 1.2 {
            return Surface::Thing;
        }
        return if roof && !steep { Surface::Roof } else { Surface::Facade };
    }
    if column.clutter != NONE && z > column.ground + 0.25 {
        return Surface::Thing;
    }
    if column.crown.1 > column.ground && z > column.ground + 0.9 {
        return Surface::Leaves;
    }
    Surface::Ground
}

/// For each column of the window the nearest rim within [`NEAR`], with its building.
fn nearest_rims(scene: &Scene, columns: &Columns) -> Vec<(u32, u32)> {
    let mut best = vec![(f32::INFINITY, NONE, 0); columns.data.len()];
    for b in scene.buildings_in(&columns.window()) {
        for (n, rim) in scene.buildings[b].rims.iter().enumerate() {
            columns.each_index(&Box2::of([rim.from, rim.to]).grown(NEAR), |k, p| {
                let distance = point_segment_distance(p, rim.from, rim.to) as f32;
                if distance < best[k].0.min(NEAR as f32) {
                    best[k] = (distance, b as u32, n as u32);
                }
            });
        }
    }
    best.into_iter().map(|(_, b, n)| (b, n)).collect()
}

/// The nearest rim of a building.
fn full_search(building: &SceneBuilding, q: DVec2) -> Option<usize> {
    let distance = |r: &Rim| point_segment_distance(q, r.from, r.to);
    let all = building.rims.iter().map(distance).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(n, _)| n)
}

/// Distance along a wall, distance to its nearer end, its number and its outward normal.
fn wall_place(building: &SceneBuilding, near: Option<usize>, q: DVec2) -> (f64, f64, usize, DVec2) {
    let Some((wall, rim)) = near.and_then(|n| Some((n, building.rims.get(n)?))) else {
        return (q.x, 1.0, 0, DVec2::X);
    };
    let along = (rim.to - rim.from).normalize_or(DVec2::X);
    let u = (q - rim.from).dot(along);
    (u, u.min(rim.from.distance(rim.to) - u), wall, -along.perp())
}

/// Gain of the picture that a face was taken from: pictures change every 35 m or so, and with the side.
pub(crate) fn exposure(seed: u64, p: DVec3, side: Option<u8>) -> Rgb {
    let side = side.map_or(0, |s| 1 + i64::from(s) / 2);
    let wobble = 6.0 * noise2(seed ^ 0xe0, 18.0, p.x, p.y);
    let cell = |v: f64| ((v + wobble) / 35.0).floor() as i64;
    let draw = |k: i64| unit(hash(seed ^ 0xe1, cell(p.x), cell(p.y), side * 8 + k));
    let gain = 0.92 + 0.16 * draw(0);
    [gain * (0.98 + 0.04 * draw(1)), gain, gain * (0.97 + 0.06 * draw(2))].map(|x| x as f32)
}
