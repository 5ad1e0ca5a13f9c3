//! Small scenes with one roof each, for tests.

use super::Scene;
use super::builder::Builder;
use super::house::{Form, axis, part, primitives, row_units};
use super::objects::{Cover, Species, Tree};
use super::primitive::Oblong;
use gable_geometry::{Box2, Counter, DVec2, dvec2};

/// A roof that a small scene can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RoofCase {
    /// Two planes.
    Gable,
    /// Four planes.
    Hip,
    /// A gable whose upper ends are hipped.
    HalfHip,
    /// Steep lower and shallow upper planes.
    Mansard,
    /// One plane.
    Shed,
    /// Four planes with one apex.
    Pyramid,
    /// A gable with a gabled projection.
    CrossGable,
    /// Two gabled wings in an L.
    LShape,
    /// A hipped bar with a gabled stem.
    TShape,
    /// Flat, with a parapet (beyond truth).
    FlatParapet,
    /// Three flat levels.
    Terraces,
    /// Four wings around a yard.
    Courtyard,
    /// A hipped house with a round tower.
    RoundTower,
    /// A plan without right angles.
    Skew,
    /// A row of five houses with different eaves.
    PartyWalls,
    /// A gabled house on ground that rises by 15 %.
    OnSlope,
    /// A hipped house under the crown of a tree.
    UnderTree,
    /// An L of 60 m in the middle of 2 × 2 blocks.
    FourBlocks,
    /// A hall of 196 m through ten blocks of 20 m.
    TenBlocks,
    /// A long gabled hall and a hipped block with dormers, low flat buildings between them, cars and
    /// a tree, on 104 × 116 m: like the real mesh that the defects were measured on.
    TwoHalls,
}

impl RoofCase {
    /// Every case.
    pub const ALL: [Self; 20] = [
        Self::Gable,
        Self::Hip,
        Self::HalfHip,
        Self::Mansard,
        Self::Shed,
        Self::Pyramid,
        Self::CrossGable,
        Self::LShape,
        Self::TShape,
        Self::FlatParapet,
        Self::Terraces,
        Self::Courtyard,
        Self::RoundTower,
        Self::Skew,
        Self::PartyWalls,
        Self::OnSlope,
        Self::UnderTree,
        Self::FourBlocks,
        Self::TenBlocks,
        Self::TwoHalls,
    ];
}

