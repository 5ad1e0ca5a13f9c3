//! From the coordinates of a file to world coordinates.

use crate::transform::Transform;
use gable_geometry::{DVec3, dvec3};

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Axis {
    /// As in the world.
    #[default]
    Z,
    /// (x, y, z) becomes (x, −z, y).
    Y,
    /// z points down: (x, y, z) becomes (x, −y, −z).
    MinusZ,
    /// y points down: (x, y, z) becomes (x, z, −y).
    MinusY,
}

impl Axis {
    /// What a user calls it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Z => "z",
            Self::Y => "y",
            Self::MinusZ => "-z",
            Self::MinusY => "-y",
        }
    }

    /// A vector of the file, z up.
    #[inline]
    pub(crate) fn turn(self, p: DVec3) -> DVec3 {
        match self {
            Self::Z => p,
            Self::Y => dvec3(p.x, -p.z, p.y),
            Self::MinusZ => dvec3(p.x, -p.y, -p.z),
            Self::MinusY => dvec3(p.x, p.z, -p.y),
        }
    }

    /// The axis of the file that lies along an axis of the world when this one points up.
    pub(crate) fn under(self, world: Self) -> Self {
        let all = [Self::Z, Self::Y, Self::MinusZ, Self::MinusY];
        let up = |axis: Self| match axis {
            Self::Z => DVec3::Z,
            Self::Y => DVec3::Y,
            Self::MinusZ => -DVec3::Z,
            Self::MinusY => -DVec3::Y,
        };
        all.into_iter().find(|axis| self.turn(up(*axis)) == up(world)).unwrap_or_default()
    }
}

/// From the coordinates of a file to world coordinates: metres, z up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// The file's axis that points up.
    pub(crate) up: Axis,
    /// What is added then, in the file's units.
    pub(crate) origin: DVec3,
    /// Of a tile: from its own frame, z up, to that of the world, after the origin was added.
    pub(crate) frame: Option<Transform>,
    /// Metres of the file's units along the world's axes.
    pub(crate) units: DVec3,
}

impl Placement {
    /// A file's point in world coordinates.
    #[inline]
    pub(crate) fn apply(&self, p: DVec3) -> DVec3 {
        let own = self.up.turn(p) + self.origin;
        self.frame.map_or(own, |frame| frame.apply(own)) * self.units
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_turn_is_one() {
        for axis in [Axis::Z, Axis::Y, Axis::MinusZ, Axis::MinusY] {
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| axis.turn(v));
            assert_eq!(x.cross(y), z, "{axis:?} turns, and does not mirror");
            assert_eq!(axis.under(Axis::Z), axis);
        }
        // Of a file that was taken for y up, what lies along the world's y is -z.
        assert_eq!(Axis::Y.under(Axis::MinusY), Axis::Z);
        assert_eq!(Axis::Y.under(Axis::Y), Axis::MinusZ);
        assert_eq!(Axis::Z.under(Axis::Y), Axis::Y);
    }

    #[test]
    fn the_origin_is_in_the_units_of_the_file() {
        let (origin, units) = (dvec3(10.0, 20.0, 30.0), dvec3(0.5, 0.5, 1.0));
        let placement = Placement { up: Axis::Y, origin, frame: None, units };
        assert_eq!(placement.apply(dvec3(2.0, 4.0, -6.0)), dvec3(6.0, 13.0, 34.0));
    }
}
