//! How the pictures look: size of the texels, colour cast of the camera, season.

use crate::error::SynthError;
use crate::scene::objects::{Cover, Species};
use gable_geometry::Counter;

/// Colours, sRGB 0–255.
type Rgb = [f32; 3];

/// What the season does to plants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Season {
    /// Light green, meadows bright.
    Spring,
    /// As on most delivered pictures.
    #[default]
    Summer,
    /// Green crowns, burnt lawns.
    Drought,
    /// Yellow, orange and brown crowns.
    Autumn,
    /// Bare crowns, of which matching finds a part; pale lawns.
    Winter,
    /// Thin snow on all that is level, bare crowns.
    Snow,
}

impl Season {
    /// Every season.
    pub const ALL: [Self; 6] = [Self::Spring, Self::Summer, Self::Drought, Self::Autumn, Self::Winter, Self::Snow];

    /// Its name at the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Spring => "spring",
            Self::Summer => "summer",
            Self::Drought => "drought",
            Self::Autumn => "autumn",
            Self::Winter => "winter",
            Self::Snow => "snow",
        }
    }

    /// Whether deciduous trees have no leaves.
    pub(crate) fn is_bare(self) -> bool {
        matches!(self, Self::Winter | Self::Snow)
    }

    /// Leaves of a tree, of which `tint` in [0, 1) is one's own.
    pub(crate) fn leaves(self, species: Species, tint: f64, summer: Rgb) -> Rgb {
        if species.is_evergreen() {
            return summer;
        }
        match self {
            Self::Summer | Self::Drought => summer,
            Self::Spring => mixed(summer, [120.0, 150.0, 62.0], 0.45),
            Self::Autumn if tint < 0.35 => mixed(summer, [186.0, 142.0, 44.0], 0.8),
            Self::Autumn if tint < 0.7 => mixed(summer, [166.0, 84.0, 36.0], 0.75),
            Self::Autumn => mixed(summer, [118.0, 88.0, 50.0], 0.6),
            Self::Winter | Self::Snow => mixed(summer, [112.0, 98.0, 84.0], 0.85),
        }
    }

    /// What covers the ground.
    pub(crate) fn ground(self, cover: Cover, summer: Rgb) -> Rgb {
        let plants = matches!(cover, Cover::Grass | Cover::Field | Cover::Thicket);
        match self {
            Self::Spring if plants => mixed(summer, [104.0, 144.0, 52.0], 0.4),
            Self::Drought if plants => mixed(summer, [176.0, 156.0, 104.0], 0.75),
            Self::Autumn if plants => mixed(summer, [140.0, 126.0, 76.0], 0.35),
            Self::Winter if plants => mixed(summer, [138.0, 130.0, 98.0], 0.5),
            Self::Snow if cover != Cover::Water => mixed(summer, [226.0, 230.0, 236.0], 0.75),
            _ => summer,
        }
    }

    /// Roofs.
    pub(crate) fn roof(self, summer: Rgb) -> Rgb {
        if self == Self::Snow { mixed(summer, [222.0, 227.0, 234.0], 0.7) } else { summer }
    }
}

fn mixed(a: Rgb, b: Rgb, share: f32) -> Rgb {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

/// How the pictures look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Edge of a texel, metres; 0.02 to 2.
    pub texel: f64,
    /// Gain of red, green and blue: the camera's white balance, haze, the light of the evening; 0.5 to 1.5.
    pub cast: [f64; 3],
    /// Season.
    pub season: Season,
}

impl Default for Look {
    fn default() -> Self {
        Self { texel: 0.1, cast: [1.0; 3], season: Season::Summer }
    }
}

impl Look {
    /// A look of which everything is drawn: texels of 3 cm to 0.5 m, most of the casts that cameras have, all seasons.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let mut c = Counter::keyed(seed, &[50]);
        let gain = c.range(0.75, 1.15);
        let warm = c.range(-0.12, 0.12);
        let green = c.range(-0.06, 0.06);
        Self {
            texel: 0.03 * (0.5_f64 / 0.03).powf(c.unit()),
            cast: [gain * (1.0 + warm), gain * (1.0 + green), gain * (1.0 - warm)],
            season: Season::ALL[c.index(Season::ALL.len())],
        }
    }

    pub(crate) fn check(&self) -> Result<(), SynthError> {
        let within = |name, value: f64, low: f64, high: f64, range| {
            if value >= low && value <= high { Ok(()) } else { Err(SynthError::Parameter { name, value, range }) }
        };
        within("texel", self.texel, 0.02, 2.0, "0.02 to 2 m")?;
        self.cast.into_iter().try_for_each(|gain| within("cast", gain, 0.5, 1.5, "three gains of 0.5 to 1.5"))
    }
}