/// Makes the scene of a case.
pub(crate) fn scene(case: RoofCase, seed: u64, slope: f64) -> Scene {
    let (size, slope) = match case {
        RoofCase::FourBlocks => (dvec2(80.0, 80.0), slope),
        RoofCase::TenBlocks => (dvec2(220.0, 40.0), slope),
        RoofCase::TwoHalls => (dvec2(104.0, 116.0), slope),
        RoofCase::Courtyard => (dvec2(60.0, 60.0), slope),
        RoofCase::OnSlope => (dvec2(40.0, 40.0), slope.max(0.15)),
        _ => (dvec2(40.0, 40.0), slope),
    };
    let mut b = Builder::new(seed, Box2 { min: DVec2::ZERO, max: size }, slope);
    let mut c = Counter::keyed(seed, &[9, case as i64]);
    b.patch(Cover::Grass, Oblong { centre: size / 2.0, axis: DVec2::X, half_length: size.x, half_width: size.y });
    let turn = if case == RoofCase::TenBlocks { 1.0 } else { c.range(5.0, 40.0) };
    let plan = Oblong { centre: size / 2.0, axis: axis(turn), half_length: 8.0, half_width: 5.0 };
    let wide = Oblong { half_length: 9.0, half_width: 8.0, ..plan };
    let form = match case {
        RoofCase::Gable | RoofCase::OnSlope => Form::Gable,
        RoofCase::Hip | RoofCase::UnderTree => Form::Hip,
        RoofCase::HalfHip => Form::HalfHip,
        RoofCase::Mansard => Form::Mansard,
        RoofCase::Shed => Form::Shed,
        RoofCase::Pyramid => Form::Pyramid,
        RoofCase::CrossGable => Form::CrossGable,
        RoofCase::LShape | RoofCase::FourBlocks => Form::LShape,
        RoofCase::TShape => Form::TShape,
        RoofCase::FlatParapet | RoofCase::PartyWalls | RoofCase::TenBlocks | RoofCase::TwoHalls => Form::Flat,
        RoofCase::Terraces => Form::Terraces,
        RoofCase::Courtyard => Form::Courtyard,
        RoofCase::RoundTower => Form::Tower,
        RoofCase::Skew => Form::Skew,
    };
    match case {
        RoofCase::PartyWalls => {
            let row = Oblong { half_length: 15.0, ..plan };
            for unit in row_units(&row, 5, &mut c) {
                let eave = c.range(5.0, 8.0);
                b.house(Form::Gable, &unit, eave, 0.8, &mut c);
            }
        }
        RoofCase::TenBlocks => {
            let hall = Oblong { half_length: 98.0, half_width: 7.0, ..plan };
            b.house(Form::Gable, &hall, 7.0, 0.5, &mut c);
        }
        RoofCase::TwoHalls => two_halls(&mut b, size / 2.0, &mut c),
        RoofCase::FourBlocks => {
            let large = Oblong { half_length: 28.0, half_width: 22.0, ..plan };
            let shape = [
                super::primitive::Primitive::gable(&part(&large, -1.0, 1.0, 0.4, 1.0), 7.0, 0.7),
                super::primitive::Primitive::gable(
                    &super::house::turned(&part(&large, -1.0, -0.55, -1.0, 0.7)),
                    7.0,
                    0.7,
                ),
            ];
            b.add(form.name(), &shape, false, &mut c);
        }
        RoofCase::Courtyard => {
            b.house(form, &Oblong { half_length: 20.0, half_width: 17.0, ..plan }, 9.0, 0.7, &mut c);
        }
        RoofCase::Terraces | RoofCase::LShape | RoofCase::TShape => {
            b.house(form, &wide, 5.5, 0.8, &mut c);
        }
        _ => {
            // A draw may bring two corners too close together: then another is taken.
            for _ in 0..16 {
                let shape = primitives(form, &plan, 5.5, 0.8, &mut c);
                if b.add(form.name(), &shape, form == Form::Flat, &mut c) {
                    break;
                }
            }
        }
    }
    if let Some(building) = b.buildings.first_mut()
        && case == RoofCase::FlatParapet
    {
        building.style.parapet = 0.5;
    }
    if case == RoofCase::UnderTree {
        let place = plan.at(0.4, -1.4);
        let ground = b.relief.height(place);
        b.trees.push(Tree { place, ground, height: 13.0, radius: 4.5, clear: 3.0, species: Species::Broadleaf, seed });
    }
    b.finish()
}

fn two_halls(b: &mut Builder, centre: DVec2, c: &mut Counter) {
    let yard = Oblong { centre, axis: axis(8.0), half_length: 49.0, half_width: 42.0 };
    b.patch(Cover::Parking, yard);
    let hall = Oblong { centre: yard.at(-0.05, 0.38), half_length: 31.0, half_width: 9.0, ..yard };
    b.house(Form::Gable, &hall, 7.5, 0.55, c);
    let block = Oblong { centre: yard.at(0.0, -0.5), half_length: 24.0, half_width: 6.8, ..yard };
    b.house(Form::Hip, &block, 9.0, 0.8, c);
    for s in [-0.45, 0.05, 0.45] {
        let low = Oblong { centre: yard.at(s, -0.11), half_length: 6.0, half_width: 5.5, ..yard };
        b.house(Form::Flat, &low, 3.6, 0.0, c);
    }
    for t in [0.72, 0.92] {
        b.cars(yard.at(-0.9, t), yard.at(0.9, t), 2.8, 0.5, true, c);
    }
    b.cars(yard.at(-0.9, -0.85), yard.at(0.9, -0.85), 6.0, 0.6, false, c);
    b.tree(yard.at(0.72, -0.05), c);
}
