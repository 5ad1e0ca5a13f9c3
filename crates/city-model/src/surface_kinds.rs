//! Kinds of surfaces with their colours, as models for viewers have them.

use crate::Semantic;

/// Surface kinds as features number them, with their colours in sRGB.
pub(crate) const KINDS: [(&str, [u8; 4]); 3] = [
    ("GroundSurface", [120, 120, 116, 255]),
    ("WallSurface", [214, 208, 197, 255]),
    ("RoofSurface", [171, 84, 66, 255]),
];

/// The terrain, with its colour.
pub(crate) const TERRAIN: (&str, [u8; 4]) = ("Terrain", [150, 158, 128, 255]);

/// The number of a kind.
pub(crate) fn kind(semantic: Semantic) -> u8 {
    match semantic {
        Semantic::GroundSurface => 0,
        Semantic::WallSurface => 1,
        Semantic::RoofSurface => 2,
    }
}

/// A colour in linear light, to three decimals.
pub(crate) fn linear(colour: [u8; 4]) -> [f64; 3] {
    [0, 1, 2].map(|i| {
        let v = f64::from(colour[i]) / 255.0;
        let light = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        (light * 1000.0).round() / 1000.0
    })
}
