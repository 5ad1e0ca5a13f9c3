//! Trees and clutter: what stands in a city besides buildings.

use super::primitive::Oblong;
use crate::noise::noise2;
use gable_geometry::DVec2;
use serde::Serialize;

/// Shapes of crowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Species {
    /// Broad, almost spherical.
    Broadleaf,
    /// Broad with brown leaves.
    Copper,
    /// A cone.
    Conifer,
    /// A narrow column.
    Poplar,
    /// A small low ball.
    Fruit,
    /// Fronds around the top of a bare trunk.
    Palm,
    /// A tuft of large leaves.
    Banana,
}

impl Species {
    /// Whether it keeps its leaves and their colour in every season.
    pub(crate) fn is_evergreen(self) -> bool {
        matches!(self, Self::Conifer | Self::Palm | Self::Banana)
    }
}

/// A tree.
#[derive(Clone, Copy, Debug)]
pub struct Tree {
    /// Place of the trunk.
    pub place: DVec2,
    /// Ground at the trunk, metres.
    pub ground: f64,
    /// Height over the ground, metres.
    pub height: f64,
    /// Radius of the crown, metres.
    pub radius: f64,
    /// Height over the ground where the crown begins, metres.
    pub clear: f64,
    /// Shape.
    pub species: Species,
    /// Seed of its bumps and colour.
    pub seed: u64,
}

impl Tree {
    /// How far branches reach from the trunk, metres.
    pub(crate) fn reach(&self) -> f64 {
        1.24 * self.radius
    }

    /// Lower and upper end of the crown over a place; `None` beside it.
    #[must_use]
    pub fn crown(&self, p: DVec2) -> Option<(f64, f64)> {
        let bump = noise2(self.seed, 1.3, p.x, p.y);
        let branch = noise2(self.seed ^ 7, 2.9, p.x, p.y);
        let rho = p.distance(self.place) / (self.radius * (1.0 + 0.24 * branch));
        if rho >= 1.0 {
            return None;
        }
        let depth = self.height - self.clear;
        let round = (1.0 - rho * rho).sqrt();
        let (low, high) = match self.species {
            Species::Broadleaf | Species::Copper | Species::Fruit => {
                let middle = self.clear + 0.42 * depth;
                (middle - 0.42 * depth * round, middle + 0.58 * depth * round.powf(0.85))
            }
            Species::Conifer => (self.clear, self.clear + depth * (1.0 - rho).powf(0.9)),
            Species::Poplar => (self.clear, self.clear + depth * (1.0 - rho.powi(4)).powf(0.7)),
            Species::Palm | Species::Banana => {
                let fronds = if self.species == Species::Palm { 4.5 } else { 2.5 };
                let turn = (self.seed % 628) as f64 / 100.0;
                let frond = ((p - self.place).to_angle() * fronds + turn).sin().abs();
                if rho > 0.35 + 0.65 * frond {
                    return None;
                }
                let top = self.height - 0.55 * depth * rho * rho;
                (top - 0.4 * depth * (1.0 - rho) - 0.3, top)
            }
        };
        let rough = 0.55 * bump * (1.0 - 0.5 * rho) + 0.35 * branch;
        let low = (low + 0.4 * branch).max(0.6);
        let high = high + rough * (0.5 + 0.05 * self.height);
        (high > low).then_some((self.ground + low, self.ground + high))
    }
}

/// Kinds of clutter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    /// A parked or driving car.
    Car,
    /// A garden wall.
    Wall,
    /// A hedge.
    Hedge,
    /// A chimney.
    Chimney,
    /// A dormer, its front towards the negative axis end.
    Dormer,
    /// Machinery on a flat roof.
    Plant,
    /// A balcony: it hangs.
    Balcony,
    /// A blob in the air that matching invents.
    Floater,
    /// The deck of a bridge: it hangs over what is below.
    Bridge,
    /// An open frame of beams on posts.
    Pergola,
    /// A cloth on poles.
    Tarpaulin,
    /// A container, a trailer, a tank on the ground.
    Container,
    /// Hay, silage, gravel, waste; some under a sheet.
    Heap,
    /// A row of crops.
    Crop,
    /// A bush on a roof.
    Bush,
}

impl Thing {
    /// Whether it stands on a building.
    #[must_use]
    pub fn on_building(self) -> bool {
        matches!(self, Self::Chimney | Self::Dormer | Self::Plant | Self::Balcony | Self::Bush)
    }

    /// Whether it hangs over the ground with free space below.
    pub(crate) fn is_canopy(self) -> bool {
        matches!(self, Self::Bridge | Self::Pergola | Self::Tarpaulin)
    }
}

/// Crops up to this height are low plants, higher ones are labelled as trees, metres.
const LOW_CROP: f64 = 1.0;
/// Width and distance of the beams of a pergola, metres.
const BEAM: f64 = 0.25;
const BEAMS: f64 = 0.8;

/// A box-like thing.
#[derive(Clone, Copy, Debug)]
pub struct Clutter {
    /// Kind.
    pub thing: Thing,
    /// Plan.
    pub plan: Oblong,
    /// Lower end, metres.
    pub low: f64,
    /// Upper end, metres.
    pub high: f64,
    /// Seed of its colour.
    pub seed: u64,
}

impl Clutter {
    /// Upper end over a place; `None` beside it.
    #[must_use]
    pub fn top(&self, p: DVec2) -> Option<f64> {
        let d = p - self.plan.centre;
        let s = d.dot(self.plan.axis) / self.plan.half_length;
        let t = d.dot(self.plan.axis.perp()) / self.plan.half_width;
        if s.abs() > 1.0 || t.abs() > 1.0 {
            return None;
        }
        let height = self.high - self.low;
        Some(match self.thing {
            Thing::Car => self.low + height * if (-0.6..0.35).contains(&s) { 1.0 } else { 0.62 },
            Thing::Dormer => self.high - 0.35 * t.abs() * self.plan.half_width.min(1.5),
            Thing::Hedge => self.high + 0.2 * noise2(self.seed, 0.9, p.x, p.y),
            Thing::Floater => {
                let round = (1.0 - (s * s + t * t) * 0.8).max(0.0);
                self.low + height * round
            }
            Thing::Heap => {
                let round = (1.0 - s * s * s * s).max(0.0) * (1.0 - t * t).max(0.0);
                self.low + height * round.sqrt() * (0.85 + 0.15 * noise2(self.seed, 1.7, p.x, p.y))
            }
            Thing::Crop | Thing::Bush => {
                let round = (1.0 - s * s * s * s * t * t).max(0.0);
                self.low + height * round * (0.8 + 0.25 * noise2(self.seed, 0.8, p.x, p.y))
            }
            Thing::Pergola => {
                let along = s * self.plan.half_length;
                let across = t * self.plan.half_width;
                let beam = along.rem_euclid(BEAMS) < BEAM || self.plan.half_width - across.abs() < BEAM;
                return beam.then_some(self.high);
            }
            Thing::Tarpaulin => self.high - 0.3 * (1.0 - (1.0 - s * s) * (1.0 - t * t)),
            _ => self.high,
        })
    }
}

impl Clutter {
    /// Whether it is a row of plants that is too low to be labelled as a tree.
    pub(crate) fn is_low_crop(&self) -> bool {
        self.thing == Thing::Crop && self.high - self.low < LOW_CROP
    }

    /// Whether it is labelled as a tree.
    pub(crate) fn is_plant(&self) -> bool {
        self.thing == Thing::Hedge || (self.thing == Thing::Crop && !self.is_low_crop())
    }
}

/// What covers the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// Street with markings.
    Asphalt,
    /// Footway.
    Pavement,
    /// Lawn.
    Grass,
    /// Paved yard.
    Yard,
    /// Bare earth.
    Soil,
    /// Car park with painted bays.
    Parking,
    /// Water, level: it mirrors, so matching finds holes and waves in it.
    Water,
    /// A field with low plants in rows.
    Field,
    /// A field after the harvest or the plough.
    Ploughed,
    /// Weeds and low shrubs.
    Thicket,
    /// Slabs of concrete.
    Concrete,
}

impl Cover {
    /// Whether it is labelled as grass.
    pub(crate) fn is_grass(self) -> bool {
        matches!(self, Self::Grass | Self::Field | Self::Thicket)
    }
}

/// A piece of ground cover; later ones lie over earlier ones.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Kind.
    pub cover: Cover,
    /// Plan, or what lies around the outline.
    pub plan: Oblong,
    /// Convex outline, counter-clockwise, inside the plan; empty where the whole plan is covered.
    pub outline: Vec<DVec2>,
    /// Height of the surface where it is level and not the ground's: water, metres.
    pub level: Option<f64>,
}

impl Patch {
    /// Whether it covers a place.
    #[must_use]
    pub fn covers(&self, p: DVec2) -> bool {
        let n = self.outline.len();
        let inside = |i: usize| {
            let (a, b) = (self.outline[i], self.outline[(i + 1) % n]);
            (b - a).perp_dot(p - a) >= 0.0
        };
        self.plan.contains(p) && (0..n).all(inside)
    }
}
